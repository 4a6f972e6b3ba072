//! Linear images of other renderers are read as by their own library.

use crate::support::needs;
use raystone::image::{Image, read_linear};
use std::path::{Path, PathBuf};

/// Files below `../shared/scenes`: size, mean of R, G and B, and the mean of R in the upper half,
/// from OpenEXR 3.5 (for `.hdr`, from a separate decoder in NumPy).
type Known = (&'static str, [u32; 2], [f64; 3], f64);

const KNOWN: &[Known] = &[
    (
        "country-kitchen/kitchen-reference.exr",
        [700, 400],
        [0.640114831237, 0.683281282257, 0.734432878086],
        1.00886819683,
    ),
    (
        "veach-mis/reference/veach_mis.exr",
        [768, 512],
        [0.237146460806, 0.239082523558, 0.24295532708],
        0.386970716246,
    ),
    (
        "nori-cbox/reference/cbox-distributed.exr",
        [800, 600],
        [0.328985214648, 0.300120710881, 0.307053590566],
        0.481092794554,
    ),
    (
        "ignis-eval/evaluation/references/ref-cbox-d1-4096.exr",
        [256, 256],
        [0.108160656819, 0.0645922434342, 0.016149960582],
        0.216321313637,
    ),
    (
        "ignis-eval/evaluation/references/ref-cycles-box-4096.exr",
        [256, 256],
        [0.13256561923, 0.132565619279, 0.132565619322],
        0.170222576165,
    ),
    (
        "ignis-eval/evaluation/references/ref-sky-clear-rad.exr",
        [256, 256],
        [17.921667099, 17.921667099, 17.921667099],
        14.0626220703,
    ),
    (
        "mitsuba-refs/common/textures/museum.exr",
        [512, 256],
        [0.396961746275, 0.316211309078, 0.278360338815],
        0.535767269903,
    ),
    (
        "mitsuba-refs/tests/scenes/floating_sphere/refs/test_directional_ref_rgb_var.exr",
        [48, 48],
        [0.000574633483007, 0.000786787836179, 0.00081122836447],
        3.17065673651e-05,
    ),
    (
        "envmaps/noon_grass_1k.hdr",
        [1024, 512],
        [2.96528680608, 3.02764295353, 3.01384042842],
        5.77909887224,
    ),
    (
        "lego-bulldozer/cathedral.hdr",
        [1024, 512],
        [0.666899786331, 0.635367154027, 0.636851918767],
        1.16193639953,
    ),
];

fn scenes() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    if !folder.exists() {
        needs::skip("files", format!("{} is not there", folder.display()));
    }
    Some(folder).filter(|folder| folder.exists())
}

fn means(image: &Image) -> [f64; 3] {
    let sum = |c: usize| image.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>();
    [0, 1, 2].map(|c| sum(c) / image.pixels.len() as f64)
}

#[test]
fn images_of_other_renderers_have_their_known_means_the_right_way_up() {
    let Some(folder) = scenes() else { return };
    for (name, size, expected, top) in KNOWN {
        let image = read_linear(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!([image.width, image.height], *size, "{name}");
        for (found, expected) in means(&image).iter().zip(expected) {
            let error = (found - expected).abs();
            assert!(error <= 1e-6 * expected.abs(), "{name}: {found} {expected}");
        }
        let upper = |image: &Image| {
            let half = &image.pixels[..image.pixels.len() / 2];
            half.iter().map(|p| f64::from(p[0])).sum::<f64>() / half.len() as f64
        };
        assert!((upper(&image) / top - 1.0).abs() < 1e-6, "{name}");
        // The test detects an upside-down image.
        let mut flipped = image;
        flipped.pixels.reverse();
        assert!((upper(&flipped) / top - 1.0).abs() > 1e-6, "{name}");
    }
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("an entry").path();
        let ending = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        if path.is_dir() {
            collect(&path, found);
        } else if ["exr", "hdr"].contains(&ending) {
            found.push(path);
        }
    }
}

#[test]
fn every_linear_image_that_comes_with_the_scenes_is_read() {
    let Some(folder) = scenes() else { return };
    let mut files = Vec::new();
    collect(&folder, &mut files);
    assert!(files.len() >= 80, "{} files", files.len());
    for file in &files {
        let image = read_linear(file).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(image.non_finite_pixels(), 0, "{}", file.display());
        let brightest = image
            .pixels
            .iter()
            .flatten()
            .fold(0.0, |a: f32, v| a.max(*v));
        assert!(brightest > 0.0, "{} is black", file.display());
    }
}

//! `raystone run --reference` and `--images`: foreign references, and linear images of a run.

use crate::{error, output, program, text};
use raystone::image::{Image, read_linear};
use raystone::measure::record::{
    BiasRecord, Body, ErrorRecord, Line, Recorded, ReferenceRecord, all_of, read_records,
};
use std::path::{Path, PathBuf};

const EXPERIMENT: &str = r#"
[run]
replicates = 3
resolution = [24, 16]
spp = [1, 3, 4]
[axes]
scene = ["cornell-box"]
accel = ["bvh"]
sequence = ["sobol"]
decorrelation = ["cranley-patterson"]
integrator = ["primary"]
[reference]
spp = 64
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
rays = 1024
[gate]
rays = 256
brute_force_tests = 1000
oracle_rays = 16
[discrepancy]
points = 16
"#;

/// Runs the experiment in a folder; the records.
fn run(folder: &Path, name: &str, more: &[&str]) -> (i32, String, Vec<Line>) {
    let file = folder.join("trial.toml");
    std::fs::write(&file, EXPERIMENT).expect("a writable folder");
    let out = folder.join(name);
    let arguments = ["run", text(&file), "-q", "--out", text(&out)];
    let ended = output(program(&arguments).args(more));
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    let lines = read_records(&out).map(|records| records.lines);
    (
        ended.status.code().unwrap_or(-1),
        said,
        lines.unwrap_or_default(),
    )
}

/// The linear image whose name begins like this.
fn linear(out: &Path, beginning: &str, ending: &str) -> PathBuf {
    let files = std::fs::read_dir(out.join("images")).expect("a folder of images");
    let mut files = files.map(|file| file.expect("an entry").path());
    let is_it = |path: &PathBuf| {
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        name.starts_with(beginning) && name.ends_with(ending)
    };
    files
        .find(is_it)
        .unwrap_or_else(|| panic!("no {beginning}….{ending}"))
}

fn errors(lines: &[Line]) -> Vec<Recorded<'_, ErrorRecord>> {
    all_of(lines).collect()
}

#[test]
fn a_run_writes_linear_images_and_takes_one_as_the_reference_of_another() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // 1 says that the reference is too noisy to rank by, which it may be.
    let (code, said, first) = run(folder.path(), "a", &["--images", "exr"]);
    assert!([0, 1].contains(&code), "{said}");
    let images: Vec<Image> = ["reference-", "image-", "mean-", "variance-"]
        .map(|name| linear(&folder.path().join("a"), name, "exr"))
        .iter()
        .map(|path| read_linear(path).expect("an image"))
        .collect();
    assert!(
        images
            .iter()
            .all(|image| (image.width, image.height) == (24, 16))
    );
    // What was recorded of the first replicate and of all is in the images.
    let measured = errors(&first);
    let hash = blake3::hash(bytemuck::cast_slice(&images[1].pixels)).to_hex();
    assert_eq!(measured[0].image_hash, hash.as_str());
    assert!(images[3].pixels.iter().flatten().any(|v| *v > 0.0));

    // The mean of a run as the reference of the next: errors of its replicates are those of the variance.
    let mean = linear(&folder.path().join("a"), "mean-", "exr");
    let (code, said, second) = run(folder.path(), "b", &["--reference", text(&mean)]);
    assert_eq!(code, 0, "{said}");
    let reference: Vec<Recorded<ReferenceRecord>> = all_of(&second).collect();
    assert_eq!(reference.len(), 1);
    assert_eq!(reference[0].file.as_deref(), Some(text(&mean)));
    assert_eq!((reference[0].mse, reference[0].spp), (None, 0));
    let last = |e: &Recorded<ErrorRecord>| e.errors.last().expect("an error").metrics.clone();
    let mse: Vec<f64> = errors(&second).iter().map(|e| last(e)["mse/v1"]).collect();
    assert_eq!(mse.len(), 3);
    let found = mse.iter().sum::<f64>() / 2.0;
    let expected = images[3].mean();
    assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    for error in errors(&second) {
        assert!(error.errors.iter().map(|e| e.spp).eq([1, 3, 4]));
        assert!(last(&error).keys().all(|id| !id.contains("unbiased")));
    }
    // One image says nothing about a bias.
    let bias: Vec<Recorded<BiasRecord>> = all_of(&second).collect();
    assert!(
        bias.iter()
            .all(|b| format!("{:?}", b.verdict).contains("NotTestable"))
    );
    // Another image is another cell.
    let hashes = |lines: &[Line]| -> Vec<String> {
        let errors = lines
            .iter()
            .filter(|line| matches!(line.body, Body::Error(_)));
        errors.map(|line| line.hash.clone()).collect()
    };
    assert_eq!(hashes(&first).len(), 3);
    assert_ne!(hashes(&first), hashes(&second));
}

#[test]
fn a_reference_that_does_not_fit_ends_with_2_before_anything_is_measured() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let wrong = folder.path().join("wrong.pfm");
    std::fs::write(&wrong, [&b"PF\n1 2\n-1\n"[..], &[0; 24]].concat()).expect("an image");
    for (file, pieces) in [
        (text(&wrong), &["1×2", "24×16", "run.resolution"][..]),
        ("no/such.exr", &["no/such.exr"]),
        ("reference.jpg", &[".exr, .hdr, .pfm, .npy"]),
    ] {
        let (code, said, lines) = run(folder.path(), "c", &["--reference", file]);
        assert!(code == 2 && lines.is_empty(), "{said}");
        for piece in pieces {
            assert!(said.contains(piece), "no {piece} in {said}");
        }
    }
    let file = folder.path().join("trial.toml");
    let unknown = output(&mut program(&["run", text(&file), "--images", "jpg"]));
    assert!(error(&unknown, 2).contains("exr, hdr, pfm, npy"));
    let two = ["run", text(&file), "--reference", text(&wrong), "--set"];
    let two = output(program(&two).arg("axes.scene=cornell-box,furnace-box"));
    assert!(error(&two, 2).contains("reference.file"));
}

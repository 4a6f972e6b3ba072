//! `raystone run --reference` and `--images`: foreign references, and linear images of a run.

use super::{error, output, program, text};
use crate::support::small_with;
use raystone::image::{Image, read_linear};
use raystone::measure::record::{
    BiasRecord, Body, ErrorRecord, Line, Recorded, ReferenceRecord, all_of, read_records,
};
use std::path::{Path, PathBuf};

/// Primary rays by a sampler with few samples.
fn experiment() -> String {
    small_with(&[
        "run.replicates = 3",
        "run.resolution = [24, 16]",
        "run.spp = [1, 3, 4]",
        "axes.sequence = [\"sobol\"]",
        "axes.decorrelation = [\"cranley-patterson\"]",
        "axes.integrator = [\"primary\"]",
        "reference.spp = 64",
        "gate.rays = 256",
    ])
}

/// Runs the experiment in a folder; the records.
fn run(folder: &Path, name: &str, more: &[&str]) -> (i32, String, Vec<Line>) {
    let file = folder.join("trial.toml");
    std::fs::write(&file, experiment()).expect("a writable folder");
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
    // Exit code 1 means that the reference is too noisy to rank by, which it may be.
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
    // The recorded hash of the first replicate is that of its image, and the images of all have a spread.
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
    // One image cannot show a bias.
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
fn a_check_that_fails_is_the_exit_code_unless_the_run_is_lenient_which_its_page_says() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // As few samples as a reference may have are too few for the errors.
    let noisy = ["--no-cache", "--set", "reference.spp=8"];
    let page = |name: &str| {
        let page = folder.path().join(name).join("index.html");
        std::fs::read_to_string(page).expect("a page")
    };
    let (code, said, _) = run(folder.path(), "strict", &noisy);
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("failed: Reference noise"), "{said}");
    assert!(page("strict").contains("no winner: ") && !page("strict").contains("--lenient"));
    let (code, said, _) = run(
        folder.path(),
        "lenient",
        &[&noisy[..], &["--lenient"]].concat(),
    );
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("failed: Reference noise"), "{said}");
    assert!(page("lenient").contains("no winner: ") && page("lenient").contains("--lenient"));
    // Joined it is as lenient about the check, and not about a part that is missing.
    let joined = |from: &str, out: &str| {
        let [from, out] = [from, out].map(|name| folder.path().join(name));
        let ended = output(&mut program(&["merge", text(&from), "--out", text(&out)]));
        ended.status.code()
    };
    let part = [&noisy[..], &["--lenient", "--shard", "1/2"]].concat();
    let (code, said, _) = run(folder.path(), "part", &part);
    assert_eq!(code, 0, "{said}");
    for (from, code) in [("strict", 1), ("lenient", 0), ("part", 1)] {
        assert_eq!(
            joined(from, &format!("{from}-joined")),
            Some(code),
            "{from}"
        );
    }
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
        let (planned, seen, _) = run(folder.path(), "d", &["--reference", file, "--dry-run"]);
        assert_eq!(planned, 2, "{seen}");
        for piece in pieces {
            assert!(said.contains(piece), "no {piece} in {said}");
            assert!(seen.contains(piece), "no {piece} in {seen}");
        }
    }
    let file = folder.path().join("trial.toml");
    let unknown = output(&mut program(&["run", text(&file), "--images", "jpg"]));
    assert!(error(&unknown, 2).contains("exr, hdr, pfm, npy"));
    let two = ["run", text(&file), "--reference", text(&wrong), "--set"];
    let two = output(program(&two).arg("axes.scene=cornell-box,furnace-box"));
    assert!(error(&two, 2).contains("reference.file"));
}

#[test]
fn a_reference_of_other_primaries_is_named_in_the_run_and_its_records() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let texels = [128, 64, 32, 129].repeat(24 * 16);
    for (name, line, is_other) in [
        ("plain", "", false),
        (
            "aces",
            "PRIMARIES=0.7347 0.2653 0 1 0.0001 -0.077 0.3217 0.3377\n",
            true,
        ),
    ] {
        let head = format!("#?RADIANCE\n{line}FORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 24\n");
        let file = folder.path().join(format!("{name}.hdr"));
        std::fs::write(&file, [head.as_bytes(), &texels].concat()).expect("an image");
        let (_, said, lines) = run(folder.path(), name, &["--reference", text(&file)]);
        let note = "they are taken for those of Rec. 709";
        let recorded = lines.iter().any(|line| match &line.body {
            Body::Warning(told) => format!("{told:?}").contains(note),
            _ => false,
        });
        assert_eq!([said.contains(note), recorded], [is_other; 2], "{said}");
    }
}

/// Returns `true` if the reference of a run with this cache was there, and the errors against it.
fn with_cache(folder: &Path, cache: &Path, name: &str, more: &[&str]) -> (bool, Vec<ErrorRecord>) {
    let file = folder.join("trial.toml");
    std::fs::write(&file, experiment()).expect("a writable folder");
    let out = folder.join(name);
    let arguments = ["run", text(&file), "-q", "--out", text(&out)];
    // So few samples are too noisy a reference, as exit code 1 reports.
    output(program(&arguments).args(more).env("RAYSTONE_CACHE", cache));
    let lines = read_records(&out).expect("records").lines;
    let references: Vec<Recorded<ReferenceRecord>> = all_of(&lines).collect();
    let errors = all_of(&lines).map(|r: Recorded<ErrorRecord>| r.body.clone());
    (references[0].cached, errors.collect())
}

/// The pixels of the parts of references that this cache keeps: the end of each file, before its hash.
fn kept_parts(cache: &Path) -> Vec<Vec<f32>> {
    const PIXELS: usize = 24 * 16 * 12;
    const HASH: usize = 32;
    let files = std::fs::read_dir(cache.join("references")).expect("a folder");
    let parts = files.map(|file| {
        let bytes = std::fs::read(file.expect("an entry").path()).expect("a readable file");
        let end = bytes.len() - HASH;
        let values = bytes[end - PIXELS..end].as_chunks::<4>().0.iter();
        values.map(|value| f32::from_le_bytes(*value)).collect()
    });
    parts.collect()
}

#[test]
fn a_reference_is_the_mean_of_eight_different_parts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cache = folder.path().join("cache");
    with_cache(folder.path(), &cache, "run", &["--images", "pfm"]);
    let parts = kept_parts(&cache);
    assert_eq!(parts.len(), 8);
    for (k, part) in parts.iter().enumerate() {
        assert!(!parts[..k].contains(part), "two parts are the same image");
    }
    let reference = linear(&folder.path().join("run"), "reference", ".pfm");
    let reference = read_linear(&reference).expect("an image");
    for (k, value) in reference.pixels.iter().flatten().enumerate() {
        let mean = parts.iter().map(|part| f64::from(part[k])).sum::<f64>() / 8.0;
        assert!((f64::from(*value) - mean).abs() <= 1e-6 * mean, "{k}");
    }
}

#[test]
fn a_reference_is_rendered_once_for_all_runs_that_it_serves() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cache = folder.path().join("cache");
    let run = |name: &str, more: &[&str]| with_cache(folder.path(), &cache, name, more);
    let (cached, rendered) = run("first", &[]);
    assert!(!cached);
    assert_eq!(run("again", &[]), (true, rendered.clone()));
    assert_eq!(run("without", &["--no-cache"]), (false, rendered.clone()));
    // Edited kernels and other samplers are measured against the same; other settings of the reference give another.
    let kernels = folder.path().join("kernels");
    std::fs::create_dir_all(kernels.join("accel")).expect("a writable folder");
    let edited = std::fs::read_to_string("kernels/accel/leaf.wesl").expect("a kernel");
    std::fs::write(kernels.join("accel/leaf.wesl"), edited + "// Edited.\n").expect("a file");
    assert!(run("edited", &["--kernels", text(&kernels)]).0);
    assert!(run("sampler", &["--set", r#"axes.sequence=["halton"]"#]).0);
    for other in [
        "reference.spp=72",
        "reference.seed=9",
        "run.resolution=[16, 24]",
        r#"axes.scene=["lamp"]"#,
    ] {
        assert!(!run(other, &["--set", other]).0, "{other}");
    }
    for kept in std::fs::read_dir(cache.join("references")).expect("a folder") {
        let path = kept.expect("an entry").path();
        let mut bytes = std::fs::read(&path).expect("a readable file");
        bytes[5] ^= 1;
        std::fs::write(&path, bytes).expect("a writable file");
    }
    assert_eq!(run("damaged", &[]), (false, rendered.clone()));
    assert_eq!(run("mended", &[]), (true, rendered));
    // A cache that cannot be written is reported, and the run continues.
    std::fs::write(folder.path().join("file"), "").expect("a writable folder");
    let unusable = with_cache(folder.path(), &folder.path().join("file"), "unusable", &[]);
    assert!(!unusable.0);
}

//! Tests of the folder of a run.

use super::*;

#[test]
fn image_names_are_short_and_distinct_even_where_case_is_ignored() {
    let long = "x".repeat(4000);
    let names = [
        slug(&["heat", "Scene.obj", "bvh"]),
        slug(&["heat", "scene.obj", "bvh"]),
        slug(&["heat", "scene.obj-bvh"]),
        slug(&["heat", "scene_obj", "bvh"]),
        slug(&["heat", &long, "bvh"]),
        slug(&["heat", &long, "roped-bvh"]),
        slug(&["heat", "λ/../..", "bvh"]),
    ];
    let lower: std::collections::BTreeSet<_> =
        names.iter().map(|name| name.to_lowercase()).collect();
    assert_eq!(lower.len(), names.len(), "{names:?}");
    for name in names {
        assert!(name.len() <= 100 && !name.contains('/'), "{name}");
    }
    let again = slug(&["heat", "scene.obj", "bvh"]);
    assert_eq!(again, slug(&["heat", "scene.obj", "bvh"]));
    assert!(again.starts_with("heat-scene.obj-bvh-"), "{again}");
}

fn write(folder: &Folder, text: &str) {
    folder.append(&format!("{text}\n")).unwrap();
    let (relative, path) = folder.image(&["heat"], "png");
    fs::write(path, relative).unwrap();
}

fn read(out: &Path) -> String {
    fs::read_to_string(out.join(RECORDS_FILE)).unwrap()
}

#[test]
fn results_are_replaced_only_by_whole_ones_and_only_on_request() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let first = Folder::open(&out, Existing::Refuse, false).unwrap();
    write(&first, "\"images/heat\" first");
    first.finish().unwrap();
    drop(first);
    assert!(Folder::open(&out, Existing::Refuse, false).is_err());
    assert!(out.join("images").is_dir() && !out.join(PARTIAL).exists());

    let second = Folder::open(&out, Existing::Replace, false).unwrap();
    write(&second, "\"images-2/heat\" second");
    assert!(read(&out).ends_with("first\n"), "replaced too early");
    assert_eq!(fs::read_dir(out.join("images")).unwrap().count(), 1);
    drop(second); // As if it were killed.
    assert!(read(&out).ends_with("first\n"));
    assert!(read(&out.join(PARTIAL)).ends_with("second\n"));

    fs::create_dir(out.join("images-of-mine")).unwrap();
    let third = Folder::open(&out, Existing::Replace, false).unwrap();
    write(&third, "\"images-2/heat\" third");
    third.finish().unwrap();
    assert!(read(&out).ends_with("third\n"));
    assert!(!out.join("images").exists() && out.join("images-2").is_dir());
    assert!(out.join("images-of-mine").is_dir());
}

#[test]
fn what_a_killed_run_measured_counts_as_results() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path();
    write(
        &Folder::open(out, Existing::Refuse, false).unwrap(),
        "killed",
    );
    let error = Folder::open(out, Existing::Refuse, false)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains(PARTIAL) && error.contains("--force"),
        "{error}"
    );
    let forced = Folder::open(out, Existing::Replace, false).unwrap();
    drop(forced);
    assert_eq!(read(out), "killed\n");
    assert!(out.join("images").is_dir());
}

#[test]
fn a_folder_that_is_being_written_is_refused_or_numbered() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let first = Folder::open(&out, Existing::Refuse, false).unwrap();
    for existing in [Existing::Refuse, Existing::Replace] {
        let error = Folder::open(&out, existing, false).unwrap_err().to_string();
        assert!(error.contains("another run is writing"), "{error}");
    }
    let second = Folder::open(&out, Existing::Number, false).unwrap();
    assert_eq!(second.out(), dir.path().join("run-2"));
    assert_eq!(numbered(Path::new("a/b/"), 3), Path::new("a/b-3"));
    drop(first);
    let again = Folder::open(&out, Existing::Number, false).unwrap();
    assert_eq!(again.out(), out, "nothing was written there");
}

#[cfg(unix)]
#[test]
fn links_are_replaced_and_not_followed() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    let (out, other) = (dir.path().join("run"), dir.path().join("other"));
    for folder in [&out, &other] {
        fs::create_dir(folder).unwrap();
    }
    let precious = other.join("precious");
    fs::write(&precious, "kept").unwrap();
    symlink(&other, out.join(IMAGES)).unwrap();
    symlink(&other, out.join(PARTIAL)).unwrap();
    symlink(&precious, out.join(LOCK_FILE)).unwrap();
    symlink(&precious, out.join(RECORDS_FILE)).unwrap();
    let folder = Folder::open(&out, Existing::Replace, false).unwrap();
    write(&folder, "new");
    folder.finish().unwrap();
    assert_eq!(read(&out), "new\n");
    assert_eq!(fs::read_to_string(&precious).unwrap(), "kept");
    assert_eq!(fs::read_dir(&other).unwrap().count(), 1);
}

#[test]
fn a_folder_taken_away_comes_back_with_the_records() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("run");
    let folder = Folder::open(&out, Existing::Refuse, false).unwrap();
    write(&folder, "first");
    fs::remove_dir_all(&out).unwrap();
    folder.append("second\n").unwrap();
    folder.finish().unwrap();
    assert_eq!(read(&out), "first\nsecond\n");
}

#[test]
fn an_interrupted_run_takes_no_more_records() {
    let dir = tempfile::tempdir().unwrap();
    let handle = Interrupt::default();
    assert_eq!(handle.now("too early"), Interrupted::NotBegun);
    let folder = Arc::new(Folder::open(dir.path(), Existing::Refuse, false).unwrap());
    handle.begin(&folder);
    let Interrupted::Kept(kept) = handle.now("SIGINT") else {
        panic!("nothing was kept");
    };
    assert_eq!(kept, dir.path());
    assert!(read(dir.path()).contains("SIGINT"));
    assert!(matches!(
        folder.append("more\n"),
        Err(RunError::Interrupted)
    ));
    assert!(matches!(folder.finish(), Err(RunError::Interrupted)));
    assert_eq!(handle.now("again"), Interrupted::Finished);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_with_the_file_and_leaves_whole_lines() {
    let dir = tempfile::tempdir().unwrap();
    let folder = Folder::open(dir.path(), Existing::Refuse, false).unwrap();
    write(&folder, "first");
    let full = File::options().write(true).open("/dev/full").unwrap();
    let real = std::mem::replace(&mut folder.records().file, full);
    let error = folder.append("second\n").unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let records = dir.path().join(PARTIAL).join(RECORDS_FILE);
    assert!(
        error.to_string().contains(&*records.to_string_lossy()),
        "{error}"
    );
    folder.records().file = real;
    folder.append("third\n").unwrap();
    folder.finish().unwrap();
    assert_eq!(read(dir.path()), "first\nthird\n");
}

/// Bytes that begin otherwise than packed ones are read as they are.
#[test]
fn packed_results_are_kept_and_replaced_as_others_are() {
    let dir = tempfile::tempdir().unwrap();
    let (out, packed) = (dir.path(), dir.path().join("records.jsonl.gz"));
    let line =
        r#"{"schema":"raystone/2","body":{"kind":"skipped","cell":"images/heat","reason":"b"}}"#;
    fs::write(&packed, format!("{line}\n")).unwrap();
    fs::create_dir(out.join(IMAGES)).unwrap();
    assert!(Folder::open(out, Existing::Refuse, false).is_err());
    // A run that is interrupted, and the next one, which is killed.
    let handle = Interrupt::default();
    for text in ["first", "second"] {
        let folder = Arc::new(Folder::open(out, Existing::Replace, false).unwrap());
        handle.begin(&folder);
        write(&folder, text);
        let kept = Interrupted::Kept(out.join(PARTIAL));
        assert!(text == "second" || handle.now("SIGINT") == kept);
        assert!(packed.exists() && !out.join(RECORDS_FILE).exists());
    }
    let third = Folder::open(out, Existing::Replace, false).unwrap();
    write(&third, "third");
    third.finish().unwrap();
    drop(third);
    assert_eq!(read(out), "third\n");
    assert!(!packed.exists() && !out.join(IMAGES).exists());
    // What is resumed is not lost.
    fs::rename(out.join(RECORDS_FILE), &packed).unwrap();
    fs::write(&packed, format!("{line}\n")).unwrap();
    let resumed = Folder::open(out, Existing::Resume, false).unwrap();
    assert_eq!(resumed.take_earlier().len(), 1);
}

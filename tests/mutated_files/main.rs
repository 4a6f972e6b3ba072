//! Thousands of broken files: each reader must refuse one with the file's name and a place, or
//! return something sound; without a panic, without end, and within memory that the file's size
//! bounds.
//!
//! The files are seeds of the fuzz targets (`fuzz/corpus`), changed by [`mutation`] from fixed
//! seeds.

#[path = "../support/needs.rs"]
mod needs;

mod dense;
#[path = "../fuzz_entry/mod.rs"]
mod fuzz_entry;
mod mutation;
mod watch;

use fuzz_entry::{OBJ_SEPARATOR, Outcome, TARGETS, Target};
use mutation::{Pcg, mutate};
use std::path::{Path, PathBuf};
use watch::{MemoryBound, Watch};

#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Mutated files of each target.
const FILES: usize = 3000;

/// First seed; file k of a target has the seed `SEED + k`.
const SEED: u64 = 20_261_121;

/// Memory that reading may take, by target: bytes per byte of input. One byte can be a vertex of a
/// fan (a triangle of 40 bytes, in arrays that double), in nine bytes of MTL a material with four uses of textures, or, in
/// three bytes of JSON, a whole node.
const BYTES_PER_BYTE: [(&str, usize); 7] = [
    ("experiment", 128),
    ("obj", 128),
    ("gltf", 640),
    ("ply", 64),
    ("ies", 64),
    ("points", 64),
    ("records", 64),
];

fn bound(target: &str) -> MemoryBound {
    let found = BYTES_PER_BYTE.iter().find(|(name, _)| *name == target);
    let (_, per_byte) = found.unwrap_or_else(|| panic!("{target} has no bound of memory"));
    MemoryBound {
        per_byte: *per_byte,
        fixed: 256 << 10,
    }
}

/// The seeds of a target by name; none in a package without `fuzz/`.
fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    if !fuzz.exists() {
        needs::skip(
            "fuzz",
            format!("{} is not part of a package", fuzz.display()),
        );
        return Vec::new();
    }
    let folder = fuzz.join("corpus").join(target);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} has no seed", folder.display());
    let read = |path: PathBuf| {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into();
        (name, std::fs::read(&path).unwrap())
    };
    paths.into_iter().map(read).collect()
}

fn run(target: &str, read: Target) {
    let seeds = seeds(target);
    if seeds.is_empty() {
        return;
    }
    let watch = Watch::new(bound(target));
    let mut faults = Vec::new();
    let mut accepted = 0;
    for (name, bytes) in &seeds {
        match watch.read(&format!("{target} {name}"), bytes, read) {
            Ok(true) => {}
            Ok(false) => panic!(
                "the seed {name} of {target} is refused: {:?}",
                message(read, bytes)
            ),
            Err(fault) => faults.push(fault),
        }
    }
    for k in 0..FILES {
        let seed = SEED + k as u64;
        let (name, bytes) = &seeds[k % seeds.len()];
        let mut random = Pcg::new(seed);
        let other = &seeds[random.below(seeds.len())].1;
        let mutant = mutate(bytes, other, &mut random);
        match watch.read(&format!("{target} {name}, seed {seed}"), &mutant, read) {
            Ok(sound) => accepted += usize::from(sound),
            Err(fault) => faults.push(format!("{fault}{}", kept(target, seed, &mutant))),
        }
    }
    println!(
        "{target}: {FILES} files, {accepted} accepted, {} refused, {} of them after a panic that the \
         reader caught; at most {:.1} bytes a byte beyond {} KiB",
        FILES - accepted - faults.len(),
        watch.caught_panics(),
        watch.largest_multiple(),
        bound(target).fixed >> 10,
    );
    let shown: Vec<_> = faults.iter().take(60).map(String::as_str).collect();
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        shown.join("\n")
    );
    // A mutation that breaks everything, or nothing, tests little.
    assert!(
        (FILES / 50..FILES * 49 / 50).contains(&accepted),
        "{accepted} of {FILES} accepted"
    );
}

/// Files cut off after each of their bytes, as a broken copy leaves them.
#[test]
fn files_cut_off_at_any_byte_are_refused_with_a_place_or_sound() {
    let mut faults = Vec::new();
    let mut files = 0;
    for (target, read) in TARGETS {
        let watch = Watch::new(bound(target));
        for (name, bytes) in seeds(target).iter().filter(|(_, b)| b.len() <= 4000) {
            for end in 1..bytes.len() {
                let outcome = watch.read(
                    &format!("{target} {name}, cut at {end}"),
                    &bytes[..end],
                    read,
                );
                faults.extend(outcome.err());
                files += 1;
            }
        }
    }
    println!("{files} files");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Large files that make the most of every byte: without them the fixed part of the bound would hide
/// the multiple.
#[test]
fn dense_files_stay_within_the_bound_of_memory() {
    let mut faults = Vec::new();
    for (target, read) in TARGETS {
        let watch = Watch::new(bound(target));
        let files = dense::files(target);
        assert!(!files.is_empty(), "{target} has no dense file");
        for (name, bytes) in files {
            let outcome = watch.read(&format!("{target} {name}"), &bytes, read);
            println!(
                "{target} {name}: {outcome:?}, {:.0} bytes a byte",
                watch.take_multiple()
            );
            faults.extend(outcome.err());
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Stores a mutant for an examination of the failure.
fn kept(target: &str, seed: u64, mutant: &[u8]) -> String {
    let path = std::env::temp_dir().join(format!("mutant-{target}-{seed}"));
    match std::fs::write(&path, mutant) {
        Ok(()) => format!(" (kept as {})", path.display()),
        Err(_) => String::new(),
    }
}

fn message(read: Target, bytes: &[u8]) -> String {
    match read(bytes) {
        Outcome::Accepted(_) => String::new(),
        Outcome::Refused(message) => message,
    }
}

fn target(name: &str) -> Target {
    let found = TARGETS.iter().find(|(other, _)| *other == name);
    found.unwrap_or_else(|| panic!("no target {name}")).1
}

#[test]
fn mutated_experiments_are_refused_with_a_place_or_sound() {
    run("experiment", target("experiment"));
}

#[test]
fn mutated_obj_and_mtl_files_are_refused_with_a_place_or_sound() {
    run("obj", target("obj"));
}

#[test]
fn mutated_gltf_and_glb_files_are_refused_with_a_place_or_sound() {
    run("gltf", target("gltf"));
}

#[test]
fn mutated_ply_files_are_refused_with_a_place_or_sound() {
    run("ply", target("ply"));
}

#[test]
fn mutated_luminaires_are_refused_with_a_place_or_sound() {
    run("ies", target("ies"));
}

#[test]
fn mutated_lists_of_points_are_refused_with_a_place_or_sound() {
    run("points", target("points"));
}

#[test]
fn mutated_records_are_refused_with_a_place_or_sound() {
    run("records", target("records"));
}

#[test]
fn every_target_has_a_fuzz_target_and_ten_thousand_files_are_read() {
    assert!(FILES * TARGETS.len() >= 10_000);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/fuzz_targets");
    if !folder.exists() {
        needs::skip(
            "fuzz",
            format!("{} is not part of a package", folder.display()),
        );
        return;
    }
    let mut found: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            assert!(
                text.contains(&format!("fuzz_entry::{name}(bytes)")),
                "{name}"
            );
            name
        })
        .collect();
    let mut known: Vec<String> = TARGETS.map(|(name, _)| name.to_owned()).into();
    found.sort();
    known.sort();
    assert_eq!(found, known);
}

#[test]
fn the_separator_of_obj_and_mtl_texts_is_in_a_seed() {
    let seeds = seeds("obj");
    assert!(seeds.is_empty() || seeds.iter().any(|(_, b)| b.contains(&OBJ_SEPARATOR)));
}

#[test]
fn readers_that_misbehave_are_caught() {
    fn accepted() -> Outcome {
        Outcome::Accepted(Box::new(|| ()))
    }
    fn refused(message: &str) -> Outcome {
        Outcome::Refused(message.to_owned())
    }
    let watch = Watch::new(MemoryBound {
        per_byte: 64,
        fixed: 1 << 10,
    });
    let fault = |read: Target| watch.read("planted", &[b'x'; 1000], read).err();
    assert_eq!(fault(|_| accepted()), None);
    assert_eq!(fault(|_| refused("foreign.obj (line 3): broken")), None);
    let planted: [(Target, &str); 6] = [
        (|_| panic!("planted"), "panics"),
        (|_| refused("foreign.obj: broken"), "does not say where"),
        (|_| refused("line 3: broken"), "does not say where"),
        (
            |bytes| {
                std::hint::black_box(vec![1_u8; 80 * bytes.len()]);
                accepted()
            },
            "memory",
        ),
        (
            |bytes| {
                // Held by the result.
                let kept = vec![1_u8; 80 * bytes.len()];
                Outcome::Accepted(Box::new(move || drop(kept)))
            },
            "memory",
        ),
        (
            |_| Outcome::Accepted(Box::new(|| panic!("an index out of range"))),
            "unsound",
        ),
    ];
    for (read, expected) in planted {
        let fault = fault(read).expect(expected);
        assert!(fault.contains(expected), "{fault}");
    }
}

//! The scan of a workgroup, `kernels/common/scan.wesl`.

use crate::support::{Pcg, kernels_with, open};
use raystone::gpu::{Bindings, Composition, Gpu, KernelLibrary, Recording, Storage};
use std::path::Path;

const GROUPS: u32 = 5;

pub(super) fn with_test_kernels(library: KernelLibrary) -> Gpu {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/device/compaction/kernels");
    open(library.with_folder(&folder).expect("kernels"))
}

/// Exclusive and inclusive sums and the total, for each word of one workgroup.
fn sums(words: &[u32]) -> Vec<[u32; 3]> {
    let total = words.iter().fold(0u32, |sum, word| sum.wrapping_add(*word));
    let mut sum = 0u32;
    let next = |word: &u32| {
        let before = sum;
        sum = sum.wrapping_add(*word);
        [before, sum, total]
    };
    words.iter().map(next).collect()
}

/// The first word whose scans differ from the host's, in workgroups of `lanes`.
fn first_wrong(gpu: &Gpu, lanes: u32) -> Option<usize> {
    let mut random = Pcg::new(u64::from(lanes));
    // All 32 bits, so that sums wrap around.
    let words: Vec<u32> = (0..GROUPS * lanes).map(|_| random.next_u32()).collect();
    let expected: Vec<[u32; 6]> = (words.chunks(lanes as usize))
        .flat_map(|group| {
            let first = sums(group);
            let second = sums(&first.iter().map(|s| s[0]).collect::<Vec<_>>());
            let both = first.into_iter().zip(second);
            both.map(|([a, b, c], [d, e, f])| [a, b, c, d, e, f])
                .collect::<Vec<_>>()
        })
        .collect();
    let kernel = Composition::new("test/scan").constant("SCAN_LANES", lanes);
    let pipeline = gpu
        .pipeline(&kernel, true)
        .unwrap_or_else(|e| panic!("{e}"));
    let scans = Storage::scratch("scans", 24 * words.len() as u64);
    let mut bindings = Bindings::new();
    bindings
        .buffer("words", &gpu.storage("words", &words).expect("a buffer"))
        .buffer("scans", &scans);
    let mut recording = Recording::new();
    recording
        .run("scan", &pipeline, &bindings, [GROUPS, 1, 1])
        .download("scans", &scans);
    let played = gpu.play(&recording).expect("it plays");
    let found: Vec<[u32; 6]> = played.download("scans").expect("words");
    (0..words.len()).find(|&at| found[at] != expected[at])
}

#[test]
fn a_workgroup_scans_as_the_host_does() {
    let gpu = with_test_kernels(KernelLibrary::default());
    for lanes in [1, 2, 8, 31, 32, 64, 100, 128, 256] {
        assert_eq!(first_wrong(&gpu, lanes), None, "{lanes} lanes");
    }
}

#[test]
fn faults_in_the_scan_of_a_workgroup_are_seen() {
    for (from, to) in [
        ("lane >= reach", "lane > reach"),
        ("reach *= 2u", "reach *= 3u"),
        ("reach < SCAN_LANES", "reach < SCAN_LANES / 2u"),
        ("row + lane - reach", "lane - reach"),
        ("Scan(sum - value, sum", "Scan(sum, sum"),
        ("row + SCAN_LANES - 1u", "row + SCAN_LANES - 2u"),
    ] {
        let gpu = with_test_kernels(kernels_with("common/scan", &[(from, to)]));
        assert_ne!(first_wrong(&gpu, 64), None, "`{to}` goes unseen");
    }
}

//! The ballot of a subgroup, whatever its size: `kernels/compaction/subgroup.wesl`.

use super::scan::with_test_kernels;
use crate::support::{Pcg, kernels_with};
use raystone::gpu::{Bindings, Composition, Gpu, KernelLibrary, Recording, Storage};

const BALLOTS: u32 = 6;
/// Bits of a ballot.
const BITS: u32 = 128;

/// The first bit before which the kernel counts other votes than there are, with its ballot.
fn first_wrong(gpu: &Gpu) -> Option<(u128, u32)> {
    let mut random = Pcg::new(7);
    let mut ballots: Vec<[u32; 4]> = (2..BALLOTS)
        .map(|_| [(); 4].map(|()| random.next_u32()))
        .collect();
    ballots.extend([[0; 4], [u32::MAX; 4]]);
    let pipeline = gpu
        .pipeline(&Composition::new("test/votes"), true)
        .unwrap_or_else(|e| panic!("{e}"));
    let votes = Storage::scratch("votes", u64::from(4 * BALLOTS * BITS));
    let mut bindings = Bindings::new();
    bindings
        .buffer(
            "ballots",
            &gpu.storage("ballots", &ballots).expect("a buffer"),
        )
        .buffer("votes", &votes);
    let mut recording = Recording::new();
    recording
        .run("votes", &pipeline, &bindings, [BALLOTS, 1, 1])
        .download("votes", &votes);
    let played = gpu.play(&recording).expect("it plays");
    let found: Vec<u32> = played.download("votes").expect("words");
    let wide = |words: [u32; 4]| {
        (0..4)
            .map(|k| u128::from(words[k]) << (32 * k))
            .sum::<u128>()
    };
    let all = ballots.into_iter().map(wide);
    let places = all.flat_map(|ballot| (0..BITS).map(move |bit| (ballot, bit)));
    let is_wrong = |(at, (ballot, bit)): (usize, (u128, u32))| {
        let before = (ballot & ((1 << bit) - 1)).count_ones();
        (found[at] != before).then_some((ballot, bit))
    };
    places.enumerate().find_map(is_wrong)
}

#[test]
fn votes_of_subgroups_of_all_sizes_are_counted() {
    let gpu = with_test_kernels(KernelLibrary::default());
    assert_eq!(first_wrong(&gpu), None);
}

#[test]
fn faults_in_the_count_of_votes_are_seen() {
    for (from, to) in [
        (
            "below - vec4<u32>(0u, 32u, 64u, 96u)",
            "below - vec4<u32>(0u, 32u, 64u, 64u)",
        ),
        (
            "vec4<u32>(32u, 64u, 96u, 128u)",
            "vec4<u32>(32u, 64u, 96u, 96u)",
        ),
        ("word < 4u", "word < 3u"),
    ] {
        let gpu = with_test_kernels(kernels_with("compaction/subgroup", &[(from, to)]));
        assert_ne!(first_wrong(&gpu), None, "`{to}` goes unseen");
    }
}

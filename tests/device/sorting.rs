//! The device's radix sort against the host's stable sort, and faults that this comparison detects.

use crate::support::{Pcg, gpu, kernels_with, open};
use raystone::gpu::{Gpu, KernelLibrary, Pairs, RadixSort, Recording};

/// Sorts on the device by the lowest `bits`; returns keys and values.
fn sorted(gpu: &Gpu, keys: &[u32], bits: u32) -> (Vec<u32>, Vec<u32>) {
    let count = keys.len() as u32;
    let values: Vec<u32> = (0..count).collect();
    let buffer = |name: &str, words: &[u32]| gpu.storage(name, words).expect("a buffer");
    let pairs = Pairs {
        keys: (&buffer("keys", keys)).into(),
        values: (&buffer("values", &values)).into(),
        count,
    };
    let sort = RadixSort::new(gpu).unwrap_or_else(|e| panic!("{e}"));
    let mut recording = Recording::new();
    let out = sort.record(&mut recording, &pairs, bits);
    recording
        .download("keys", &out.keys)
        .download("values", &out.values);
    let played = gpu.play(&recording).unwrap_or_else(|e| panic!("{e}"));
    // A buffer of few words is longer than needed.
    let words = |name: &str| {
        let mut words: Vec<u32> = played.download(name).expect("words");
        words.truncate(keys.len());
        words
    };
    (words("keys"), words("values"))
}

/// [`sorted`] on the host.
fn expected(keys: &[u32], bits: u32) -> (Vec<u32>, Vec<u32>) {
    let mut values: Vec<u32> = (0..keys.len() as u32).collect();
    // Whole digits.
    let mask = u32::MAX >> (32 - bits.next_multiple_of(8));
    values.sort_by_key(|&place| keys[place as usize] & mask);
    let keys = values.iter().map(|&place| keys[place as usize]).collect();
    (keys, values)
}

fn kinds(random: &mut Pcg, count: u32) -> Vec<(&'static str, Vec<u32>)> {
    let mut of = |key: &mut dyn FnMut(&mut Pcg, u32) -> u32| -> Vec<u32> {
        (0..count).map(|place| key(random, place)).collect()
    };
    vec![
        ("random", of(&mut |random, _| random.next_u32())),
        ("equal", of(&mut |_, _| 0x0a0b_0c0d)),
        ("ascending", of(&mut |_, place| place)),
        ("descending", of(&mut |_, place| u32::MAX - place)),
        (
            "few of each digit",
            of(&mut |random, _| random.next_u32() & 0x0301_0203),
        ),
    ]
}

#[test]
fn keys_are_sorted_and_equal_ones_stay_in_order() {
    let mut random = Pcg::new(3);
    for count in [0, 1, 2, 63, 64, 65, 255, 256, 2047, 2048, 2049, 10_007] {
        for (kind, keys) in kinds(&mut random, count) {
            for bits in [8, 17, 30, 32] {
                let found = sorted(gpu(), &keys, bits);
                assert!(
                    found == expected(&keys, bits),
                    "{count} {kind} keys, {bits} bits"
                );
            }
        }
    }
}

#[test]
fn a_million_keys_are_sorted() {
    let mut random = Pcg::new(4);
    for (kind, keys) in kinds(&mut random, 1 << 20) {
        assert!(sorted(gpu(), &keys, 32) == expected(&keys, 32), "{kind}");
    }
}

#[test]
fn faults_in_the_passes_are_seen() {
    let faults = [
        (
            "a digit skipped",
            "digits",
            "(key >> digits.shift)",
            "(key >> select(digits.shift, 0u, digits.shift == 8u))",
        ),
        (
            "an unstable scatter",
            "scatter",
            "let place = starts[bin] + rank;",
            "let place = starts[bin] + countOneBits(low) + countOneBits(high) - 1u - rank;",
        ),
        (
            "the last key missing",
            "scatter",
            "let is_key = item < digits.count;",
            "let is_key = item + 1u < digits.count;",
        ),
        (
            "the last tile not counted",
            "offsets",
            "first < digits.tiles;",
            "first + 1u < digits.tiles;",
        ),
        (
            "smaller digits forgotten",
            "scatter",
            "smaller += sums.total;",
            "smaller = sums.total;",
        ),
    ];
    let mut random = Pcg::new(5);
    let keys: Vec<u32> = (0..2048 * 64 + 1)
        .map(|_| random.next_u32() & 0x00ff_0fff)
        .collect();
    let expected = expected(&keys, 32);
    assert!(sorted(&open(KernelLibrary::default()), &keys, 32) == expected);
    for (what, pass, from, to) in faults {
        let gpu = open(kernels_with(&format!("common/sort/{pass}"), &[(from, to)]));
        assert!(sorted(&gpu, &keys, 32) != expected, "{what}");
    }
}

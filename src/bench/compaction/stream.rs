//! Streams on the host, expected compactions, and checks of actual ones.

use raystone_core::random::Pcg32;
use raystone_gpu::compaction::{Compaction, Order};
use raystone_sampling::hash::pcg_hash;

/// A word of an element. The first is its number, from 1, the others a hash of it.
pub fn word(element: u32, word: u32) -> u32 {
    match word {
        0 => element + 1,
        word => pcg_hash(element ^ pcg_hash(word)),
    }
}

pub(crate) fn elements(count: u32, bytes: u32) -> Vec<u32> {
    let of = |element| (0..bytes / 4).map(move |w| word(element, w));
    (0..count).flat_map(of).collect()
}

/// Flags of `count` elements, of which a share `valid` survives, in random buckets.
pub fn flags(count: u32, valid: f64, buckets: u32, seed: u64) -> Vec<u32> {
    let mut random = Pcg32::new(seed);
    let mut flag = || {
        if random.uniform() < valid {
            1 + random.below(buckets as usize) as u32
        } else {
            0
        }
    };
    (0..count).map(|_| flag()).collect()
}

/// The elements that should survive, in stable order.
pub fn expected(flags: &[u32], method: &dyn Compaction) -> Vec<u32> {
    let all = || (0..flags.len() as u32).zip(flags);
    if method.order() == Order::WithHoles {
        return all().map(|(element, _)| element).collect();
    }
    let bucket = |wanted| all().filter(move |(_, flag)| **flag == wanted);
    let buckets = (1..=method.buckets()).flat_map(bucket);
    buckets.map(|(element, _)| element).collect()
}

/// Two checksums over the survivors: the sum of hashes, and of hashes times positions.
pub fn digest(expected: &[u32], bytes: u32) -> [u32; 2] {
    let mut sums = [0_u32; 2];
    for (slot, element) in (0..).zip(expected) {
        let words = 0..bytes / 4;
        let hash = words.fold(0, |hash, w| mix(hash, word(*element, w)));
        let place: u32 = 2_u32.wrapping_mul(slot).wrapping_add(1);
        sums[0] = sums[0].wrapping_add(hash);
        sums[1] = sums[1].wrapping_add(hash.wrapping_mul(place));
    }
    sums
}

fn mix(hash: u32, word: u32) -> u32 {
    let product = (hash ^ word).wrapping_mul(2_654_435_769);
    product ^ (product >> 15)
}

/// Describes the first error in a method's `count` and output words.
pub fn fault(
    flags: &[u32],
    bytes: u32,
    method: &dyn Compaction,
    (count, kept): (u32, &[u32]),
) -> Option<String> {
    let expected = expected(flags, method);
    if count as usize != expected.len() {
        return Some(format!("{count} elements stay, not {}", expected.len()));
    }
    let mut missing = vec![false; flags.len()];
    for element in &expected {
        missing[*element as usize] = true;
    }
    let slots = kept.chunks_exact(bytes as usize / 4);
    for ((slot, words), stable) in (0..count).zip(slots).zip(&expected) {
        let element = words[0].wrapping_sub(1);
        let is_whole = words.iter().zip(0..).all(|(w, at)| *w == word(element, at));
        let what = match flags.get(element as usize) {
            None => "nothing of the stream".to_owned(),
            Some(_) if !is_whole => format!("part of element {element}"),
            Some(_) if method.order() != Order::Any && element != *stable => {
                format!("element {element}, and not element {stable}: the order is lost")
            }
            Some(_) if std::mem::take(&mut missing[element as usize]) => continue,
            Some(0) => format!("element {element}, which is a hole"),
            Some(_) => format!("element {element}, which stands before, too"),
        };
        return Some(format!("in slot {slot} of {count} is {what}"));
    }
    None
}

//! Prime bases and permutations of their digits.

use super::hash::pcg_hash;

pub(super) fn primes(count: usize) -> Vec<u32> {
    let mut primes: Vec<u32> = Vec::with_capacity(count);
    let mut candidate = 2;
    while primes.len() < count {
        let mut divisors = primes.iter().take_while(|&p| p * p <= candidate);
        if divisors.all(|p| candidate % p != 0) {
            primes.push(candidate);
        }
        candidate += 1;
    }
    primes
}

/// Faure's permutation of the digits of `base`; 0 is fixed.
///
/// Source: H. Faure, "Good permutations for extreme discrepancy", J. Number Theory 42, 1992.
pub fn faure_permutation(base: u32) -> Vec<u32> {
    if base <= 2 {
        return (0..base).collect();
    }
    let half = base / 2;
    if base.is_multiple_of(2) {
        let inner = faure_permutation(half);
        let doubled = |odd: u32| inner.iter().map(move |d| 2 * d + odd);
        return doubled(0).chain(doubled(1)).collect();
    }
    let inner = faure_permutation(base - 1);
    let mut out: Vec<u32> = inner.iter().map(|&d| d + u32::from(d >= half)).collect();
    out.insert(half as usize, half);
    out
}

/// A fixed random permutation of the digits (Fisher–Yates); 0 is fixed, so an expansion ends.
pub(super) fn random_permutation(base: u32) -> Vec<u32> {
    let mut out: Vec<u32> = (0..base).collect();
    for i in (2..base).rev() {
        let random = u64::from(pcg_hash(i.wrapping_add(pcg_hash(base))));
        let other = 1 + ((random * u64::from(i)) >> 32) as usize;
        out.swap(i as usize, other);
    }
    out
}

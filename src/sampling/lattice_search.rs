//! Searches the generating vector of an extensible rank-1 lattice.
//!
//! Quality is the squared worst-case error in the Korobov space of smoothness 2 with product weights:
//! e²(N, z) = −1 + 1/N Σ_i Π_j (1 + γ_j ω(i z_j / N mod 1)), ω(x) = 2π² (x² − x + 1/6). The search goes
//! component by component (I. Sloan, A. Reztsov 2002) over all odd z below 2¹⁰ and minimises the
//! product of e² over N = 2, 4, … 2¹⁰, since the prefixes count as well. For N = 2¹¹ … 2¹⁶ each
//! component gets one more binary digit, the better of two (as F. Hickernell, H. Niederreiter 2003
//! extend lattices), so earlier prefixes are unchanged. A lattice of N points has N / 4 different
//! components except for the sign: late dimensions of small prefixes repeat early ones.

use std::f64::consts::PI;
use std::sync::OnceLock;

pub(super) const DIMENSIONS: usize = 128;
/// Points are optimised for up to 2^LAST_LEVEL samples.
pub(super) const LAST_LEVEL: u32 = 16;
/// Exhaustive search up to this level.
const SEARCH_LEVEL: u32 = 10;

/// Weight of component `j`: late dimensions of a path matter less, but none has weight zero.
fn weight(j: usize) -> f64 {
    1.0 / (j as f64 + 1.0)
}

fn kernel(level: u32) -> Vec<f64> {
    let omega = |x: f64| 2.0 * PI * PI * (x * x - x + 1.0 / 6.0);
    (0..1_u32 << level)
        .map(|i| omega(f64::from(i) / f64::from(1_u32 << level)))
        .collect()
}

/// Product of e² over N = 2 … 2^SEARCH_LEVEL with component `z` added, as a sum of logarithms.
fn merit(products: &[f64], omega: &[f64], gamma: f64, z: usize) -> f64 {
    let mask = omega.len() - 1;
    // A multiple i / 2¹⁰ is a point of every N whose 2¹⁰ / N divides i.
    let mut sums = [0.0; SEARCH_LEVEL as usize + 1];
    for (i, product) in products.iter().enumerate() {
        let coarsest = SEARCH_LEVEL - (i.trailing_zeros()).min(SEARCH_LEVEL);
        sums[coarsest as usize] += product * (1.0 + gamma * omega[(i * z) & mask]);
    }
    let mut sum = sums[0];
    let mut merit = 0.0;
    for (level, part) in sums.iter().enumerate().skip(1) {
        sum += part;
        let count = f64::from(1_u32 << level);
        merit += (sum / count - 1.0).max(f64::MIN_POSITIVE).ln();
    }
    merit
}

fn search() -> Vec<u32> {
    let omega = kernel(SEARCH_LEVEL);
    let mut products = vec![1.0; omega.len()];
    let mut vector = Vec::with_capacity(DIMENSIONS);
    for j in 0..DIMENSIONS {
        let gamma = weight(j);
        // z and N − z give the same lattice: half of the odd numbers suffice.
        let candidates = (1..omega.len() / 2).step_by(2);
        let merits = candidates.map(|z| (merit(&products, &omega, gamma, z), z));
        let best = merits.min_by(|a, b| a.0.total_cmp(&b.0));
        let z = best.map_or(1, |(_, z)| z);
        multiply(&mut products, &omega, gamma, z);
        vector.push(z as u32);
    }
    vector
}

fn multiply(products: &mut [f64], omega: &[f64], gamma: f64, z: usize) {
    let mask = omega.len() - 1;
    for (i, product) in products.iter_mut().enumerate() {
        *product *= 1.0 + gamma * omega[(i * z) & mask];
    }
}

/// Adds the digit 2^(level−1) to every component or not, whichever is better.
fn extend(vector: &mut [u32], level: u32) {
    let omega = kernel(level);
    let mask = omega.len() - 1;
    let mut products = vec![1.0; omega.len()];
    for (j, component) in vector.iter_mut().enumerate() {
        let gamma = weight(j);
        let error = |z: usize| -> f64 {
            let terms = products.iter().enumerate();
            terms
                .map(|(i, p)| p * (1.0 + gamma * omega[(i * z) & mask]))
                .sum()
        };
        let plain = *component as usize;
        let extended = plain | 1 << (level - 1);
        let z = if error(extended) < error(plain) {
            extended
        } else {
            plain
        };
        multiply(&mut products, &omega, gamma, z);
        *component = z as u32;
    }
}

/// The vector, computed once per process; its first components are the same for any length.
pub(super) fn generating_vector() -> &'static [u32] {
    static VECTOR: OnceLock<Vec<u32>> = OnceLock::new();
    VECTOR.get_or_init(|| {
        let mut vector = search();
        for level in SEARCH_LEVEL + 1..=LAST_LEVEL {
            extend(&mut vector, level);
        }
        vector
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The square of the worst-case error of a prefix, by the formula above.
    fn square(level: u32, vector: &[u32]) -> f64 {
        let count = 1_u64 << level;
        let omega = |x: f64| 2.0 * PI * PI * (x * x - x + 1.0 / 6.0);
        let term = |i: u64| -> f64 {
            let factors = vector.iter().enumerate().map(|(j, z)| {
                let place = (i * u64::from(*z) % count) as f64 / count as f64;
                1.0 + weight(j) * omega(place)
            });
            factors.product()
        };
        (0..count).map(term).sum::<f64>() / count as f64 - 1.0
    }

    #[test]
    fn every_further_digit_of_a_component_is_the_better_of_two() {
        for level in SEARCH_LEVEL + 1..=LAST_LEVEL {
            let below = |z: &u32| z & ((1 << level) - 1);
            let chosen: Vec<u32> = generating_vector()[..3].iter().map(below).collect();
            for place in 1..3 {
                let vector = &chosen[..=place];
                let mut other = vector.to_vec();
                other[place] ^= 1 << (level - 1);
                let [chosen, other] = [vector, &other].map(|vector| square(level, vector));
                assert!(chosen <= other * (1.0 + 1e-6), "{level}: {chosen}, {other}");
            }
        }
    }
}

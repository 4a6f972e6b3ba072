//! Sequences computed anew: digits by exact integers, Sobol's points from Joe and Kuo's rows, nets by
//! counting. Nothing here comes from the crate of samplers but the points that are compared.

use crate::words::borders;
use raystone_core::params::Variant;
use raystone_discrepancy::{Budget, PointSet, net_quality};
use raystone_sampling::{Coordinate, Sampler, to_unit};
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// Lines `s a m_1 … m_s` of the dimensions 1 to 255: degree and inner coefficients of the polynomial, and
/// the first direction integers. Generated from SciPy 1.17's `_sobol_direction_numbers.npz` (`poly` without
/// its outer bits, `vinit`), and equal to the lines of `new-joe-kuo-6.21201`.
///
/// Source: S. Joe, F. Kuo, "Constructing Sobol sequences with better two-dimensional projections", 2008.
const JOE_KUO: &str = include_str!("joe_kuo.txt");
/// Points whose nets are looked at, at most.
const NET: u32 = 256;
/// Decorrelations that leave nets in base 2 as they are.
const KEEP_NETS: [&str; 4] = ["none", "digital-shift", "linear-scramble", "owen-hash"];
/// Samples whose strata are looked at, at most.
const STRATA: u32 = 1024;
/// Seconds that counting a net may take.
const NET_SECONDS: f64 = 60.0;

/// The first 256 primes by Eratosthenes' sieve.
fn primes() -> &'static [u32] {
    static PRIMES: OnceLock<Vec<u32>> = OnceLock::new();
    PRIMES.get_or_init(|| {
        let mut composite = [false; 1620];
        let mut primes = Vec::new();
        for n in 2..composite.len() {
            if !composite[n] {
                primes.push(n as u32);
                (n * n..composite.len())
                    .step_by(n)
                    .for_each(|k| composite[k] = true);
            }
        }
        primes
    })
}

/// Faure's permutation of one digit.
///
/// Source: H. Faure, "Good permutations for extreme discrepancy", J. Number Theory 42, 1992.
fn faure_digit(base: u32, digit: u32) -> u32 {
    let half = base / 2;
    if base <= 2 {
        return digit;
    }
    if base.is_multiple_of(2) {
        let odd = digit / half;
        return 2 * faure_digit(half, digit - odd * half) + odd;
    }
    if digit == half {
        return half;
    }
    let inner = faure_digit(base - 1, digit - u32::from(digit > half));
    inner + u32::from(inner >= half)
}

/// The mirrored digits of `n` over a power of the base, cut to a fraction of 2³².
fn mirrored(n: u32, base: u32, permutation: fn(u32, u32) -> u32) -> u32 {
    let (mut digits, mut power, mut rest) = (0_u128, 1_u128, n);
    while rest > 0 {
        digits = digits * u128::from(base) + u128::from(permutation(base, rest % base));
        power *= u128::from(base);
        rest /= base;
    }
    ((digits << 32) / power) as u32
}

/// Direction numbers of Joe and Kuo's dimensions, as fractions of 2³².
///
/// Source: P. Bratley, B. Fox, "Algorithm 659", ACM TOMS 14, 1988.
fn directions() -> &'static [[u32; 32]] {
    static DIRECTIONS: OnceLock<Vec<[u32; 32]>> = OnceLock::new();
    DIRECTIONS.get_or_init(|| {
        let corput = std::array::from_fn(|i| 1 << (31 - i));
        let of_line = |line: &str| {
            let mut numbers = line.split(' ').filter_map(|n| n.parse::<u32>().ok());
            let [s, a] = [(); 2].map(|()| numbers.next().unwrap_or(1));
            let mut m: Vec<u32> = numbers.collect();
            for i in m.len()..32 {
                let back = |k: usize| m[i - k];
                let s = s as usize;
                let inner = (1..s).filter(|k| a >> (s - 1 - k) & 1 == 1);
                let last = back(s) ^ back(s) << s;
                m.push(inner.fold(last, |sum, k| sum ^ back(k) << k));
            }
            std::array::from_fn(|i| m[i] << (31 - i))
        };
        std::iter::once(corput)
            .chain(JOE_KUO.lines().map(of_line))
            .collect()
    })
}

/// Sobol's point; `None` beyond the list.
fn sobol(sample: u32, dimension: u32) -> Option<u32> {
    let columns = directions().get(dimension as usize)?;
    let set = columns
        .iter()
        .enumerate()
        .filter(|(bit, _)| sample >> bit & 1 == 1);
    Some(set.fold(0, |x, (_, column)| x ^ column))
}

/// Fractions of 2³² of the steps of `r2`: powers of the root of x^(d+1) = x + 1, by bisection, or square
/// roots of primes, by integers.
fn r2_step(dimensions: u32, dimension: u32) -> Option<u32> {
    if dimensions > 8 {
        let prime = u128::from(*primes().get(dimension as usize)?);
        // √p · 2³³, cut; its last bit rounds.
        let root = (prime << 66).isqrt();
        return Some(((root + 1) >> 1) as u32);
    }
    let (mut low, mut high) = (1.0_f64, 2.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let power = middle.powi(dimensions as i32 + 1);
        *if power > middle + 1.0 {
            &mut high
        } else {
            &mut low
        } = middle;
    }
    let power = low.powi(-(dimension as i32 + 1));
    Some((power * 2.0_f64.powi(32)).round() as u32)
}

/// The word of a sequence as it should be; `None` where this is not known.
fn expected(variant: &Variant, samples: u32, at: Coordinate) -> Option<u32> {
    let parameter = |key: &str| variant.params.0.get(key).map(ToString::to_string);
    let number = |key: &str| parameter(key)?.parse::<u32>().ok();
    let permutation: Option<fn(u32, u32) -> u32> = match parameter("digits").as_deref() {
        Some("plain") => Some(|_, digit| digit),
        Some("faure") => Some(faure_digit),
        _ => None,
    };
    let prime = |k: u32| primes().get(k as usize).copied();
    match variant.name.as_str() {
        "van-der-corput" => Some(mirrored(at.sample, number("base")?, |_, digit| digit)),
        "halton" => Some(mirrored(at.sample, prime(at.dimension)?, permutation?)),
        "hammersley" if at.dimension == 0 => {
            Some(((u64::from(at.sample) << 32) / u64::from(samples.max(1))) as u32)
        }
        "hammersley" => Some(mirrored(at.sample, prime(at.dimension - 1)?, permutation?)),
        "sobol" => sobol(at.sample, at.dimension),
        "r2" => {
            let step = r2_step(number("dimensions")?, at.dimension)?;
            Some(
                at.sample
                    .wrapping_add(1)
                    .wrapping_mul(step)
                    .wrapping_add(1 << 31),
            )
        }
        _ => None,
    }
}

/// What is wrong with a sampler's sequence: a word that is not the one computed anew, or a net that is worse
/// than promised.
pub fn fault(sampler: &Sampler) -> Option<String> {
    let samples = sampler.demand.samples.unwrap_or(1);
    let facts = sampler.sequence.facts();
    let end = if facts.by_count || facts.samples.is_some() {
        samples
    } else {
        u32::MAX
    };
    let samples_at = borders(end);
    for dimension in 0..sampler.demand.dimensions {
        for &sample in &samples_at {
            let at = Coordinate {
                pixel: 0,
                sample,
                dimension,
                seed: 0,
            };
            let Some(expected) = expected(&sampler.sequence_variant, samples, at) else {
                break;
            };
            let found = sampler.sequence.sequence(&sampler.table, at);
            if found != expected {
                return Some(format!(
                    "its sequence is {found:#010x} in dimension {dimension} of sample {sample}, computed anew \
                     {expected:#010x}"
                ));
            }
        }
    }
    fault_of_nets(sampler).or_else(|| fault_of_strata(sampler))
}

/// Points of `jittered` that share a stratum, or strata that are more than twice as long as wide, or more than a row too many.
fn fault_of_strata(sampler: &Sampler) -> Option<String> {
    let count = sampler.demand.samples?.min(STRATA);
    let is_whole = sampler.demand.samples == Some(count);
    if sampler.sequence_variant.name != "jittered" || !is_whole || sampler.demand.dimensions < 2 {
        return None;
    }
    let [columns, rows] = [0, 3].map(|place| sampler.table.sequence_word(place));
    let is_even = columns <= 2 * rows && rows <= columns;
    if !is_even || columns * rows < count || columns * rows >= count + columns {
        return Some(format!("{columns} × {rows} strata for {count} samples"));
    }
    let stratum = |sample| {
        let word = |dimension, count: u32| {
            let at = Coordinate {
                pixel: 5,
                sample,
                dimension,
                seed: 1,
            };
            let word = sampler.sequence.sequence(&sampler.table, at);
            (u64::from(word) * u64::from(count)) >> 32
        };
        [word(0, columns), word(1, rows)]
    };
    let taken: BTreeSet<[u64; 2]> = (0..count).map(stratum).collect();
    (taken.len() < count as usize).then(|| format!("{count} samples lie in {} strata", taken.len()))
}

/// The t of a pair of dimensions: 2^m points are a (t, m, 2)-net in base 2.
fn net(m: u32, word: impl Fn(u32, u32) -> Option<u32>, pair: [u32; 2]) -> Option<u32> {
    let point = |sample| {
        let unit = |dimension| Some(f64::from(to_unit(word(sample, dimension)?)));
        Some([unit(pair[0])?, unit(pair[1])?])
    };
    let points: Option<Vec<[f64; 2]>> = (0..1 << m).map(point).collect();
    let set = PointSet::from_points(&points?).ok()?;
    Some(net_quality(&set, &Budget::seconds(NET_SECONDS)).ok()?.t)
}

/// The first pair of dimensions that is no net, or a worse one than Sobol's, whose t scrambling keeps.
fn fault_of_nets(sampler: &Sampler) -> Option<String> {
    let name = sampler.sequence_variant.name.as_str();
    let keeps = KEEP_NETS.contains(&sampler.decorrelation_variant.name.as_str());
    if !keeps || !matches!(name, "sobol" | "owen-sobol" | "pmj02") {
        return None;
    }
    let m = sampler.demand.samples?.min(NET).checked_ilog2()?;
    for first in (0..sampler.demand.dimensions.saturating_sub(1)).step_by(2) {
        let pair = [first, first + 1];
        let drawn = |sample, dimension| {
            let at = Coordinate {
                pixel: 5,
                sample,
                dimension,
                seed: 1,
            };
            Some(sampler.sample_u32(at))
        };
        let found = net(m, drawn, pair)?;
        let promised = match name {
            "pmj02" => 0,
            _ => net(m, sobol, pair)?,
        };
        if found != promised {
            return Some(format!(
                "2^{m} points in dimensions {pair:?} are a ({found}, {m}, 2)-net, and not a ({promised}, {m}, 2)-net"
            ));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primes_roots_and_digits_are_those_of_tables() {
        assert_eq!(primes().len(), 256);
        assert_eq!([primes()[0], primes()[99], primes()[255]], [2, 541, 1619]);
        let faure = |base| (0..base).map(|d| faure_digit(base, d)).collect::<Vec<_>>();
        // Faure 1992, table 1.
        assert_eq!(faure(5), [0, 3, 2, 1, 4]);
        assert_eq!(faure(8), [0, 4, 2, 6, 1, 5, 3, 7]);
        // 1/φ² and 1/φ₂ as Roberts writes them; √2 − 1.
        let word = |x: f64| (x * 2.0_f64.powi(32)).round() as u32;
        assert_eq!(r2_step(1, 0), Some(word(0.618_033_988_749_894_8)));
        assert_eq!(r2_step(2, 1), Some(word(0.569_840_290_998_053_3)));
        assert_eq!(r2_step(9, 0), Some(word(std::f64::consts::SQRT_2 - 1.0)));
    }

    #[test]
    fn points_of_sobol_are_those_of_scipy() {
        // scipy.stats.qmc.Sobol(256, scramble=False, bits=32), fast_forward(i).random() times 2³²; SciPy draws
        // in Gray code order.
        let scipy = [
            (
                3,
                [
                    0xc000_0000,
                    0xc000_0000,
                    0xc000_0000,
                    0xc000_0000,
                    0x4000_0000,
                ],
            ),
            (
                1000,
                [
                    0x18c0_0000,
                    0x84c0_0000,
                    0x5a40_0000,
                    0x8b40_0000,
                    0x3fc0_0000,
                ],
            ),
            (
                99999,
                [
                    0xd78a_8000,
                    0xad8e_8000,
                    0x4c18_8000,
                    0xb19b_8000,
                    0xe242_8000,
                ],
            ),
            (
                123456789,
                [
                    0xcadc_d1a0,
                    0x01a3_d160,
                    0x4055_8ba0,
                    0xab9f_d4e0,
                    0x2198_abe0,
                ],
            ),
        ];
        for (i, row) in scipy {
            let found = [1, 2, 50, 127, 255].map(|d| sobol(i ^ i >> 1, d));
            assert_eq!(found, row.map(Some), "{i}");
        }
        assert_eq!(sobol(1, 256), None);
    }
}

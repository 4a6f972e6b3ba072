//! Projections of a sampler's points on single dimensions and on pairs of them, by the twin: faults of tables,
//! which the kernel reads as well.

use raystone::discrepancy::star_2d;
use raystone::sampling::{Coordinate, Sampler, to_unit};
use std::collections::HashSet;

/// Dimensions whose pairs are all measured, and the maximum of each at 1024 points; random ones have about 0.04.
const PAIRED: usize = 20;
const MOST_STAR: f64 = 0.12;
/// Numbers that differ in these lowest bits alone are the same: points of bases below 256 lie farther apart.
const UNSEEN: u32 = 12;
/// Two dimensions are the same if more than this part of their words is.
const SAME: usize = 16;

/// The words of the first points of a pixel by dimension.
fn columns(sampler: &Sampler, samples: u32) -> Vec<Vec<u32>> {
    let word = |sample, dimension| {
        sampler.sample_u32(Coordinate {
            pixel: 77,
            sample,
            dimension,
            seed: 3,
        })
    };
    let column = |dimension| (0..samples).map(|i| word(i, dimension)).collect();
    (0..sampler.demand.dimensions).map(column).collect()
}

/// Describes a fault of the first `samples` points: a number that a dimension draws twice, a dimension that equals
/// another one, or two that are locked together. Numbers that are jittered one by one come as near to each other
/// as random ones (two of 1024 agree in 20 bits in two dimensions of five): only whole words count as the same.
pub fn fault(sampler: &Sampler, samples: u32, are_jittered: bool) -> Option<String> {
    let columns = columns(sampler, samples);
    let unseen = if are_jittered { 0 } else { UNSEEN };
    for (i, xs) in columns.iter().enumerate() {
        if xs.iter().map(|x| x >> unseen).collect::<HashSet<_>>().len() < xs.len() {
            return Some(format!(
                "dimension {i} draws a number twice in {samples} samples"
            ));
        }
        for (j, ys) in columns.iter().enumerate().skip(i + 1) {
            let same = xs.iter().zip(ys).filter(|(x, y)| x == y).count();
            if same > xs.len() / SAME {
                return Some(format!(
                    "dimensions {i} and {j} draw the same in {same} samples"
                ));
            }
            if j >= PAIRED {
                continue;
            }
            let unit = |x: &u32| f64::from(to_unit(*x));
            let points: Vec<[f64; 2]> =
                xs.iter().zip(ys).map(|(x, y)| [unit(x), unit(y)]).collect();
            let star = star_2d(&points).unwrap_or(1.0);
            if star > MOST_STAR {
                return Some(format!(
                    "D* of dimensions {i} and {j} is {star:.4} > {MOST_STAR}"
                ));
            }
        }
    }
    None
}

/// Returns the first dimension in which 2^m points, the maximum, do not lie in one interval each of 2^m.
pub fn fault_of_axes(sampler: &Sampler) -> Option<String> {
    let m = sampler.demand.samples?.checked_ilog2()?;
    let columns = columns(sampler, 1 << m);
    let even = |column: &Vec<u32>| {
        let mut taken = vec![false; 1 << m];
        column
            .iter()
            .all(|x| !std::mem::replace(&mut taken[(x >> (32 - m)) as usize], true))
    };
    let wrong = columns.iter().position(|column| !even(column))?;
    Some(format!(
        "the first 2^{m} points of dimension {wrong} leave an interval of 2^-{m} empty"
    ))
}

//! Nets in base 2: how evenly points fill the boxes of the dyadic grids.

use super::{Budget, DiscrepancyError, PointSet};

const NAME: &str = "tvalue";

/// A (t, m, d)-net in base 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Net {
    /// Quality: every elementary interval of volume 2^(t−m) has exactly 2^t points. 0 is best.
    pub t: u32,
    /// There are 2^m points.
    pub m: u32,
}

/// The smallest t for which the points are a (t, m, d)-net in base 2 (Niederreiter 1992, definition
/// 4.1).
///
/// An elementary interval is a box `Π [a_k 2^-e_k, (a_k + 1) 2^-e_k)`; sets that are even for small
/// volumes are even for larger ones, so the sums of exponents are tried from 1 on. Cost: N times
/// the number of shapes.
///
/// # Errors
/// The number of points is no power of two; a coordinate is 1, which no interval contains; the
/// budget is spent first.
pub fn net_quality(points: &PointSet, budget: &Budget) -> Result<Net, DiscrepancyError> {
    let m = size_of_net(points, NAME)?;
    let mut counts = Vec::new();
    for sum in 1..=m {
        let mut even = true;
        each_shape(points.dim(), sum, &mut |shape| {
            budget.check(NAME)?;
            even = even && is_even(points, shape, m, &mut counts);
            Ok(even)
        })?;
        if !even {
            return Ok(Net { t: m - sum + 1, m });
        }
    }
    Ok(Net { t: 0, m })
}

/// The number of shapes of elementary intervals of volume 1/N, and the number of those in which
/// every interval has exactly one point.
///
/// # Errors
/// As [`net_quality`].
pub fn elementary_shapes(
    points: &PointSet,
    budget: &Budget,
) -> Result<(u64, u64), DiscrepancyError> {
    let measure = "intervals";
    let m = size_of_net(points, measure)?;
    let (mut all, mut even) = (0, 0);
    let mut counts = Vec::new();
    each_shape(points.dim(), m, &mut |shape| {
        budget.check(measure)?;
        all += 1;
        even += u64::from(is_even(points, shape, m, &mut counts));
        Ok(true)
    })?;
    Ok((all, even))
}

fn size_of_net(points: &PointSet, measure: &'static str) -> Result<u32, DiscrepancyError> {
    let n = points.len();
    let refuse = |reason| Err(DiscrepancyError::NotDefined { measure, reason });
    if !n.is_power_of_two() {
        return refuse(format!("needs a power of two of points, there are {n}"));
    }
    if let Some(index) = points.points().position(|p| p.contains(&1.0)) {
        return refuse(format!(
            "needs coordinates below 1, point {index} has a coordinate of 1"
        ));
    }
    Ok(n.trailing_zeros())
}

/// Calls `visit` with all lists of `dim` exponents of a given sum until it returns false.
fn each_shape(
    dim: usize,
    sum: u32,
    visit: &mut impl FnMut(&[u32]) -> Result<bool, DiscrepancyError>,
) -> Result<(), DiscrepancyError> {
    // As digits of a counter, the first dimension fastest; the last takes the remainder.
    let mut shape = vec![0; dim];
    shape[dim - 1] = sum;
    loop {
        if !visit(&shape)? {
            return Ok(());
        }
        let mut d = 0;
        while d + 1 < dim && shape[dim - 1] == 0 {
            shape[dim - 1] += shape[d];
            shape[d] = 0;
            d += 1;
        }
        if d + 1 >= dim {
            return Ok(());
        }
        shape[d] += 1;
        shape[dim - 1] -= 1;
    }
}

/// True if all intervals of a shape have the same number of the 2^m points.
fn is_even(points: &PointSet, shape: &[u32], m: u32, counts: &mut Vec<u32>) -> bool {
    let sum: u32 = shape.iter().sum();
    counts.clear();
    counts.resize(1 << sum, 1 << (m - sum));
    points.points().all(|point| {
        let cell = point.iter().zip(shape).fold(0, |cell, (&x, &e)| {
            cell << e | (x * f64::from(1u32 << e)) as usize
        });
        // If no interval has too many, all have the right number.
        let left = &mut counts[cell];
        let free = *left > 0;
        *left = left.wrapping_sub(1);
        free
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_comes_once() {
        for (dim, sum, expected) in [(1, 5, 1), (2, 5, 6), (3, 4, 15), (4, 0, 1), (3, 1, 3)] {
            let mut shapes = Vec::new();
            let mut note = |shape: &[u32]| {
                assert_eq!(shape.iter().sum::<u32>(), sum);
                shapes.push(shape.to_vec());
                Ok(true)
            };
            each_shape(dim, sum, &mut note).unwrap();
            shapes.sort();
            shapes.dedup();
            assert_eq!(shapes.len(), expected, "{dim} {sum}");
        }
    }
}

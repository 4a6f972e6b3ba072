//! Distances between points.

use super::PointSet;

/// The distance between two points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Euclidean distance.
    Plain,
    /// Euclidean distance on the torus, where 0 and 1 are the same coordinate.
    Torus,
}

impl Metric {
    fn along(self, a: f64, b: f64) -> f64 {
        let distance = (a - b).abs();
        match self {
            Self::Plain => distance,
            Self::Torus => distance.min(1.0 - distance),
        }
    }

    fn squared(self, a: &[f64], b: &[f64]) -> f64 {
        let along = |(&a, &b)| self.along(a, b);
        a.iter().zip(b).map(along).map(|d| d * d).sum()
    }
}

/// Minimum distance between two points of the set; `None` for a single point.
///
/// A sweep over the first coordinate searches only up to the minimum distance so far: about N^(3/2)
/// steps for even sets in two dimensions.
pub(crate) fn minimum_distance(points: &PointSet, metric: Metric) -> Option<f64> {
    let mut sorted: Vec<&[f64]> = points.points().collect();
    sorted.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut least: Option<f64> = None;
    for (i, a) in sorted.iter().enumerate() {
        // On the torus the first points are repeated after the last ones.
        let again = match metric {
            Metric::Plain => &[],
            Metric::Torus => &sorted[..i],
        };
        let later = sorted[i + 1..].iter().map(|b| (b, b[0] - a[0]));
        for (b, ahead) in later.chain(again.iter().map(|b| (b, 1.0 + b[0] - a[0]))) {
            if least.is_some_and(|least| ahead * ahead > least) {
                break;
            }
            let squared = metric.squared(a, b);
            if least.is_none_or(|least| squared < least) {
                least = Some(squared);
            }
        }
    }
    least.map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    fn brute_force(points: &PointSet, metric: Metric) -> Option<f64> {
        let all: Vec<&[f64]> = points.points().collect();
        let pairs = (0..all.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let squares = pairs.map(|(i, j)| metric.squared(all[i], all[j]));
        squares.reduce(f64::min).map(f64::sqrt)
    }

    #[test]
    fn the_sweep_finds_what_all_pairs_have() {
        let mut random = SplitMix64(4);
        for round in 0..1000 {
            let (dim, n) = (1 + round % 4, 1 + random.below(30));
            let levels = [2, 9, 1 << 20][round % 3];
            let coordinate = |_| random.below(levels + 1) as f64 / levels as f64;
            let points = PointSet::new(dim, (0..n * dim).map(coordinate).collect()).unwrap();
            for metric in [Metric::Plain, Metric::Torus] {
                let found = minimum_distance(&points, metric);
                assert_eq!(found, brute_force(&points, metric), "{metric:?} {points:?}");
            }
        }
    }

    #[test]
    fn the_torus_joins_opposite_sides() {
        let points = PointSet::from_points(&[[0.0, 0.5], [1.0, 0.5], [0.5, 0.25]]).unwrap();
        assert_eq!(minimum_distance(&points, Metric::Torus), Some(0.0));
        let plain = (0.25f64 + 0.0625).sqrt();
        assert_eq!(minimum_distance(&points, Metric::Plain), Some(plain));
        let one = PointSet::from_points(&[[0.5]]).unwrap();
        assert_eq!(minimum_distance(&one, Metric::Torus), None);
    }
}

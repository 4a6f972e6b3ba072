//! Figures of the points drawn by a pair of dimensions: discrepancies, errors of analytic
//! integrands, coherence between pixels and joint coverage by many pixels.

use raystone_discrepancy::known_figures::POINTS;
use raystone_discrepancy::{
    Budget, DiscrepancyError, PointSet, Quadratic, quadratic, star_2d_prefixes,
};
use raystone_record::{FigureAtCount, IntegrandFigures, Interval, StreamFigures};
use raystone_render::integrand::{Function, functions};
use raystone_stats::statistics::{log_log_slope, mean_interval, root_mean_interval};
use std::f64::consts::TAU;

/// Limit on N for mean-square discrepancies, which cost N².
pub(crate) const MOST_QUADRATIC: usize = 1 << 13;
/// Time limit of one such sum in seconds.
const SUM_SECONDS: f64 = 600.0;
/// Copies superposed for the coverage, as in Dufay 2017, Fig. 5.13.
pub(crate) const COPIES: u32 = 150;
/// Resolution of coordinates: smaller errors are not due to the points.
const RESOLUTION: f64 = 1.0 / (1 << 24) as f64;
/// Cells along a side of the coverage grid, per √N.
const CELLS: usize = 4;

/// Figures of one seed's points at each number of points.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SeedFigures {
    star: Vec<f64>,
    /// Square roots; shorter than `star` if N goes beyond [`MOST_QUADRATIC`].
    l2_star: Vec<f64>,
    centered: Vec<f64>,
    /// By function, then by number of points.
    squared_errors: Vec<Vec<f64>>,
}

impl SeedFigures {
    /// Measures the first `n` points for every `n` in `counts`, ascending, and appends the results.
    ///
    /// # Errors
    /// Fewer points than the largest count, or points outside the unit square.
    pub(crate) fn add(
        &mut self,
        points: &[[f64; 2]],
        counts: &[usize],
    ) -> Result<(), DiscrepancyError> {
        self.star.extend(star_2d_prefixes(points, counts)?);
        for &n in counts.iter().filter(|&&n| n <= MOST_QUADRATIC) {
            let set = PointSet::from_points(&points[..n])?;
            let square = |kind| quadratic(&set, kind, &Budget::seconds(SUM_SECONDS));
            self.l2_star.push(square(Quadratic::L2Star)?.sqrt());
            self.centered.push(square(Quadratic::Centered)?);
        }
        let functions = functions();
        self.squared_errors.resize(functions.len(), Vec::new());
        for (errors, (_, function)) in self.squared_errors.iter_mut().zip(&functions) {
            errors.extend(squared_errors(function, points, counts));
        }
        Ok(())
    }
}

/// Measures known points: D* and the centred discrepancy of all boxes in NumPy, the root of SciPy's L2-star discrepancy, and
/// ((Σ e^(x + y)) / 8 − (e − 1)²)² in Python.
///
/// # Errors
/// A figure is not what it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let mut found = SeedFigures::default();
    let measured = found.add(&POINTS, &[POINTS.len()]);
    measured.map_err(|e| format!("known points: {e}"))?;
    let of_exponential = found
        .squared_errors
        .first()
        .and_then(|errors| errors.first());
    let known = [
        ("D*", found.star.first(), 0.25),
        (
            "L2-star discrepancy",
            found.l2_star.first(),
            0.092_255_154_082_908_05,
        ),
        (
            "centred discrepancy",
            found.centered.first(),
            0.015_346_950_954_860_938,
        ),
        (
            "squared error of e^(x + y)",
            of_exponential,
            0.13123593500391467,
        ),
    ];
    let known = known.map(|(name, found, expected)| (name, found.copied(), expected));
    let known = known.into_iter().chain(of_seeds()?).chain(of_pixels());
    let wrong = known.into_iter().find(|(_, found, expected)| {
        // No figure is none that is right.
        !found.is_some_and(|found| (found - expected).abs() <= 1e-12)
    });
    wrong.map_or(Ok(()), |(name, found, expected)| {
        Err(format!(
            "the {name} of known points is {found:?}, and should be {expected}: this program computes wrong figures; \
             build it anew, and report what stays wrong"
        ))
    })
}

/// A figure's name, what was computed, and what it should be.
type Known = (&'static str, Option<f64>, f64);

/// Means and slopes over two seeds, the points and their mirror image, by SciPy and NumPy.
fn of_seeds() -> Result<Vec<Known>, String> {
    let counts = [2, 4, 8];
    let mirrored = POINTS.map(|[x, y]| [0.875 - x, y]);
    let mut seeds = [SeedFigures::default(), SeedFigures::default()];
    for (seed, points) in seeds.iter_mut().zip([POINTS, mirrored]) {
        let added = seed.add(&points, &counts);
        added.map_err(|e| format!("known points: {e}"))?;
    }
    let (star, figures) = over_seeds(&counts, &seeds);
    let mean =
        |figures: &[FigureAtCount], n| Some(figures.iter().find(|at| at.n == n)?.value.value);
    let slope = |slope: Option<Interval>| slope.map(|slope| slope.value);
    let exponential = figures.integrands.first();
    let rmse = exponential.and_then(|of| mean(&of.rmse, 4));
    Ok(vec![
        ("mean of D*", mean(&star, 4), 0.390_625),
        (
            "slope of D*",
            slope(figures.star_slope),
            -0.719_060_556_195_942_4,
        ),
        (
            "mean of L2-star",
            mean(&figures.l2_star, 2),
            0.288_193_396_322_893_2,
        ),
        (
            "slope of L2-star",
            slope(figures.l2_star_slope),
            -0.836_333_984_616_544_8,
        ),
        (
            "mean of centred discrepancies",
            mean(&figures.centered, 8),
            0.015_499_538_845_485_938,
        ),
        ("error of an integral", rmse, 0.548_195_132_904_098_9),
        (
            "slope of an integral's error",
            exponential.and_then(|of| slope(of.slope)),
            -0.611_699_117_055_745_2,
        ),
    ])
}

/// Two by two pixels of two directions each, and cells of eleven by eleven.
fn of_pixels() -> Vec<Known> {
    let angle = neighbour_angle(&POINTS, 2, 2);
    vec![
        ("angle of neighbours", angle, 0.861_271_325_873_668),
        ("coverage", Some(coverage(&POINTS, 8)), 8.0 / 121.0),
    ]
}

/// Squared error of a function's mean over the first `n` points, for ascending `counts`.
pub(crate) fn squared_errors(
    function: &Function,
    points: &[[f64; 2]],
    counts: &[usize],
) -> Vec<f64> {
    let (mut sum, mut taken) = (0.0, 0);
    let mut error = |&n: &usize| {
        sum += points[taken..n]
            .iter()
            .map(|&p| function.value(p))
            .sum::<f64>();
        taken = n;
        (sum / n as f64 - function.integral()).powi(2)
    };
    counts.iter().map(&mut error).collect()
}

/// D* and all other figures over seeds. One seed gives intervals of zero width.
pub(crate) fn over_seeds(
    counts: &[usize],
    seeds: &[SeedFigures],
) -> (Vec<FigureAtCount>, StreamFigures) {
    let star = means(counts, seeds, |s| &s.star);
    let figures = StreamFigures {
        star_slope: slope(counts, seeds, |s| &s.star),
        l2_star: means(counts, seeds, |s| &s.l2_star),
        l2_star_slope: slope(counts, seeds, |s| &s.l2_star),
        centered: means(counts, seeds, |s| &s.centered),
        integrands: integrands(counts, seeds),
        pixels: Vec::new(),
    };
    (star, figures)
}

type Column = fn(&SeedFigures) -> &Vec<f64>;

fn means(counts: &[usize], seeds: &[SeedFigures], column: Column) -> Vec<FigureAtCount> {
    let mean = |(i, &n): (usize, &usize)| {
        let values: Option<Vec<f64>> = seeds.iter().map(|s| column(s).get(i).copied()).collect();
        mean_interval(&values?).map(|value| FigureAtCount { n, value })
    };
    counts.iter().enumerate().filter_map(mean).collect()
}

fn slope(counts: &[usize], seeds: &[SeedFigures], column: Column) -> Option<Interval> {
    let curves: Vec<_> = seeds.iter().map(|s| curve(counts, column(s))).collect();
    log_log_slope(&curves)
}

fn curve(counts: &[usize], values: &[f64]) -> Vec<(f64, f64)> {
    let points = counts.iter().zip(values);
    points.map(|(&n, &value)| (n as f64, value)).collect()
}

/// RMSE over seeds of every function, and its slope. The slope is half that of the mean square,
/// hence that of the RMSE and not of a mean absolute error. It ignores an N at which at least half
/// of the seeds are exact to coordinate resolution (16 points often halve the square).
fn integrands(counts: &[usize], seeds: &[SeedFigures]) -> Vec<IntegrandFigures> {
    let figures = |(k, (name, function)): (usize, (&str, Function))| {
        let errors: Vec<&Vec<f64>> = seeds.iter().map(|s| &s.squared_errors[k]).collect();
        let rmse = counts.iter().enumerate().filter_map(|(i, &n)| {
            let squares: Vec<f64> = errors.iter().map(|e| e[i]).collect();
            root_mean_interval(&squares).map(|value| FigureAtCount { n, value })
        });
        let least = RESOLUTION.powi(2);
        let resolved = |i: usize| {
            let seen = errors.iter().filter(|e| e[i] > least).count();
            2 * seen > errors.len()
        };
        let squares = |e: &&Vec<f64>| -> Vec<(f64, f64)> {
            let points = curve(counts, e).into_iter().enumerate();
            let fitted = points.filter(|(i, _)| resolved(*i));
            fitted.map(|(_, (n, e))| (n, e.max(least))).collect()
        };
        let curves: Vec<_> = errors.iter().map(squares).collect();
        let half = |slope: Interval| Interval {
            value: 0.5 * slope.value,
            low: 0.5 * slope.low,
            high: 0.5 * slope.high,
        };
        IntegrandFigures {
            function: name.to_owned(),
            integral: function.integral(),
            rmse: rmse.collect(),
            slope: log_log_slope(&curves).map(half),
        }
    };
    functions().into_iter().enumerate().map(figures).collect()
}

/// Cosine-distributed direction around the z axis; double-precision twin of `sample_cosine` in
/// `kernels/shading/hemisphere.wesl`.
pub fn cosine_direction([u, v]: [f64; 2]) -> [f64; 3] {
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    [radius * cos, radius * sin, (1.0 - u).sqrt()]
}

/// Mean angle between the directions of neighbouring pixels (right and below) at the same sample
/// index, radians. `points`: `samples` of each pixel, in rows of `width`.
pub(crate) fn neighbour_angle(points: &[[f64; 2]], width: usize, samples: usize) -> Option<f64> {
    let directions: Vec<_> = points.iter().map(|&p| cosine_direction(p)).collect();
    let pixels = points.len().checked_div(samples)?;
    let mut angles = Vec::new();
    for pixel in 0..pixels {
        let right = Some(pixel + 1).filter(|next| next % width != 0);
        let below = Some(pixel + width).filter(|next| *next < pixels);
        for next in right.into_iter().chain(below) {
            let pairs = (0..samples).map(|i| (pixel * samples + i, next * samples + i));
            angles.extend(pairs.map(|(a, b)| angle(directions[a], directions[b])));
        }
    }
    raystone_stats::statistics::mean(&angles)
}

/// Accurate for small angles, unlike an arc cosine.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let difference = length([0, 1, 2].map(|k| a[k] - b[k]));
    let sum = length([0, 1, 2].map(|k| a[k] + b[k]));
    2.0 * difference.atan2(sum)
}

/// Fraction of cells with a point in a square grid of (4 √n)² cells for n points per pixel.
pub(crate) fn coverage(points: &[[f64; 2]], n: usize) -> f64 {
    let side = ((n as f64).sqrt() * CELLS as f64).round().max(1.0) as usize;
    let mut hit = vec![false; side * side];
    for point in points {
        let [x, y] = point.map(|c| ((c * side as f64) as usize).min(side - 1));
        hit[y * side + x] = true;
    }
    hit.iter().filter(|&&cell| cell).count() as f64 / hit.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    #[test]
    fn known_points_have_their_figures() {
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn errors_of_a_midpoint_grid_have_the_slope_of_its_theory() {
        // The midpoint rule with N points errs by about N^(-1) for smooth 2-D functions.
        let grid = |n: usize| -> Vec<[f64; 2]> {
            let side = (n as f64).sqrt() as usize;
            let at = |k: usize| (k as f64 + 0.5) / side as f64;
            (0..n).map(|i| [at(i % side), at(i / side)]).collect()
        };
        let counts = [16, 64, 256, 1024];
        let mut seed = SeedFigures::default();
        for n in counts {
            seed.add(&grid(n), &[n]).unwrap();
        }
        let (star, figures) = over_seeds(&counts, &[seed]);
        assert_eq!(star.len(), 4);
        // Half a cell along an edge is in excess: D* = 1/√N − 1/(4N).
        let expected = |n: f64| 1.0 / n.sqrt() - 0.25 / n;
        for at in &star {
            assert!(
                (at.value.value - expected(at.n as f64)).abs() < 1e-12,
                "{at:?}"
            );
        }
        let exponential = &figures.integrands[0];
        assert_eq!(exponential.function, "exponential");
        let slope = exponential.slope.unwrap().value;
        assert!((slope + 1.0).abs() < 0.01, "{slope}");
        assert_eq!(figures.l2_star.len(), 4);
    }

    #[test]
    fn random_points_have_the_slope_of_monte_carlo() {
        let counts = [16, 64, 256, 1024];
        let seeds: Vec<SeedFigures> = (0..64)
            .map(|seed| {
                let mut generator = Pcg32::new(seed);
                let points: Vec<_> = (0..1024)
                    .map(|_| [generator.uniform(), generator.uniform()])
                    .collect();
                let squared_errors = functions()
                    .iter()
                    .map(|(_, f)| squared_errors(f, &points, &counts))
                    .collect();
                SeedFigures {
                    squared_errors,
                    ..SeedFigures::default()
                }
            })
            .collect();
        for figures in integrands(&counts, &seeds) {
            let slope = figures.slope.unwrap();
            assert!((slope.value + 0.5).abs() < 0.12, "{figures:?}");
            assert!(slope.low < slope.high);
        }
    }

    #[test]
    fn an_exact_hit_is_left_out_of_a_slope() {
        let counts = [16, 32, 64, 128];
        let law = |n: usize| if n == 16 { 1e-20 } else { 1.0 / n as f64 };
        let seed = SeedFigures {
            squared_errors: vec![counts.map(law).to_vec(); functions().len()],
            ..SeedFigures::default()
        };
        for seeds in [vec![seed.clone()], vec![seed; 3]] {
            for figures in integrands(&counts, &seeds) {
                assert_eq!(figures.rmse.len(), 4);
                let slope = figures.slope.unwrap().value;
                assert!((slope + 0.5).abs() < 1e-12, "{slope}");
            }
        }
    }

    #[test]
    fn coherence_is_zero_for_equal_pixels_and_large_for_independent_ones() {
        let mut generator = Pcg32::new(2);
        let mut random = |n: usize| -> Vec<[f64; 2]> {
            (0..n)
                .map(|_| [generator.uniform(), generator.uniform()])
                .collect()
        };
        let independent = neighbour_angle(&random(64 * 16), 8, 16).unwrap();
        assert!((0.9..1.3).contains(&independent), "{independent}");
        let one = random(16);
        let equal: Vec<_> = (0..64).flat_map(|_| one.clone()).collect();
        assert_eq!(neighbour_angle(&equal, 8, 16), Some(0.0));
        assert_eq!(neighbour_angle(&[], 8, 0), None);
    }

    #[test]
    fn coverage_counts_cells() {
        assert_eq!(
            coverage(&[[0.1, 0.1], [0.12, 0.1], [0.9, 0.9]], 1),
            2.0 / 16.0
        );
        assert_eq!(coverage(&[[1.0 - 1e-9, 0.0]], 4), 1.0 / 64.0);
    }
}

//! Points that keep their distance: best candidates on a torus.

use raystone_core::random::Pcg32;

/// Candidates for each point.
const CANDIDATES: usize = 16;

/// Points of the unit square, each the farthest from those before it among [`CANDIDATES`] random ones, with
/// distances that wrap around: every beginning of the list is a blue noise.
///
/// Source: D. P. Mitchell, "Spectrally optimal sampling for distribution ray tracing", SIGGRAPH 1991, with as
/// many candidates for the last point as for the first, so that time grows as the list does.
pub(super) fn best_candidates(count: usize, random: &mut Pcg32) -> Vec<[f64; 2]> {
    let mut points = Vec::with_capacity(count);
    let mut cells = Cells::new(1);
    while points.len() < count {
        if points.len() >= 4 * cells.side * cells.side {
            cells = Cells::new(2 * cells.side);
            points.iter().for_each(|point| cells.add(*point));
        }
        let mut best = ([0.0; 2], 0.0);
        for _ in 0..CANDIDATES {
            let candidate = [random.uniform(), random.uniform()];
            let distance = cells.nearest(candidate, best.1);
            if distance >= best.1 {
                best = (candidate, distance);
            }
        }
        cells.add(best.0);
        points.push(best.0);
    }
    points
}

/// Points by cells of the torus.
struct Cells {
    side: usize,
    points: Vec<Vec<[f64; 2]>>,
}

impl Cells {
    fn new(side: usize) -> Self {
        let points = vec![Vec::new(); side * side];
        Self { side, points }
    }

    fn place(&self, point: [f64; 2]) -> [usize; 2] {
        point.map(|x| ((x * self.side as f64) as usize).min(self.side - 1))
    }

    fn add(&mut self, point: [f64; 2]) {
        let [x, y] = self.place(point);
        self.points[y * self.side + x].push(point);
    }

    /// The squared distance of the nearest point; of one that is nearer than `least`, that of any such.
    fn nearest(&self, from: [f64; 2], least: f64) -> f64 {
        let [x, y] = self.place(from);
        let mut nearest = f64::INFINITY;
        for ring in 0..=self.side / 2 {
            // All points of this ring are at least so far away.
            let away = ring.saturating_sub(1) as f64 / self.side as f64;
            if nearest <= away * away || nearest < least {
                break;
            }
            for [dx, dy] in ring_of(ring) {
                let wrapped = |at: usize, by: isize| {
                    (at as isize + by).rem_euclid(self.side as isize) as usize
                };
                let cell = wrapped(y, dy) * self.side + wrapped(x, dx);
                let distances = self.points[cell].iter().map(|to| squared(from, *to));
                nearest = distances.fold(nearest, f64::min);
            }
        }
        nearest
    }
}

/// Steps to the cells whose larger distance along an axis is `ring`.
fn ring_of(ring: usize) -> impl Iterator<Item = [isize; 2]> {
    let ring = ring as isize;
    (-ring..=ring).flat_map(move |dy| {
        let step = if dy.abs() == ring { 1 } else { 2 * ring };
        (-ring..=ring)
            .step_by(step.max(1) as usize)
            .map(move |dx| [dx, dy])
    })
}

/// The squared distance on the torus.
fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = |axis: usize| {
        let apart = (a[axis] - b[axis]).abs();
        apart.min(1.0 - apart)
    };
    along(0) * along(0) + along(1) * along(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: usize = 32 * 32;

    #[test]
    fn the_nearest_point_is_that_of_all_points() {
        let mut random = Pcg32::new(3);
        for (side, count) in [(1, 3), (2, 9), (3, 5), (8, 40), (8, 1)] {
            let mut cells = Cells::new(side);
            let points: Vec<[f64; 2]> = (0..count)
                .map(|_| [random.uniform(), random.uniform()])
                .collect();
            points.iter().for_each(|point| cells.add(*point));
            for _ in 0..200 {
                let from = [random.uniform(), random.uniform()];
                let all = points.iter().map(|to| squared(from, *to));
                let nearest = all.fold(f64::INFINITY, f64::min);
                assert_eq!(cells.nearest(from, 0.0), nearest, "{side}, {points:?}");
                assert!(cells.nearest(from, f64::INFINITY) >= nearest);
            }
        }
    }

    /// Of every beginning, distances are compared with those of a hexagonal lattice, 2 / (√3 N) squared.
    #[test]
    fn every_beginning_keeps_its_distance() {
        for count in [64, 256, COUNT] {
            let least = |points: &[[f64; 2]]| {
                let pairs = (0..points.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
                let least = pairs
                    .map(|(i, j)| squared(points[i], points[j]))
                    .fold(f64::INFINITY, f64::min);
                (least / (2.0 / (3.0_f64.sqrt() * points.len() as f64))).sqrt()
            };
            let mut random = Pcg32::new(1);
            let blue = least(&best_candidates(COUNT, &mut random)[..count]);
            let white: Vec<[f64; 2]> = (0..count)
                .map(|_| [random.uniform(), random.uniform()])
                .collect();
            println!("{count}: {blue:.3}, random {:.3}", least(&white));
            assert!(blue > 0.45, "{count}: {blue}");
            assert!(least(&white) < 0.5 * blue);
        }
    }

    /// The mean power of low frequencies is 1 where points are independent.
    #[test]
    fn low_frequencies_are_missing() {
        let power = |points: &[[f64; 2]]| {
            let mut powers = Vec::new();
            for (x, y) in (-8..=8).flat_map(|y| (-8..=8).map(move |x| (x, y))) {
                if x * x + y * y == 0 || x * x + y * y > 64 {
                    continue;
                }
                let waves = points.iter().map(|p| {
                    let turn = f64::from(x) * p[0] + f64::from(y) * p[1];
                    (std::f64::consts::TAU * turn).sin_cos()
                });
                let (s, c) = waves.fold((0.0, 0.0), |sum, wave| (sum.0 + wave.0, sum.1 + wave.1));
                powers.push((s * s + c * c) / points.len() as f64);
            }
            powers.iter().sum::<f64>() / powers.len() as f64
        };
        let mut random = Pcg32::new(1);
        let blue = power(&best_candidates(COUNT, &mut random));
        let white: Vec<[f64; 2]> = (0..COUNT)
            .map(|_| [random.uniform(), random.uniform()])
            .collect();
        println!("{blue:.3}, random {:.3}", power(&white));
        assert!((power(&white) - 1.0).abs() < 0.25, "{}", power(&white));
        assert!(blue < 0.25, "{blue}");
    }
}

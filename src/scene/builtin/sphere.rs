//! A closed longitude-latitude grid on the unit sphere.

use super::super::builder::SceneBuilder;
use super::numeric::sin_cos_turns;
use glam::{DVec3, Vec3};

/// `bands` of latitude by `sectors` of longitude; the polar bands are fans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SphereGrid {
    pub bands: usize,
    pub sectors: usize,
}

impl SphereGrid {
    /// The largest nearly square grid of at most `triangles` triangles, at least 8 (octahedron).
    pub(super) fn with_at_most(triangles: usize) -> Self {
        let half = triangles.max(8) / 2;
        // Twice as many sectors as bands give square cells: half = sectors * (bands - 1).
        let square = ((half as f64 / 2.0).sqrt() as usize).max(1);
        let candidates = square.div_ceil(2)..=(square + square / 2);
        let best = candidates
            .filter(|inner| half / inner >= 3)
            .max_by_key(|inner| (half / inner * inner, usize::MAX - inner.abs_diff(square)))
            .unwrap_or(1);
        Self {
            bands: best + 1,
            sectors: half / best,
        }
    }

    pub(super) fn triangles(&self) -> usize {
        2 * self.sectors * (self.bands - 1)
    }

    /// Adds the sphere with each unit vector mapped by `place`, counter-clockwise from outside.
    pub(super) fn push(
        &self,
        builder: &mut SceneBuilder,
        material: u32,
        place: impl Fn(DVec3) -> Vec3,
    ) {
        let turns = |k: usize, n: usize| sin_cos_turns(k as f64 / n as f64);
        let around: Vec<_> = (0..self.sectors).map(|k| turns(k, self.sectors)).collect();
        let ring = |band: usize| -> Vec<Vec3> {
            let (radius, height) = turns(band, 2 * self.bands);
            let point = |(sin, cos): &(f64, f64)| DVec3::new(radius * cos, height, -radius * sin);
            around.iter().map(|a| place(point(a))).collect()
        };
        let poles = [DVec3::Y, DVec3::NEG_Y].map(&place);
        let mut upper = ring(1);
        let first = upper.clone();
        let next = |k: usize| (k + 1) % self.sectors;
        for k in 0..self.sectors {
            builder.push([poles[0], first[k], first[next(k)]], material);
        }
        for band in 2..self.bands {
            let lower = ring(band);
            for k in 0..self.sectors {
                let quad = [upper[k], lower[k], lower[next(k)], upper[next(k)]];
                builder.push_quad(quad, material);
            }
            upper = lower;
        }
        for k in 0..self.sectors {
            builder.push([poles[1], upper[next(k)], upper[k]], material);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_comes_close_to_the_wanted_count_and_never_exceeds_it() {
        for wanted in (8..3000).chain([100_000, 1_000_000, 9_999_991, 50_000_000]) {
            let grid = SphereGrid::with_at_most(wanted);
            let got = grid.triangles();
            assert!(grid.bands >= 2 && grid.sectors >= 3);
            assert!(got <= wanted, "{wanted} gave {got}");
            let slack = 16.0_f64.max(0.002 * wanted as f64);
            assert!((wanted - got) as f64 <= slack, "{wanted} gave {got}");
        }
        assert_eq!(SphereGrid::with_at_most(8).triangles(), 8);
        assert_eq!(SphereGrid::with_at_most(100_000).triangles(), 100_000);
    }
}

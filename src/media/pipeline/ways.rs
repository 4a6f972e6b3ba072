//! Curved ways in f64, by the ray equation (Pfeuti 2009, eq. 2.7): judges of `kernels/media/curved/`, written from the definitions in
//! `docs/media.md` and the thesis.

use super::Mirror;
use super::bending::NUDGE;
use crate::{Medium, Volume};
use glam::{DVec3, UVec3};

/// A direction along an axis by less than this part of a step does not end it.
const STRAIGHT: f64 = 0.02;
/// More steps than these catch light.
const MOST_STEPS: usize = 1 << 20;
/// Halvings of a chord until a mirror is found.
const HALVINGS: u32 = 8;

/// How a way is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Steps {
    /// To the borders of regions by drift, kick, drift: the pipeline's own definition.
    Regions,
    /// Short ones of this many voxels by Runge and Kutta's method, without a structure: next to the exact way.
    Short(f64),
}

/// What bends light, with the grid that it is in.
pub(crate) struct Ways<'a> {
    medium: &'a Medium,
    /// n of each voxel, and its gradient by central differences.
    n: Vec<f64>,
    gradient: Vec<DVec3>,
    steps: Steps,
    mirror: Option<Mirror>,
}

/// A straight piece of a way, in voxels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chord {
    /// Where it begins.
    pub(crate) from: DVec3,
    /// Where it ends, in the grid.
    pub(crate) to: DVec3,
    /// Of length 1.
    pub(crate) direction: DVec3,
    /// v where it begins.
    pub(crate) v: DVec3,
}

impl<'a> Ways<'a> {
    /// Of a volume, if its index is not the same everywhere.
    pub(crate) fn of(volume: &Volume, medium: &'a Medium, steps: Steps) -> Option<Self> {
        let is_straight = volume.refraction.iter().all(|n| *n == volume.refraction[0]);
        (!is_straight).then(|| Self::through(volume, medium, steps))
    }

    /// Of any volume.
    pub(crate) fn through(volume: &Volume, medium: &'a Medium, steps: Steps) -> Self {
        let n: Vec<f64> = volume.refraction.iter().map(|n| f64::from(*n)).collect();
        let size = medium.resolution;
        let gradient = |place: usize| {
            let voxel = UVec3::from(crate::volume::voxel_at(volume.resolution, place));
            let along = [UVec3::X, UVec3::Y, UVec3::Z].map(|axis| {
                let on = (voxel + axis).min(size - 1);
                let back = voxel.saturating_sub(axis);
                let width = f64::from((on - back).element_sum().max(1));
                let value = |v: UVec3| n[medium.voxel_index(v) as usize];
                (value(on) - value(back)) / width
            });
            DVec3::from(along)
        };
        let gradient = (0..n.len()).map(gradient).collect();
        Self {
            medium,
            n,
            gradient,
            steps,
            mirror: None,
        }
    }

    /// The same with a mirror.
    pub(crate) fn with(self, mirror: Option<Mirror>) -> Self {
        Self { mirror, ..self }
    }

    /// What a mirror reflects into a ray between two places on its way, where it comes with v from a place of index `outside`, and what
    /// part of light goes on; `None` where it is not crossed.
    pub(crate) fn mirrored(
        &self,
        ends: [DVec3; 2],
        v: DVec3,
        outside: f64,
    ) -> Option<(DVec3, f64)> {
        let mirror = self.mirror?;
        let index = f64::from(mirror.index);
        let [mut near, mut far] = ends;
        if self.n_at(near) >= index || self.n_at(far) < index {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            let end = if self.n_at(middle) < index {
                &mut near
            } else {
                &mut far
            };
            *end = middle;
        }
        let normal = -self.gradient_at(far).normalize();
        let along = v.reject_from_normalized(normal) / outside;
        let onward = along + normal * (1.0 - along.length_squared()).max(0.0).sqrt();
        let part = f64::from(mirror.part);
        let light = mirror.zenith.as_dvec3() * (part * onward.y.max(0.0));
        Some((light, 1.0 - part))
    }

    /// Weights of the eight voxels around a position.
    fn around(&self, position: DVec3) -> [(usize, f64); 8] {
        let most = self.medium.resolution - 1;
        let local = (position - 0.5).max(DVec3::ZERO).min(most.as_dvec3());
        let low = local.as_uvec3();
        let w = local - low.as_dvec3();
        [0, 1, 2, 3, 4, 5, 6, 7].map(|k: u32| {
            let offset = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let weight = DVec3::select(offset.cmpeq(UVec3::ONE), w, 1.0 - w).element_product();
            (
                self.medium.voxel_index((low + offset).min(most)) as usize,
                weight,
            )
        })
    }

    /// n at a position in voxels.
    pub(crate) fn n_at(&self, position: DVec3) -> f64 {
        self.around(position)
            .iter()
            .map(|(at, w)| self.n[*at] * w)
            .sum()
    }

    fn gradient_at(&self, position: DVec3) -> DVec3 {
        self.around(position)
            .iter()
            .map(|(at, w)| self.gradient[*at] * *w)
            .sum()
    }

    /// The way of light from a place in the grid along a unit direction, until it leaves the grid.
    pub(crate) fn way(&self, origin: DVec3, direction: DVec3) -> Vec<Chord> {
        let size = self.medium.resolution.as_dvec3();
        let holds = |x: DVec3| (x.cmpge(DVec3::ZERO) & x.cmple(size)).all();
        let mut x = origin.max(DVec3::ZERO).min(size);
        let mut v = direction * self.n_at(x);
        let mut chords = Vec::new();
        while holds(x) && chords.len() < MOST_STEPS {
            let (next, kicked) = match self.steps {
                Steps::Regions => self.to_border(x, v),
                Steps::Short(h) => self.short_step(x, v, h),
            };
            let direction = (next - x).normalize();
            // Where it leaves the grid.
            let planes = DVec3::select(direction.cmpgt(DVec3::ZERO), size, DVec3::ZERO);
            let leaves = ((planes - x) / direction).to_array();
            let leaves = leaves.into_iter().filter(|t| t.is_finite());
            let length = leaves.fold((next - x).length(), f64::min).max(0.0);
            chords.push(Chord {
                from: x,
                to: x + direction * length,
                direction,
                v,
            });
            (x, v) = (next, kicked);
        }
        chords
    }

    /// To the border of the structure's region: straight where it has one n, else half the step, the change of direction, and the
    /// other half.
    fn to_border(&self, x: DVec3, v: DVec3) -> (DVec3, DVec3) {
        let most = (self.medium.resolution - 1).as_dvec3();
        let region = self
            .medium
            .region_of(x.max(DVec3::ZERO).min(most).as_uvec3(), &mut 0);
        let mut h = f64::INFINITY;
        for axis in 0..3 {
            let along = v[axis] / v.length();
            if along.abs() >= STRAIGHT {
                let plane = if along > 0.0 {
                    region.high[axis]
                } else {
                    region.low[axis]
                };
                h = h.min((f64::from(plane) - x[axis]).abs() / along.abs());
            }
        }
        h += f64::from(NUDGE);
        if region.n.x == region.n.y {
            return (x + v.normalize() * h, v);
        }
        let middle = x + v.normalize() * (h / 2.0);
        let kicked = v + self.gradient_at(middle) * h;
        (middle + kicked.normalize() * (h / 2.0), kicked)
    }

    /// dx/ds = v / |v|, dv/ds = ∇n.
    fn short_step(&self, x: DVec3, v: DVec3, h: f64) -> (DVec3, DVec3) {
        let slope = |x: DVec3, v: DVec3| (v.normalize(), self.gradient_at(x));
        let a = slope(x, v);
        let b = slope(x + a.0 * (h / 2.0), v + a.1 * (h / 2.0));
        let c = slope(x + b.0 * (h / 2.0), v + b.1 * (h / 2.0));
        let d = slope(x + c.0 * h, v + c.1 * h);
        (
            x + (a.0 + 2.0 * (b.0 + c.0) + d.0) * (h / 6.0),
            v + (a.1 + 2.0 * (b.1 + c.1) + d.1) * (h / 6.0),
        )
    }
}

//! Steps along a curved path: the ray equation d/ds (n dx/ds) = ∇n with v = n dx/ds, by one of six schemes, after a fixed length
//! or to the border of a structure's region. Kernel: `kernels/media/bend.wesl`.

use crate::Medium;
use crate::medium::Region;
use crate::optics::Optical;
use glam::Vec3;
use raystone_core::parameters;
use raystone_gpu::UniformValues;

const EULER: u32 = 0;
const PRINTED: u32 = 1;
const NORMALISED: u32 = 2;
const SEMI_IMPLICIT: u32 = 3;
const DRIFT_KICK_DRIFT: u32 = 4;
const RUNGE_KUTTA: u32 = 5;

/// An axis along which a path moves by a smaller share of its step does not end it: rounding could hold it at a plane.
const STRAIGHT: f32 = 0.02;
const SIXTH: f32 = 0.166_666_67;

parameters! {
    /// A scheme for the ray equation.
    pub enum Scheme {
        /// explicit Euler, the position by v / n (Pfeuti 2009, eqs. 2.10 and 2.11)
        Euler = "euler",
        /// the thesis's listing A.4: the position by v / |v|, the direction by n ∇n; does not converge
        Printed = "printed",
        /// explicit Euler, the position by v / |v|
        Normalised = "normalised",
        /// the direction first, then the position with it
        SemiImplicit = "semi-implicit",
        /// half a step of the position, the direction, the other half: second order
        DriftKickDrift = "drift-kick-drift",
        /// Runge and Kutta's method of fourth order
        RungeKutta = "rk4",
    }

    /// Where steps end.
    pub enum Rule {
        /// after a fixed length
        Fixed = "fixed",
        /// at the border of the level map's cube, as in the thesis
        Region = "region",
    }
}

impl Scheme {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Euler,
        Self::Printed,
        Self::Normalised,
        Self::SemiImplicit,
        Self::DriftKickDrift,
        Self::RungeKutta,
    ];

    const fn word(self) -> u32 {
        match self {
            Self::Euler => EULER,
            Self::Printed => PRINTED,
            Self::Normalised => NORMALISED,
            Self::SemiImplicit => SEMI_IMPLICIT,
            Self::DriftKickDrift => DRIFT_KICK_DRIFT,
            Self::RungeKutta => RUNGE_KUTTA,
        }
    }
}

/// How paths are marched.
#[derive(Debug, Clone, Copy)]
pub struct March {
    /// The scheme.
    pub scheme: Scheme,
    /// The step in voxels; with regions the least one, 0 for none.
    pub step: f32,
    /// How far beyond the border of a region a step ends, in voxels.
    pub nudge: f32,
    /// A path that is longer is ended, and counted.
    pub most_steps: u32,
}

impl March {
    /// What kernels read of it.
    pub(crate) fn values(&self) -> UniformValues {
        UniformValues::new()
            .u32("scheme", self.scheme.word())
            .u32("most_steps", self.most_steps)
            .f32("step", self.step)
            .f32("nudge", self.nudge)
    }
}

/// Position, and direction times n.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// Position in voxels.
    pub x: Vec3,
    /// n dx/ds.
    pub v: Vec3,
}

impl Path {
    /// A path that begins at `x` along a unit direction.
    pub fn new(optical: &Optical, x: Vec3, direction: Vec3) -> Self {
        let v = direction * optical.optics_at(x).n;
        Self { x, v }
    }
}

pub(crate) fn norm(v: Vec3) -> f32 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// One step of length `h`.
pub(crate) fn advance(optical: &Optical, scheme: Scheme, path: Path, h: f32) -> Path {
    let Path { x, v } = path;
    let here = || optical.optics_at(x);
    match scheme {
        Scheme::RungeKutta => runge_kutta(optical, path, h),
        Scheme::DriftKickDrift => {
            let middle = x + v * (0.5 * h / norm(v));
            let v = v + optical.optics_at(middle).gradient * h;
            let x = middle + v * (0.5 * h / norm(v));
            Path { x, v }
        }
        Scheme::Euler => Path {
            x: x + v * (h / here().n),
            v: v + here().gradient * h,
        },
        Scheme::Printed => Path {
            x: x + v * (h / norm(v)),
            v: v + here().gradient * (h * here().n),
        },
        Scheme::SemiImplicit => {
            let v = v + here().gradient * h;
            let x = x + v * (h / norm(v));
            Path { x, v }
        }
        Scheme::Normalised => Path {
            x: x + v * (h / norm(v)),
            v: v + here().gradient * h,
        },
    }
}

/// dx/ds = v / n, dv/ds = ∇n.
fn slope(optical: &Optical, x: Vec3, v: Vec3) -> Path {
    let here = optical.optics_at(x);
    Path {
        x: v / here.n,
        v: here.gradient,
    }
}

fn runge_kutta(optical: &Optical, path: Path, h: f32) -> Path {
    let a = slope(optical, path.x, path.v);
    let b = slope(optical, path.x + a.x * (0.5 * h), path.v + a.v * (0.5 * h));
    let c = slope(optical, path.x + b.x * (0.5 * h), path.v + b.v * (0.5 * h));
    let d = slope(optical, path.x + c.x * h, path.v + c.v * h);
    let x = path.x + (a.x + (b.x + c.x) * 2.0 + d.x) * (h * SIXTH);
    let v = path.v + (a.v + (b.v + c.v) * 2.0 + d.v) * (h * SIXTH);
    Path { x, v }
}

/// The length of the next step: the same always, or to the border of the region that a structure says, and a little
/// beyond.
pub(crate) fn step_length(march: &March, regions: Option<&Medium>, path: &Path) -> f32 {
    let Some(medium) = regions else {
        return march.step;
    };
    step_in(march, &region_at(medium, path), path)
}

fn region_at(medium: &Medium, path: &Path) -> Region {
    let most = (medium.resolution - 1).as_vec3();
    let voxel = path.x.max(Vec3::ZERO).min(most).as_uvec3();
    medium.region_of(voxel, &mut 0)
}

fn step_in(march: &March, region: &Region, path: &Path) -> f32 {
    let forward = path.v.cmpgt(Vec3::ZERO);
    let planes = Vec3::select(forward, region.high.as_vec3(), region.low.as_vec3());
    let (along, speed) = (path.v.abs(), norm(path.v));
    let next = (planes - path.x).abs() / along;
    let next = Vec3::select(
        along.cmplt(Vec3::splat(STRAIGHT * speed)),
        Vec3::splat(1e30),
        next,
    );
    (next.min_element() * speed + march.nudge).max(march.step)
}

//! Light along curved paths: the ray equation d/ds (n dx/ds) = ∇n with v = n dx/ds, step by step.
//! Kernels: `kernels/media/bend.wesl`, `kernels/media/march.wesl`.

use crate::Medium;
use crate::medium::Region;
use crate::optics::Optical;
use glam::{Vec2, Vec3};
use raystone_core::parameters;
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};

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

/// Where a path ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ended {
    /// Beyond the border, or where its steps were used up.
    pub path: Path,
    /// The position before the last step.
    pub before: Vec3,
    /// Steps taken.
    pub steps: u32,
    /// The greatest relative difference of |v| and n on the way.
    pub drift: f32,
}

fn norm(v: Vec3) -> f32 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

/// One step of length `h`.
fn advance(optical: &Optical, scheme: Scheme, path: Path, h: f32) -> Path {
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
fn step_length(march: &March, regions: Option<&Medium>, path: &Path) -> f32 {
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

/// Marches a path until it leaves what bends it.
pub fn march_path(
    march: &March,
    optical: &Optical,
    regions: Option<&Medium>,
    begin: Path,
) -> Ended {
    let mut ended = Ended {
        path: begin,
        before: begin.x,
        steps: 0,
        drift: 0.0,
    };
    while optical.holds(ended.path.x) && ended.steps < march.most_steps {
        ended.before = ended.path.x;
        let h = step_length(march, regions, &ended.path);
        ended.path = advance(optical, march.scheme, ended.path, h);
        let Path { x, v } = ended.path;
        if optical.holds(x) {
            let off = (norm(v) / optical.optics_at(x).n - 1.0).abs();
            ended.drift = ended.drift.max(off);
        }
        ended.steps += 1;
    }
    ended
}

/// Paths on the device.
pub struct Marcher {
    recording: Recording,
    player: Player,
}

impl Marcher {
    /// Uploads what bends light, a structure if steps end at its regions, and where paths begin.
    ///
    /// # Errors
    /// An array exceeds what the adapter binds, or the kernel does not compile.
    pub fn new(
        gpu: &Gpu,
        march: &March,
        optical: &Optical,
        regions: Option<&Medium>,
        begins: &[Path],
    ) -> Result<Self, GpuError> {
        let mut composition = optical.compose(Composition::new("media/march"));
        let mut bindings = Bindings::new();
        if let Some(medium) = regions {
            composition = composition
                .with("structure", medium.structure.module())
                .feature("regions", true);
            bindings = crate::upload::bindings(medium, gpu)?;
        }
        optical.bind(gpu, &mut bindings, 1.0)?;
        let count = begins.len() as u32;
        let words: Vec<[f32; 8]> = begins
            .iter()
            .map(|Path { x, v }| [x.x, x.y, x.z, 0.0, v.x, v.y, v.z, 0.0])
            .collect();
        let [ends, status] = [("ends", u64::from(count) * 48), ("status", 64)]
            .map(|(name, bytes)| Storage::scratch(name, bytes));
        bindings
            .uniform("march", march.values())
            .uniform("paths", UniformValues::new().u32("count", count))
            .buffer("begins", &gpu.storage("begins", &words)?)
            .buffer("ends", &ends)
            .buffer("status", &status);
        let mut recording = Recording::new();
        let pipeline = gpu.pipeline(&composition, true)?;
        recording
            .clear(&status)
            .run("march", &pipeline, &bindings, groups_for(count))
            .download("ends", &ends)
            .download("status", &status);
        Ok(Self {
            recording,
            player: Player::new(gpu),
        })
    }

    /// Marches all paths.
    ///
    /// # Errors
    /// The driver ended loops, or the device is lost.
    pub fn march(&self) -> Result<(Vec<Ended>, Elapsed), GpuError> {
        let played = self.player.play(&self.recording)?;
        let status = played.download::<u32>("status")?;
        self.player.gpu().check_error_word(status[0])?;
        let ended = |w: [[f32; 4]; 3]| {
            let [x, v, before] = w.map(|w| Vec3::new(w[0], w[1], w[2]));
            Ended {
                path: Path { x, v },
                before,
                steps: w[0][3] as u32,
                drift: w[1][3],
            }
        };
        let ends = played.download::<[[f32; 4]; 3]>("ends")?;
        Ok((ends.into_iter().map(ended).collect(), played.elapsed()))
    }
}

/// Where rays parallel to x begin on a sphere around the middle of a box of `side` voxels, at these heights above its
/// axis.
pub fn parallel_rays(optical: &Optical, side: u32, radius: f64, heights: &[f64]) -> Vec<Path> {
    let middle = f64::from(side) / 2.0;
    // A little inside, so that rounding leaves none beside the sphere.
    let begin = |height: &f64| {
        let back = (radius * radius - height * height).sqrt() * (1.0 - 1e-6);
        let height = height * (1.0 - 1e-6);
        let x = Vec3::new(
            (middle - back) as f32,
            (middle + height) as f32,
            middle as f32,
        );
        Path::new(optical, x, Vec3::X)
    };
    heights.iter().map(begin).collect()
}

/// How far from the focus of a lens of Luneburg a path meets its sphere, in voxels.
pub fn focus_miss(side: u32, radius: f64, ended: &Ended) -> f64 {
    let middle = f64::from(side) / 2.0;
    let (from, to) = (
        ended.before.as_dvec3() - middle,
        ended.path.x.as_dvec3() - middle,
    );
    let d = to - from;
    let (a, b, c) = (
        d.length_squared(),
        from.dot(d),
        from.length_squared() - radius * radius,
    );
    let t = (-b + (b * b - a * c).max(0.0).sqrt()) / a;
    (from + d * t - glam::DVec3::X * radius).length()
}

/// Degrees by which a ball of index n turns a ray at a height above its axis, by Snell's law at both sides.
pub fn ball_deviation(n: f64, radius: f64, height: f64) -> f64 {
    let outside = (height / radius).asin();
    let inside = (height / radius / n).asin();
    -2.0 * (outside - inside).to_degrees()
}

/// Degrees from the x axis of a direction in the plane of x and y.
pub fn angle_of(direction: Vec3) -> f64 {
    let [x, y] = Vec2::new(direction.x, direction.y).as_dvec2().to_array();
    y.atan2(x).to_degrees()
}

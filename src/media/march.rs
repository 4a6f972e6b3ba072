//! Light along curved paths, step by step until it leaves what bends it. Kernel: `kernels/media/march.wesl`.

use crate::Medium;
use crate::bend::{advance, norm, step_length};
use crate::optics::Optical;
use glam::{Vec2, Vec3};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues,
    groups_for,
};

pub use crate::bend::{March, Path, Rule, Scheme};

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

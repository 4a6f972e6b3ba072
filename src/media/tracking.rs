//! Unbiased light in a medium that fills its box: transmittance by delta, ratio and residual-ratio tracking, and radiance
//! by paths. Kernel: `kernels/media/tracking.wesl`.

use crate::medium::Medium;
use crate::{Bounds, MediaError, Phase, Volume};
use glam::DVec3;
use raystone_gpu::{
    Composition, Elapsed, Gpu, GpuError, Player, Recording, Storage, UniformValues, groups_for,
};

/// What is estimated, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Transmittance, 1 or 0: whether nothing collides on the way (Woodcock et al. 1965).
    Delta,
    /// Transmittance, a product over tentative collisions (Novák, Selle & Jarosz 2014).
    Ratio,
    /// The same, with the least extinction of each region in closed form.
    ResidualRatio,
    /// Radiance of paths of so many scatterings at most, with the point light sampled at each.
    Paths(u32),
}

impl Estimator {
    const fn word(self) -> u32 {
        match self {
            Self::Delta => 0,
            Self::Ratio => 1,
            Self::ResidualRatio => 2,
            Self::Paths(_) => 3,
        }
    }
}

/// A ray into a medium, and the light around it.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    /// Where the ray begins; before the medium, or in it.
    pub origin: DVec3,
    /// Its direction, of length 1.
    pub direction: DVec3,
    /// Position of a point light, inside or outside.
    pub point: DVec3,
    /// Its radiant intensity, 0 for none.
    pub intensity: f64,
    /// Radiance from outside, equal in all directions.
    pub background: f64,
}

/// Estimates of a batch of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Their mean.
    pub mean: f64,
    /// The standard error of the mean.
    pub error: f64,
    /// Paths that were ended for their length.
    pub ended: usize,
}

/// Reasons why light cannot be tracked.
#[derive(Debug, thiserror::Error)]
pub enum TrackingError {
    /// The medium does not fill its box, or scatters by another share of its extinction here and there.
    #[error("tracking needs a medium that {0}")]
    Unfit(&'static str),
    /// The ray misses it.
    #[error("the ray misses the medium")]
    Misses,
    /// Something of the medium is wrong.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// The kernel does not run.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Samples of one ray on the device.
pub struct Tracker {
    recording: Recording,
    player: Player,
}

impl Tracker {
    /// Uploads a medium and compiles the kernel.
    ///
    /// # Errors
    /// The volume is bounded by a sphere or has no albedo of its own, the ray misses it, or an array exceeds what the
    /// adapter binds.
    pub fn new(
        gpu: &Gpu,
        (volume, medium): (&Volume, &Medium),
        light: &Light,
        estimator: Estimator,
        (count, seed): (u32, u32),
    ) -> Result<Self, TrackingError> {
        if volume.bounds != Bounds::Box {
            return Err(TrackingError::Unfit("fills its box"));
        }
        let [enter, _] = volume
            .clip(light.origin, light.direction)
            .ok_or(TrackingError::Misses)?;
        let origin = medium.in_voxels(light.origin + light.direction * enter);
        let vector = |v: DVec3| v.as_vec3().to_array();
        let most_scatterings = match estimator {
            Estimator::Paths(most) => most,
            _ => 0,
        };
        let values = UniformValues::new()
            .vec("scale", &vector(medium.difference_in_voxels(DVec3::ONE)))
            .u32("count", count)
            .vec("origin", &vector(origin))
            .u32("estimator", estimator.word())
            .vec("direction", &vector(light.direction))
            .u32("seed", seed)
            .vec("light", &vector(medium.in_voxels(light.point)))
            .f32("intensity", light.intensity as f32)
            .f32("albedo", albedo(volume)?)
            .f32("background", light.background as f32)
            .u32("phase_kind", volume.phase.kind)
            .f32("anisotropy", volume.phase.anisotropy)
            .u32("most_scatterings", most_scatterings);
        let [estimates, status] = [("estimates", u64::from(count) * 8), ("status", 64)]
            .map(|(name, bytes)| Storage::scratch(name, bytes));
        let mut bindings = crate::upload::bindings(medium, gpu)?;
        bindings
            .uniform("tracking", values)
            .buffer("estimates", &estimates)
            .buffer("status", &status);
        let composition =
            Composition::new("media/tracking").with("structure", medium.structure.module());
        let pipeline = gpu.pipeline(&composition, true)?;
        let mut recording = Recording::new();
        recording
            .clear(&status)
            .run("tracking", &pipeline, &bindings, groups_for(count))
            .download("estimates", &estimates)
            .download("status", &status);
        Ok(Self {
            recording,
            player: Player::new(gpu),
        })
    }

    /// Draws all samples.
    ///
    /// # Errors
    /// The driver ended loops, or the device is lost.
    pub fn estimate(&self) -> Result<(Estimate, Elapsed), GpuError> {
        let played = self.player.play(&self.recording)?;
        let status = played.download::<u32>("status")?;
        self.player.gpu().check_error_word(status[0])?;
        let found = played.download::<[f32; 2]>("estimates")?;
        let count = found.len() as f64;
        let mean = found.iter().map(|e| f64::from(e[0])).sum::<f64>() / count;
        let square = |e: &[f32; 2]| (f64::from(e[0]) - mean).powi(2);
        let variance = found.iter().map(square).sum::<f64>() / (count - 1.0).max(1.0);
        let estimate = Estimate {
            mean,
            error: (variance / count).sqrt(),
            ended: found.iter().filter(|e| e[1] != 0.0).count(),
        };
        Ok((estimate, played.elapsed()))
    }
}

/// σ_s / σ of a volume, if it is the same everywhere.
pub(crate) fn albedo(volume: &Volume) -> Result<f32, TrackingError> {
    let pairs = volume.scattering.iter().zip(&volume.absorption);
    let mut shares = pairs
        .filter(|(s, a)| *s + *a > 0.0)
        .map(|(s, a)| s / (s + a));
    let first = shares.next().unwrap_or(0.0);
    let even = shares.all(|share| (share - first).abs() < 1e-4);
    even.then_some(first).ok_or(TrackingError::Unfit(
        "scatters by the same share of its extinction everywhere",
    ))
}

/// Radiance of light of a point that is scattered once, by a quadrature in f64 of `steps` intervals along the ray:
/// `depth` is ∫ σ ds between two positions, and `sigma` the extinction at one.
pub fn single_scattering(
    volume: &Volume,
    light: &Light,
    steps: u32,
    sigma: impl Fn(DVec3) -> f64,
    depth: impl Fn(DVec3, DVec3) -> f64,
) -> Result<f64, TrackingError> {
    let [enter, leave] =
        (volume.clip(light.origin, light.direction)).ok_or(TrackingError::Misses)?;
    let albedo = f64::from(albedo(volume)?);
    let width = (leave - enter) / f64::from(steps);
    let begin = light.origin + light.direction * enter;
    let phase = |cosine: f64| {
        let phase: Phase = volume.phase;
        f64::from(crate::phase::phase_density(phase, cosine as f32))
    };
    let at = |k: u32| {
        let x = begin + light.direction * ((f64::from(k) + 0.5) * width);
        let way = light.point - x;
        let through = (-depth(begin, x) - depth(x, light.point)).exp();
        let scattered = phase(light.direction.dot(way.normalize())) / way.length_squared();
        sigma(x) * through * scattered * width
    };
    Ok(albedo * light.intensity * (0..steps).map(at).sum::<f64>())
}

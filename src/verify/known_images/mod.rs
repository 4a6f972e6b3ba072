//! Images with radiance known in closed form or by f64 quadrature. Each exposes one kind of fault
//! of an integrator, a material or a light. `raystone verify --images` renders them through the
//! kernels.
//!
//! A view shows one point: every pixel is an independent estimate of the same radiance, and their
//! spread gives the standard error. Samples are doubled until four standard errors are at most
//! [`NOISE`] of the radiance. The result is then compared with the known radiance with an added
//! tolerance of [`SYSTEMATIC`], so that a fault above 0.2 % passes only by chance, and one of 0.3 %
//! never.

pub mod closed;
pub(crate) mod lamps;
pub(crate) mod lights;
mod occlusion;
mod surfaces;
mod textures;

use crate::kinds::KindChecks;
use crate::trial_scenes::Trial;
use glam::{DVec3, Quat, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_gpu::GpuError;
use raystone_render::Renderer;
use raystone_scene::{Light, SceneData, SceneError, decode_normal, encode_normal};

/// Width and height of a view, pixels.
pub const SIZE: [u32; 2] = [8, 8];
/// Limit of four standard errors, relative to the radiance.
pub const NOISE: f64 = 1.5e-3;
/// Relative difference allowed beyond four standard errors: f32, and the width of a pixel.
pub const SYSTEMATIC: f64 = 5e-4;
/// Samples per pixel: minimum, and maximum, beyond which the noise counts as a fault.
const SAMPLES: [u32; 2] = [256, 1 << 15];
/// Fraction of the brightest channel that a channel without light may show.
const DARK: f64 = 1e-5;
const SEED: u32 = 4_242;
const FIELD_OF_VIEW: f32 = 0.01;

/// A view of one point, and its radiance.
pub struct View {
    /// The name.
    pub name: String,
    /// The camera, which sees only this point.
    pub camera: Camera,
    /// Linear RGB.
    pub expected: DVec3,
}

impl View {
    /// A view of the point `at` from `at + from`.
    pub fn new(name: &str, at: Vec3, from: Vec3, expected: DVec3) -> Self {
        let camera = Camera {
            eye: at + from,
            target: at,
            up: from.any_orthonormal_vector(),
            vertical_fov_degrees: FIELD_OF_VIEW,
        };
        Self {
            name: name.to_owned(),
            camera,
            expected,
        }
    }
}

/// A scene with points of known radiance.
pub struct KnownImage {
    /// The name.
    pub name: &'static str,
    /// The scene.
    pub scene: SceneData,
    /// Integrator, and its non-default parameters.
    pub trial: Trial,
    /// The views.
    pub views: Vec<View>,
}

impl KnownImage {
    /// The image turned and moved as a whole, so that none of its planes is exact in f32. Maps turn
    /// about one axis only, so an image with one stays unchanged.
    fn turned(mut self) -> Self {
        const BY: Vec3 = vec3(0.3, -0.2, 0.5);
        let is_map = |light: &Light| matches!(light, Light::Environment { .. });
        if self.scene.lights.iter().any(is_map) {
            return self;
        }
        let turn = Quat::from_axis_angle(vec3(0.36, 0.48, 0.8), 0.7);
        let place = |p: Vec3| turn * p + BY;
        for triangle in &mut self.scene.triangles {
            *triangle = triangle.map(place);
        }
        for word in self.scene.normals.as_flattened_mut() {
            if let Some(normal) = decode_normal(*word) {
                *word = encode_normal(turn * normal.as_vec3());
            }
        }
        let lights = std::mem::take(&mut self.scene.lights).into_iter();
        self.scene.lights = lights.map(|light| light.moved(turn, BY)).collect();
        for View { camera, .. } in &mut self.views {
            (camera.eye, camera.target) = (place(camera.eye), place(camera.target));
            camera.up = turn * camera.up;
        }
        self
    }
}

/// The images of the built-in kinds.
///
/// # Errors
/// A built-in scene is missing.
pub fn known_images() -> Result<Vec<KnownImage>, SceneError> {
    known_images_of(&KindChecks::default())
}

/// The images of these kinds of materials and lights.
///
/// # Errors
/// As [`known_images`].
pub fn known_images_of(kinds: &KindChecks) -> Result<Vec<KnownImage>, SceneError> {
    let mut all = lamps::images()?;
    all.extend(lights::images(&kinds.lights)?);
    all.extend(occlusion::images()?);
    all.extend(surfaces::images(&kinds.materials)?);
    all.extend(textures::images()?);
    Ok(all)
}

/// The measured result of one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Image and view.
    pub name: String,
    /// Known radiance, linear RGB.
    pub expected: DVec3,
    /// Mean over pixels and samples.
    pub measured: DVec3,
    /// Standard error of the mean.
    pub sigma: DVec3,
    /// Samples per pixel.
    pub spp: u32,
    /// Description of the fault, if any.
    pub fault: Option<String>,
}

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

impl Seen {
    /// The result when the kernels cannot run.
    pub fn not_rendered(image: &KnownImage, reason: &str) -> Self {
        Self {
            name: image.name.to_owned(),
            expected: DVec3::NAN,
            measured: DVec3::NAN,
            sigma: DVec3::NAN,
            spp: 0,
            fault: Some(format!("not rendered: {reason}")),
        }
    }

    /// Radiance relative to which differences of a channel are measured.
    fn scale(&self, channel: usize) -> f64 {
        if self.expected[channel] > 0.0 {
            self.expected[channel]
        } else {
            self.expected.max_element().max(1.0) * DARK / SYSTEMATIC
        }
    }

    /// The channel with the largest difference, and that difference relative to the known radiance.
    pub fn worst(&self) -> (usize, f64) {
        let off = |c: usize| (self.measured[c] - self.expected[c]) / self.scale(c);
        let all = [0, 1, 2].map(|c| (c, off(c)));
        let greater = |a: (usize, f64), b: (usize, f64)| if b.1.abs() > a.1.abs() { b } else { a };
        all.into_iter().reduce(greater).unwrap_or_default()
    }

    /// The largest standard error, relative to the known radiance.
    pub fn noise(&self) -> f64 {
        let parts = [0, 1, 2].map(|c| self.sigma[c] / self.scale(c));
        parts.into_iter().fold(0.0, f64::max)
    }

    fn judged(mut self) -> Self {
        self.fault = (0..3).find_map(|c| {
            let scale = self.scale(c);
            let (off, noise) = (
                (self.measured[c] - self.expected[c]).abs() / scale,
                4.0 * self.sigma[c] / scale,
            );
            let (measured, expected, name) = (self.measured[c], self.expected[c], CHANNELS[c]);
            if off.is_nan() || off > SYSTEMATIC + noise.min(NOISE) {
                let percent = 100.0 * off;
                return Some(format!(
                    "{name} is {measured:.6}, not {expected:.6}: {percent:.3} % off"
                ));
            }
            (noise > NOISE).then(|| {
                format!(
                    "{name} is too noisy to say: four standard errors are {:.2} %",
                    100.0 * noise
                )
            })
        });
        self
    }
}

/// Mean over the pixels, and its standard error.
fn moments(pixels: &[[f32; 3]]) -> [DVec3; 2] {
    let count = pixels.len() as f64;
    let all = || pixels.iter().map(|p| Vec3::from(*p).as_dvec3());
    let mean = all().sum::<DVec3>() / count;
    let squares: DVec3 = all().map(|p| (p - mean) * (p - mean)).sum();
    let sigma = squares / (count * (count - 1.0));
    [mean, sigma.map(f64::sqrt)]
}

/// Renders a view with more and more samples until its noise is low enough, and checks it.
///
/// # Errors
/// A kernel raised its error word, or the device is lost or hangs.
pub fn look(renderer: &mut Renderer, image: &KnownImage, view: &View) -> Result<Seen, GpuError> {
    renderer.look(view.camera)?;
    let [mut spp, most] = SAMPLES;
    let mut done = 0;
    loop {
        renderer.add_samples(done, spp - done, SEED)?;
        done = spp;
        let [measured, sigma] = moments(&renderer.image()?.pixels);
        let seen = Seen {
            name: format!("{}, {}", image.name, view.name),
            expected: view.expected,
            measured,
            sigma,
            spp,
            fault: None,
        };
        if 4.0 * seen.noise() <= NOISE || spp >= most {
            return Ok(seen.judged());
        }
        spp *= 2;
    }
}

/// Maximum samples per pixel of a view.
pub fn most_samples() -> u32 {
    SAMPLES[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(measured: f64, sigma: f64) -> Seen {
        Seen {
            name: "test".to_owned(),
            expected: DVec3::new(2.0, 0.0, 1.0),
            measured: DVec3::new(measured, 0.0, 1.0),
            sigma: DVec3::new(sigma, 0.0, 0.0),
            spp: 1,
            fault: None,
        }
        .judged()
    }

    #[test]
    fn no_more_than_noise_and_rounding_pass_and_noise_is_no_excuse() {
        assert_eq!(seen(2.0009, 0.0).fault, None);
        assert!(seen(2.002, 0.0).fault.is_some());
        assert_eq!(seen(2.002, 0.0005).fault, None);
        // 0.3 % is detected however large the noise is.
        assert!(seen(2.006, 0.5).fault.is_some());
        assert!(seen(2.0, 0.5).fault.is_some_and(|f| f.contains("noisy")));
        assert!(seen(f64::NAN, 0.0).fault.is_some());
        let mut dark = seen(2.0, 0.0);
        dark.measured.y = 1e-3;
        assert!(dark.judged().fault.is_some_and(|f| f.contains("green")));
    }

    #[test]
    fn all_images_have_views_whose_answers_are_numbers() {
        let all = known_images().expect("scenes");
        assert!(all.len() >= 20, "{}", all.len());
        for image in &all {
            assert!(!image.views.is_empty(), "{}", image.name);
            for view in &image.views {
                let known = view.expected;
                assert!(
                    known.is_finite() && known.min_element() >= 0.0,
                    "{}",
                    image.name
                );
            }
        }
    }
}

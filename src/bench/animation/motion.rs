//! Motion of a scene: every frame is derived from the scene as loaded.

use glam::{DVec3, Vec3};
use raystone_config::{Animation, Motion};
use raystone_core::random::Pcg32;
use raystone_scene::{LoadOptions, SceneData, builtin_scenes, load};
use std::f64::consts::TAU;

const SEED: u64 = 1;

/// The scene in a frame; the first is bit-identical to the scene itself.
///
/// # Errors
/// Instance motion without instances, or an instance that cannot be placed.
pub fn moved(scene: &SceneData, animation: &Animation, frame: u32) -> Result<SceneData, String> {
    let time = animation.time(frame);
    let radius = f64::from(scene.bounds().radius());
    let amplitude = animation.amplitude * radius;
    let mut moved = scene.clone();
    match animation.motion {
        Motion::Deform => {
            let wave = Wave {
                amplitude,
                length: animation.wavelength * radius,
                time,
            };
            // Deformed triangles are no longer copies.
            moved.assembly = None;
            for triangle in &mut moved.triangles {
                triangle.vertices = triangle.vertices.map(|v| wave.moves(v));
            }
        }
        Motion::Instances => {
            let assembly = moved.assembly.as_ref();
            let count = assembly.map_or(0, |assembly| assembly.instances().len());
            let ways = directions(count).map(|d| (amplitude * time * d).as_vec3());
            moved.shift((0..).zip(ways))?;
        }
    }
    moved.hash = format!("{}, frame {frame} of {animation:?}", scene.hash);
    Ok(moved)
}

/// A wave in space: x moves with y, y with z, z with x. It travels one wavelength from the first to
/// the last frame, which therefore look alike.
struct Wave {
    amplitude: f64,
    length: f64,
    time: f64,
}

impl Wave {
    /// Displacement of one coordinate by another, 0 at time 0: A · (sin τ(x/Λ + t) − sin τ(x/Λ)).
    fn displacement(&self, along: f64) -> f64 {
        let phase = along / self.length;
        self.amplitude * ((TAU * (phase + self.time)).sin() - (TAU * phase).sin())
    }

    fn moves(&self, vertex: Vec3) -> Vec3 {
        let at = vertex.as_dvec3();
        let by = DVec3::new(at.y, at.z, at.x).to_array();
        (at + DVec3::from_array(by.map(|x| self.displacement(x)))).as_vec3()
    }
}

/// The corners of a box of which the radius is half the way from the lowest to the highest corner. A quarter of the way through a
/// wave as long as that and a tenth as high, x moves by R (sin 2π(y/R + ¼) − sin 2π y/R) / 10.
///
/// # Errors
/// Another place of a corner.
pub(crate) fn check() -> Result<(), String> {
    let mut entries = builtin_scenes().into_iter();
    let entry = entries.find(|entry| entry.name == "cornell-box");
    let variant = entry.ok_or("there is no box")?.default_variant();
    let scene = load(&variant, &LoadOptions::default()).map_err(|error| error.to_string())?;
    let corners = |scene: &SceneData| -> Vec<DVec3> {
        let all = scene.triangles.iter().flat_map(|of| of.vertices);
        all.map(|corner| corner.as_dvec3()).collect()
    };
    let still = corners(&scene);
    let low = still.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = still.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let radius = 0.5 * (high - low).length();
    let animation = Animation {
        motion: Motion::Deform,
        frames: 5,
        amplitude: 0.1,
        wavelength: 1.0,
    };
    let [quarter, whole] = [1, 4].map(|frame| moved(&scene, &animation, frame));
    let [quarter, whole] = [corners(&quarter?), corners(&whole?)];
    let expected = |x: f64, y: f64| {
        let angle = TAU * y / radius;
        x + 0.1 * radius * ((angle + TAU / 4.0).sin() - angle.sin())
    };
    for (k, at) in still.iter().enumerate() {
        let by_hand = DVec3::new(
            expected(at.x, at.y),
            expected(at.y, at.z),
            expected(at.z, at.x),
        );
        for (found, expected) in [(quarter[k], by_hand), (whole[k], *at)] {
            if (found - expected).abs().max_element() > 1e-5 * radius {
                return Err(format!(
                    "a known corner at {at} moves to {found} and should move to {expected}: this program moves scenes otherwise; \
                     build it anew, and report what stays wrong"
                ));
            }
        }
    }
    Ok(())
}

/// Directions of so many instances.
fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    let mut random = Pcg32::new(SEED);
    (0..count).map(move |_| {
        let z = 1.0 - 2.0 * random.uniform();
        let (sine, cosine) = (TAU * random.uniform()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * cosine, radius * sine, z)
    })
}

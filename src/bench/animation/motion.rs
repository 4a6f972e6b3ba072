//! Motion of a scene: every frame is derived from the scene as loaded.

use glam::{DVec3, Vec3};
use raystone_config::{Animation, Motion};
use raystone_core::random::Pcg32;
use raystone_scene::SceneData;
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

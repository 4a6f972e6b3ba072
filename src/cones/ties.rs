//! Triangles at one distance on the device: oracles leave their order open, and the first is to be in front.

use crate::cone::Camera;
use crate::device::Tracer;
use crate::scene::Patch;
use crate::trace::{Blend, Given};
use crate::world::directions;
use glam::DVec3;
use raystone_gpu::{Gpu, GpuError};
use raystone_specular::real::V3;

/// What is wrong with a picture of one cone that three copies of a triangle cover: it has the colour of the first, however many
/// layers are kept. `None` if nothing is.
///
/// # Errors
/// The kernel does not compile, or the device is lost.
pub(crate) fn fault_of_ties(gpu: &Gpu) -> Result<Option<String>, GpuError> {
    let colours = [DVec3::X, DVec3::Y, DVec3::Z];
    let patches = colours.map(|colour| Patch {
        corners: [[-50.0, -50.0], [50.0, -50.0], [0.0, 80.0]]
            .map(|[y, z]| V3::of(DVec3::new(10.0, y, z))),
        colours: [V3::of(colour); 3],
        centre: V3::of(10.0 * DVec3::X),
        radius: 100.0,
        tile: 0.0,
    });
    for most in [1, 2, 3] {
        let given = Given {
            camera: camera(),
            background: V3::of(DVec3::ZERO),
            most,
            cut: 0.0,
            blend: Blend::Saturate.word(),
        };
        let (found, _) = Tracer::new(gpu, &given, &patches, &directions())?.trace()?;
        let is_first = (found.iter()).all(|pixel| {
            pixel.counts == [3, most, 3] && pixel.colour.f64().distance(colours[0]) < 1e-5
        });
        if found.is_empty() || !is_first {
            return Ok(Some(format!(
                "of three triangles at one distance, with room for {most} layers, the first is not in front: {found:?}"
            )));
        }
    }
    Ok(None)
}

/// One pixel along x.
fn camera() -> Camera<f32> {
    Camera {
        eye: V3::of(DVec3::ZERO),
        right: V3::of(-DVec3::Y),
        up: V3::of(DVec3::Z),
        forward: V3::of(DVec3::X),
        distance: 100.0,
        stride: 1.0,
        side: 1,
        mirror: 0,
        gloss: 0.0,
        is_mean: false,
    }
}

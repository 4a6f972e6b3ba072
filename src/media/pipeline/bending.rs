//! What bends photons and rays of a view. Kernels: `kernels/media/curved/`.

use super::PipelineError;
use crate::march::{March, Scheme};
use crate::optics::Optical;
use crate::{Medium, Volume};
use glam::Vec3;
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, UniformValues};

/// How far beyond the border of a region a step ends, in voxels.
pub(crate) const NUDGE: f32 = 1e-3;
/// A way of more steps than so many for each voxel along the axes is caught.
const STEPS_PER_VOXEL: u32 = 16;

/// A medium whose index is not the same everywhere: its index and gradient, and how ways are marched.
#[derive(Debug, Clone)]
pub(super) struct Bending {
    optical: Optical,
    march: March,
    voxel: f64,
}

impl Bending {
    /// `None` where nothing bends light, unless it is to be asked for everywhere.
    ///
    /// # Errors
    /// Its voxels are no cubes.
    pub(super) fn of(
        volume: &Volume,
        medium: &Medium,
        always: bool,
    ) -> Result<Option<Self>, PipelineError> {
        if !always && volume.refraction.iter().all(|n| *n == volume.refraction[0]) {
            return Ok(None);
        }
        let size = medium.size_of_voxel();
        if (size.max_element() - size.min_element()) > 1e-9 * size.max_element() {
            return Err(PipelineError::Voxels(size));
        }
        let march = March {
            scheme: Scheme::DriftKickDrift,
            step: 0.0,
            nudge: NUDGE,
            most_steps: STEPS_PER_VOXEL * medium.resolution.element_sum(),
        };
        Ok(Some(Self {
            optical: Optical::of(volume),
            march,
            voxel: size.x,
        }))
    }

    /// Adds what kernels read of it.
    ///
    /// # Errors
    /// The grid exceeds what the adapter binds.
    pub(super) fn bind(&self, gpu: &Gpu, bindings: &mut Bindings) -> Result<(), GpuError> {
        self.optical.bind(gpu, bindings, self.voxel)?;
        bindings.uniform("march", self.march.values());
        Ok(())
    }
}

/// A surface of one index in a medium that bends light, as a mirror of a part of it: once along a ray of the view, where it enters what
/// is denser, that part is light of a sky (Pfeuti 2009, §3.7). Photons do not see it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mirror {
    /// n of the surface.
    pub index: f32,
    /// The part of light that it reflects, 0 to 1.
    pub part: f32,
    /// Radiance of the zenith; that of other directions falls with the cosine from it, and there is none below.
    pub zenith: Vec3,
}

impl Mirror {
    /// A surface that is none.
    pub(super) const NONE: Self = Self {
        index: 1.0,
        part: 0.0,
        zenith: Vec3::ZERO,
    };

    /// Adds what kernels read of it.
    pub(super) fn bind(&self, bindings: &mut Bindings) {
        let values = UniformValues::new()
            .f32("index", self.index)
            .f32("part", self.part)
            .vec("zenith", &self.zenith.to_array());
        bindings.uniform("mirror", values);
    }
}

/// The kernel of that name, along straight or curved ways.
pub(super) fn kernel(name: &str, bending: Option<&Bending>) -> Composition {
    match bending {
        None => Composition::new(&format!("media/{name}")),
        Some(_) => Composition::new(&format!("media/curved/{name}")).feature("regions", true),
    }
}

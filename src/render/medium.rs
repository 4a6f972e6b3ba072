//! The medium of a scene in its tables. Kernel: `kernels/integrator/medium.wesl`.

use glam::{DVec3, UVec3};
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, UniformValues};
use raystone_scene::{SceneData, SceneMedium};
use raystone_volume::{Bounds, Straight};

/// A medium with its structure, and where its arrays begin in `shading_tables`.
pub(super) struct MediumTables {
    straight: Straight,
    placed: UniformValues,
    /// Field, pairs and index, in words.
    first: [u32; 3],
    /// True if coefficients differ by channel.
    pub(super) is_coloured: bool,
}

impl MediumTables {
    /// The medium of a scene, if it has one.
    ///
    /// # Errors
    /// The path tracer cannot follow paths through it: see [`SceneMedium::new`]; or the driver cannot compile that.
    pub(super) fn of(gpu: &Gpu, scene: &SceneData) -> Result<Option<Self>, GpuError> {
        // Such drivers (Mesa 22.3) end the process while they compile loops of flights within those of paths.
        if gpu.loop_limit.is_some() && scene.medium.is_some() {
            return Err(GpuError::Kernel(format!(
                "{}: this driver, which also ends loops early, crashes when it compiles paths through a medium; install a newer one \
                 (Debian 12: `scripts/install-driver --backports`), or leave the medium out",
                scene.name
            )));
        }
        let build = |medium: &SceneMedium| {
            let volume = &medium.volume;
            let straight = Straight::new(volume, &medium.structure)
                .map_err(|e| GpuError::Kernel(format!("{}: {e}", scene.name)))?;
            let voxels: DVec3 = UVec3::from(volume.resolution).as_dvec3();
            let scale = voxels / (volume.high - volume.low);
            let [scattering_tint, absorption_tint] = medium.tints;
            let placed = UniformValues::new()
                .vec("low", &volume.low.as_vec3().to_array())
                .f32("density", straight.density)
                .vec("scale", &scale.as_vec3().to_array())
                .u32("is_ball", u32::from(volume.bounds == Bounds::Sphere))
                .u32("phase_kind", volume.phase.kind)
                .f32("anisotropy", volume.phase.anisotropy)
                .vec("scattering_tint", &scattering_tint.to_array())
                .vec("absorption_tint", &absorption_tint.to_array());
            Ok(Self {
                straight,
                placed,
                first: [0; 3],
                is_coloured: medium.is_coloured(),
            })
        };
        scene.medium.as_ref().map(build).transpose()
    }

    /// Appends field, pairs and index to the words of a scene.
    pub(super) fn append(&mut self, words: &mut Vec<u32>) {
        let medium = &self.straight.medium;
        let arrays = [&medium.field, medium.pairs.as_flattened(), &medium.index];
        for (first, array) in self.first.iter_mut().zip(arrays) {
            *first = words.len() as u32;
            words.extend_from_slice(array);
        }
    }

    /// Binds the uniforms of kernels with the feature `media`.
    pub(super) fn bind(&self, bindings: &mut Bindings) {
        let medium = &self.straight.medium;
        let [field, pair, index] = self.first;
        let values = UniformValues::new()
            .uvec("resolution", &medium.resolution.to_array())
            .u32("levels", medium.levels)
            .vec("spans", &medium.spans.to_array())
            .u32("empty", medium.empty)
            .u32("entries", medium.index.len() as u32)
            .u32("top", medium.top)
            .u32("first_field", field)
            .u32("first_pair", pair)
            .u32("first_index", index);
        bindings
            .uniform("medium", values)
            .uniform("placed", self.placed.clone());
    }

    /// The kernel module of its structure.
    pub(super) fn module(&self) -> &'static str {
        self.straight.medium.structure.module()
    }
}

/// A kernel for scenes with a medium over which this module is the structure.
pub(super) fn activate(
    kernel: Composition,
    module: Option<&str>,
    is_coloured: bool,
) -> Composition {
    match module {
        Some(module) => kernel
            .feature("media", true)
            .feature("media_colours", is_coloured)
            .with("structure", module),
        None => kernel,
    }
}

//! The media of a scene in its tables. Kernels: `kernels/integrator/medium.wesl`, and where they are several
//! `kernels/integrator/several_media.wesl`.

use glam::{DVec3, UVec3};
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, UniformValues};
use raystone_scene::{MOST_MEDIA, SceneData, SceneMedium};
use raystone_volume::{Bounds, Straight};

/// A medium with its structure, and where its arrays begin in `shading_tables`.
struct MediumTables {
    straight: Straight,
    placed: UniformValues,
    /// Field, pairs and index, in words.
    first: [u32; 3],
}

/// The media of a scene.
pub(super) struct MediaTables {
    media: Vec<MediumTables>,
    /// The first of their rows in `shading_tables`, if they are several.
    first_row: u32,
    /// True if coefficients of one differ by channel.
    is_coloured: bool,
}

/// What kernels for scenes with media have to be composed of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MediaFeatures {
    /// Module of the structure over them.
    module: &'static str,
    is_coloured: bool,
    are_several: bool,
}

/// Members of `Medium` and `Placed` in the four words of each row, a number of words each.
const ROWS: [&[(&str, usize)]; 8] = [
    &[("resolution", 3), ("levels", 1)],
    &[("spans", 2), ("empty", 1), ("entries", 1)],
    &[
        ("top", 1),
        ("first_field", 1),
        ("first_pair", 1),
        ("first_index", 1),
    ],
    &[("low", 3), ("density", 1)],
    &[("scale", 3), ("is_ball", 1)],
    &[("phase_kind", 1), ("anisotropy", 1)],
    &[("scattering_tint", 3)],
    &[("absorption_tint", 3)],
];

impl MediumTables {
    fn of(medium: &SceneMedium) -> Result<Self, raystone_volume::MediaError> {
        let volume = &medium.volume;
        let straight = Straight::new(volume, &medium.structure)?;
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
        })
    }

    /// Values of the structure and where its arrays are.
    fn values(&self) -> UniformValues {
        let medium = &self.straight.medium;
        let [field, pair, index] = self.first;
        UniformValues::new()
            .uvec("resolution", &medium.resolution.to_array())
            .u32("levels", medium.levels)
            .vec("spans", &medium.spans.to_array())
            .u32("empty", medium.empty)
            .u32("entries", medium.index.len() as u32)
            .u32("top", medium.top)
            .u32("first_field", field)
            .u32("first_pair", pair)
            .u32("first_index", index)
    }

    /// The same as rows of four words.
    fn rows(&self) -> Vec<u32> {
        let values = self.values();
        let row = |members: &&[(&str, usize)]| {
            let words = members.iter().flat_map(|(name, length)| {
                let found = values.words(name).or_else(|| self.placed.words(name));
                let mut words = found.unwrap_or_default().to_vec();
                words.resize(*length, 0);
                words
            });
            let mut words: Vec<u32> = words.collect();
            words.resize(4, 0);
            words
        };
        ROWS.iter().flat_map(row).collect()
    }
}

impl MediaTables {
    /// The media of a scene, if it has any.
    ///
    /// # Errors
    /// The path tracer cannot follow paths through one: see [`SceneMedium::new`]; they are too many, or have different
    /// structures; or the driver cannot compile that.
    pub(super) fn of(gpu: &Gpu, scene: &SceneData) -> Result<Option<Self>, GpuError> {
        let Some(first) = scene.media.first() else {
            return Ok(None);
        };
        let problem = |text: String| GpuError::Kernel(format!("{}: {text}", scene.name));
        // Such drivers (Mesa 22.3) end the process while they compile loops of flights within those of paths.
        if gpu.loop_limit.is_some() {
            return Err(problem(
                "this driver, which also ends loops early, crashes when it compiles paths through a medium; install a newer one \
                 (Debian 12: `scripts/install-driver --backports`), or leave the medium out"
                    .to_owned(),
            ));
        }
        if scene.media.len() > MOST_MEDIA {
            let found = scene.media.len();
            return Err(problem(format!(
                "it holds {found} media, and paths are followed through {MOST_MEDIA} at most: put some into one grid"
            )));
        }
        let other = scene.media.iter().find(|m| m.structure != first.structure);
        if let Some(other) = other {
            return Err(problem(format!(
                "its media have the structures `{}` and `{}`: kernels have one, give all the same",
                first.structure, other.structure
            )));
        }
        let media = scene.media.iter().map(MediumTables::of);
        let media: Result<Vec<MediumTables>, _> = media.collect();
        Ok(Some(Self {
            media: media.map_err(|e| problem(e.to_string()))?,
            first_row: 0,
            is_coloured: scene.media.iter().any(SceneMedium::is_coloured),
        }))
    }

    /// Appends field, pairs and index of each to the words of a scene, then rows that tell where they are.
    pub(super) fn append(&mut self, words: &mut Vec<u32>) {
        for tables in &mut self.media {
            let medium = &tables.straight.medium;
            let arrays = [&medium.field, medium.pairs.as_flattened(), &medium.index];
            for (first, array) in tables.first.iter_mut().zip(arrays) {
                *first = words.len() as u32;
                words.extend_from_slice(array);
            }
        }
        if self.are_several() {
            words.resize(words.len().next_multiple_of(4), 0);
            self.first_row = words.len() as u32 / 4;
            words.extend(self.media.iter().flat_map(MediumTables::rows));
        }
    }

    /// Binds the uniforms of kernels with the feature `media`.
    pub(super) fn bind(&self, bindings: &mut Bindings) {
        match self.media.as_slice() {
            [only] => bindings
                .uniform("medium", only.values())
                .uniform("placed", only.placed.clone()),
            several => bindings.uniform(
                "media",
                UniformValues::new()
                    .u32("first", self.first_row)
                    .u32("count", several.len() as u32),
            ),
        };
    }

    fn are_several(&self) -> bool {
        self.media.len() > 1
    }

    /// What kernels have to know of them.
    pub(super) fn features(&self) -> Option<MediaFeatures> {
        let first = self.media.first()?;
        Some(MediaFeatures {
            module: first.straight.medium.structure.module(),
            is_coloured: self.is_coloured,
            are_several: self.are_several(),
        })
    }
}

/// A kernel for scenes with such media.
pub(super) fn activate(kernel: Composition, features: Option<MediaFeatures>) -> Composition {
    match features {
        Some(features) => kernel
            .feature("media", true)
            .feature("media_colours", features.is_coloured)
            .feature("several_media", features.are_several)
            .with("structure", features.module),
        None => kernel,
    }
}

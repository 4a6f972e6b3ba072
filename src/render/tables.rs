//! Scene buffers for shading: canonical triangles, materials, lights, textures.

use super::light_tables::LightTables;
use super::medium::{self, MediaFeatures, MediaTables};
use super::mirror_tree::{MirrorPlaces, MirrorTree};
use super::offset::TransformError;
use super::scene_kinds::{SceneKind as _, SceneKinds};
use super::surface_tables::{MATERIAL_WORDS, Places, SurfaceFeatures, append};
use glam::Vec3;
use raystone_accel::{TriangleBuffers, TriangleSoup};
use raystone_gpu::{Bindings, Composition, Gpu, GpuError};
use raystone_scene::{
    Daylight, LIGHT_KINDS, LightKind, LightList, Material, MaterialKind, SceneData,
};

/// Features that a scene requires; absent ones are not in the kernel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SceneFeatures {
    /// Textures, normals and colours of vertices.
    pub surfaces: SurfaceFeatures,
    /// There are lights to sample.
    pub lights: bool,
    /// Kinds of lights.
    pub light_kinds: SceneKinds<LightKind>,
    /// Lights must be chosen: there are several, or an emissive triangle outside of the only one.
    pub many_lights: bool,
    /// A surface emits only from its front.
    pub one_sided_lights: bool,
    /// Rays that leave the scene find light.
    pub background: bool,
    /// The environment is the sky over a scene without a light.
    pub daylight: bool,
    /// Kinds of materials.
    pub materials: SceneKinds<MaterialKind>,
    /// Surface features of each material kind, by number.
    pub kinds: Vec<SurfaceFeatures>,
    /// Instances add to the error of points.
    pub transforms: bool,
    /// A triangle is mirrored, with reversed orientation.
    pub mirrored: bool,
    /// What the scene's media need, if it has any. Kernels cannot carry them: a medium takes numbers from the sampler.
    pub(super) media: Option<MediaFeatures>,
}

/// Groups of features that kernels can be made to include although a scene does not need them.
/// Kinds of materials and lights are added to theirs.
const FEATURE_GROUPS: [(&str, &[&str]); 7] = [
    ("materials", &["several_materials"]),
    (
        "textures",
        &[
            "textures",
            "metallic_roughness_textures",
            "emission_textures",
            "texture_transforms",
            "vertex_colors",
        ],
    ),
    ("normals", &["normals", "normal_maps"]),
    (
        "lights",
        &["lights", "one_sided_lights", "several_light_kinds"],
    ),
    ("choice", &["many_lights"]),
    ("background", &["background", "daylight"]),
    ("transforms", &["transforms", "mirrored_triangles"]),
];

/// All features, including those of built-in kinds, each with its group.
pub(super) fn grouped_features() -> impl Iterator<Item = (&'static str, &'static str)> {
    let others = FEATURE_GROUPS.iter();
    let others = others.flat_map(|(group, names)| names.iter().map(move |name| (*group, *name)));
    let materials = SceneKinds::<MaterialKind>::default();
    let materials: Vec<_> = materials.flags().collect();
    let materials = materials.into_iter().map(|(name, _)| ("materials", name));
    let lights = LIGHT_KINDS.iter().map(|kind| (kind.group, kind.feature));
    others.chain(materials).chain(lights)
}

impl SceneFeatures {
    /// Feature names in kernels, and whether they are enabled.
    pub fn flags(&self) -> Vec<(&'static str, bool)> {
        let mut flags: Vec<_> = self.materials.flags().collect();
        flags.extend([
            ("several_materials", self.materials.are_several()),
            ("lights", self.lights),
            ("many_lights", self.many_lights),
            ("several_light_kinds", self.light_kinds.are_several()),
            ("one_sided_lights", self.one_sided_lights),
            ("background", self.background),
            ("daylight", self.daylight),
            ("transforms", self.transforms),
            ("mirrored_triangles", self.mirrored),
        ]);
        flags.extend(self.light_kinds.flags());
        flags.extend(self.surfaces.flags());
        flags
    }

    /// The kernel with the scene's external kinds.
    pub(super) fn activate(&self, kernel: Composition) -> Composition {
        let kernel = self.light_kinds.activate(self.materials.activate(kernel));
        medium::activate(kernel, self.media)
    }

    /// Features omitted by a kernel for surfaces of only this kind, by its number, or only misses.
    pub(crate) fn unneeded(&self, kind: Option<usize>) -> Vec<&'static str> {
        let own = kind.and_then(|number| self.materials.kind(number).feature());
        let others = self.materials.flags().map(|(name, _)| name);
        let others = others.filter(|name| own != Some(*name));
        let surfaces = kind.map_or(SurfaceFeatures::default(), |kind| self.kinds[kind]);
        let others = others.chain(["several_materials"]);
        others.chain(surfaces.unneeded()).collect()
    }
}

/// A scene on the GPU.
pub struct SceneBuffers {
    /// `triangles`, `shading_tables`.
    pub bindings: Bindings,
    /// The triangles alone, and how rays intersect them.
    pub triangles: TriangleBuffers,
    /// Number of triangles.
    pub triangle_count: u32,
    /// Error of points from instance transforms.
    pub transform_error: TransformError,
    /// The features required of kernels.
    pub features: SceneFeatures,
    /// Radiance of the environment.
    pub environment: [f32; 3],
    /// The sky; kernels without its feature do not read it.
    pub daylight: Daylight,
    /// The sampled lights.
    pub lights: LightTables,
    /// Start of texture coordinates in `shading_tables`, in words.
    pub first_uv: u32,
    /// Start of normals in `shading_tables`, in words.
    pub first_normal: u32,
    /// Start of vertex colours in `shading_tables`, in words.
    pub first_color: u32,
    /// Start of the bits of mirrored triangles in `shading_tables`, in words.
    pub first_mirrored: u32,
    /// Where the tree over mirrors is in `shading_tables`.
    pub mirrors: MirrorPlaces,
    /// Length of the diagonal of the scene's box, scene units.
    pub diagonal: f64,
    /// Corners of that box.
    pub bounds: [[f32; 3]; 2],
}

impl SceneBuffers {
    /// Uploads the shading data.
    ///
    /// # Errors
    /// A buffer exceeds the adapter's limit.
    pub fn upload(gpu: &Gpu, scene: &SceneData, soup: &TriangleSoup) -> Result<Self, GpuError> {
        let surfaces = SurfaceFeatures::of(scene, |_| true);
        let materials = SceneKinds::of(scene.materials.iter().map(|material| material.kind));
        let mut lights = LightTables::of(scene, &LightList::of(scene));
        let mut media = MediaTables::of(gpu, scene)?;
        let tables = Tables::of(scene, &materials, &mut lights, &surfaces, media.as_mut());
        let triangles = TriangleBuffers::upload(gpu, soup)?;
        let mut bindings = triangles.bindings.clone();
        bindings.buffer(
            "shading_tables",
            &gpu.storage("shading_tables", &tables.words)?,
        );
        if let Some(media) = &media {
            media.bind(&mut bindings);
        }
        let transform_error = TransformError::of(soup);
        let has_map = lights.has_map();
        Ok(Self {
            bindings,
            triangles,
            triangle_count: soup.records.len() as u32,
            transform_error,
            features: SceneFeatures {
                surfaces,
                lights: lights.lights > 0,
                light_kinds: lights.kinds.clone(),
                many_lights: lights.are_chosen(scene),
                one_sided_lights: lights.one_sided,
                background: has_map || scene.daylight.is_some() || scene.environment != Vec3::ZERO,
                daylight: scene.daylight.is_some(),
                kinds: (0..materials.count())
                    .map(|number| {
                        let kind = materials.kind(number);
                        SurfaceFeatures::of(scene, |material| material.kind == kind)
                    })
                    .collect(),
                materials,
                transforms: transform_error.scale != 0.0 || transform_error.shift != 0.0,
                mirrored: scene.mirrored.contains(&true),
                media: media.as_ref().and_then(MediaTables::features),
            },
            environment: scene.environment.to_array(),
            daylight: scene.daylight.unwrap_or_default(),
            lights,
            first_uv: tables.places.first_uv,
            first_normal: tables.places.first_normal,
            first_color: tables.places.first_color,
            first_mirrored: tables.places.first_mirrored,
            mirrors: tables.mirrors,
            diagonal: f64::from(2.0 * scene.bounds().radius()),
            bounds: [scene.bounds().min, scene.bounds().max].map(|corner| corner.to_array()),
        })
    }
}

/// Content of `shading_tables`, in this order: three `vec4` per material, parameters of materials,
/// lights, the data of [`surface_tables`](super::surface_tables), the media, and the tree over mirrors.
///
/// A material: base colour and kind number, with the highest bit set if it emits only from its
/// front; emission and index of its parameters, in `vec4`; indices of its texture placements, 0 for
/// none.
struct Tables {
    words: Vec<u32>,
    places: Places,
    mirrors: MirrorPlaces,
}

impl Tables {
    fn of(
        scene: &SceneData,
        kinds: &SceneKinds<MaterialKind>,
        lights: &mut LightTables,
        surfaces: &SurfaceFeatures,
        media: Option<&mut MediaTables>,
    ) -> Self {
        let mut words = vec![0; MATERIAL_WORDS * scene.materials.len()];
        for (index, material) in scene.materials.iter().enumerate() {
            let parameters = words.len() as u32 / 4;
            words.extend(material.parameters.iter().map(|x| x.to_bits()));
            words.resize(words.len().next_multiple_of(4), 0);
            let [r, g, b] = material.base_color.to_array().map(f32::to_bits);
            let [er, eg, eb] = material.emission.to_array().map(f32::to_bits);
            let one_sided = u32::from(emits_in_front(material)) << 31;
            let kind = kinds.number(material.kind) | one_sided;
            let row = [r, g, b, kind, er, eg, eb, parameters];
            let first = MATERIAL_WORDS * index;
            words[first..first + row.len()].copy_from_slice(&row);
        }
        lights.append(&mut words);
        let places = append(scene, surfaces, &mut words);
        if let Some(media) = media {
            media.append(&mut words);
        }
        let mirrors = MirrorTree::of(scene).append(&mut words);
        words.resize(words.len().next_multiple_of(4), 0);
        Self {
            words,
            places,
            mirrors,
        }
    }
}

/// True if the material emits only from its front.
pub(super) fn emits_in_front(material: &Material) -> bool {
    !material.emits_both_sides && material.emission != Vec3::ZERO
}

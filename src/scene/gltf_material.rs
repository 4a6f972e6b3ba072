//! Materials and images of glTF documents.

use super::builder::DEFAULT_ALBEDO;
use super::gltf_files::Files;
use super::material::{Description, Format, emitted};
use super::texture::{Encoded, ImageSource};
use super::{DIELECTRIC, DIFFUSE, MIRROR, Material, MaterialSource, approximation_warning};
use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};
use std::borrow::Cow;

/// Roughness from which glass looks frosted.
const FROSTED: f32 = 0.1;

/// All materials of a document and the images that they need.
pub(super) struct Palette<'a> {
    /// The document's materials in order, then the default one.
    pub materials: Vec<Material>,
    /// How the texture of each material is mapped, if it has one; parallel to `materials`.
    pub mappings: Vec<Option<Mapping>>,
    /// Images that some material uses; materials index into it.
    pub images: Vec<ImageSource<'a>>,
    pub warnings: Vec<String>,
}

/// Where a texture's coordinates come from: set `set` of the mesh, by `KHR_texture_transform` scaled, then
/// rotated, then moved.
pub(super) struct Mapping {
    pub set: u32,
    linear: Mat2,
    offset: Vec2,
}

impl Mapping {
    fn of(info: &gltf::texture::Info<'_>) -> Self {
        let Some(transform) = info.texture_transform() else {
            return Self {
                set: info.tex_coord(),
                linear: Mat2::IDENTITY,
                offset: Vec2::ZERO,
            };
        };
        let (sin, cos) = transform.rotation().sin_cos();
        let rotation = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
        Self {
            set: transform.tex_coord().unwrap_or(info.tex_coord()),
            linear: rotation * Mat2::from_diagonal(transform.scale().into()),
            offset: transform.offset().into(),
        }
    }

    pub fn apply(&self, uv: [f32; 2]) -> Vec2 {
        self.linear * Vec2::from(uv) + self.offset
    }
}

/// Reads all materials; images are found here and decoded later.
pub(super) fn read<'a>(
    files: &Files,
    document: &gltf::Document,
    buffers: &'a [Vec<u8>],
    with_textures: bool,
) -> Palette<'a> {
    let mut palette = Palette {
        materials: Vec::new(),
        mappings: Vec::new(),
        images: Vec::new(),
        warnings: Vec::new(),
    };
    // Place of each of the document's images in `palette.images`.
    let mut image_ids = vec![None; document.images().len()];
    for material in document.materials() {
        let mut found = convert(&material, files, &mut palette.warnings);
        let info = base_color(&material).1.filter(|_| with_textures);
        let info = info.filter(|_| found.kind != &MIRROR);
        palette.mappings.push(info.as_ref().map(Mapping::of));
        if let Some(image) = info.map(|info| info.texture().source()) {
            let id = image_ids[image.index()].get_or_insert_with(|| {
                palette.images.push(image_source(files, &image, buffers));
                palette.images.len() as u32 - 1
            });
            found.base_color_texture = Some(*id);
        }
        palette.materials.push(found);
    }
    palette
        .materials
        .push(Material::diffuse("default", Vec3::splat(DEFAULT_ALBEDO)));
    palette.mappings.push(None);
    palette
        .warnings
        .extend(warnings(document, &palette.materials));
    palette
}

/// Linear base colour and texture: the diffuse ones where `KHR_materials_pbrSpecularGlossiness`
/// gives them.
fn base_color<'a>(material: &gltf::Material<'a>) -> (Vec4, Option<gltf::texture::Info<'a>>) {
    match material.pbr_specular_glossiness() {
        Some(model) => (model.diffuse_factor().into(), model.diffuse_texture()),
        None => {
            let model = material.pbr_metallic_roughness();
            (model.base_color_factor().into(), model.base_color_texture())
        }
    }
}

fn convert(material: &gltf::Material<'_>, files: &Files, warnings: &mut Vec<String>) -> Material {
    let (color, _) = base_color(material);
    let model = material.pbr_metallic_roughness();
    let gloss = material.pbr_specular_glossiness();
    // A texture can make any part of the surface dark: better no light than light everywhere.
    let emission = match material.emissive_texture() {
        Some(_) => Vec3::ZERO,
        None => emitted(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0),
    };
    let index = material.index().unwrap_or(0);
    let source = MaterialSource {
        roughness: Some(match &gloss {
            Some(gloss) => 1.0 - gloss.glossiness_factor(),
            None => model.roughness_factor(),
        }),
        metallic: gloss.is_none().then(|| model.metallic_factor()),
        specular: gloss.map(|gloss| gloss.specular_factor()),
        shininess: None,
        ior: material.ior(),
        transmission: material.transmission().map(|t| t.transmission_factor()),
        filter: None,
        thickness: material.volume().map(|v| v.thickness_factor()),
        opacity: Some(color.w),
        // The names of the standard are the crate's in capitals.
        alpha_mode: Some(format!("{:?}", material.alpha_mode()).to_uppercase()),
        illum: None,
    };
    let description = Description {
        format: Format::Gltf,
        base_color: color.xyz(),
        is_varied: model.metallic_roughness_texture().is_some()
            || material
                .transmission()
                .is_some_and(|t| t.transmission_texture().is_some()),
        source: &source,
    };
    let name = material.name();
    let name = name.map_or_else(|| format!("material {index}"), str::to_owned);
    Material {
        emission: emitted(emission),
        emits_both_sides: material.double_sided(),
        ..Material::described(name, &description, &files.model, warnings)
    }
}

fn image_source<'a>(
    files: &Files,
    image: &gltf::Image<'_>,
    buffers: &'a [Vec<u8>],
) -> ImageSource<'a> {
    let index = image.index();
    let (uri_name, encoded) = match image.source() {
        gltf::image::Source::View { view, .. } => {
            let range = view.offset()..view.offset().saturating_add(view.length());
            let buffer = buffers.get(view.buffer().index());
            let bytes = buffer.and_then(|data| data.get(range));
            let missing = || Encoded::Missing("its bytes lie outside the buffer".to_owned());
            let encoded = bytes.map_or_else(missing, |b| Encoded::Memory(Cow::Borrowed(b)));
            (None, encoded)
        }
        gltf::image::Source::Uri { uri, .. } if uri.starts_with("data:") => {
            let owned = |bytes| Encoded::Memory(Cow::Owned(bytes));
            (None, files.read(uri).map_or_else(Encoded::Missing, owned))
        }
        gltf::image::Source::Uri { uri, .. } => (
            Some(uri),
            files.find(uri).map_or_else(Encoded::Missing, Encoded::File),
        ),
    };
    ImageSource {
        name: image
            .name()
            .or(uri_name)
            .map_or_else(|| format!("image {index}"), str::to_owned),
        encoded,
    }
}

/// One warning per kind of appearance that is drawn otherwise than the file says.
fn warnings(document: &gltf::Document, materials: &[Material]) -> Vec<String> {
    // The material as converted beside the one in the file; the last, default one is not in it.
    let of = |wanted: &dyn Fn(&Material, &gltf::Material<'_>) -> bool| -> Vec<&str> {
        let pairs = materials.iter().zip(document.materials());
        let chosen = pairs.filter(|(converted, original)| wanted(converted, original));
        chosen
            .map(|(converted, _)| converted.name.as_str())
            .collect()
    };
    let transmissive =
        of(&|m, _| m.kind != &DIELECTRIC && m.source.transmission.is_some_and(|t| t > 0.0));
    let frosted =
        of(&|m, _| m.kind == &DIELECTRIC && m.source.roughness.is_some_and(|r| r > FROSTED));
    let cut_out = of(&|m, _| m.source.alpha_mode.as_deref() != Some("OPAQUE"));
    // Where a texture scales the metalness, the factor alone says nothing.
    let metal = of(&|m, original| {
        let model = original.pbr_metallic_roughness();
        m.kind == &DIFFUSE
            && m.source.metallic.is_some_and(|metal| metal > 0.5)
            && model.metallic_roughness_texture().is_none()
    });
    let textured_light = of(&|_, original| {
        original.emissive_texture().is_some() && emitted(original.emissive_factor()) != Vec3::ZERO
    });
    [
        approximation_warning("transmissive", "diffuse", transmissive),
        approximation_warning("frosted glass", "clear glass", frosted),
        approximation_warning("cut out or blended by alpha", "diffuse", cut_out),
        approximation_warning("rough metal", "diffuse", metal),
        approximation_warning(
            "lit by an emissive texture (drawn dark)",
            "diffuse",
            textured_light,
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

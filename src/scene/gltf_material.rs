//! Materials and images of glTF documents.

use super::builder::DEFAULT_ALBEDO;
use super::gltf_files::Files;
use super::gltf_texture::{Images, Placed};
use super::material::{Description, Format, emitted};
use super::texture::ImageSource;
use super::{
    AlphaChannel, AlphaMask, DIELECTRIC, DIFFUSE, LoadOptions, MIRROR, Material, MaterialSource,
    PRINCIPLED, approximation_warning,
};
use glam::{Vec3, Vec4, Vec4Swizzles};
use gltf::material::AlphaMode;

/// Roughness above which glass looks frosted.
const FROSTED: f32 = 0.1;

/// Surface extensions that are not rendered.
const EXTENSIONS: [&str; 9] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_subsurface",
    "KHR_materials_unlit",
];

/// All materials of a document and the images they need.
pub(super) struct Palette<'a> {
    /// The document's materials in order, then the default one.
    pub materials: Vec<Material>,
    /// Texture coordinate set of each material that has textures; parallel to `materials`.
    pub sets: Vec<Option<u32>>,
    /// Images used by some material; materials index into it.
    pub images: Vec<ImageSource<'a>>,
    pub warnings: Vec<String>,
    /// Extensions named in a warning.
    pub named: Vec<&'static str>,
}

/// Reads all materials; images are collected here and decoded later.
pub(super) fn read<'a>(
    files: &'a Files,
    document: &gltf::Document,
    buffers: &'a [Vec<u8>],
    options: &LoadOptions,
) -> Palette<'a> {
    let with_textures = options.textures;
    let mut images = Images::new(files, document, buffers);
    let (mut materials, mut sets, mut told) = (Vec::new(), Vec::new(), Vec::new());
    let mut elsewhere = Vec::new();
    for material in document.materials() {
        let mut found = convert(&material, files, options, &mut told);
        let mut set = None;
        found.mask = mask(&material, &mut images, &mut set);
        if with_textures && textured(&material, &mut found, &mut images, &mut set) {
            elsewhere.push(found.name.clone());
        }
        materials.push(found);
        sets.push(set);
    }
    materials.push(Material::diffuse("default", Vec3::splat(DEFAULT_ALBEDO)));
    sets.push(None);
    told.extend(warnings(document, &materials));
    let elsewhere = elsewhere.iter().map(String::as_str).collect();
    told.extend(approximation_warning(
        "textured by several sets of coordinates",
        "if only the textures of the first were there",
        elsewhere,
    ));
    Palette {
        materials,
        sets,
        named: named(document),
        images: images.used,
        warnings: told,
    }
}

/// Assigns `found` the usable textures of its material. Returns true if one was left out because it
/// uses another coordinate set than those before it.
fn textured(
    material: &gltf::Material<'_>,
    found: &mut Material,
    images: &mut Images<'_>,
    set: &mut Option<u32>,
) -> bool {
    let mut left_out = false;
    let mut take = |placed: Placed| {
        let is_ours = *set.get_or_insert(placed.set) == placed.set;
        left_out |= !is_ours;
        is_ours.then_some(placed.place)
    };
    let color = base_color(material).1.filter(|_| found.kind != &MIRROR);
    found.base_color_texture = color.and_then(|info| take(images.place(&info)));
    if found.kind == &PRINCIPLED {
        let varied = material.pbr_metallic_roughness();
        let varied = varied.metallic_roughness_texture();
        found.metallic_roughness_texture = varied.and_then(|info| take(images.place(&info)));
    }
    if found.kind != &DIELECTRIC {
        let bent = material.normal_texture();
        found.normal_texture = bent.and_then(|info| take(images.place_normals(&info)));
    }
    if found.emission != Vec3::ZERO {
        let shining = material.emissive_texture();
        found.emission_texture = shining.and_then(|info| take(images.place(&info)));
    }
    left_out
}

/// The mask of `alphaMode` `MASK`, from the alpha of the base colour and its texture, whose
/// coordinate set comes first.
fn mask(
    material: &gltf::Material<'_>,
    images: &mut Images<'_>,
    set: &mut Option<u32>,
) -> Option<AlphaMask> {
    if material.alpha_mode() != AlphaMode::Mask {
        return None;
    }
    let (factor, texture) = base_color(material);
    let texture = texture.map(|info| {
        let placed = images.place(&info);
        *set = Some(placed.set);
        placed.place
    });
    Some(AlphaMask {
        texture,
        channel: AlphaChannel::Alpha,
        factor: factor.w,
        cutoff: material.alpha_cutoff().unwrap_or(AlphaMask::CUTOFF),
    })
}

/// Linear base colour and texture; from `KHR_materials_pbrSpecularGlossiness` if present.
fn base_color<'a>(material: &gltf::Material<'a>) -> (Vec4, Option<gltf::texture::Info<'a>>) {
    match material.pbr_specular_glossiness() {
        Some(model) => (model.diffuse_factor().into(), model.diffuse_texture()),
        None => {
            let model = material.pbr_metallic_roughness();
            (model.base_color_factor().into(), model.base_color_texture())
        }
    }
}

fn convert(
    material: &gltf::Material<'_>,
    files: &Files,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Material {
    let (color, _) = base_color(material);
    let model = material.pbr_metallic_roughness();
    let gloss = material.pbr_specular_glossiness();
    let emission =
        emitted(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
    // A texture may darken any part of the surface: better no light than light everywhere.
    let emission = match material.emissive_texture() {
        Some(_) if !options.textures => Vec3::ZERO,
        _ => emission,
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
        // The standard's names are the crate's in capitals.
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
        is_followed: options.textures,
        source: &source,
    };
    let name = material.name();
    let name = name.map_or_else(|| format!("material {index}"), str::to_owned);
    Material {
        emission: emitted(emission),
        emits_both_sides: material.double_sided(),
        ..Material::described(name, &description, options.kinds, &files.model, warnings)
    }
}

/// Surface extensions used by some material and named by [`warnings`].
fn named(document: &gltf::Document) -> Vec<&'static str> {
    let has = |name: &&str| {
        document
            .materials()
            .any(|m| m.extension_value(name).is_some())
    };
    EXTENSIONS.into_iter().filter(has).collect()
}

/// One warning per kind of appearance drawn differently from the file.
fn warnings(document: &gltf::Document, materials: &[Material]) -> Vec<String> {
    // Pairs each converted material with its original; the final default one has none.
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
    let blended = of(&|_, original| original.alpha_mode() == AlphaMode::Blend);
    // A texture may scale the metalness, so the factor alone decides nothing.
    let metal = of(&|m, original| {
        let model = original.pbr_metallic_roughness();
        m.kind == &DIFFUSE
            && m.source.metallic.is_some_and(|metal| metal > 0.5)
            && model.metallic_roughness_texture().is_none()
    });
    let glossy = of(&|_, original| {
        let model = original.pbr_specular_glossiness();
        model.is_some_and(|model| model.specular_glossiness_texture().is_some())
    });
    let tinted = of(&|_, original| {
        let volume = original.volume();
        volume.is_some_and(|volume| volume.attenuation_distance().is_finite())
    });
    let occluded = of(&|_, original| original.occlusion_texture().is_some());
    let extended = EXTENSIONS.iter().filter_map(|name| {
        let names = of(&|_, original| original.extension_value(name).is_some());
        approximation_warning(&format!("extended by {name}"), "if it were not", names)
    });
    [
        approximation_warning("transmissive", "diffuse", transmissive),
        approximation_warning("frosted glass", "clear glass", frosted),
        approximation_warning("blended by alpha", "if it were opaque", blended),
        approximation_warning("rough metal", "diffuse", metal),
        approximation_warning("tinted by depth", "if it were not", tinted),
        approximation_warning(
            "darkened by an occlusion texture",
            "if it were not",
            occluded,
        ),
        approximation_warning(
            "of varying gloss",
            "if the texture of it were white",
            glossy,
        ),
    ]
    .into_iter()
    .flatten()
    .chain(extended)
    .collect()
}

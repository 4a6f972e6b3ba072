//! Materials and images of glTF documents.

use super::builder::DEFAULT_ALBEDO;
use super::gltf_data::Data;
use super::gltf_document::Item;
use super::gltf_files::Files;
use super::gltf_texture::{Images, Placed};
use super::material::{Description, Format, emitted};
use super::texture::ImageSource;
use super::{
    AlphaChannel, AlphaMask, DIELECTRIC, DIFFUSE, LoadOptions, Material, MaterialSource,
    NAMES_IN_WARNING, PRINCIPLED, approximation_warning,
};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// Roughness above which glass looks frosted.
const FROSTED: f32 = 0.1;

const SPECULAR: &str = "KHR_materials_specular";
const UNLIT: &str = "KHR_materials_unlit";

/// Surface extensions that are not rendered, or in part.
const EXTENSIONS: [&str; 9] = [
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    SPECULAR,
    "KHR_materials_subsurface",
    UNLIT,
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
    document: Item<'a>,
    data: &'a Data<'a>,
    options: &LoadOptions,
) -> Palette<'a> {
    let with_textures = options.textures;
    let mut images = Images::new(files, document, data);
    let (mut materials, mut sets, mut told) = (Vec::new(), Vec::new(), Vec::new());
    let mut elsewhere = Vec::new();
    for (index, material) in document.list("materials").enumerate() {
        let mut found = convert(material, index, files, options, &mut told);
        let mut set = None;
        found.mask = mask(material, &mut images, &mut set);
        if with_textures && textured(material, &mut found, &mut images, &mut set) {
            elsewhere.push(found.name.clone());
        }
        materials.push(found);
        sets.push(set);
    }
    materials.push(Material::diffuse("default", Vec3::splat(DEFAULT_ALBEDO)));
    sets.push(None);
    told.extend(warnings(document, &materials));
    told.extend(unseen(&materials));
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
fn textured<'a>(
    material: Item<'a>,
    found: &mut Material,
    images: &mut Images<'a>,
    set: &mut Option<u32>,
) -> bool {
    let mut left_out = false;
    let mut take = |placed: Placed| {
        let is_ours = *set.get_or_insert(placed.set) == placed.set;
        left_out |= !is_ours;
        is_ours.then_some(placed.place)
    };
    let color = base_color(material).1;
    found.base_color_texture = color.and_then(|info| take(images.place(info)));
    // With the gloss of an extension it belongs to a fallback.
    if found.kind == &PRINCIPLED && gloss(material).is_none() {
        let varied = texture(material.get(METALLIC), "metallicRoughnessTexture");
        let varied = varied.and_then(|info| take(images.place(info)));
        found.metallic_roughness_texture = varied;
    }
    if let Some(bent) = texture(material, "normalTexture") {
        let mut placed = images.place(bent);
        placed.place.scale = bent.number("scale").unwrap_or(1.0);
        found.normal_texture = take(placed);
    }
    if found.emission != Vec3::ZERO {
        let shining = texture(material, "emissiveTexture");
        found.emission_texture = shining.and_then(|info| take(images.place(info)));
    }
    left_out
}

/// The mask of `alphaMode` `MASK` or `BLEND`, from the alpha of the base colour and its texture,
/// whose coordinate set comes first.
fn mask<'a>(
    material: Item<'a>,
    images: &mut Images<'a>,
    set: &mut Option<u32>,
) -> Option<AlphaMask> {
    let cutoff = match alpha_mode(material).as_str() {
        "MASK" => Some(material.number("alphaCutoff").unwrap_or(AlphaMask::CUTOFF)),
        "BLEND" => None,
        _ => return None,
    };
    let (factor, texture) = base_color(material);
    let texture = texture.map(|info| {
        let placed = images.place(info);
        *set = Some(placed.set);
        placed.place
    });
    Some(AlphaMask {
        texture,
        channel: AlphaChannel::Alpha,
        factor: factor.w,
        cutoff,
    })
}

/// Names the materials of which no point is ever shown, whatever their textures say.
fn unseen(materials: &[Material]) -> Option<String> {
    let never = |mask: AlphaMask| match mask.cutoff {
        Some(cutoff) => mask.factor < cutoff,
        None => mask.factor <= 0.0,
    };
    let unseen = materials.iter().filter(|m| m.mask.is_some_and(never));
    let names: Vec<&str> = unseen.map(|m| m.name.as_str()).collect();
    let are = match names.len() {
        0 => return None,
        1 => "material is",
        _ => "materials are",
    };
    let (count, names) = (
        names.len(),
        names[..names.len().min(NAMES_IN_WARNING)].join(", "),
    );
    Some(format!(
        "{count} {are} wholly transparent, by the alpha of its colour, and nothing is drawn there: {names}"
    ))
}

const METALLIC: &str = "pbrMetallicRoughness";
const GLOSSY: &str = "KHR_materials_pbrSpecularGlossiness";
const TRANSMISSION: &str = "KHR_materials_transmission";
const VOLUME: &str = "KHR_materials_volume";

/// Unknown modes are opaque, as the default is.
fn alpha_mode(material: Item<'_>) -> String {
    let mode = material.text("alphaMode").unwrap_or("OPAQUE");
    mode.to_ascii_uppercase()
}

/// Linear base colour and texture; from `KHR_materials_pbrSpecularGlossiness` if present.
fn base_color(material: Item<'_>) -> (Vec4, Option<Item<'_>>) {
    let (model, factor, key) = match gloss(material) {
        Some(model) => (model, "diffuseFactor", "diffuseTexture"),
        None => (
            material.get(METALLIC),
            "baseColorFactor",
            "baseColorTexture",
        ),
    };
    let factor = model.vector(factor, [1.0; 4]).into();
    (factor, texture(model, key))
}

/// The specular-glossiness model of a material. Where a texture varies it, which is not rendered, the metallic-roughness model
/// beside it is nearer, if there is one.
fn gloss(material: Item<'_>) -> Option<Item<'_>> {
    let model = material.extension(GLOSSY).given()?;
    let varies = texture(model, "specularGlossinessTexture").is_some();
    (!varies || !material.get(METALLIC).is_given()).then_some(model)
}

/// Factor on the reflectance of the dielectric part at normal incidence (`KHR_materials_specular`): the mean of its channels.
fn reflectance(material: Item<'_>) -> f32 {
    let model = material.extension(SPECULAR);
    let [r, g, b] = model.vector("specularColorFactor", [1.0; 3]);
    model.number("specularFactor").unwrap_or(1.0) * (r + g + b) / 3.0
}

/// What a material says of a texture, if it names one.
fn texture<'a>(part: Item<'a>, key: &str) -> Option<Item<'a>> {
    let info = part.get(key);
    info.get("index").is_given().then_some(info)
}

fn convert(
    material: Item<'_>,
    index: usize,
    files: &Files,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> Material {
    let (color, _) = base_color(material);
    let model = material.get(METALLIC);
    let gloss = gloss(material);
    let transmission = material.extension(TRANSMISSION).given();
    // Its plain colour is nearest to a diffuse surface, which has none of these numbers.
    let is_lit = !material.extension(UNLIT).is_given();
    let strength = material.extension("KHR_materials_emissive_strength");
    let strength = strength.number("emissiveStrength").unwrap_or(1.0);
    let emission = emitted(material.vector("emissiveFactor", [0.0; 3])) * strength;
    // A texture may darken any part of the surface: better no light than light everywhere.
    let emission = match texture(material, "emissiveTexture") {
        Some(_) if !options.textures => Vec3::ZERO,
        _ => emission,
    };
    let factor = |part: Item<'_>, key: &str, default: f32| part.number(key).unwrap_or(default);
    let volume = material.extension(VOLUME).given();
    let source = MaterialSource {
        roughness: is_lit.then(|| match gloss {
            Some(gloss) => 1.0 - factor(gloss, "glossinessFactor", 1.0),
            None => factor(model, "roughnessFactor", 1.0),
        }),
        metallic: (is_lit && gloss.is_none()).then(|| factor(model, "metallicFactor", 1.0)),
        specular: (gloss.filter(|_| is_lit)).map(|gloss| gloss.vector("specularFactor", [1.0; 3])),
        shininess: None,
        ior: ior(material),
        transmission: (transmission.filter(|_| is_lit))
            .map(|t| factor(t, "transmissionFactor", 0.0)),
        filter: None,
        thickness: volume.map(|v| factor(v, "thicknessFactor", 0.0)),
        opacity: Some(color.w),
        alpha_mode: Some(alpha_mode(material)),
        illum: None,
    };
    let has = |part: Item<'_>, key: &str| texture(part, key).is_some();
    let description = Description {
        format: Format::Gltf,
        base_color: color.xyz(),
        is_varied: gloss.is_none() && has(model, "metallicRoughnessTexture")
            || transmission.is_some_and(|t| has(t, "transmissionTexture")),
        is_followed: options.textures,
        source: &source,
    };
    let name = material.text("name");
    let name = name.map_or_else(|| format!("material {index}"), str::to_owned);
    let found = Material::described(name, &description, options.kinds, &files.model, warnings);
    Material {
        emission: emitted(emission),
        emits_both_sides: material.flag("doubleSided") == Some(true),
        ..found.with_reflectance_times(reflectance(material))
    }
}

fn ior(material: Item<'_>) -> Option<f32> {
    let ior = material.extension("KHR_materials_ior").given()?;
    Some(ior.number("ior").unwrap_or(1.5))
}

/// Surface extensions used by some material and named by [`warnings`].
fn named(document: Item<'_>) -> Vec<&'static str> {
    let has = |name: &&str| {
        let mut materials = document.list("materials");
        materials.any(|m| m.extension(name).is_given())
    };
    EXTENSIONS.into_iter().filter(has).collect()
}

/// One warning per kind of appearance drawn differently from the file.
fn warnings(document: Item<'_>, materials: &[Material]) -> Vec<String> {
    // Pairs each converted material with its original; the final default one has none.
    let of = |wanted: &dyn Fn(&Material, Item<'_>) -> bool| -> Vec<&str> {
        let pairs = materials.iter().zip(document.list("materials"));
        let chosen = pairs.filter(|(converted, original)| wanted(converted, *original));
        chosen
            .map(|(converted, _)| converted.name.as_str())
            .collect()
    };
    let transmissive =
        of(&|m, _| m.kind != &DIELECTRIC && m.source.transmission.is_some_and(|t| t > 0.0));
    let partly = of(&|m, _| {
        m.kind == &DIELECTRIC && m.source.transmission.is_some_and(|t| t > 0.0 && t < 1.0)
    });
    let beyond = of(&|m, _| {
        let source = &m.source;
        let factors = [source.metallic, source.roughness, source.transmission];
        (factors.iter().flatten()).any(|factor| !(0.0..=1.0).contains(factor))
    });
    let frosted =
        of(&|m, _| m.kind == &DIELECTRIC && m.source.roughness.is_some_and(|r| r > FROSTED));
    // A texture may scale the metalness, so the factor alone decides nothing.
    let metal = of(&|m, original| {
        let varied = texture(original.get(METALLIC), "metallicRoughnessTexture");
        let is_metal = m.source.metallic.is_some_and(|metal| metal > 0.5);
        m.kind == &DIFFUSE && is_metal && varied.is_none()
    });
    let varies = |model: Item<'_>| texture(model, "specularGlossinessTexture").is_some();
    let glossy = of(&|_, original| gloss(original).is_some_and(varies));
    let fallen_back =
        of(&|_, original| gloss(original).is_none() && varies(original.extension(GLOSSY)));
    let tinted = of(&|_, original| {
        let volume = original.extension(VOLUME);
        volume.number("attenuationDistance").is_some()
    });
    let unknown =
        of(&|_, original| !["OPAQUE", "MASK", "BLEND"].contains(&alpha_mode(original).as_str()));
    let occluded = of(&|_, original| texture(original, "occlusionTexture").is_some());
    let extended = EXTENSIONS.iter().filter_map(|name| {
        let names = of(&|_, original| original.extension(name).is_given());
        let as_if = match *name {
            SPECULAR => {
                "if it scaled the reflectance at normal incidence alone, by the mean of its colour"
            }
            UNLIT => "diffuse",
            _ => "if it were not",
        };
        approximation_warning(&format!("extended by {name}"), as_if, names)
    });
    [
        approximation_warning("transmissive", "if it were not", transmissive),
        approximation_warning("partly transmissive", "wholly transmissive", partly),
        approximation_warning(
            "of a metalness, roughness or transmission beyond 0 to 1",
            "if it were the nearest of these",
            beyond,
        ),
        approximation_warning("frosted glass", "clear glass", frosted),
        approximation_warning("rough metal", "diffuse", metal),
        approximation_warning("of an unknown alpha mode", "opaque", unknown),
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
        approximation_warning(
            "of varying gloss",
            "of the metallic-roughness model beside it",
            fallen_back,
        ),
    ]
    .into_iter()
    .flatten()
    .chain(extended)
    .collect()
}

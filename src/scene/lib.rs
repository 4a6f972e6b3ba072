//! Scenes: OBJ, glTF, PLY and Nori XML loaders, procedural scenes, cameras, materials, emitters.
//!
//! A scene is a flat triangle soup in world space with per-triangle material indices. Structures
//! see only [`Triangle`]s, two-level ones also the [`Assembly`]; shading sees the rest.
#![warn(missing_docs)]

mod builder;
pub mod builtin;
mod camera;
mod colors;
mod content;
mod copies;
mod daylight;
mod disguise;
mod environment;
mod error;
mod framing;
mod gltf;
#[cfg(test)]
mod gltf_cases;
mod gltf_container;
mod gltf_data;
mod gltf_document;
mod gltf_files;
mod gltf_instancing;
mod gltf_lights;
mod gltf_material;
mod gltf_meshopt;
#[cfg(test)]
mod gltf_meshopt_tests;
mod gltf_notes;
mod gltf_pose;
mod gltf_primitive;
mod gltf_roots;
mod gltf_texture;
mod hung_lamps;
mod ies;
mod image_alpha;
mod instances;
pub mod known_figures;
mod known_files;
mod known_lights;
mod known_scenes;
mod light;
mod mask;
mod material;
mod medium;
mod more_media;
mod mtl;
mod mtl_statements;
mod mtl_texture;
mod nori;
mod normals;
mod obj;
mod obj_statements;
#[cfg(test)]
mod odd_files;
mod ply;
mod ply_body;
mod ply_header;
mod polygon;
mod reduce;
mod shifts;
mod tally;
mod text;
mod texture;
mod texture_use;

pub use builder::{DEFAULT_ALBEDO, MAX_COORDINATE};
pub use builtin::builtin_scenes;
pub use camera::{Bounds, check_camera};
pub use colors::{WHITE, decode_color, encode_color};
pub use daylight::Daylight;
pub use environment::EnvironmentMap;
pub use error::SceneError;
pub use framing::Framing;
pub use ies::{IesError, IesProfile, Photometry};
pub use instances::{Assembly, Instance, InstanceError, Transform, row_sum_norm};
pub use light::{LIGHT_KINDS, Light, LightKind, LightList, ListedLight, Parallelogram, Source};
pub use mask::{AlphaChannel, AlphaMask};
pub use material::{
    COOK_TORRANCE, CookTorrance, DEFAULT_IOR, DIELECTRIC, DIFFUSE, Description, Format, Fresnel,
    Lobes, Look, MATERIAL_KINDS, MIRROR, Masking, Material, MaterialKind, MaterialSource, PHONG,
    PRINCIPLED, reflectance_of_ior,
};
pub use medium::{MOST_MEDIA, SceneMedium};
pub use normals::{GEOMETRIC, decode_normal, encode_normal};
pub use raystone_core::load::LoadReport;
pub use shifts::{Shifts, parse_shifts, shifts_text};
pub use texture_use::{TextureUse, Wrap};

use glam::{Vec2, Vec3};
use medium::MediumParameters;
use raystone_core::geometry::{Camera, Triangle};
use raystone_core::params::{
    ParamRange, ParamValue, Parameter, ParameterSchema, Parameters as _, Params, Variant,
};
use std::io::Read as _;
use std::path::Path;

/// An 8-bit texture, row by row from the top. [`TextureUse`] determines its encoding.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// File or embedded name, for messages.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `width * height` texels, RGBA8.
    pub texels: Vec<[u8; 4]>,
}

/// A loaded scene: flat world-space triangles and the shading data.
///
/// `triangles`, `uvs`, `normals`, `colors`, `mirrored` and `material_ids` are parallel; `uvs` is
/// empty if no material is textured.
// Many fields: parallel arrays are what builders and kernels read.
#[derive(Debug, Clone)]
pub struct SceneData {
    /// Name as typed.
    pub name: String,
    /// The triangle soup.
    pub triangles: Vec<Triangle>,
    /// Texture coordinates per corner, `v` pointing down (glTF convention); empty if unused.
    pub uvs: Vec<[Vec2; 3]>,
    /// Corner normals, encoded by [`encode_normal`]; empty if all are face normals.
    pub normals: Vec<[u32; 3]>,
    /// Corner colours ([`encode_color`]), which multiply the base colour; empty if all white.
    pub colors: Vec<[[u32; 2]; 3]>,
    /// True for mirrored triangles, whose corners turn clockwise seen from the front: copies keep
    /// the object's corner order, on which u and v of hits depend. Empty if there are none.
    pub mirrored: Vec<bool>,
    /// Index into `materials` of each triangle.
    pub material_ids: Vec<u32>,
    /// Materials; never empty.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Objects and instances, if the scene consists of instances.
    pub assembly: Option<Assembly>,
    /// The camera of the file or built-in scene; `None` for automatic framing.
    pub camera: Option<Camera>,
    /// Constant radiance of the environment, linear RGB; zero is a black sky.
    pub environment: Vec3,
    /// Lights without triangles.
    pub lights: Vec<Light>,
    /// The sky over a scene that brings no light; its radiance is a multiple of `environment`.
    pub daylight: Option<Daylight>,
    /// The media that light is scattered and absorbed in. Where they overlap, their coefficients add up.
    pub media: Vec<SceneMedium>,
    /// Automatic framing, if the scene has no camera.
    pub framing: Option<Framing>,
    /// BLAKE3 of the scene's content (hex), part of every cell's hash.
    pub hash: String,
    /// Dropped and approximated content.
    pub report: LoadReport,
}

/// Options for loading a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoadOptions {
    /// Decode textures. If false, textured surfaces show their constant colour and texture
    /// coordinates are dropped. Masks are always read, as they affect hits.
    pub textures: bool,
    /// Largest width and height of a texture in texels; larger ones are reduced, with a warning.
    pub max_texture_size: u32,
    /// Size limit in bytes of the scene's tables, which the adapter binds as one buffer. Textures
    /// and maps are reduced until they fit, with a warning.
    pub table_bytes: u64,
    /// Allow a glTF model to name files outside its folder, and an OBJ model absolute paths; an
    /// untrusted model could read any file of this machine.
    pub allow_outside: bool,
    /// Material kinds to match a file's materials against; if several match, the last wins.
    pub kinds: &'static [&'static MaterialKind],
}

/// Storage buffer binding size that every adapter supports, bytes (WebGPU's
/// `maxStorageBufferBindingSize`).
pub const LEAST_BINDING: u64 = 128 << 20;

impl LoadOptions {
    /// The largest texture size and total number of words next to `triangles` triangles.
    fn texture_limits(&self, triangles: usize) -> [u64; 2] {
        let room = texture::texel_room(self.table_bytes, triangles);
        [self.max_texture_size.into(), room]
    }
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            textures: true,
            max_texture_size: 1024,
            table_bytes: LEAST_BINDING,
            allow_outside: false,
            kinds: &MATERIAL_KINDS,
        }
    }
}

/// Loads a built-in scene with default parameters, or a model file.
///
/// # Errors
/// As [`load`].
pub fn named(name: &str) -> Result<SceneData, SceneError> {
    let builtin = builtin_scenes().into_iter().find(|e| e.name == name);
    let file = || Variant {
        name: name.to_owned(),
        params: Params::default(),
        label: name.to_owned(),
    };
    let variant = builtin.map_or_else(file, |entry| entry.default_variant());
    load(&variant, &LoadOptions::default())
}

/// Loads the scene named by `variant`: a built-in one, or the path of an OBJ, glTF, GLB, PLY or
/// Nori XML file (relative to the working directory, extension in any case).
///
/// # Errors
/// [`SceneError`]: unknown name, unreadable or malformed file, no triangles, coordinates too large.
pub fn load(variant: &Variant, options: &LoadOptions) -> Result<SceneData, SceneError> {
    let mut variant = variant.clone();
    let mut common = Params::default();
    let of_all = [
        MOST_TRIANGLES,
        COPIES,
        ENVIRONMENT,
        HUNG_LAMPS,
        SHIFTS,
        MORE_MEDIA,
    ];
    for name in of_all {
        common.0.extend(variant.params.0.remove_entry(name));
    }
    let mut medium = Params::default();
    for parameter in MediumParameters::schema() {
        (medium.0).extend(variant.params.0.remove_entry(parameter.name));
    }
    let idle = MediumParameters::idle(&medium);
    let medium = MediumParameters::from_params(&medium)?;
    let common = common.completed(&common_parameters())?;
    let mut scene = load_alone(&variant, options)?;
    scene.report.warnings.extend(idle);
    let number = |name| match common.0.get(name) {
        Some(ParamValue::Integer(number @ 1..)) => Some(*number as usize),
        _ => None,
    };
    if let Some(most) = number(MOST_TRIANGLES) {
        scene = copies::with_at_most(scene, most)?;
    }
    if let Some(copies) = number(COPIES) {
        scene = copies::on_a_plane(scene, copies)?;
    }
    if let Some(lamps) = number(HUNG_LAMPS) {
        scene = hung_lamps::hang(scene, lamps as u32);
    }
    scene = medium.applied(scene)?;
    let text = |name| match common.0.get(name) {
        Some(ParamValue::Name(text)) if !text.is_empty() => Some(text.as_str()),
        _ => None,
    };
    if let Some(tables) = text(MORE_MEDIA) {
        scene = more_media::added(scene, tables)?;
    }
    if let Some(file) = text(ENVIRONMENT) {
        scene = scene.under(Path::new(file), options.table_bytes)?;
    }
    if let Some(ways) = text(SHIFTS) {
        let name = scene.name.clone();
        let shifted = parse_shifts(ways).and_then(|ways| scene.shifted(&ways));
        scene = shifted.map_err(|problem| SceneError::Shifts { name, problem })?;
    }
    Ok(scene)
}

/// Common parameter: environment map.
const ENVIRONMENT: &str = "environment";

/// Common parameter: ways of instances.
pub const SHIFTS: &str = "shifts";

/// Common parameter: media beside the first.
const MORE_MEDIA: &str = "more_media";

/// Common parameter: number of added lamps.
const HUNG_LAMPS: &str = "hung_lamps";

/// Common parameter: maximum number of triangles.
const MOST_TRIANGLES: &str = "most_triangles";

/// Common parameter: number of copies on a plane.
const COPIES: &str = "copies";

/// Parameters of every scene, built-in or not.
pub(crate) fn common_parameters() -> ParameterSchema {
    let mut common = vec![
        Parameter {
            name: ENVIRONMENT,
            description: "equirectangular map (HDR, EXR, PFM or NPY) that lights the scene from all around; none if empty",
            default: ParamValue::Name(String::new()),
            range: ParamRange::Text,
        },
        Parameter {
            name: MOST_TRIANGLES,
            description: "vertices are merged until the scene has no more triangles; 0 leaves it as it is",
            default: ParamValue::Integer(0),
            range: ParamRange::Integer {
                min: 0,
                max: u32::MAX.into(),
            },
        },
        Parameter {
            name: COPIES,
            description: "copies of the scene that stand on a plane, turned about the vertical; 0 leaves it as it is",
            default: ParamValue::Integer(0),
            range: ParamRange::Integer {
                min: 0,
                max: 65_536,
            },
        },
        Parameter {
            name: HUNG_LAMPS,
            description: "small square lamps that are hung into the scene, at places of their own, and shine down",
            default: ParamValue::Integer(0),
            range: ParamRange::Integer { min: 0, max: 4096 },
        },
        Parameter {
            name: MORE_MEDIA,
            description: "media beside the first, in braces each, with the parameters that the first one has: `{ medium = \"cloud\", scattering = 2 }, { … }`",
            default: ParamValue::Name(String::new()),
            range: ParamRange::Text,
        },
        Parameter {
            name: SHIFTS,
            description: "instances that stand elsewhere, each with its number and its way in scene units: `7 0.5 0 0, 9 0 1 -2`",
            default: ParamValue::Name(String::new()),
            range: ParamRange::Text,
        },
    ];
    common.extend(MediumParameters::schema());
    common
}

/// Loads a variant's scene without its environment map.
fn load_alone(variant: &Variant, options: &LoadOptions) -> Result<SceneData, SceneError> {
    if let Some(scene) = builtin::build(variant) {
        return scene;
    }
    let name = variant.name.as_str();
    let path = Path::new(name);
    disguise::check(path)?;
    match extension(path).as_str() {
        "obj" => obj::load(path, name, options),
        "gltf" | "glb" => gltf::load(path, name, options),
        "ply" => ply::load(path, name),
        "xml" => nori::load(path, name, options),
        _ if path.exists() => Err(SceneError::UnknownFormat {
            path: path.to_owned(),
        }),
        _ => Err(SceneError::Unknown {
            name: name.to_owned(),
            hint: builtin::hint(name),
        }),
    }
}

/// Checks that the files which the parameters of a scene name can be opened: its environment and its medium.
///
/// # Errors
/// The first that cannot.
pub fn check_files(variant: &Variant) -> Result<(), SceneError> {
    let named = [ENVIRONMENT, "medium", "absorber"].map(|name| variant.params.0.get(name));
    for value in named.into_iter().flatten() {
        match value {
            ParamValue::Name(file) if Path::new(file).extension().is_some() => {
                error::open(Path::new(file))?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// Checks a model file without loading it: known format, not empty, and a plausible beginning.
///
/// # Errors
/// [`SceneError`]: unknown format, or a file that cannot be read or cannot be a model.
pub fn check_model(path: &Path) -> Result<(), SceneError> {
    let mut start = Vec::new();
    let read = error::open(path)?
        .0
        .take(MODEL_START)
        .read_to_end(&mut start);
    read.map_err(SceneError::unreadable(path))?;
    let text = raystone_core::text::plain_text_or_latin1(start.clone());
    disguise::check(path)?;
    let padding = |c: char| matches!(c, '\0' | '\u{feff}') || c.is_ascii_whitespace();
    let json = || text.trim_start_matches(padding).starts_with('{');
    let xml = || text.trim_ascii_start().starts_with('<');
    let (begins_well, expected) = match extension(path).as_str() {
        // Exporters pad files with zeros at the end.
        "obj" => (
            !text.trim_end_matches('\0').contains('\0'),
            "it is not text",
        ),
        "gltf" | "glb" => (
            start.starts_with(b"glTF") || json(),
            "it begins neither with `glTF` nor with `{`",
        ),
        "ply" => (text.starts_with("ply"), "it does not begin with `ply`"),
        "xml" => (xml(), "it does not begin with `<`"),
        _ => {
            let path = path.to_owned();
            return Err(SceneError::UnknownFormat { path });
        }
    };
    if begins_well {
        Ok(())
    } else {
        Err(SceneError::malformed(path, "", expected))
    }
}

fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension
        .to_ascii_lowercase()
        .to_string_lossy()
        .into_owned()
}

/// Number of bytes that [`check_model`] inspects.
const MODEL_START: u64 = 512;

/// Number of materials that a warning names.
const NAMES_IN_WARNING: usize = 4;

/// One warning for all materials that are `what` but drawn as `drawn`; `None` if there are none.
fn approximation_warning(what: &str, drawn: &str, names: Vec<&str>) -> Option<String> {
    if names.is_empty() {
        return None;
    }
    let count = names.len();
    let mut shown = names[..count.min(NAMES_IN_WARNING)].join(", ");
    if count > NAMES_IN_WARNING {
        shown += ", …";
    }
    let are = ["materials are", "material is"][usize::from(count == 1)];
    Some(format!(
        "{count} {are} {what}, which is not rendered yet; drawn as {drawn}: {shown}"
    ))
}

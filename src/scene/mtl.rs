//! Material libraries (MTL) of OBJ files.

use super::builder::DEFAULT_ALBEDO;
use super::material::{Description, Format, emitted};
use super::mtl_texture::{Statement, statement};
use super::obj_statements::{unread_warning, without_comment};
use super::text::normalised;
use super::texture::{Encoded, ImageSource};
use super::{
    AlphaChannel, AlphaMask, DIELECTRIC, LoadOptions, MIRROR, Material, MaterialSource, TextureUse,
};
use glam::Vec3;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Display;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Collects the materials of all `mtllib` statements while the OBJ file is read.
pub(super) struct Library {
    folder: PathBuf,
    options: LoadOptions,
    contents: RefCell<Contents>,
    /// Libraries loaded so far; each is read once.
    loaded: RefCell<HashSet<PathBuf>>,
}

#[derive(Default)]
pub(super) struct Contents {
    pub materials: Vec<Material>,
    pub textures: Vec<ImageSource<'static>>,
    pub warnings: Vec<String>,
    /// Statements that are not rendered, with their materials.
    unused: BTreeMap<&'static str, Vec<String>>,
    /// Index in `textures` by path.
    texture_ids: HashMap<PathBuf, u32>,
}

impl Library {
    /// Looks for libraries next to the OBJ file `obj`.
    pub(crate) fn new(obj: &Path, options: &LoadOptions) -> Self {
        Self {
            folder: obj.parent().unwrap_or(Path::new("")).to_owned(),
            options: *options,
            contents: RefCell::default(),
            loaded: RefCell::default(),
        }
    }

    /// Loads the libraries of a statement: a single file whose name may contain blanks, if it
    /// exists, or several. Returns the indices of their materials by name. Broken libraries are
    /// warnings.
    pub(crate) fn load(&self, names: &str) -> Vec<(String, u32)> {
        let cut = without_comment(names).trim();
        let is_there = |name: &&str| self.folder.join(plain(name)).is_file();
        match [names, cut].iter().find(|name| is_there(name)) {
            Some(name) => self.load_one(name),
            None => cut
                .split_whitespace()
                .flat_map(|name| self.load_one(name))
                .collect(),
        }
    }

    fn load_one(&self, name: &str) -> Vec<(String, u32)> {
        let file = plain(name);
        let path = self.folder.join(&file);
        if !self.loaded.borrow_mut().insert(path.clone()) {
            return Vec::new();
        }
        let mut contents = self.contents.borrow_mut();
        let unread = |error: &dyn Display| {
            let path = path.display();
            format!("material library {path}: {error}; its materials are drawn grey")
        };
        let bytes = relative(Path::new(&file), &self.options)
            .and_then(|()| raystone_core::files::read(&path));
        let bytes = match bytes {
            Ok(bytes) => bytes,
            Err(error) => {
                contents.warnings.push(unread(&error));
                return Vec::new();
            }
        };
        let text = readable_lines(&normalised(bytes), &path, &mut contents.warnings);
        let (materials, numbers) = match tobj::load_mtl_buf(&mut Cursor::new(text)) {
            Ok(read) => read,
            Err(error) => {
                contents.warnings.push(unread(&error));
                return Vec::new();
            }
        };
        let before = contents.materials.len();
        for material in &materials {
            contents.add(material, &path, &self.options);
        }
        let numbers = numbers.into_iter();
        numbers
            .map(|(name, k)| (name, (before + k) as u32))
            .collect()
    }

    /// All materials in library order, their textures, and a warning for deviations from the file.
    pub(crate) fn into_contents(self) -> Contents {
        let mut contents = self.contents.into_inner();
        let approximated = contents
            .materials
            .iter()
            .filter(|m| m.kind != &DIELECTRIC && m.source.opacity.is_some_and(|d| d < 1.0));
        let names = approximated.map(|m| m.name.as_str()).collect();
        let text = super::approximation_warning("partly transparent", "diffuse", names);
        contents.warnings.extend(text);
        for (what, names) in &contents.unused {
            let names = names.iter().map(String::as_str).collect();
            let text =
                super::approximation_warning(&format!("shaped by {what}"), "if it were not", names);
            contents.warnings.extend(text);
        }
        contents
    }
}

impl Contents {
    fn add(&mut self, material: &tobj::Material, file: &Path, options: &LoadOptions) {
        let folder = file.parent().unwrap_or(Path::new(""));
        // The standard shows textures unscaled by default.
        let unstated = if material.diffuse_texture.is_some() {
            1.0
        } else {
            DEFAULT_ALBEDO
        };
        let diffuse = Vec3::from(material.diffuse.unwrap_or([unstated; 3]));
        let source = source(material);
        let description = Description {
            format: Format::Mtl,
            base_color: diffuse,
            is_varied: false,
            is_followed: false,
            source: &source,
        };
        let name = material.name.clone();
        let found =
            Material::described(name, &description, options.kinds, file, &mut self.warnings);
        let mask = self.mask(material, folder, options);
        let mut texture = |statement: Option<&str>, is_used: bool| {
            let statement = statement.filter(|_| is_used && options.textures)?;
            Some(self.texture(folder, statement, options).place)
        };
        let other = |key: &str| material.unknown_param.get(key).map(String::as_str);
        let is_rough = found.kind != &MIRROR && found.kind != &DIELECTRIC;
        let emission = emitted(material.emissive.unwrap_or_default());
        let is_lamp = emission != Vec3::ZERO;
        let textured = Material {
            base_color_texture: texture(material.diffuse_texture.as_deref(), is_rough),
            normal_texture: texture(other("norm"), found.kind != &DIELECTRIC),
            emission_texture: texture(other("map_Ke"), is_lamp),
            emission,
            mask,
            ..found
        };
        let unused = [
            ("map_Ks", material.specular_texture.is_some()),
            ("map_Ns", material.shininess_texture.is_some()),
            ("a bump map", material.normal_texture.is_some()),
        ];
        for (what, _) in unused.iter().filter(|(_, is_there)| *is_there) {
            self.unused
                .entry(what)
                .or_default()
                .push(textured.name.clone());
        }
        self.materials.push(textured);
    }

    /// The texture named by a statement; each file is added once.
    fn texture(&mut self, folder: &Path, text: &str, options: &LoadOptions) -> Statement {
        let Statement {
            file,
            place,
            channel,
        } = statement(text);
        let next = self.textures.len() as u32;
        let path = folder.join(&file);
        let texture = *self.texture_ids.entry(path).or_insert_with_key(|path| {
            self.textures.push(ImageSource {
                name: path.display().to_string(),
                encoded: match relative(Path::new(&file), options) {
                    Ok(()) => Encoded::File(path.clone()),
                    Err(error) => Encoded::Missing(error.to_string()),
                },
            });
            next
        });
        Statement {
            place: TextureUse { texture, ..place },
            file,
            channel,
        }
    }

    /// The opacity texture as a mask with cutoff one half, in place of MTL's blending.
    fn mask(
        &mut self,
        material: &tobj::Material,
        folder: &Path,
        options: &LoadOptions,
    ) -> Option<AlphaMask> {
        let text = material.dissolve_texture.as_deref()?;
        let found = self.texture(folder, text, options);
        let channel = found.channel.unwrap_or(AlphaChannel::AlphaOrLuminance);
        let mask = AlphaMask::of(found.place, channel, AlphaMask::CUTOFF);
        let factor = material.dissolve.unwrap_or(1.0);
        Some(AlphaMask { factor, ..mask })
    }
}

fn plain(name: &str) -> String {
    name.replace('\\', "/")
}

/// Refuses absolute paths, which belong to the machine that wrote the file. Relative ones may leave
/// the folder: many models keep textures in `../textures`.
fn relative(file: &Path, options: &LoadOptions) -> std::io::Result<()> {
    if file.has_root() && !options.allow_outside {
        Err(std::io::Error::other(
            "an absolute path, which is read with --allow-outside only",
        ))
    } else {
        Ok(())
    }
}

fn source(material: &tobj::Material) -> MaterialSource {
    let numbers = |key: &str| -> Vec<f32> {
        let value = material.unknown_param.get(key).map_or("", String::as_str);
        let words = value.split_whitespace();
        words.map_while(|word| word.parse().ok()).collect()
    };
    let extra = |key: &str| numbers(key).first().copied();
    // Beckmann roughness of a Phong lobe: alpha^2 = 2 / (n + 2) (Walter et al. 2007); glTF's
    // roughness is the square root of alpha.
    let phong = |n: f32| (2.0 / (n.max(0.0) + 2.0)).powf(0.25);
    MaterialSource {
        roughness: extra("Pr").or(material.shininess.map(phong)),
        metallic: extra("Pm"),
        specular: material.specular,
        shininess: material.shininess,
        ior: material.optical_density,
        transmission: None,
        filter: match numbers("Tf")[..] {
            [] => None,
            [r, g, b, ..] => Some([r, g, b]),
            [grey, ..] => Some([grey; 3]),
        },
        thickness: None,
        opacity: material.dissolve.or(extra("Tr").map(|t| 1.0 - t)),
        alpha_mode: None,
        illum: material.illumination_model,
    }
}

/// Statements that are read, irrelevant (empty, ambient), or reported with their materials.
const READ: [&str; 25] = [
    "", "newmtl", "Ka", "Kd", "Ks", "Ke", "Ns", "Ni", "d", "Tr", "Tf", "illum", "Pr", "Pm",
    "map_Kd", "map_Ks", "map_Ke", "map_Ns", "map_ns", "map_NS", "map_d", "map_Bump", "map_bump",
    "bump", "norm",
];

/// Limit on the kinds of unread statements recorded: a file in another format has any number.
const MOST_UNREAD: usize = 64;

/// The text without lines that make `tobj` reject the library or panic; single-number colours
/// become three.
fn readable_lines(text: &str, path: &Path, warnings: &mut Vec<String>) -> String {
    let mut out = String::with_capacity(text.len());
    let mut unread: BTreeMap<String, usize> = BTreeMap::new();
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split('#').next().unwrap_or("").split_whitespace();
        let keyword = words.next().unwrap_or("");
        let argument = words.clone().next();
        let count = words.clone().count();
        let numbers = words.take_while(|w| w.parse::<f32>().is_ok()).count();
        let broken = match keyword {
            "Ka" | "Kd" | "Ks" | "Ke" => {
                if let (1, 1, Some(grey)) = (count, numbers, argument) {
                    out.push_str(&format!("{keyword} {grey} {grey} {grey}\n"));
                    continue;
                }
                numbers < 3
            }
            "Ns" | "Ni" | "d" => numbers < 1,
            "illum" => argument.is_none_or(|word| word.parse::<u8>().is_err()),
            "newmtl" | "bump" => argument.is_none(),
            _ => keyword.starts_with("map_") && argument.is_none(),
        };
        if !READ.contains(&keyword) && unread.len() < MOST_UNREAD {
            unread.entry(keyword.to_owned()).or_insert(number);
        }
        if broken {
            warnings.push(format!(
                "{}, line {number}: `{}` ignored: the value cannot be read",
                path.display(),
                line.trim()
            ));
        } else {
            out.push_str(line);
            out.push('\n');
        }
    }
    let unread = unread
        .iter()
        .map(|(what, line)| format!("`{what}` (line {line})"));
    let unread = unread_warning(unread);
    warnings.extend(unread.map(|text| format!("{}: {text}", path.display())));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_statements_are_dropped_with_their_line_and_the_rest_is_kept() {
        let text = "newmtl a\nKd 0.5\nKs 1 x 1\nNs\nillum 999\nKe 1 2 3\n";
        let mut warnings = Vec::new();
        let kept = readable_lines(text, Path::new("m.mtl"), &mut warnings);
        assert_eq!(kept, "newmtl a\nKd 0.5 0.5 0.5\nKe 1 2 3\n");
        assert_eq!(warnings.len(), 3);
        assert!(warnings[0].contains("line 3"), "{warnings:?}");
        let (materials, _) = tobj::load_mtl_buf(&mut Cursor::new(kept)).unwrap();
        assert_eq!(materials[0].emissive, Some([1.0, 2.0, 3.0]));
    }
}

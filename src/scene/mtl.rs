//! Material libraries (MTL) of OBJ files.

use super::builder::DEFAULT_ALBEDO;
use super::disguise::Disguise;
use super::gltf_files::decoded;
use super::material::{Description, Format, emitted, refracts};
use super::mtl_statements::{self, BLACK, Definition, Map};
use super::mtl_texture::{Statement, statement};
use super::obj_statements::without_comment;
use super::tally::{Tally, Unread};
use super::text::normalised;
use super::texture::{Encoded, ImageSource};
use super::{
    AlphaChannel, AlphaMask, DIELECTRIC, DIFFUSE, LoadOptions, MIRROR, Material, PHONG, PRINCIPLED,
    TextureUse,
};
use glam::Vec3;
use raystone_core::files::files;
use std::cell::RefCell;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use unicode_normalization::UnicodeNormalization as _;

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
    /// Folder of the model.
    model_folder: PathBuf,
    /// Texture files found elsewhere than the current library says.
    moved: Tally,
    /// Wholly transparent materials of the current library.
    unseen: Tally,
}

impl Library {
    /// Looks for libraries next to the OBJ file `obj`.
    pub(crate) fn new(obj: &Path, options: &LoadOptions) -> Self {
        let folder = obj.parent().unwrap_or(Path::new("")).to_owned();
        Self {
            options: *options,
            contents: RefCell::new(Contents {
                model_folder: folder.clone(),
                ..Contents::default()
            }),
            folder,
            loaded: RefCell::default(),
        }
    }

    /// Loads the libraries of a statement: a single file whose name may contain blanks, if it
    /// exists or only the last word ends as one and not all words are files, or several. Returns
    /// the indices of their materials by name. Broken libraries are warnings.
    pub(crate) fn load(&self, names: &str) -> HashMap<String, u32> {
        let cut = without_comment(names).trim();
        let is_there = |name: &str| spelt(&[&self.folder], name).is_some();
        let are_there = || cut.split_whitespace().all(is_there);
        match [names, cut]
            .iter()
            .find_map(|name| spelt(&[&self.folder], name))
        {
            Some(name) => self.load_one(&name),
            None if cut.to_ascii_lowercase().matches(".mtl").count() == 1 && !are_there() => {
                self.load_one(cut)
            }
            None => cut
                .split_whitespace()
                .flat_map(|name| self.load_one(name))
                .collect(),
        }
    }

    fn load_one(&self, name: &str) -> HashMap<String, u32> {
        let name = spelt(&[&self.folder], name).unwrap_or_else(|| plain(name));
        let named = self.folder.join(&name);
        let place = place(&[&self.folder], &name, &self.options);
        let mut contents = self.contents.borrow_mut();
        let path = place.as_ref().unwrap_or(&named).clone();
        if !self.loaded.borrow_mut().insert(path.clone()) {
            return HashMap::new();
        }
        let bytes = place.and_then(|path| raystone_core::files::read(&path));
        let bytes = bytes.and_then(|bytes| match Disguise::of(&bytes) {
            Some(Disguise { problem, advice }) => {
                Err(std::io::Error::other(format!("{problem} ({advice})")))
            }
            None => Ok(bytes),
        });
        let bytes = match bytes {
            Ok(bytes) => bytes,
            Err(error) => {
                contents.warnings.push(format!(
                    "material library {}: {error}; its materials are drawn grey",
                    named.display()
                ));
                return HashMap::new();
            }
        };
        if path != named {
            contents.warnings.push(format!(
                "material library {}: {} is read in its place",
                named.display(),
                path.display()
            ));
        }
        contents.add_all(&normalised(bytes), &path, &self.options)
    }

    /// All materials in library order, their textures, and warnings for deviations from the file.
    pub(crate) fn into_contents(self) -> Contents {
        let mut contents = self.contents.into_inner();
        for (what, names) in &contents.unused {
            let names = names.iter().map(String::as_str).collect();
            let text =
                super::approximation_warning(&format!("shaped by {what}"), "if it were not", names);
            contents.warnings.extend(text);
        }
        contents
    }
}

/// The mask of a material whose `map_d` is this, and whose `d` this factor; glass has none of `d` alone. `is_color` says that
/// the image is that of the colour, whose alpha alone can be meant.
fn mask(
    map_d: Option<Statement>,
    factor: f32,
    is_cut_by_d: bool,
    is_color: bool,
) -> Option<AlphaMask> {
    match map_d {
        // Images cut out leaves and fences: a cutoff of one half, in place of MTL's blending, which `d` asks for.
        Some(map) => {
            let unstated = if is_color {
                AlphaChannel::Alpha
            } else {
                AlphaChannel::AlphaOrLuminance
            };
            let channel = map.channel.unwrap_or(unstated);
            let cutoff = (factor >= 1.0).then_some(AlphaMask::CUTOFF);
            let mask = AlphaMask::of(map.place, channel, cutoff);
            Some(AlphaMask { factor, ..mask })
        }
        None => is_cut_by_d.then(|| AlphaMask::even(factor)),
    }
}

impl Contents {
    /// Adds the materials of a library; returns their indices by name.
    fn add_all(&mut self, text: &str, path: &Path, options: &LoadOptions) -> HashMap<String, u32> {
        let mut numbers = HashMap::new();
        let mut unread = Unread::default();
        let mut again = Tally::default();
        let mut without_comments = Vec::new();
        for definition in mtl_statements::read(text, &mut unread) {
            let number = self.materials.len() as u32;
            let name = &definition.name;
            without_comments.push((without_comment(name).trim().to_owned(), number));
            again.see_if(
                numbers.insert(name.clone(), number).is_some(),
                definition.line,
            );
            self.add(definition, path, options, &mut unread);
        }
        for (name, number) in without_comments {
            numbers.entry(name).or_insert(number);
        }
        let notes = [
            unread.note(),
            again.note(
                ["material is defined again", "materials are defined again"],
                "line",
                "the last definition counts",
            ),
            std::mem::take(&mut self.moved).note(
                [
                    "texture is not where it should be",
                    "textures are not where they should be",
                ],
                "line",
                "the file of this name, in any case, beside the library or the model is read",
            ),
            std::mem::take(&mut self.unseen).note(
                [
                    "material is wholly transparent, by `d` or `Tr`",
                    "materials are wholly transparent, by `d` or `Tr`",
                ],
                "line",
                "nothing is drawn there",
            ),
        ];
        let named = notes.iter().flatten();
        self.warnings
            .extend(named.map(|note| format!("{}: {note}", path.display())));
        numbers
    }

    fn add(
        &mut self,
        definition: Definition,
        file: &Path,
        options: &LoadOptions,
        unread: &mut Unread,
    ) {
        let Definition {
            name,
            line,
            diffuse,
            emission,
            source,
            maps: [map_kd, map_ke, map_d, norm],
            has_roughness,
            ..
        } = definition;
        let folder = file.parent().unwrap_or(Path::new(""));
        // Programs write a black `Kd` where the texture takes its place.
        let is_replaced = map_kd.is_some() && diffuse == Some([0.0; 3]);
        let diffuse = diffuse.filter(|_| !is_replaced);
        // The standard shows textures unscaled by default.
        let unstated = map_kd.as_ref().map_or(DEFAULT_ALBEDO, |_| 1.0);
        // No light is better than light everywhere.
        let unstated_light = map_ke.as_ref().map_or(0.0, |_| 1.0) * f32::from(options.textures);
        unread.see_if(is_replaced, "`Kd` of 0 with a `map_Kd`", line);
        if let (Some(map), Some([0.0, 0.0, 0.0])) = (&map_ke, emission) {
            unread.see("`map_Ke` where `Ke` is 0", map.line);
        }
        let description = Description {
            format: Format::Mtl,
            base_color: Vec3::from(diffuse.unwrap_or([unstated; 3])),
            is_varied: false,
            is_followed: false,
            source: &source,
        };
        let found =
            Material::described(name, &description, options.kinds, file, &mut self.warnings);
        let is_glass = found.kind == &DIELECTRIC;
        unread.see_if(
            refracts(source.illum) && !is_glass,
            "`illum` of glass whose `Ni` is 1 and which filters nothing",
            line,
        );
        let opacity = source.opacity.unwrap_or(1.0);
        for (what, is_so) in [
            (
                "`Kd` of glass",
                diffuse.is_some_and(|kd| kd.iter().any(|part| *part > BLACK)),
            ),
            ("`d` of glass", 0.0 < opacity && opacity < 1.0),
            ("`Pr` of glass", has_roughness && source.metallic.is_some()),
        ] {
            unread.see_if(is_glass && is_so, what, line);
        }
        let is_plain = found.kind == &DIFFUSE;
        unread.see_if(
            is_plain && source.illum == Some(0),
            "`illum` 0, a colour without light",
            line,
        );
        unread.see_if(
            is_plain && source.illum == Some(10),
            "`illum` 10, shadows alone",
            line,
        );
        // Their colours are `Tf` and `Ks`.
        let is_rough = found.kind != &MIRROR && !is_glass;
        if let Some(map) = map_kd.as_ref().filter(|_| !is_rough) {
            unread.see("`map_Kd` of glass or a mirror", map.line);
        }
        let is_clamped =
            found.kind == &PHONG && found.parameters.last() != source.shininess.as_ref();
        unread.see_if(is_clamped, "what is beyond 0 to 100000 in `Ns`", line);
        let factor = source.opacity.unwrap_or(1.0);
        let image = |map: &Map| plain(&in_order(&map.text, &[folder, &self.model_folder]).file);
        let is_color = map_d.as_ref().map(image) == map_kd.as_ref().map(image);
        let map_d = map_d.map(|map| self.texture(folder, &map, options, unread));
        let mask = mask(map_d, factor, !is_glass, is_color);
        self.unseen.see_if(mask.is_some() && factor <= 0.0, line);
        let mut texture = |map: Option<Map>, is_used: bool| {
            let map = map.filter(|_| is_used && options.textures)?;
            Some(self.texture(folder, &map, options, unread).place)
        };
        let emission = emitted(emission.unwrap_or([unstated_light; 3]));
        let is_lamp = emission != Vec3::ZERO;
        let textured = Material {
            base_color_texture: texture(map_kd, is_rough),
            normal_texture: texture(norm, true),
            emission_texture: texture(map_ke, is_lamp),
            emission,
            mask,
            ..found
        };
        let shines = source.specular.is_some_and(|ks| ks != [0.0; 3]);
        // The models 0 and 1 have no highlights.
        let is_shown = ![&DIFFUSE, &PRINCIPLED].contains(&textured.kind)
            || matches!(source.illum, Some(0 | 1));
        let specular = (shines && !is_shown).then_some("a specular colour (`Ks`)");
        for what in definition.unused.into_iter().chain(specular) {
            let names = self.unused.entry(what).or_default();
            names.push(textured.name.clone());
        }
        self.materials.push(textured);
    }

    /// The texture named by a statement; each file is added once.
    fn texture(
        &mut self,
        folder: &Path,
        map: &Map,
        options: &LoadOptions,
        unread: &mut Unread,
    ) -> Statement {
        // Some exporters write paths from the model's folder.
        let folders = [folder, &self.model_folder];
        let Statement {
            file,
            place: used,
            channel,
            skipped,
        } = in_order(&map.text, &folders);
        for option in skipped {
            unread.see(&format!("`{option}` of a texture"), map.line);
        }
        // A comment may follow, but names contain `#`, too.
        let spellings = [&file, without_comment(&file)];
        let file = spellings.iter().find_map(|name| spelt(&folders, name));
        let file = file.unwrap_or_else(|| plain(spellings[0]));
        let next = self.textures.len() as u32;
        let named = folder.join(&file);
        let (path, encoded) = match place(&folders, &file, options) {
            Ok(path) => (path.clone(), Encoded::File(path)),
            Err(error) => (named.clone(), Encoded::Missing(error.to_string())),
        };
        if path != named {
            self.moved.see(map.line);
        }
        let texture = *self.texture_ids.entry(path).or_insert_with_key(|path| {
            self.textures.push(ImageSource {
                name: path.display().to_string(),
                encoded,
            });
            next
        });
        Statement {
            place: TextureUse { texture, ..used },
            file,
            channel,
            skipped: Vec::new(),
        }
    }
}

/// A path as written on any system, without quotation marks.
fn plain(name: &str) -> String {
    name.trim().trim_matches('"').replace('\\', "/")
}

/// The spelling of a name that a file in one of `folders` has: as it is, with blanks behind backslashes as in a shell, or
/// with `%20` and the like as in a URI.
fn spelt(folders: &[&Path], name: &str) -> Option<String> {
    let as_is = plain(name);
    let mut spellings = vec![plain(&name.replace("\\ ", " ")), decoded(&as_is)];
    spellings.retain(|other| *other != as_is);
    let is_there = |name: &String| folders.iter().any(|folder| found(folder, name).is_some());
    [as_is].into_iter().chain(spellings).find(is_there)
}

/// Reads a statement; options may also stand behind the file, where that makes the name one of a file.
fn in_order(text: &str, folders: &[&Path]) -> Statement {
    let read = statement(text);
    if spelt(folders, &read.file).is_some() {
        return read;
    }
    match read.file.split_once(" -") {
        Some((name, options)) if spelt(folders, name).is_some() => {
            let before = &text[..text.len() - read.file.len()];
            statement(&format!("{before}-{options} {name}"))
        }
        _ => numbered(text, &read.file, folders).unwrap_or(read),
    }
}

/// Reads a statement whose file begins with a number and a blank, which options take for one more number of theirs.
fn numbered(text: &str, file: &str, folders: &[&Path]) -> Option<Statement> {
    let options = &text[..text.len() - file.len()];
    let blanks = options.rmatch_indices(char::is_whitespace);
    let mut starts = blanks.map(|(at, blank)| at + blank.len());
    starts.find_map(|start| {
        let name = spelt(folders, &text[start..])?;
        let read = statement(&format!("{}x", &text[..start]));
        (read.file == "x").then_some(Statement { file: name, ..read })
    })
}

/// The path of a file that is named relative to the first of `folders`, or to another; or else the
/// path of a file of its name in one of them.
///
/// # Errors
/// The path is absolute and may not be read: it belongs to the machine that wrote the file. Relative
/// ones may leave the folder: many models keep textures in `../textures`.
fn place(folders: &[&Path], file: &str, options: &LoadOptions) -> std::io::Result<PathBuf> {
    let in_any = |file: &str| folders.iter().find_map(|folder| found(folder, file));
    let is_absolute = Path::new(file).has_root();
    let is_allowed = !is_absolute || options.allow_outside;
    let there = is_allowed.then(|| in_any(file)).flatten();
    let beside = || in_any(file.rsplit('/').next()?);
    match there.or_else(beside) {
        Some(path) => Ok(path),
        None if is_allowed => Ok(folders[0].join(file)),
        None => Err(std::io::Error::other(
            "an absolute path, which is read with --allow-outside only",
        )),
    }
}

/// The file of this name, or else the only one whose name differs in case or in how Unicode composes its letters alone, as
/// those of its folders may: models come from systems that ignore both.
pub(super) fn found(folder: &Path, file: &str) -> Option<PathBuf> {
    let path = folder.join(file);
    let is_file = |path: &PathBuf| files().open(path).is_ok();
    if is_file(&path) {
        return Some(path);
    }
    let mut parts = Path::new(file).components();
    let in_any_case = parts.try_fold(folder.to_owned(), |at, part| entry(&at, part.as_os_str()));
    in_any_case.filter(is_file)
}

/// What stands in a folder under this name, or else the only thing whose [`folded`] name is the same.
fn entry(folder: &Path, name: &OsStr) -> Option<PathBuf> {
    let path = folder.join(name);
    if files().is_folder(&path) || files().open(&path).is_ok() {
        return Some(path);
    }
    let parent = Some(folder).filter(|folder| !folder.as_os_str().is_empty());
    let listed = files().list(parent.unwrap_or(Path::new("."))).ok()?;
    let names = listed.iter().filter_map(|other| other.file_name());
    let mut same = names.filter(|other| folded(other) == folded(name));
    let only = same.next().filter(|_| same.next().is_none())?;
    Some(folder.join(only))
}

/// A name in lower case and with composed letters: macOS writes `é` as a letter and an accent, others as one character.
fn folded(name: &OsStr) -> String {
    let name = name.to_string_lossy();
    name.nfc().flat_map(char::to_lowercase).collect()
}

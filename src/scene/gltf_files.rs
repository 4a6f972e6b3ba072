//! Files that a glTF model names by URI.

use super::LoadOptions;
use super::disguise::Disguise;
use super::mtl::found;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use base64::{Engine, alphabet};
use std::cell::RefCell;
use std::path::{Component, Path, PathBuf};

/// Finds and reads a model's files, by default only inside its folder.
pub(super) struct Files {
    pub model: PathBuf,
    folder: PathBuf,
    allow_outside: bool,
    /// Notes on files that are read in the place of others.
    pub others: RefCell<Vec<String>>,
}

impl Files {
    pub(crate) fn new(model: &Path, options: &LoadOptions) -> Self {
        let folder = match model.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        Self {
            model: model.to_owned(),
            folder: folder.to_owned(),
            allow_outside: options.allow_outside,
            others: RefCell::default(),
        }
    }

    /// Reads a data URI or a file.
    ///
    /// # Errors
    /// The problem, with the name of the file.
    pub(crate) fn read(&self, uri: &str) -> Result<Vec<u8>, String> {
        if is_data(uri) {
            return read_data(uri).map_err(|p| format!("the data URI cannot be decoded: {p}"));
        }
        let file = self.find(uri)?;
        let bytes = raystone_core::files::read(&file);
        let bytes = bytes.map_err(|error| format!("{}: {error}", file.display()))?;
        match Disguise::of_text(&bytes) {
            Some(Disguise { problem, advice }) => {
                Err(format!("{}: {problem}; {advice}", file.display()))
            }
            None => Ok(bytes),
        }
    }

    /// Resolves a relative URI: as the standard has it, with `%20` and the like decoded, or as
    /// exporters write it, with backslashes, a blank or percent sign as it is, or a query behind; or else the only file
    /// whose name differs in case or in how Unicode composes its letters alone, or a file of this name beside the model,
    /// with a note.
    ///
    /// # Errors
    /// The file lies outside the model's folder, by name or by link, and that is not allowed.
    pub(crate) fn find(&self, uri: &str) -> Result<PathBuf, String> {
        if uri.starts_with("http:") || uri.starts_with("https:") {
            return Err(format!(
                "`{uri}` is on the network; save it beside the model and write its name instead"
            ));
        }
        let uri = uri.strip_prefix("file://").unwrap_or(uri);
        let slashes = |text: &str| text.replace('\\', "/");
        let plain = decoded(uri);
        let bare = uri.split(['?', '#']).next().unwrap_or_default();
        let written = [&plain, uri, &slashes(&plain), &slashes(uri), &decoded(bare)];
        let files = written.map(|name| self.folder.join(name));
        let exists = |file: &&PathBuf| raystone_core::files::files().real(file).is_ok();
        let as_written = files.iter().find(exists).cloned();
        let in_any_case = || written.iter().find_map(|name| found(&self.folder, name));
        // The path of another machine.
        let beside = || {
            let mut names = written
                .iter()
                .filter_map(|name| name.rsplit(['/', '\\']).next());
            names.find_map(|name| found(&self.folder, name))
        };
        let other = || in_any_case().or_else(beside);
        let other = as_written.is_none().then(other).flatten();
        let note = other.as_ref().map(|other| {
            let other = other.display();
            format!("`{uri}` is not there: {other} is read")
        });
        // None exists: the name that is most likely meant, for the message.
        let file = as_written.or(other).unwrap_or_else(|| files[2].clone());
        if !self.allow_outside && !self.is_inside(&file) {
            let advice = match raystone_core::files::files().real(&file) {
                Ok(_) => "--allow-outside reads it all the same",
                Err(_) => "it is not there, either",
            };
            return Err(format!("`{uri}` lies outside the model's folder; {advice}"));
        }
        self.others.borrow_mut().extend(note);
        Ok(file)
    }

    /// True for files in the model's folder, by name or by link.
    fn is_inside(&self, file: &Path) -> bool {
        // With links resolved. The reader reports missing files, unless the name leads outside.
        let real = |path: &Path| raystone_core::files::files().real(path);
        match (real(file), real(&self.folder)) {
            (Ok(file), Ok(folder)) => file.starts_with(folder),
            _ => file.strip_prefix(&self.folder).is_ok_and(|rest| {
                let ordinary = |part| matches!(part, Component::Normal(_) | Component::CurDir);
                rest.components().all(ordinary)
            }),
        }
    }
}

pub(super) fn is_data(uri: &str) -> bool {
    let scheme = uri.get(..5).unwrap_or_default();
    scheme.eq_ignore_ascii_case("data:")
}

/// The bytes of a data URI of any media type, in base64 or percent-encoded (RFC 2397). The base64
/// may itself be percent-encoded, broken into lines, without padding, or in the letters of URLs.
fn read_data(uri: &str) -> Result<Vec<u8>, String> {
    let (head, data) = uri.split_once(',').ok_or("it has no comma")?;
    let data = decoded_bytes(data);
    if !head.to_ascii_lowercase().ends_with(";base64") {
        return Ok(data);
    }
    let letter = |byte: &u8| match byte {
        b'-' => Some(b'+'),
        b'_' => Some(b'/'),
        b'=' => None,
        byte => (!byte.is_ascii_whitespace()).then_some(*byte),
    };
    let letters: Vec<u8> = data.iter().filter_map(letter).collect();
    let engine = GeneralPurpose::new(&alphabet::STANDARD, UNPADDED);
    engine.decode(letters).map_err(|error| error.to_string())
}

/// The last letter may have bits beyond the last byte.
const UNPADDED: GeneralPurposeConfig = GeneralPurposeConfig::new()
    .with_decode_padding_mode(DecodePaddingMode::RequireNone)
    .with_decode_allow_trailing_bits(true);

pub(super) fn decoded(uri: &str) -> String {
    String::from_utf8_lossy(&decoded_bytes(uri)).into_owned()
}

/// Decodes `%20` and the like.
fn decoded_bytes(uri: &str) -> Vec<u8> {
    let mut decoded = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let hex = (byte == b'%').then(|| after.get(..2)).flatten();
        let value = hex.and_then(|h| u8::from_str_radix(std::str::from_utf8(h).ok()?, 16).ok());
        decoded.push(value.unwrap_or(byte));
        rest = &after[if value.is_some() { 2 } else { 0 }..];
    }
    decoded
}

//! What a file is in place of what its name says: a download that went wrong, or one that is still packed.

use super::SceneError;
use std::io::Read as _;
use std::path::Path;

/// What a file begins with that is no model, text or image, and what to do about it.
pub(super) struct Disguise {
    pub problem: &'static str,
    pub advice: &'static str,
}

const POINTER: Disguise = Disguise {
    problem: "it is a pointer of Git LFS to the file",
    advice: "fetch the file: `git lfs pull`",
};
const PAGE: Disguise = Disguise {
    problem: "it is a web page",
    advice: "download the file itself, to which such a page has a link",
};
const GZIP: Disguise = Disguise {
    problem: "it is compressed by gzip",
    advice: "unpack it first: `gzip -dc IN > OUT`",
};
const ZIP: Disguise = Disguise {
    problem: "it is a ZIP archive",
    advice: "unpack it first: `unzip FILE`, and give a file that was in it",
};
const UTF_16: Disguise = Disguise {
    problem: "it is UTF-16 text without a mark that says so",
    advice: "save it as UTF-8: `iconv -f UTF-16LE -t UTF-8 IN > OUT`",
};

/// Number of bytes that tell.
const START: u64 = 512;

impl Disguise {
    /// By the first bytes of a file.
    pub(crate) fn of(start: &[u8]) -> Option<&'static Self> {
        match start {
            [0x1f, 0x8b, 8, ..] => Some(&GZIP),
            [b'P', b'K', 3, 4, ..] => Some(&ZIP),
            _ => Self::of_text(start),
        }
    }

    /// [`Self::of`] for files that may begin with any bytes.
    pub(crate) fn of_text(start: &[u8]) -> Option<&'static Self> {
        let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
        let text = start.trim_ascii_start();
        let begins = |with: &str| {
            let there = text.get(..with.len());
            there.is_some_and(|there| there.eq_ignore_ascii_case(with.as_bytes()))
        };
        if begins("version https://git-lfs") {
            Some(&POINTER)
        } else if begins("<!doctype html") || begins("<html") {
            Some(&PAGE)
        } else {
            None
        }
    }

    /// True for letters that have a zero behind each of them.
    pub(crate) fn of_letters(start: &[u8]) -> Option<&'static Self> {
        let pairs = start.as_chunks::<2>().0;
        let is_wide = |pair: &[u8; 2]| pair[0].is_ascii() && pair[0] != 0 && pair[1] == 0;
        (!pairs.is_empty() && pairs.iter().all(is_wide)).then_some(&UTF_16)
    }

    pub(crate) fn error(&self, path: &Path) -> SceneError {
        SceneError::Unsupported {
            path: path.to_owned(),
            place: String::new(),
            problem: self.problem.to_owned(),
            advice: self.advice,
        }
    }
}

/// Refuses a model that is something else. One that cannot be read is left to its reader.
///
/// # Errors
/// What it is, and what to do about it.
pub(super) fn check(path: &Path) -> Result<(), SceneError> {
    let mut start = Vec::new();
    if let Ok((file, _)) = raystone_core::files::files().open(path) {
        file.take(START).read_to_end(&mut start).ok();
    }
    let is_text = super::extension(path) == "obj";
    let wide = || Disguise::of_letters(&start).filter(|_| is_text);
    match Disguise::of(&start).or_else(wide) {
        Some(found) => Err(found.error(path)),
        None => Ok(()),
    }
}

//! Texts that all parts deal in: content hashes, and the known name nearest to a misspelt one.

/// Hash of named parts as 64 hexadecimal digits (BLAKE3).
///
/// Every name and text goes in behind its length, so that parts cannot run together: moving a
/// character from one part to the next changes the hash. The order of the parts counts.
pub fn cell_hash(parts: &[(&str, &str)]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(parts.len() as u64).to_le_bytes());
    for (name, text) in parts {
        for field in [name, text] {
            hasher.update(&(field.len() as u64).to_le_bytes());
            hasher.update(field.as_bytes());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// A text as one word of a POSIX shell, whatever characters are in it.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Characters of names that are compared: the time and the memory that it takes are their product.
const COMPARED: usize = 64;

/// The known name nearest to `name`, if any are known.
///
/// Nearness is the normalised Damerau–Levenshtein similarity; a name that contains the other one
/// counts as a near one, so that `grid` finds `uniform-grid`.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let beginning = |text: &str| text.chars().take(COMPARED).collect::<String>();
    let name = beginning(name).to_lowercase();
    let score = |candidate: &str| {
        let candidate = beginning(candidate);
        let contained = name.len() >= 3 && (candidate.contains(&name) || name.contains(&candidate));
        strsim::normalized_damerau_levenshtein(&name, &candidate)
            + if contained { 0.5 } else { 0.0 }
    };
    known
        .into_iter()
        .max_by(|a, b| score(a).total_cmp(&score(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_prefers_a_transposition_and_finds_a_part_of_a_name() {
        let known = ["brute-force", "bvh", "roped-bvh", "uniform-grid"];
        assert_eq!(nearest("bhv", known), Some("bvh"));
        assert_eq!(nearest("grid", known), Some("uniform-grid"));
        assert_eq!(nearest("Roped_BVH", known), Some("roped-bvh"));
        assert_eq!(nearest("bvh", []), None);
    }

    #[test]
    fn shell_words_come_back_from_a_shell() {
        for text in [
            "a b",
            "it's",
            "$(x)`y`",
            "",
            "plain-1.2/x",
            "\"",
            "a\nb",
            "*",
            "~",
            "!x",
        ] {
            let echo = format!("printf %s {}", shell_word(text));
            let output = std::process::Command::new("sh")
                .args(["-c", &echo])
                .output();
            assert_eq!(output.unwrap().stdout, text.as_bytes(), "{text:?}");
        }
        assert_eq!(shell_word("plain-1.2/x"), "plain-1.2/x");
    }

    #[test]
    fn equal_parts_hash_equal_and_every_change_shows() {
        let base = cell_hash(&[("scene", "ab"), ("accel", "c")]);
        assert_eq!(base, cell_hash(&[("scene", "ab"), ("accel", "c")]));
        assert_eq!(base.len(), 64);
        for other in [
            cell_hash(&[("scene", "a"), ("accel", "bc")]),
            cell_hash(&[("scene", "abaccel"), ("", "c")]),
            cell_hash(&[("accel", "c"), ("scene", "ab")]),
            cell_hash(&[("scene", "ab"), ("accel", "c"), ("", "")]),
            cell_hash(&[("scene", "ab"), ("accel", "d")]),
        ] {
            assert_ne!(base, other);
        }
    }
}

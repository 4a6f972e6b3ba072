//! Content hash of a cell.

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

#[cfg(test)]
mod tests {
    use super::cell_hash;

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

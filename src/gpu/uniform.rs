//! Uniform values by member name: offsets come from the composed kernel, never from Rust.

use std::collections::BTreeMap;

/// Values for the members of a uniform struct.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UniformValues(BTreeMap<String, Vec<u32>>);

impl UniformValues {
    /// Creates an empty set of values.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets a `u32`.
    #[must_use]
    pub fn u32(mut self, name: &str, value: u32) -> Self {
        self.0.insert(name.to_owned(), vec![value]);
        self
    }

    /// Sets a `f32`.
    #[must_use]
    pub fn f32(mut self, name: &str, value: f32) -> Self {
        self.0.insert(name.to_owned(), vec![value.to_bits()]);
        self
    }

    /// Sets a vector of `f32`.
    #[must_use]
    pub fn vec(mut self, name: &str, value: &[f32]) -> Self {
        self.0
            .insert(name.to_owned(), value.iter().map(|x| x.to_bits()).collect());
        self
    }

    /// Sets a vector of `u32`.
    #[must_use]
    pub fn uvec(mut self, name: &str, value: &[u32]) -> Self {
        self.0.insert(name.to_owned(), value.to_vec());
        self
    }

    /// Words of a member.
    pub fn words(&self, name: &str) -> Option<&[u32]> {
        self.0.get(name).map(Vec::as_slice)
    }

    /// Bytes of a struct with members at these offsets. `Err` contains members without a value.
    pub(super) fn pack(&self, size: u32, members: &[(String, u32)]) -> Result<Vec<u8>, String> {
        let mut bytes = vec![0u8; size as usize];
        for (name, offset) in members {
            let words = self.0.get(name).ok_or_else(|| name.clone())?;
            let target = *offset as usize;
            let source: &[u8] = bytemuck::cast_slice(words);
            bytes[target..target + source.len()].copy_from_slice(source);
        }
        Ok(bytes)
    }
}

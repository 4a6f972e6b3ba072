//! An environment map as `kernels/shading/light/environment.wesl` reads it.

use super::alias::{AliasEntry, alias_table};
use crate::scene::EnvironmentMap;

/// The alias tables of a map, threshold and alias of each entry: one that chooses the row, then one for each row.
pub(crate) fn environment_aliases(map: &EnvironmentMap) -> Vec<(f32, u32)> {
    let entries = aliases(map, &map.weights());
    entries.iter().map(|e| (e.threshold, e.alias)).collect()
}

fn aliases(map: &EnvironmentMap, weights: &[f64]) -> Vec<AliasEntry> {
    let by_row = || weights.chunks(map.width as usize);
    let sums: Vec<f64> = by_row().map(|row| row.iter().sum()).collect();
    let mut entries = alias_table(&sums);
    entries.extend(by_row().flat_map(alias_table));
    entries
}

/// Rows of `shading_tables`: size, texels with their probabilities, alias tables of rows and columns.
pub(super) fn environment_rows(map: &EnvironmentMap) -> Vec<[u32; 4]> {
    let weights = map.weights();
    let total: f64 = weights.iter().sum();
    let mut rows = vec![[map.width, map.height, 0, 0]];
    rows.extend(map.texels.iter().zip(&weights).map(|(texel, weight)| {
        let [r, g, b] = texel.to_array();
        [r, g, b, (weight / total) as f32].map(f32::to_bits)
    }));
    let entries = aliases(map, &weights);
    let words = |entry: Option<&AliasEntry>| {
        entry.map_or([0; 2], |entry| [entry.threshold.to_bits(), entry.alias])
    };
    rows.extend(entries.chunks(2).map(|pair| {
        let [[a, b], [c, d]] = [words(pair.first()), words(pair.get(1))];
        [a, b, c, d]
    }));
    rows
}

//! An environment map in the layout of `kernels/shading/light/environment.wesl`.

use super::alias::{AliasEntry, alias_table};
use super::units::{shared_out, unit_share};
use raystone_scene::EnvironmentMap;

/// Texel selection in a map: values of rows, and of the columns of each.
struct Shares {
    rows: Vec<u32>,
    columns: Vec<Vec<u32>>,
}

impl Shares {
    fn of(map: &EnvironmentMap) -> Self {
        let weights = map.weights();
        let by_row = || weights.chunks(map.width as usize);
        let sums: Vec<f64> = by_row().map(|row| row.iter().sum()).collect();
        Self {
            rows: shared_out(&sums),
            columns: by_row().map(shared_out).collect(),
        }
    }

    /// One table that chooses the row, then one per row.
    fn aliases(&self) -> Vec<AliasEntry> {
        let mut entries = alias_table(&self.rows);
        entries.extend(self.columns.iter().flat_map(|row| alias_table(row)));
        entries
    }
}

/// The alias tables of a map, threshold and alias of each part: one that chooses the row, then one
/// per row. The number of parts of a table is the next power of two.
pub fn environment_aliases(map: &EnvironmentMap) -> Vec<(u32, u32)> {
    let entries = Shares::of(map).aliases();
    entries.iter().map(|e| (e.threshold, e.alias)).collect()
}

/// Rows of `shading_tables`: size, texels with probabilities, alias tables of rows and columns.
pub(super) fn environment_rows(map: &EnvironmentMap) -> Vec<[u32; 4]> {
    let shares = Shares::of(map);
    let mut rows = vec![[map.width, map.height, 0, 0]];
    let columns = shares.columns.iter().zip(&shares.rows);
    let chosen = columns.flat_map(|(columns, row)| {
        (columns.iter()).map(|column| unit_share(*row) * unit_share(*column))
    });
    rows.extend(map.texels.iter().zip(chosen).map(|(texel, chosen)| {
        let [r, g, b] = texel.to_array();
        [r, g, b, chosen].map(f32::to_bits)
    }));
    let entries = shares.aliases();
    let words =
        |entry: Option<&AliasEntry>| entry.map_or([0; 2], |entry| [entry.threshold, entry.alias]);
    rows.extend(entries.chunks(2).map(|pair| {
        let [[a, b], [c, d]] = [words(pair.first()), words(pair.get(1))];
        [a, b, c, d]
    }));
    rows
}

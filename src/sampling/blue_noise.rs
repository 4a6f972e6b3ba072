//! `blue-noise`: shifts by a dither mask, so that the errors of neighbouring pixels differ. CPU
//! version of `kernels/sampling/blue_noise.wesl`.
//!
//! Source: I. Georgiev, M. Fajardo, "Blue-noise dithered sampling", SIGGRAPH Talks 2016: Cranley
//! and Patterson's shift, from a mask of 64×64 pixels ([`super::void_and_cluster`]) that is moved
//! for each dimension and seed. Or, with the parameter `tables`, the points of E. Heitz, L.
//! Belcour, V. Ostromoukhov, D. Coeurjolly, J.-C. Iehl, "A low-discrepancy sampler that distributes
//! Monte Carlo errors as a blue noise in screen space", SIGGRAPH Talks 2019: 256 Owen-scrambled
//! Sobol points, ranked and scrambled by tiles of 128×128 pixels optimised for one number of
//! samples. These points replace those of `sobol`.
//!
//! Words: the image's width, then the mask or points, ranking and scrambling, four bytes per word.

use super::hash::{keyed_hash, pcg_hash};
use super::{Coordinate, Decorrelation, Demand, Partner, SamplerTable, void_and_cluster};
use raystone_core::parameters;
use std::path::Path;

parameters! {
    /// shifts by a void-and-cluster mask (Georgiev & Fajardo 2016), or the tables of Heitz et al.
    /// (2019)
    pub(crate) struct BlueNoise {
        /// folder with the tables of Heitz et al. 2019, whose points then replace those of sobol; none is the mask
        tables: String = String::new();
    }
}

const MASK: u32 = 1;
const MASK_SIZE: u32 = 64;
const POINTS: u32 = 1;
const RANKING: u32 = 16_385;
const SCRAMBLING: u32 = 49_153;
const TILE_SIZE: u32 = 128;
/// Dimensions and samples of Heitz's points.
const HEITZ_LIMIT: u32 = 256;

impl BlueNoise {
    /// The folder of Heitz's tables, if requested.
    fn folder(&self) -> Option<&str> {
        Some(self.tables.as_str()).filter(|folder| !folder.is_empty())
    }
}

/// Index of the pixel in a tile that repeats every `size` pixels and is moved at random by `key`.
fn tile_index(table: &SamplerTable, at: Coordinate, size: u32, key: u32) -> u32 {
    let width = table.decorrelation_word(0);
    let shift = keyed_hash(pcg_hash(at.seed), key);
    let x = (at.pixel % width).wrapping_add(shift & 0xffff) % size;
    let y = (at.pixel / width).wrapping_add(shift >> 16) % size;
    y * size + x
}

fn table_byte(table: &SamplerTable, first: u32, i: u32) -> u32 {
    (table.decorrelation_word(first + (i >> 2)) >> (8 * (i & 3))) & 0xff
}

/// Heitz's point, which replaces that of the sequence.
fn heitz_point(table: &SamplerTable, at: Coordinate) -> u32 {
    let key = 8 * tile_index(table, at, TILE_SIZE, 0) + (at.dimension & 7);
    let ranked = (at.sample & 0xff) ^ table_byte(table, RANKING, key);
    let point = table_byte(table, POINTS, 256 * ranked + (at.dimension & 0xff));
    let digits = point ^ table_byte(table, SCRAMBLING, key);
    (digits << 24) | 0x0080_0000
}

/// The words of one file of Heitz's tables.
fn read_words(folder: &Path, name: &str, bytes: usize) -> Result<Vec<u32>, String> {
    let path = folder.join(name);
    let content =
        raystone_core::files::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    if content.len() != bytes {
        return Err(format!(
            "{}: {} bytes, a table of Heitz et al. has {bytes}",
            path.display(),
            content.len()
        ));
    }
    let words = content.chunks_exact(4);
    Ok(words
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect())
}

/// Points, ranking and scrambling for `samples` samples per pixel. One sample has no ranking.
fn read_tables(folder: &Path, samples: u32) -> Result<Vec<u32>, String> {
    if !samples.is_power_of_two() || samples > HEITZ_LIMIT {
        return Err(format!(
            "the tables of Heitz et al. are for 1, 2, 4, … {HEITZ_LIMIT} samples per pixel, not {samples}"
        ));
    }
    let tile = 8 * (TILE_SIZE * TILE_SIZE) as usize;
    let mut words = read_words(folder, "sobol_256spp_256d.u8", 1 << 16)?;
    words.extend(match samples {
        1 => vec![0; tile / 4],
        _ => read_words(
            folder,
            &format!("ranking_tile_128x128x8_{samples:03}spp.u8"),
            tile,
        )?,
    });
    let scrambling = format!("scrambling_tile_128x128x8_{samples:03}spp.u8");
    words.extend(read_words(folder, &scrambling, tile)?);
    Ok(words)
}

impl Decorrelation for BlueNoise {
    fn by_count(&self) -> bool {
        self.folder().is_some()
    }

    fn by_width(&self) -> bool {
        true
    }

    fn limits(&self) -> [Option<u32>; 2] {
        let limit = self.folder().map(|_| HEITZ_LIMIT);
        [limit, limit]
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        if self.folder().is_some() && partner.name != "sobol" {
            return Some(
                "the tables of Heitz et al. bring points of Sobol's sequence; take sobol"
                    .to_owned(),
            );
        }
        partner.without_structure()
    }

    fn table(&self, _: &Partner, demand: &Demand) -> Result<Vec<u32>, String> {
        let mut words = vec![demand.width.unwrap_or(1).max(1)];
        match self.folder() {
            Some(folder) => {
                words.extend(read_tables(Path::new(folder), demand.samples.unwrap_or(1))?)
            }
            // Midpoints of the 4096 steps.
            None => words.extend(
                void_and_cluster::ranks()
                    .iter()
                    .map(|rank| rank << 20 | 1 << 19),
            ),
        }
        Ok(words)
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("HEITZ", u32::from(self.folder().is_some()))]
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32 {
        if self.folder().is_some() {
            return heitz_point(table, at);
        }
        x.wrapping_add(
            table.decorrelation_word(MASK + tile_index(table, at, MASK_SIZE, at.dimension)),
        )
    }
}

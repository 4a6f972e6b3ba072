//! Last phase: 16 bytes per cell, four bytes per map entry and reference.

use super::voxels::{Block, Entry, GridCell, Map};
use super::{EMPTY, LAST, LOG_BITS, Partition};
use rayon::prelude::*;

/// Largest log2 of the side of a block.
const MOST_LOG: u32 = 3;
/// Top cells written by one task.
const RUN: usize = 64;

pub(super) struct Compressed {
    pub cells: Vec<u32>,
    /// Map entries, then references.
    pub words: Vec<u32>,
    pub first_reference: usize,
}

pub(super) fn compress(partition: &Partition) -> Compressed {
    let mut words = entries(&partition.map);
    let first_reference = words.len();
    let mut cells = Vec::with_capacity(4 * partition.cells.len());
    let references: u32 = partition.cells.iter().map(|c| c.count).sum();
    words.reserve_exact(references as usize);
    for cell in &partition.cells {
        let first = words.len() - first_reference;
        cells.extend(pack(
            cell,
            if cell.count == 0 { EMPTY } else { first as u32 },
        ));
        words.extend_from_slice(cell.list(&partition.pool));
        if let (Some(last), true) = (words.last_mut(), cell.count > 0) {
            *last |= LAST;
        }
    }
    Compressed {
        cells,
        words,
        first_reference,
    }
}

/// Words of a cell: six coordinates of 16 bits and the index of its list.
fn pack(cell: &GridCell, list: u32) -> [u32; 4] {
    let [x, y, z] = cell.min.map(u32::from);
    let [u, v, w] = cell.max.map(u32::from);
    [x | y << 16, z | u << 16, v | w << 16, list]
}

/// Entries with blocks of at most 2^[`MOST_LOG`] along an axis; a single cell is one entry.
fn entries(map: &Map) -> Vec<u32> {
    let tops = map.top_cells();
    let write_run = |words: &[u32]| {
        let mut writer = Writer {
            map,
            below: Vec::new(),
        };
        let top = words.iter().map(|&word| writer.entry(word)).collect();
        (top, writer.below)
    };
    let runs: Vec<(Vec<u32>, Vec<u32>)> =
        map.entries[..tops].par_chunks(RUN).map(write_run).collect();
    let below = runs.iter().map(|(_, below)| below.len()).sum::<usize>();
    let mut out = Vec::with_capacity(tops + below);
    let mut place = tops as u32;
    let moved = |word: &u32, place: u32| {
        let is_block = word & ((1 << LOG_BITS) - 1) != 0;
        word + if is_block { place << LOG_BITS } else { 0 }
    };
    for (top, below) in &runs {
        out.extend(top.iter().map(|word| moved(word, place)));
        place += below.len() as u32;
    }
    place = tops as u32;
    for (_, below) in &runs {
        out.extend(below.iter().map(|word| moved(word, place)));
        place += below.len() as u32;
    }
    out
}

struct Writer<'a> {
    map: &'a Map,
    below: Vec<u32>,
}

impl Writer<'_> {
    fn entry(&mut self, word: u32) -> u32 {
        match Map::decode(word) {
            Entry::GridCell(cell) => cell << LOG_BITS,
            Entry::Block(number) => {
                let block = self.map.blocks[number as usize];
                self.cube(block, [0; 3], block.log)
            }
        }
    }

    /// Entry of an aligned cube of 2^`log` entries of a block.
    fn cube(&mut self, block: Block, at: [u32; 3], log: u32) -> u32 {
        let index = |[x, y, z]: [u32; 3]| {
            (block.first + (((z << block.log) + y) << block.log) + x) as usize
        };
        let first = self.map.entries[index(at)];
        let side = 1u32 << log;
        let mut rows =
            (0..side).flat_map(|z| (0..side).map(move |y| [at[0], at[1] + y, at[2] + z]));
        let uniform = rows.all(|row| {
            let row = index(row);
            self.map.entries[row..row + side as usize]
                .iter()
                .all(|&word| word == first)
        });
        if log == 0 || (uniform && matches!(Map::decode(first), Entry::GridCell(_))) {
            return self.entry(first);
        }
        // As few levels as possible, with sides as equal as possible.
        let parts = log.div_ceil(log.div_ceil(MOST_LOG));
        let place = self.below.len();
        self.below.resize(place + (1 << (3 * parts)), 0);
        for child in 0..1u32 << (3 * parts) {
            let mask = (1 << parts) - 1;
            let offset = [child & mask, child >> parts & mask, child >> (2 * parts)];
            let from = std::array::from_fn(|a| at[a] + (offset[a] << (log - parts)));
            self.below[place + child as usize] = self.cube(block, from, log - parts);
        }
        (place as u32) << LOG_BITS | parts
    }
}

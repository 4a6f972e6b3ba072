//! First phase: top cells by Cleary's rule, each cut into a power of two of voxels by its own count
//! of triangles, with one cell per voxel; empty octants are one cell from the start.

use super::super::grid::lists::{Lists, PartLists, in_runs};
use super::super::grid::{COARSER, Cut, Grid, GridBox, areas, finest, most_words};
use super::super::{AccelError, TriangleSoup};
use super::voxels::{Block, Entry, GridCell, Map};
use super::{MOST_PLACES, Options, Partition};
use crate::BuildLog;
use rayon::prelude::*;

/// Most top cells along an axis, so that they can still be cut with 16-bit coordinates.
const MOST_TOP: u32 = 2048;
/// Largest log2 of a block's side.
const MOST_LOG: u32 = 6;
/// A voxel with at least this many triangles, and over 1/[`BUNCHED`] of its block's, is cut again.
const LEAST_BUNCH: usize = 32;
const BUNCHED: usize = 4;

/// Cuts the scene; phases `bounds`, `insert`, `sort` and `build`.
pub(super) fn cut(
    name: &str,
    soup: &TriangleSoup,
    settings: &Options,
    log: &mut BuildLog,
) -> Result<Partition, AccelError> {
    let grid_box = log.phase("bounds", || GridBox::new(soup));
    let top = grid_box.resolution(soup.records.len(), settings.lambda1, MOST_TOP);
    let shift = (65_535 / top[0].max(top[1]).max(top[2])).ilog2();
    let coarse = Grid::new(&grid_box, top);
    let fine = coarse.part([0; 3], top, top.map(|n| n << shift));
    let lists = Lists::new(name, &coarse, soup, true, log)?;
    let most = most_words(log).min(MOST_PLACES);
    log.phase("build", || {
        let tops = coarse.cells() as usize;
        let areas = areas(&coarse, soup);
        let voxels = |cell: usize| {
            let ids = lists.of(cell).iter();
            let areas = ids.map(|&id| areas[id as usize]);
            1u64 << (3 * parts_log(&fine, settings, shift, areas))
        };
        let needed: u64 = (0..tops).into_par_iter().map(voxels).sum();
        AccelError::check_limit(format!("voxels of an {name}"), needed, most, COARSER)?;
        let cut_run = |cells: std::ops::Range<usize>| {
            let mut run = Run {
                fine: &fine,
                soup,
                areas: &areas,
                settings,
                made: Pieces::default(),
                spare: Vec::new(),
            };
            for cell in cells {
                let lowest = coarse.coordinates(cell as u32).map(|c| c << shift);
                let entry = run.entry(lowest, shift, lists.of(cell), 2);
                run.made.top.push(entry);
            }
            run.made
        };
        Ok(join(fine, top, shift, in_runs(tops, cut_run)))
    })
}

/// log2 of the parts per axis for a cube of 2^`size` voxels that lists triangles of these areas.
fn parts_log(
    fine: &Grid,
    settings: &Options,
    size: u32,
    areas: impl ExactSizeIterator<Item = f32> + Clone,
) -> u32 {
    if areas.len() == 0 {
        return 0;
    }
    let side = fine.cell.map(|c| f64::from(c) * f64::from(1u32 << size));
    let Cut { wanted, share } = Cut::new(side, areas, settings.lambda2);
    let most = wanted.iter().copied().fold(1.0, f64::max);
    let by_copies = if share < 1.0 {
        (most * share).max(1.0).log2() as u32
    } else {
        MOST_LOG
    };
    // Parts are cubes of voxels: the least divisible axis decides, but a flat cell may be cut.
    let longest = side.iter().copied().fold(0.0, f64::max);
    let finest = (0..3)
        .map(|a| finest(side[a].max(longest / 16.0), fine.margin[a]))
        .fold(f64::INFINITY, f64::min);
    let ceiling = most.log2().ceil() as u32;
    ceiling
        .min(by_copies)
        .min(finest.log2() as u32)
        .min(size)
        .min(MOST_LOG)
}

/// Output of a task; indices are relative to its own start.
#[derive(Default)]
struct Pieces {
    top: Vec<u32>,
    entries: Vec<u32>,
    blocks: Vec<Block>,
    cells: Vec<GridCell>,
    pool: Vec<u32>,
}

/// Joins the output of the tasks, in order.
fn join(fine: Grid, top: [u32; 3], shift: u32, runs: Vec<Pieces>) -> Partition {
    let tops = runs.iter().map(|run| run.top.len()).sum::<usize>();
    let total = |length: fn(&Pieces) -> usize| runs.iter().map(length).sum::<usize>();
    let mut entries = Vec::with_capacity(tops + total(|run| run.entries.len()));
    let mut blocks = Vec::with_capacity(total(|run| run.blocks.len()));
    let mut cells: Vec<GridCell> = Vec::with_capacity(total(|run| run.cells.len()));
    let mut pool = Vec::with_capacity(total(|run| run.pool.len()));
    let moved = |word: &u32, cells: usize, blocks: usize| match Map::decode(*word) {
        Entry::GridCell(_) => word + cells as u32,
        Entry::Block(_) => word + blocks as u32,
    };
    let (mut cells_before, mut blocks_before) = (0, 0);
    for run in &runs {
        entries.extend(
            run.top
                .iter()
                .map(|w| moved(w, cells_before, blocks_before)),
        );
        cells_before += run.cells.len();
        blocks_before += run.blocks.len();
    }
    for run in runs {
        let (cells_before, blocks_before) = (cells.len(), blocks.len());
        let place = entries.len() as u32;
        entries.extend(
            run.entries
                .iter()
                .map(|w| moved(w, cells_before, blocks_before)),
        );
        blocks.extend(run.blocks.iter().map(|b| Block {
            first: b.first + place,
            ..*b
        }));
        let begin = pool.len() as u32;
        cells.extend(run.cells.iter().map(|c| GridCell {
            first: c.first + begin,
            ..*c
        }));
        pool.extend_from_slice(&run.pool);
    }
    let map = Map {
        top,
        shift,
        entries,
        blocks,
    };
    Partition {
        fine,
        map,
        cells,
        pool,
    }
}

struct Run<'a> {
    fine: &'a Grid,
    soup: &'a TriangleSoup,
    areas: &'a [f32],
    settings: &'a Options,
    made: Pieces,
    /// Memory for lists, one per active level.
    spare: Vec<PartLists>,
}

struct Open<'a> {
    block: Block,
    lists: &'a Lists,
    lowest: [u32; 3],
    /// log2 of the voxels along a side of one of its entries.
    size: u32,
    /// Triangles in the whole block.
    count: usize,
    level: u32,
}

impl Run<'_> {
    /// Word of the entry of a cube of 2^`size` voxels, including everything below it.
    fn entry(&mut self, lowest: [u32; 3], size: u32, ids: &[u32], level: u32) -> u32 {
        let areas = ids.iter().map(|&id| self.areas[id as usize]);
        let log = parts_log(self.fine, self.settings, size, areas);
        if log == 0 {
            return self.cell(lowest, size, ids);
        }
        let mut lists = self.spare.pop().unwrap_or_default();
        let part = self.fine.part(lowest, [1 << size; 3], [1 << log; 3]);
        lists.fill(&part, self.soup, ids);
        let block = Block {
            first: self.made.entries.len() as u32,
            log,
        };
        let number = self.made.blocks.len() as u32;
        self.made.blocks.push(block);
        let end = self.made.entries.len() + (1 << (3 * log));
        self.made.entries.resize(end, 0);
        let open = Open {
            block,
            lists: &lists.lists,
            lowest,
            size: size - log,
            count: ids.len(),
            level,
        };
        self.fill(&open, [0; 3], log);
        self.spare.push(lists);
        Map::encode(Entry::Block(number))
    }

    fn cell(&mut self, lowest: [u32; 3], size: u32, ids: &[u32]) -> u32 {
        let number = self.made.cells.len() as u32;
        self.made.cells.push(GridCell {
            min: lowest.map(|v| v as u16),
            max: lowest.map(|v| (v + (1 << size)) as u16),
            first: self.made.pool.len() as u32,
            count: ids.len() as u32,
        });
        self.made.pool.extend_from_slice(ids);
        Map::encode(Entry::GridCell(number))
    }

    /// Fills the entries of an aligned cube of 2^`log` parts of a block.
    fn fill(&mut self, open: &Open, at: [u32; 3], log: u32) {
        let Open { block, lists, .. } = open;
        let side = 1u32 << log;
        let row = |y: u32, z: u32| ((((at[2] + z) << block.log) + at[1] + y) << block.log) + at[0];
        let is_empty = |first: u32| {
            let [first, end] = [first as usize, (first + side) as usize];
            lists.starts[first] == lists.starts[end]
        };
        let rows = || (0..side).flat_map(|z| (0..side).map(move |y| (y, z)));
        let lowest = std::array::from_fn(|a| open.lowest[a] + (at[a] << open.size));
        if rows().all(|(y, z)| is_empty(row(y, z))) {
            let word = self.cell(lowest, open.size + log, &[]);
            for (y, z) in rows() {
                let first = (block.first + row(y, z)) as usize;
                self.made.entries[first..first + side as usize].fill(word);
            }
        } else if log > 0 {
            for octant in 0..8 {
                let part = std::array::from_fn(|a| at[a] + ((octant >> a & 1) << (log - 1)));
                self.fill(open, part, log - 1);
            }
        } else {
            let index = row(0, 0);
            let ids = lists.of(index as usize);
            let bunched = ids.len() >= LEAST_BUNCH && ids.len() * BUNCHED > open.count;
            let word = if bunched && open.level < self.settings.levels {
                self.entry(lowest, open.size, ids, open.level + 1)
            } else {
                self.cell(lowest, open.size, ids)
            };
            self.made.entries[(block.first + index) as usize] = word;
        }
    }
}

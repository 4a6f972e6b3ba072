//! The triangles of each cell: a two-step counting sort on all cores. The result does not depend on
//! the number of cores or the division of the work.
//!
//! Triangles are inserted in runs; each run distributes its (cell, triangle) pairs over buckets,
//! which are equal ranges of cells. Each bucket is then counting-sorted in memory that fits a
//! cache.

use super::super::{AccelError, TriangleSoup, triangle::TriangleRecord};
use super::raster::Raster;
use super::{Grid, check_words, most_words};
use crate::BuildLog;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of buckets; more would spill the write buffers, fewer the counters.
const BUCKETS: u32 = 64;
/// References are counted up to this multiple of the limit.
const ENOUGH: u64 = 16;
/// References after which a run reports its count to the others.
const REPORT: u64 = 1 << 16;
const LEAST_RUN: usize = 2048;
/// Cells that one task cuts.
const RUN: usize = 64;

/// Cell `c` lists `references[starts[c]..starts[c + 1]]`, triangles ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lists {
    /// Start of each cell, and the end of the last.
    pub starts: Vec<u32>,
    pub references: Vec<u32>,
}

/// Pairs of one run, by bucket.
type Pairs = Vec<Vec<(u32, u32)>>;

impl Lists {
    /// Lists all triangles of a scene; `exact` as in [`Raster::rows`]. Phases `insert` and `sort`.
    ///
    /// # Errors
    /// More cells or references than [`most_words`].
    pub(crate) fn new(
        name: &str,
        grid: &Grid,
        soup: &TriangleSoup,
        exact: bool,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        check_words(&format!("cells of a {name}"), grid.cells(), log)?;
        let most = most_words(log);
        let shift = bucket_shift(grid.cells() as u32);
        let (runs, needed) = log.phase("insert", || {
            insert(grid, &soup.records, exact, (shift, most))
        });
        let more = if needed > ENOUGH * most {
            "counted so far"
        } else {
            "in all"
        };
        check_words(&format!("references of a {name}, {more}"), needed, log)?;
        Ok(log.phase("sort", || sort(grid.cells() as usize, shift, &runs)))
    }

    pub(crate) fn of(&self, cell: usize) -> &[u32] {
        &self.references[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

/// Cells of a bucket, as a power of two, for at most [`BUCKETS`] buckets.
fn bucket_shift(cells: u32) -> u32 {
    let bits = 32 - (cells - 1).leading_zeros();
    bits.saturating_sub(BUCKETS.ilog2())
}

/// Pairs of every run in triangle order, and their number. Beyond `most` they are only counted, and
/// beyond [`ENOUGH`] times that not even counted.
fn insert(
    grid: &Grid,
    records: &[TriangleRecord],
    exact: bool,
    (shift, most): (u32, u64),
) -> (Vec<Pairs>, u64) {
    let total = AtomicU64::new(0);
    let runs = 4 * rayon::current_num_threads();
    let run_length = records.len().div_ceil(runs).max(LEAST_RUN);
    let buckets = ((grid.cells() as u32 - 1) >> shift) as usize + 1;
    let insert_run = |run: &[TriangleRecord]| {
        let room = 2 * run.len() / buckets;
        let mut pairs: Pairs = (0..buckets).map(|_| Vec::with_capacity(room)).collect();
        let mut raster = Raster::default();
        let (mut so_far, mut count) = (0, 0);
        for triangle in run {
            raster.rows(grid, triangle, exact, |first, cells| {
                count += u64::from(cells);
                if so_far <= most {
                    for cell in first..first + cells {
                        pairs[(cell >> shift) as usize].push((cell, triangle.id));
                    }
                }
            });
            if count >= REPORT {
                so_far = total.fetch_add(count, Ordering::Relaxed) + count;
                count = 0;
            }
            if so_far > ENOUGH * most {
                break;
            }
        }
        total.fetch_add(count, Ordering::Relaxed);
        pairs
    };
    let runs = records.par_chunks(run_length).map(insert_run).collect();
    (runs, total.into_inner())
}

fn sort(cells: usize, shift: u32, runs: &[Pairs]) -> Lists {
    let buckets = ((cells - 1) >> shift) + 1;
    let size = |bucket: usize| runs.iter().map(|run| run[bucket].len()).sum::<usize>();
    let sizes: Vec<usize> = (0..buckets).map(size).collect();
    let mut starts = vec![0u32; cells + 1];
    let mut references = vec![0u32; sizes.iter().sum()];
    starts[cells] = references.len() as u32;

    let mut work = Vec::with_capacity(buckets);
    let (mut rest_starts, mut rest) = (&mut starts[..cells], &mut references[..]);
    let mut begin = 0u32;
    for (bucket, &size) in sizes.iter().enumerate() {
        let here = rest_starts.len().min(1 << shift);
        let (own_starts, later_starts) = rest_starts.split_at_mut(here);
        let (own, later) = rest.split_at_mut(size);
        work.push((bucket, begin, own_starts, own));
        (rest_starts, rest) = (later_starts, later);
        begin += size as u32;
    }
    work.into_par_iter()
        .for_each(|(bucket, begin, starts, references)| {
            let pairs = || runs.iter().flat_map(|run| run[bucket].iter().copied());
            sort_bucket((bucket << shift) as u32, begin, pairs, starts, references);
        });
    Lists { starts, references }
}

/// Counting sort of one bucket's pairs, with its first cell and first reference index.
fn sort_bucket<I: Iterator<Item = (u32, u32)>>(
    first_cell: u32,
    begin: u32,
    pairs: impl Fn() -> I,
    starts: &mut [u32],
    references: &mut [u32],
) {
    pairs().for_each(|(cell, _)| starts[(cell - first_cell) as usize] += 1);
    let mut sum = 0;
    for start in starts.iter_mut() {
        sum += *start;
        *start = sum - *start;
    }
    // Filling moves each start to its end, the start of the next cell.
    pairs().for_each(|(cell, triangle)| {
        let slot = &mut starts[(cell - first_cell) as usize];
        references[*slot as usize] = triangle;
        *slot += 1;
    });
    let mut previous = 0;
    for start in starts.iter_mut() {
        (*start, previous) = (begin + previous, *start);
    }
}

/// Lists of one part of a grid from a few triangles, on one thread; reuses memory.
#[derive(Debug, Default)]
pub(crate) struct PartLists {
    raster: Raster,
    pairs: Vec<(u32, u32)>,
    /// Result of the last fill.
    pub lists: Lists,
}

impl PartLists {
    /// Lists `ids`, which must ascend, in the cells of `grid`.
    pub(crate) fn fill(&mut self, grid: &Grid, soup: &TriangleSoup, ids: &[u32]) {
        let Self { raster, pairs, .. } = self;
        let Lists { starts, references } = &mut self.lists;
        pairs.clear();
        for &id in ids {
            raster.rows(grid, &soup.records[id as usize], true, |first, cells| {
                pairs.extend((first..first + cells).map(|cell| (cell, id)));
            });
        }
        let cells = grid.cells() as usize;
        starts.clear();
        starts.resize(cells + 1, 0);
        references.clear();
        references.resize(pairs.len(), 0);
        starts[cells] = pairs.len() as u32;
        let (starts, pairs) = (&mut starts[..cells], || pairs.iter().copied());
        sort_bucket(0, 0, pairs, starts, references);
    }
}

/// Results of tasks over runs of cells, in order; independent of the number of threads.
pub(crate) fn in_runs<T: Send>(cells: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let runs = (0..cells.div_ceil(RUN)).into_par_iter();
    let of_run = |run: usize| run * RUN..((run + 1) * RUN).min(cells);
    runs.map(|run| work(of_run(run))).collect()
}

/// Checks that lists are contiguous and hold all references.
///
/// # Errors
/// The first violation.
pub(crate) fn check_starts(
    starts: impl ExactSizeIterator<Item = usize>,
    cells: usize,
    references: usize,
) -> Result<(), AccelError> {
    ensure!(starts.len() == cells + 1, "the cells are not all of them");
    let mut end = 0;
    for (cell, start) in starts.enumerate() {
        ensure!(
            start >= end,
            "cell {cell}: the list before it runs backwards"
        );
        end = start;
    }
    ensure!(end == references, "the cells do not cover the references");
    Ok(())
}

/// Checks the invariant of every grid: each triangle of the scene lies in the grid, and the cells
/// at its corners and its centroid list it. `is_listed` returns true if the cell of a position
/// lists a triangle.
///
/// # Errors
/// The first triangle that violates it, or a reference to a missing triangle.
pub(crate) fn check_lists(
    grid: &Grid,
    soup: &TriangleSoup,
    references: impl Iterator<Item = u32>,
    is_listed: impl Fn([f32; 3], u32) -> bool,
) -> Result<(), AccelError> {
    for id in references {
        let exists = (id as usize) < soup.records.len();
        ensure!(exists, "triangle {id} is listed and does not exist");
    }
    for record in &soup.records {
        let id = record.id;
        let inside = grid.bounds.contains(&record.bounds());
        ensure!(inside, "triangle {id} lies outside the grid");
        let [a, b, c] = record.vertices();
        let centroid = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0);
        for position in [a, b, c, centroid] {
            ensure!(
                is_listed(position, id),
                "triangle {id} is not listed in the cell of {position:?}"
            );
        }
    }
    Ok(())
}

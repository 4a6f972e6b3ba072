//! Chebyshev distance of every cell to the nearest occupied one, in O(cells).
//!
//! Source: A. Meijster, J. Roerdink, W. Hesselink, "A general algorithm for computing distance
//! transforms in linear time", 2000, with the chessboard metric: one pass of two sweeps along x,
//! and one lower envelope per line along y, then along z.

use rayon::prelude::*;

/// Maximum distance; distances are stored in the upper bits of a cell's word.
pub(crate) const FARTHEST: u8 = 127;

/// For cells in the order of [`super::Grid::index`], the number of steps, including diagonal ones,
/// to the nearest cell for which `occupied` holds; 0 there, at most [`FARTHEST`].
pub(crate) fn chebyshev(
    [nx, ny, nz]: [u32; 3],
    occupied: impl Fn(usize) -> bool + Sync,
) -> Vec<u8> {
    let [nx, ny, nz] = [nx as usize, ny as usize, nz as usize];
    let mut field = vec![0u8; nx * ny * nz];
    field.par_chunks_mut(nx * ny).enumerate().for_each_init(
        Envelope::default,
        |envelope, (z, slice)| {
            for (y, line) in slice.chunks_mut(nx).enumerate() {
                let first = (z * ny + y) * nx;
                for (x, distance) in line.iter_mut().enumerate() {
                    *distance = if occupied(first + x) { 0 } else { FARTHEST };
                }
                sweep(line);
            }
            for x in 0..nx {
                envelope.line(ny, |y| slice[y * nx + x]);
                (0..ny).for_each(|y| slice[y * nx + x] = envelope.result[y]);
            }
        },
    );
    if nz == 1 {
        return field;
    }
    // Lines along z are gathered layer by layer, so that memory is read in order.
    let layers: Vec<Vec<u8>> = (0..ny)
        .into_par_iter()
        .map_init(Envelope::default, |envelope, y| {
            let mut layer = vec![0; nx * nz];
            for x in 0..nx {
                envelope.line(nz, |z| field[(z * ny + y) * nx + x]);
                (0..nz).for_each(|z| layer[z * nx + x] = envelope.result[z]);
            }
            layer
        })
        .collect();
    field
        .par_chunks_mut(nx * ny)
        .enumerate()
        .for_each(|(z, slice)| {
            for (line, layer) in slice.chunks_mut(nx).zip(&layers) {
                line.copy_from_slice(&layer[z * nx..(z + 1) * nx]);
            }
        });
    field
}

/// Distances along one line, forwards and backwards.
fn sweep(line: &mut [u8]) {
    let step = |near: u8, distance: &mut u8| {
        *distance = (*distance).min((near + 1).min(FARTHEST));
        *distance
    };
    line.iter_mut().fold(FARTHEST, step);
    line.iter_mut().rev().fold(FARTHEST, step);
}

/// The lower envelope of the functions max(|i − k|, g(k)) over a line; reuses memory between lines.
#[derive(Default)]
struct Envelope {
    given: Vec<u8>,
    /// Sites k of the envelope, and the start of each.
    parts: Vec<(i32, i32)>,
    result: Vec<u8>,
}

impl Envelope {
    fn line(&mut self, length: usize, given: impl Fn(usize) -> u8) {
        self.given.clear();
        self.given.extend((0..length).map(given));
        self.result.clear();
        self.result.extend_from_slice(&self.given);
        if self.given.iter().all(|&g| g == self.given[0]) {
            return;
        }
        let g = |k: i32| i32::from(self.given[k as usize]);
        let value = |i: i32, k: i32| (i - k).abs().max(g(k));
        // The index from which site u lies below site k < u.
        let separation = |k: i32, u: i32| {
            if g(k) <= g(u) {
                (k + g(u)).max((k + u) / 2)
            } else {
                (u - g(k)).min((k + u) / 2)
            }
        };
        self.parts.clear();
        self.parts.push((0, 0));
        for u in 1..length as i32 {
            while let Some(&(k, begin)) = self.parts.last() {
                if value(begin, k) <= value(begin, u) {
                    break;
                }
                self.parts.pop();
            }
            let begin = self.parts.last().map_or(0, |&(k, _)| separation(k, u) + 1);
            if begin < length as i32 {
                self.parts.push((u, begin));
            }
        }
        for i in (0..length as i32).rev() {
            if let Some(&(k, begin)) = self.parts.last() {
                self.result[i as usize] = value(i, k) as u8;
                if i == begin {
                    self.parts.pop();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    fn brute_force(size: [i32; 3], occupied: &[bool]) -> Vec<u8> {
        let cells: Vec<[i32; 3]> = (0..size[2])
            .flat_map(|z| (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y, z])))
            .collect();
        let sites: Vec<_> = (0..cells.len()).filter(|&c| occupied[c]).collect();
        let apart = |a: [i32; 3], b: [i32; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).max();
        cells
            .iter()
            .map(|&c| {
                let nearest = sites.iter().filter_map(|&s| apart(c, cells[s])).min();
                nearest.map_or(FARTHEST, |d| d.min(i32::from(FARTHEST)) as u8)
            })
            .collect()
    }

    #[test]
    fn distances_equal_brute_force_and_a_forgotten_cell_is_seen() {
        let mut generator = Pcg32::new(1);
        let mut random = |n: u32| generator.below(n as usize) as u32;
        let mut sensitive = 0;
        for case in 0..300 {
            let size = [1 + random(9), 1 + random(9), 1 + random(9)];
            let cells = size.iter().product::<u32>();
            let sparse = [2, 8, 40, 400][case % 4];
            let mut occupied: Vec<bool> = (0..cells).map(|_| random(sparse) == 0).collect();
            let expected = brute_force(size.map(|s| s as i32), &occupied);
            assert_eq!(chebyshev(size, |c| occupied[c]), expected, "{size:?}");
            if let Some(site) = occupied.iter().position(|&o| o) {
                occupied[site] = false;
                sensitive += usize::from(chebyshev(size, |c| occupied[c]) != expected);
            }
        }
        assert!(sensitive > 150, "{sensitive} cases notice a forgotten cell");
    }

    #[test]
    fn distances_are_cut_off_and_an_empty_grid_is_far_everywhere() {
        let long = chebyshev([300, 1, 1], |c| c == 0);
        assert_eq!((long[126], long[127], long[299]), (126, 127, 127));
        let long = chebyshev([1, 1, 300], |c| c == 299);
        assert_eq!((long[298], long[150], long[0]), (1, 127, 127));
        assert!(
            chebyshev([3, 4, 5], |_| false)
                .iter()
                .all(|&d| d == FARTHEST)
        );
    }
}

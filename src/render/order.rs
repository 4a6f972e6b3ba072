//! The order in which the pixels of a sample are rendered, so that something can be shown before
//! all of them are done.
//!
//! A. Dufay (thesis, Bordeaux 2017, section 2.2.4) renders one pixel of every 16 × 16 tile at a
//! time, the corners of coarse squares before those of finer ones (Fig. 2.13), and fills the gaps
//! for display from the corner of the finest square that has a sample (Alg. 2.1). He compares that
//! with one pass and with sixteen (Table 2.2).

use raystone_core::parameters;
use raystone_core::params::Choice as _;
use raystone_image::Image;

parameters! {
    /// The assignment of an image's pixels to passes.
    pub enum Order {
        /// All at once.
        OnePass = "one-pass",
        /// Sixteen blocks, four by four.
        Blocks = "blocks",
        /// One pixel of each 16 × 16 tile at a time, coarse squares first: 256 passes.
        QuadTree = "quad-tree",
    }
}

/// Edge of a tile of [`Order::QuadTree`], pixels.
pub(crate) const TILE: u32 = 16;
const BLOCKS: u32 = 4;

/// Pixels of one pass: `count` in each direction, starting at `first` and `step` apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Column and row of the first.
    pub first: [u32; 2],
    /// Number in each direction.
    pub count: [u32; 2],
    /// Spacing, pixels.
    pub step: u32,
}

impl Part {
    /// Its pixels, column and row.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> {
        let Self { first, count, step } = *self;
        let row = move |j| (0..count[0]).map(move |i| [first[0] + step * i, first[1] + step * j]);
        (0..count[1]).flat_map(row)
    }
}

/// The position of the `number`-th of 256 passes in a tile: its base-4 digits, reversed, are a
/// Morton number, so passes 1, 4, 16, 64 complete the pixels at multiples of 16, 8, 4, 2.
pub(crate) fn quad_tree_place(number: u32) -> [u32; 2] {
    let digit = |at: u32| number >> (2 * at) & 3;
    let bit = |axis: u32| (0..4).map(|at| (digit(at) >> axis & 1) << (3 - at)).sum();
    [bit(0), bit(1)]
}

impl Order {
    /// The non-empty passes of a sample of an image of this size; each pixel is in one of them.
    pub fn parts(self, size: [u32; 2]) -> Vec<Part> {
        let parts: Vec<Part> = match self {
            Self::OnePass => vec![Part {
                first: [0, 0],
                count: size,
                step: 1,
            }],
            Self::Blocks => {
                let border = |axis: usize, k: u32| {
                    (u64::from(k) * u64::from(size[axis]) / u64::from(BLOCKS)) as u32
                };
                let block = |number: u32| {
                    let at = [number % BLOCKS, number / BLOCKS];
                    let first = [0, 1].map(|axis| border(axis, at[axis]));
                    Part {
                        first,
                        count: [0, 1].map(|axis| border(axis, at[axis] + 1) - first[axis]),
                        step: 1,
                    }
                };
                (0..BLOCKS * BLOCKS).map(block).collect()
            }
            Self::QuadTree => {
                let part = |number: u32| {
                    let first = quad_tree_place(number);
                    let count = |axis: usize| size[axis].saturating_sub(first[axis]).div_ceil(TILE);
                    Part {
                        first,
                        count: [count(0), count(1)],
                        step: TILE,
                    }
                };
                (0..TILE * TILE).map(part).collect()
            }
        };
        let has_pixels = |part: &Part| part.count.iter().all(|count| *count > 0);
        parts.into_iter().filter(has_pixels).collect()
    }

    /// Passes after which [`splat`] finds a colour for every pixel.
    pub(crate) fn passes_to_first_picture(self, size: [u32; 2]) -> usize {
        let mut sums = vec![[0.0; 4]; size[0] as usize * size[1] as usize];
        let parts = self.parts(size);
        let complete = parts.iter().position(|part| {
            for [x, y] in part.pixels() {
                sums[(y * size[0] + x) as usize] = [1.0; 4];
            }
            splat(&sums, size).is_some()
        });
        complete.map_or(parts.len(), |place| place + 1)
    }

    /// What is wrong with sums that are said to be the first with a colour for every pixel: they are those of one sample and
    /// whole passes, and without the last of these a pixel has none.
    pub fn fault_of_first(self, sums: &[[f32; 4]], size: [u32; 2]) -> Option<String> {
        let taken = sums.iter().filter(|[.., taken]| *taken == 1.0).count();
        let others = sums.iter().filter(|[.., taken]| *taken > 1.0).count();
        let (mut pixels, mut passes) = (0, 0);
        let mut before = sums.to_vec();
        for part in self.parts(size) {
            if pixels >= taken {
                break;
            }
            passes += 1;
            pixels += part.count.iter().product::<u32>() as usize;
            if pixels >= taken {
                for [x, y] in part.pixels() {
                    before[(y * size[0] + x) as usize] = [0.0; 4];
                }
            }
        }
        let is_first = pixels == taken && others == 0 && splat(sums, size).is_some();
        let is_right = is_first && splat(&before, size).is_none();
        (!is_right).then(|| {
            format!(
                "the first picture of the order {} has {taken} pixels after {passes} passes of a sample: it is not the first \
                 without a gap",
                self.name()
            )
        })
    }
}

/// The image of partial sums (radiance, and number of samples). A pixel without samples gets the mean of the first
/// sampled corner of the squares of 2, 4, 8, 16 pixels around it (Dufay 2017, Alg. 2.1: four iterations by its
/// comment, five in his code). `None` while a pixel finds none.
///
/// # Panics
/// The number of sums is not the number of pixels.
pub fn splat(sums: &[[f32; 4]], [width, height]: [u32; 2]) -> Option<Image> {
    assert_eq!(sums.len(), width as usize * height as usize);
    let colour = |x: u32, y: u32| {
        (0..=TILE.ilog2()).map(|level| 1 << level).find_map(|f| {
            let [r, g, b, taken] = sums[(y / f * f * width + x / f * f) as usize];
            let mean = |sum: f32| (f64::from(sum) / f64::from(taken)) as f32;
            (taken >= 1.0).then(|| [r, g, b].map(mean))
        })
    };
    let all = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let pixels = all.map(|[x, y]| colour(x, y));
    Some(Image {
        width,
        height,
        pixels: pixels.collect::<Option<_>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// True if these parts contain every pixel once.
    fn is_bijection(parts: &[Part], size: [u32; 2]) -> bool {
        let pixels: Vec<_> = parts.iter().flat_map(Part::pixels).collect();
        let distinct: BTreeSet<_> = pixels.iter().copied().collect();
        let inside = distinct.iter().all(|[x, y]| *x < size[0] && *y < size[1]);
        pixels.len() == distinct.len() && inside && distinct.len() as u32 == size[0] * size[1]
    }

    #[test]
    fn each_pixel_stands_in_one_part_whatever_the_size() {
        for size in [[64, 48], [17, 33], [1, 1], [3, 16], [250, 130], [16, 16]] {
            for order in [Order::OnePass, Order::Blocks, Order::QuadTree] {
                let parts = order.parts(size);
                assert!(is_bijection(&parts, size), "{order:?} of {size:?}");
                // Faults: a missing part, a repeated one, one moved by a pixel.
                let without: Vec<_> = parts[1..].to_vec();
                let twice = [&parts[..], &parts[..1]].concat();
                let mut moved = parts.clone();
                moved[0].first[0] += 1;
                for faulty in [without, twice, moved] {
                    assert!(!is_bijection(&faulty, size), "{order:?} of {size:?}");
                }
            }
        }
        assert_eq!(Order::QuadTree.parts([64, 64]).len(), 256);
        assert_eq!(Order::Blocks.parts([64, 64]).len(), 16);
    }

    #[test]
    fn the_quad_tree_takes_coarse_squares_before_fine_ones() {
        let first: Vec<_> = (0..8).map(quad_tree_place).collect();
        let expected = [
            [0, 0],
            [8, 0],
            [0, 8],
            [8, 8],
            [4, 0],
            [12, 0],
            [4, 8],
            [12, 8],
        ];
        assert_eq!(first, expected);
        for (passes, step) in [(1, 16), (4, 8), (16, 4), (64, 2), (256, 1)] {
            let done: BTreeSet<_> = (0..passes).map(quad_tree_place).collect();
            let grid = (0..16)
                .step_by(step)
                .flat_map(|x| (0..16).step_by(step).map(move |y| [x, y]));
            assert!(done.into_iter().eq(grid), "{passes}");
        }
    }

    #[test]
    fn a_splat_is_complete_after_one_pass_of_the_quad_tree_and_after_all_blocks() {
        let size = [40, 37];
        let complete_after = |order: Order| {
            let mut sums = vec![[0.0; 4]; 40 * 37];
            let parts = order.parts(size);
            let all = parts.len();
            for (done, part) in (1..).zip(parts) {
                for [x, y] in part.pixels() {
                    sums[(y * 40 + x) as usize] = [x as f32, y as f32, 2.0, 1.0];
                }
                if let Some(image) = splat(&sums, size) {
                    let at = |x: usize, y: usize| image.pixels[y * 40 + x];
                    assert_eq!(at(0, 0), [0.0, 0.0, 2.0]);
                    if done == 1 && all > 1 {
                        assert_eq!(at(39, 36), [32.0, 32.0, 2.0]);
                        assert_eq!(at(15, 17), [0.0, 16.0, 2.0]);
                    }
                    return done;
                }
            }
            0
        };
        for (order, passes) in [
            (Order::OnePass, 1),
            (Order::Blocks, 16),
            (Order::QuadTree, 1),
        ] {
            assert_eq!(complete_after(order), passes);
            assert_eq!(order.passes_to_first_picture(size), passes);
        }
        let sums = |order: Order, passes: usize, taken: f32| {
            let mut sums = vec![[0.0; 4]; 40 * 37];
            let pixels = order.parts(size).into_iter().take(passes);
            let pixels: Vec<_> = pixels
                .flat_map(|part| part.pixels().collect::<Vec<_>>())
                .collect();
            for [x, y] in pixels {
                sums[(y * 40 + x) as usize][3] = taken;
            }
            sums
        };
        for (order, passes) in [
            (Order::OnePass, 1),
            (Order::Blocks, 16),
            (Order::QuadTree, 1),
        ] {
            let fault = |passes, taken| order.fault_of_first(&sums(order, passes, taken), size);
            assert_eq!(fault(passes, 1.0), None, "{order:?}");
            assert!(fault(passes, 2.0).is_some() && fault(passes - 1, 1.0).is_some());
        }
        assert!(
            Order::QuadTree
                .fault_of_first(&sums(Order::QuadTree, 2, 1.0), size)
                .is_some()
        );
        // Two samples of a pixel are averaged.
        let sums = [[2.0, 4.0, 6.0, 2.0]];
        assert_eq!(
            splat(&sums, [1, 1]).map(|i| i.pixels),
            Some(vec![[1.0, 2.0, 3.0]])
        );
        assert_eq!(splat(&[[0.0; 4]], [1, 1]), None);
    }
}

//! The paths that the check of images looks at.

use raystone_core::geometry::Camera;
use raystone_core::random::Pcg32;
use std::collections::BTreeSet;

/// Edge of the blocks of pixels where faults of dispatches begin: workgroups are this large, and
/// slices of an image are multiples of it high.
const BLOCK: u32 = 8;
/// Random pixels of the last row, of the last column, at borders of blocks, and anywhere.
const OF_EACH: u32 = 24;

/// Which pixels of an image are checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// One in so many, others for each sample.
    Every(u32),
    /// Those where dispatches go wrong: corners, the last row and column, borders of workgroups,
    /// numbers next to powers of two, one of each eight rows (and so of each slice), and random
    /// ones, others for each sample.
    Borders,
}

/// The paths to check.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Which of its pixels.
    pub choice: Choice,
    /// Sample indices.
    pub samples: Vec<u32>,
    /// Seed of the replicate.
    pub seed: u32,
}

/// An image of which paths are checked.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Which of its pixels.
    pub choice: Choice,
    /// Number of sample indices, spread over all.
    pub samples: u32,
    /// Sums of the samples below this one are compared with single samples; 0 for none.
    pub summed: u32,
    /// Part of the scene's field of view: at the borders of a small part there is something to see.
    pub view: f32,
}

impl Frame {
    /// More pixels than sixteen bits can number: about 500 paths.
    pub const LARGE: Self = Self {
        size: [267, 251],
        choice: Choice::Borders,
        samples: 2,
        summed: 0,
        view: 0.5,
    };
    /// As many paths as [`Self::SLOTS`], and one more.
    pub const FULL: [Self; 2] = [Self::full([32, 32]), Self::full([41, 25])];
    /// Slots of queues that [`Self::FULL`] fills: the fewest that a wavefront may have.
    pub const SLOTS: u32 = 1024;

    const fn full(size: [u32; 2]) -> Self {
        Self {
            size,
            choice: Choice::Every(8),
            samples: 1,
            summed: 4,
            view: 0.5,
        }
    }

    /// The camera that sees its part of the view of this one.
    pub fn camera(&self, camera: Camera) -> Camera {
        Camera {
            vertical_fov_degrees: self.view * camera.vertical_fov_degrees,
            ..camera
        }
    }

    /// Its paths among `spp` samples: of the last alone, or with the first among several.
    pub fn pixels(&self, spp: u32, seed: u32) -> Pixels {
        let last = u64::from(spp.max(1) - 1);
        let steps = u64::from(self.samples.max(1) - 1);
        let at = |step: u64| (step * last).checked_div(steps).unwrap_or(last) as u32;
        let mut samples: Vec<u32> = (0..=steps).map(at).collect();
        samples.dedup();
        Pixels {
            size: self.size,
            choice: self.choice,
            samples,
            seed,
        }
    }
}

impl Pixels {
    /// Numbers, row by row, of the pixels checked in the sample in this place of the list, ascending.
    pub fn chosen(&self, turn: u32) -> Vec<u32> {
        let all = 0..self.size[0] * self.size[1];
        match self.choice {
            Choice::Every(every) => all
                .filter(|number| (number + turn).is_multiple_of(every.max(1)))
                .collect(),
            Choice::Borders => borders(self.size, Pcg32::new(u64::from(turn))),
        }
    }
}

fn borders([width, height]: [u32; 2], mut random: Pcg32) -> Vec<u32> {
    let mut below = |most: u32| random.below(most.max(1) as usize) as u32;
    let [right, bottom] = [width - 1, height - 1];
    let mut at: Vec<[u32; 2]> = vec![[0, 0], [right, 0], [0, bottom], [right, bottom]];
    for _ in 0..OF_EACH {
        at.push([below(width), bottom]);
        at.push([right, below(height)]);
        // The first or the last pixel of a block, along both axes.
        let side = |number: u32| number / BLOCK * BLOCK + number % 2 * (BLOCK - 1);
        at.push([below(width), below(height)].map(side));
        at.push([below(width), below(height)]);
    }
    at.extend((0..height).step_by(BLOCK as usize).map(|row| {
        let in_band = below(BLOCK.min(height - row));
        [below(width), row + in_band]
    }));
    at.retain(|[x, y]| *x < width && *y < height);
    let mut numbers: BTreeSet<u32> = at.iter().map(|[x, y]| y * width + x).collect();
    let powers = (0..u32::BITS).map(|bit| 1 << bit);
    numbers.extend(powers.flat_map(|power: u32| [power - 1, power]));
    numbers.retain(|number| *number < width * height);
    numbers.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(size: [u32; 2], choice: Choice) -> Pixels {
        Pixels {
            size,
            choice,
            samples: vec![0],
            seed: 1,
        }
    }

    #[test]
    fn every_part_of_a_dispatch_has_a_pixel() {
        let size = [267, 251];
        let pixels = pixels(size, Choice::Borders);
        let chosen = pixels.chosen(0);
        assert!(chosen.is_sorted() && chosen.len() < 300, "{}", chosen.len());
        let has = |is: &dyn Fn([u32; 2]) -> bool| {
            let at = |number: &u32| [number % size[0], number / size[0]];
            chosen.iter().filter(|number| is(at(number))).count()
        };
        for corner in [[0, 0], [266, 0], [0, 250], [266, 250]] {
            assert_eq!(has(&|at| at == corner), 1);
        }
        assert!(has(&|[x, _]| x == 266) > 10 && has(&|[_, y]| y == 250) > 10);
        assert!(has(&|at| at.iter().all(|edge| edge % 8 == 7)) > 2);
        assert!((0..32).all(|band| has(&|[_, y]| y / 8 == band) > 0));
        for number in [0, 255, 256, 32_767, 32_768, 65_535, 65_536, 267 * 251 - 1] {
            assert!(chosen.contains(&number), "{number}");
        }
        assert_ne!(chosen, pixels.chosen(1));
    }

    #[test]
    fn samples_are_spread_from_the_first_to_the_last() {
        let of = |samples, spp| {
            let frame = Frame {
                samples,
                ..Frame::LARGE
            };
            frame.pixels(spp, 1).samples
        };
        assert_eq!(of(1, 16), [15]);
        assert_eq!(of(2, 16), [0, 15]);
        assert_eq!(of(4, 16), [0, 5, 10, 15]);
        assert_eq!(of(4, 2), [0, 1]);
        assert_eq!(of(4, 1), [0]);
        assert_eq!(of(2, u32::MAX), [0, u32::MAX - 1]);
        let [full, over] = Frame::FULL.map(|frame| frame.size[0] * frame.size[1]);
        assert_eq!([full, over], [Frame::SLOTS, Frame::SLOTS + 1]);
    }

    #[test]
    fn small_images_have_no_pixel_outside() {
        for size in [[1, 1], [1, 9], [7, 3], [16, 16]] {
            let all = size[0] * size[1];
            let chosen = pixels(size, Choice::Borders).chosen(3);
            assert!(
                chosen.last() == Some(&(all - 1)) && chosen[0] == 0,
                "{size:?}"
            );
        }
        assert_eq!(pixels([3, 2], Choice::Every(4)).chosen(1), [3]);
    }
}

//! `raystone points --plot`.

use super::output::print;
use super::points::{Points, Stream};
use anyhow::{Context as _, Result, anyhow};
use raystone::discrepancy::PointSet;
use raystone::report::plot::points::{MOST_DRAWN, thinned};
use raystone::report::point_page::{PointPage, document};
use raystone::report::write_page;
use std::path::Path;
use std::process::ExitCode;

/// Points of which pictures are made at most.
const MOST_POINTS: u32 = 1 << 20;
/// Dimensions of which pictures are made at most.
const MOST_DIMENSIONS: usize = 16;

impl Points {
    /// Draws the points of the pixel with this number, and prints where the page is.
    pub(super) fn draw(&self, stream: &Stream, pixel: u32, folder: &Path) -> Result<ExitCode> {
        self.check(pixel)?;
        // Before the work, so that a folder that cannot be written costs no time.
        std::fs::create_dir_all(folder)
            .with_context(|| format!("--plot: cannot make the folder {}", folder.display()))?;
        let words = stream.words(&self.coordinates(pixel, 0..self.count, &self.dims))?;
        let numbers = words.into_iter().map(unit).collect();
        let points = PointSet::new(self.dims.len(), numbers)?;
        let [x, y] = self.pixel;
        let page = PointPage {
            label: stream.sampler.label(),
            origin: format!(
                "pixel {x},{y} of an image {} wide, seed {}; drawn by raystone {}",
                self.width,
                self.seed,
                env!("CARGO_PKG_VERSION")
            ),
            dims: self.dims.clone(),
            points,
            copies: self.copies(stream, pixel)?,
        };
        let mut document = document(&page)?;
        let (html, _) = write_page(folder, &mut document)?;
        print(&format!("page: {}\n", html.display()))?;
        Ok(ExitCode::SUCCESS)
    }

    fn check(&self, pixel: u32) -> Result<()> {
        let refuse = |reason: String| Err(anyhow!(reason));
        let (count, dims) = (self.count, self.dims.len());
        if !(2..=MOST_DIMENSIONS).contains(&dims) {
            return refuse(format!(
                "--plot draws 2 to {MOST_DIMENSIONS} dimensions, {dims} is not among them: set --dims"
            ));
        }
        if count > MOST_POINTS {
            return refuse(format!(
                "--plot draws up to {MOST_POINTS} points, {count} are too many: set --count"
            ));
        }
        if pixel.checked_add(self.copies).is_none() {
            return refuse(format!(
                "--copies {}: there are fewer pixels after --pixel {},{}",
                self.copies, self.pixel[0], self.pixel[1]
            ));
        }
        Ok(())
    }

    /// The first two dimensions of the same samples in each pixel, no more of them than are drawn.
    fn copies(&self, stream: &Stream, pixel: u32) -> Result<Vec<Vec<[f64; 2]>>> {
        let each = (MOST_DRAWN / self.copies as usize).max(1);
        let samples: Vec<u32> = thinned(self.count as usize, each)
            .into_iter()
            .map(|i| i as u32)
            .collect();
        let of_pixel = |pixel| self.coordinates(pixel, samples.iter().copied(), &self.dims[..2]);
        let coordinates: Vec<_> = (pixel..pixel + self.copies).flat_map(of_pixel).collect();
        let numbers: Vec<f64> = stream.words(&coordinates)?.into_iter().map(unit).collect();
        let (pairs, _) = numbers.as_chunks::<2>();
        Ok(pairs.chunks(samples.len()).map(<[_]>::to_vec).collect())
    }
}

/// The fraction that a number of the stream stands for.
fn unit(word: u32) -> f64 {
    f64::from(word) * 2.0_f64.powi(-32)
}

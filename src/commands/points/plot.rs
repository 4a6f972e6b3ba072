//! `raystone points --plot`.

use super::{Points, Stream, fraction};
use anyhow::{Context as _, Result, bail};
use raystone::discrepancy::PointSet;
use raystone::report::plot::points::{MOST_DRAWN, thinned};
use raystone::report::point_page::{PointPage, document};
use raystone::report::write_page;
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;

/// Maximum number of points in pictures.
const MOST_POINTS: u32 = 1 << 20;
/// Maximum number of dimensions in pictures.
const MOST_DIMENSIONS: usize = 16;

impl Points {
    /// Draws the points, and prints where the page is.
    pub(super) fn draw(&self, stream: &Stream, folder: &Path) -> Result<ExitCode> {
        self.check(stream.pixel)?;
        // Before the work, so that a folder that cannot be written costs no time.
        std::fs::create_dir_all(folder)
            .with_context(|| format!("--plot: cannot make the folder {}", folder.display()))?;
        let words = stream.words(stream.pixel, 0..self.sampler.count(), &self.dims)?;
        let numbers = words.into_iter().map(fraction).collect();
        let points = PointSet::new(self.dims.len(), numbers)?;
        let [x, y] = self.sampler.pixel;
        let page = PointPage {
            label: stream.sampler.label(),
            origin: format!(
                "pixel {x},{y} of an image {} wide, seed {}; drawn by raystone {}",
                self.sampler.width,
                self.sampler.seed,
                env!("CARGO_PKG_VERSION")
            ),
            dims: self.dims.clone(),
            points,
            copies: self.copies(stream)?,
        };
        let mut document = document(&page)?;
        let (html, _) = write_page(folder, &mut document)?;
        let text = format!("page: {}\n", html.display());
        self.output.show("points", json!({ "page": html }), &text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn check(&self, pixel: u32) -> Result<()> {
        let (count, dims) = (self.sampler.count(), self.dims.len());
        if !(2..=MOST_DIMENSIONS).contains(&dims) {
            bail!(
                "--plot draws 2 to {MOST_DIMENSIONS} dimensions, {dims} is not among them: set --dims"
            );
        }
        if count > MOST_POINTS {
            bail!("--plot draws up to {MOST_POINTS} points, {count} are too many: set --count");
        }
        if pixel.checked_add(self.copies).is_none() {
            let (copies, [x, y]) = (self.copies, self.sampler.pixel);
            bail!("--copies {copies}: there are fewer pixels after --pixel {x},{y}");
        }
        Ok(())
    }

    /// Returns the first two dimensions of the same samples in each pixel, no more of them than are drawn.
    fn copies(&self, stream: &Stream) -> Result<Vec<Vec<[f64; 2]>>> {
        let each = (MOST_DRAWN / self.copies as usize).max(1);
        let samples = thinned(self.sampler.count() as usize, each).into_iter();
        let samples: Vec<u32> = samples.map(|i| i as u32).collect();
        let of_pixel = |pixel| {
            let words = stream.words(pixel, samples.iter().copied(), &self.dims[..2])?;
            let numbers: Vec<f64> = words.into_iter().map(fraction).collect();
            Ok(numbers.as_chunks::<2>().0.to_vec())
        };
        (stream.pixel..stream.pixel + self.copies)
            .map(of_pixel)
            .collect()
    }
}

//! `raystone points`: of a sampler or a file, printed, drawn or measured.

mod measure;
mod plot;
mod sampler;

use super::output::{OutputArguments, print, print_json};
use anyhow::{Result, bail};
use clap::Args;
use measure::MeasureArguments;
use raystone::discrepancy::PointSet;
use sampler::{SamplerArguments, Stream};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Print the points of a sampler, one a line, draw them, or measure how evenly they fill the unit cube: those of a file, too
///
/// A number is the 32-bit fraction that kernel and scalar twin agree on, with 17 significant digits; the
/// renderer draws its upper 24 bits.
#[derive(Args)]
pub struct Points {
    /// File to measure, with a point a line, coordinates parted by blanks, commas or tabs, `#` for comments; `-` is standard
    /// input, as is none without --sequence
    #[arg(conflicts_with_all = ["sequence", "decorrelation", "count", "pixel", "width", "seed", "param", "gpu", "plot"])]
    file: Option<PathBuf>,
    #[command(flatten)]
    sampler: SamplerArguments,
    /// Dimensions of each point [default: 0,1; of a file all]
    #[arg(long, value_name = "D,…", value_delimiter = ',')]
    dims: Vec<u32>,
    /// The first D dimensions: short for --dims 0,1,…
    #[arg(long, value_name = "D", conflicts_with = "dims", value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    dim: Option<u32>,
    /// Draw the points instead of printing them: a page and its pictures, into this folder
    #[arg(
        long,
        value_name = "DIR",
        requires = "sequence",
        conflicts_with = "measure"
    )]
    plot: Option<PathBuf>,
    /// Pixels whose points are drawn upon each other, from --pixel on
    #[arg(long, value_name = "N", default_value_t = 150, requires = "plot", value_parser = clap::value_parser!(u32).range(1..=65536))]
    copies: u32,
    #[command(flatten)]
    measures: MeasureArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Points {
    pub fn execute(mut self) -> Result<ExitCode> {
        if let Some(dim) = self.dim {
            self.dims = (0..dim).collect();
        }
        let Some(sequence) = &self.sampler.sequence else {
            let points = measure::read(self.file.as_deref(), &self.dims)?;
            return self.measures.print(&points);
        };
        if self.dims.is_empty() {
            self.dims = vec![0, 1];
        }
        let stream = self.sampler.stream(sequence, &self.dims)?;
        if let Some(folder) = &self.plot {
            return self.draw(&stream, folder);
        }
        let (count, dims) = (self.sampler.count(), &self.dims);
        let parts = stream.parts(count, dims);
        if !self.output.json && !self.measures.is_asked() {
            for part in parts {
                print(&lines(&part?, dims.len()))?;
            }
            return Ok(ExitCode::SUCCESS);
        }
        if u64::from(count) * dims.len() as u64 > MOST_NUMBERS {
            bail!(
                "{count} points of {} coordinates are more than is held in memory, {MOST_NUMBERS} numbers: lower --count or --dims",
                dims.len()
            );
        }
        let numbers: Vec<Vec<f64>> = parts.collect::<Result<_>>()?;
        let numbers = numbers.concat();
        if self.measures.is_asked() {
            return self.measures.print(&PointSet::new(dims.len(), numbers)?);
        }
        let points: Vec<&[f64]> = numbers.chunks_exact(dims.len()).collect();
        print_json("points", json!({ "dims": dims, "points": points }))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Most numbers that are measured, or shown as JSON: 1 GiB.
const MOST_NUMBERS: u64 = 1 << 27;

/// Returns a word as a fraction of 2³²: exact in double precision.
fn fraction(word: u32) -> f64 {
    f64::from(word) * 2.0_f64.powi(-32)
}

/// Formats one point a line.
fn lines(numbers: &[f64], dims: usize) -> String {
    let mut text = String::new();
    for point in numbers.chunks_exact(dims) {
        for (i, number) in point.iter().enumerate() {
            let separator = if i == 0 { "" } else { " " };
            // Writing to a string cannot fail.
            let _ = write!(text, "{separator}{number:.16e}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_17_significant_digits_and_come_back_as_they_were() {
        let words = [0x8000_0000, u32::MAX, 1, 0];
        let text = lines(&words.map(fraction), 2);
        let rows: Vec<_> = text.lines().collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].split(' ').next(), Some("5.0000000000000000e-1"));
        let back = rows.iter().flat_map(|row| row.split(' '));
        let back: Vec<u32> = back
            .map(|n| (n.parse::<f64>().unwrap() * 2.0_f64.powi(32)) as u32)
            .collect();
        assert_eq!(back, words);
    }
}

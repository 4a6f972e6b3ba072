//! `raystone points`.

use super::arguments::{DeviceArguments, list_override};
use super::output::{OutputArguments, print, print_json};
use anyhow::{Result, anyhow, bail};
use clap::Args;
use raystone::config::{Axis, Catalogue, Experiment};
use raystone::gpu::Gpu;
use raystone::params::{Entry, Variant};
use raystone::run::{Registries, dump_stream};
use raystone::sampling::{Coordinate, Demand, Sampler};
use raystone::text::nearest;
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Numbers that are computed and printed at a time.
const BATCH: usize = 1 << 18;

/// One sampler as an experiment, so that one parser checks names and parameters everywhere.
const DEFAULTS: &str =
    "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\nsequence = [\"sobol\"]\n";

/// Print the points of a sampler, one a line, or draw them
///
/// A number is the 32-bit fraction that kernel and scalar twin agree on, with 17 significant digits; the
/// renderer draws its upper 24 bits.
#[derive(Args)]
pub struct Points {
    /// Sample sequence
    #[arg(long)]
    sequence: String,
    /// Decorrelation of the pixels
    #[arg(long, default_value = "none")]
    decorrelation: String,
    /// Number of points
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) count: u32,
    /// Dimensions of each point
    #[arg(long, value_name = "D,…", value_delimiter = ',', default_value = "0,1")]
    pub(super) dims: Vec<u32>,
    /// Pixel whose points are drawn
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, default_value = "0,0")]
    pub(super) pixel: [u32; 2],
    /// Width of the image that the pixel lies in
    #[arg(long, value_name = "W", default_value_t = 192, value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub(super) width: u32,
    /// Seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u32,
    /// Parameter of the sequence or the decorrelation (of both, if both have it): `--param
    /// digits=faure`
    #[arg(long, value_name = "KEY=VALUE")]
    param: Vec<String>,
    /// Draw the points instead of printing them: a page and its pictures, into this folder
    #[arg(long, value_name = "DIR")]
    pub(super) plot: Option<PathBuf>,
    /// Pixels whose points are drawn upon each other, from --pixel on
    #[arg(long, value_name = "N", default_value_t = 150, requires = "plot", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(super) copies: u32,
    /// Compute on the adapter instead of the host: the bytes are the same
    #[arg(long)]
    gpu: bool,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Points {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = Registries::default();
        let sampler = self.sampler(&registries)?;
        let [x, y] = self.pixel;
        if x >= self.width {
            bail!(
                "--pixel {x},{y}: the image is {} pixels wide; set --width",
                self.width
            );
        }
        let pixel = y.checked_mul(self.width).and_then(|row| row.checked_add(x));
        let pixel =
            pixel.ok_or_else(|| anyhow!("--pixel {x},{y}: pixels are numbered by 32 bits"))?;
        let gpu = match self.gpu {
            true => Some(self.device.open(&registries)?),
            false => None,
        };
        let stream = Stream { sampler, gpu };
        if let Some(folder) = &self.plot {
            return self.draw(&stream, pixel, folder);
        }
        let mut points: Vec<Vec<f64>> = Vec::new();
        let per_batch = (BATCH / self.dims.len()).max(1) as u32;
        let mut first = 0;
        while first < self.count {
            let count = per_batch.min(self.count - first);
            let words = stream.words(&self.coordinates(pixel, first..first + count, &self.dims))?;
            let batch = words.chunks_exact(self.dims.len());
            match self.output.json {
                true => points.extend(batch.map(|point| point.iter().map(fraction).collect())),
                false => print(&lines(batch))?,
            }
            first += count;
        }
        if self.output.json {
            print_json("points", json!({ "dims": self.dims, "points": points }))?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// These samples, dimension by dimension.
    pub(super) fn coordinates(
        &self,
        pixel: u32,
        samples: impl IntoIterator<Item = u32>,
        dims: &[u32],
    ) -> Vec<Coordinate> {
        let coordinate = |sample, dimension: &u32| Coordinate {
            pixel,
            sample,
            dimension: *dimension,
            seed: self.seed,
        };
        let point = |sample| dims.iter().map(move |d| coordinate(sample, d));
        samples.into_iter().flat_map(point).collect()
    }

    fn sampler(&self, registries: &Registries) -> Result<Sampler> {
        let catalogue = registries.catalogue();
        let overrides = self.overrides(&catalogue)?;
        let experiment = Experiment::parse(DEFAULTS, "raystone points", &overrides, &catalogue)?;
        let one = |axis| -> Result<Variant> {
            match experiment.axes[axis].as_slice() {
                [variant] => Ok(variant.clone()),
                several => Err(anyhow!(
                    "points are drawn from one {axis}, not from {}: give one value",
                    several.len()
                )),
            }
        };
        let highest = self.dims.iter().copied().max().unwrap_or(0);
        let demand = Demand {
            samples: Some(self.count),
            dimensions: highest.saturating_add(1),
            width: Some(self.width),
        };
        let pair = (one(Axis::Sequence)?, one(Axis::Decorrelation)?);
        Ok(registries.samplers.sampler(&pair.0, &pair.1, &demand)?)
    }

    /// What the flags say, as overrides of [`DEFAULTS`].
    fn overrides(&self, catalogue: &Catalogue) -> Result<Vec<String>> {
        let mut overrides = Vec::new();
        let mut entries: Vec<(Axis, &Entry)> = Vec::new();
        for (axis, name) in [
            (Axis::Sequence, &self.sequence),
            (Axis::Decorrelation, &self.decorrelation),
        ] {
            overrides.push(list_override(
                &format!("axes.{axis}"),
                std::slice::from_ref(name),
            ));
            let entry = catalogue[axis].iter().find(|e| e.name == *name);
            entries.extend(entry.map(|entry| (axis, entry)));
        }
        // An unknown name is answered by the parser, better than a parameter of it would be.
        if entries.len() < 2 {
            return Ok(overrides);
        }
        for param in &self.param {
            let key = param.split('=').next().unwrap_or_default().trim();
            let has = |entry: &Entry| entry.schema.iter().any(|p| p.name == key);
            let owners: Vec<_> = entries.iter().filter(|(_, entry)| has(entry)).collect();
            if owners.is_empty() {
                return Err(unknown_parameter(param, key, &entries));
            }
            for (axis, entry) in owners {
                overrides.push(format!("{axis}.{}.{param}", entry.name));
            }
        }
        Ok(overrides)
    }
}

/// A sampler and where it is computed.
pub(super) struct Stream {
    pub(super) sampler: Sampler,
    /// The adapter, unless the host computes.
    gpu: Option<Gpu>,
}

impl Stream {
    /// The number at each coordinate.
    pub(super) fn words(&self, coordinates: &[Coordinate]) -> Result<Vec<u32>> {
        let Some(gpu) = &self.gpu else {
            return Ok(coordinates
                .iter()
                .map(|c| self.sampler.sample_u32(*c))
                .collect());
        };
        let mut words = Vec::with_capacity(coordinates.len());
        for batch in coordinates.chunks(BATCH) {
            let dumped = dump_stream(gpu, &self.sampler, batch);
            words.extend(dumped.map_err(|reason| anyhow!(reason))?);
        }
        Ok(words)
    }
}

fn unknown_parameter(param: &str, key: &str, entries: &[(Axis, &Entry)]) -> anyhow::Error {
    let names = entries.iter().flat_map(|(_, entry)| &entry.schema);
    let known: Vec<&str> = names.map(|p| p.name).collect();
    let hint = match nearest(key, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`? Known: {}", known.join(", ")),
        None => "neither has parameters".to_owned(),
    };
    let [sequence, decorrelation] = [0, 1].map(|i| entries[i].1.name.as_str());
    anyhow!("--param {param}: {sequence} × {decorrelation} has no parameter `{key}`; {hint}")
}

/// A fraction of 2³²: exact in double precision.
fn fraction(word: &u32) -> f64 {
    f64::from(*word) * 2.0_f64.powi(-32)
}

/// One point a line.
fn lines<'w>(points: impl Iterator<Item = &'w [u32]>) -> String {
    let mut text = String::new();
    for point in points {
        for (i, word) in point.iter().enumerate() {
            let separator = if i == 0 { "" } else { " " };
            // Writing to a string cannot fail.
            let _ = write!(text, "{separator}{:.16e}", fraction(word));
        }
        text.push('\n');
    }
    text
}

fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    parsed.ok_or_else(|| "must be two integers, for instance 3,5".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_17_significant_digits_and_come_back_as_they_were() {
        let text = lines([0x8000_0000, u32::MAX, 1, 0].chunks_exact(2));
        let rows: Vec<_> = text.lines().collect();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].split(' ').next(), Some("5.0000000000000000e-1"));
        let back = rows.iter().flat_map(|row| row.split(' '));
        let back: Vec<u32> = back
            .map(|n| (n.parse::<f64>().unwrap() * 2.0_f64.powi(32)) as u32)
            .collect();
        assert_eq!(back, [0x8000_0000, u32::MAX, 1, 0]);
    }
}

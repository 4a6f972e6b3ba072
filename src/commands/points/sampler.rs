//! The sampler that points are drawn from, and where it is computed.

use super::fraction;
use crate::commands::arguments::{DeviceArguments, of_flags, on_axis, one_cell, unknown};
use anyhow::{Result, anyhow, bail};
use clap::Args;
use raystone::config::{Axis, Catalogue};
use raystone::gpu::Gpu;
use raystone::params::Entry;
use raystone::run::{Registries, dump_stream};
use raystone::sampling::{Coordinate, Demand, Sampler};
use std::ops::Range;

/// Numbers that are computed at a time.
const BATCH: usize = 1 << 18;

/// A sampler and what is drawn from it.
#[derive(Args)]
pub struct SamplerArguments {
    /// Sample sequence
    #[arg(long, requires = "count")]
    pub(super) sequence: Option<String>,
    /// Decorrelation of the pixels
    #[arg(long, default_value = "none", requires = "sequence")]
    decorrelation: String,
    /// Number of points
    #[arg(long, value_name = "N", requires = "sequence", value_parser = clap::value_parser!(u32).range(1..))]
    count: Option<u32>,
    /// Pixel whose points are drawn
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, default_value = "0,0", requires = "sequence")]
    pub(super) pixel: [u32; 2],
    /// Width of the image that the pixel lies in
    #[arg(long, value_name = "W", default_value_t = 192, requires = "sequence")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub(super) width: u32,
    /// Seed
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        requires = "sequence",
        allow_negative_numbers = true
    )]
    pub(super) seed: u32,
    /// Parameter of the sequence or the decorrelation (of both, if both have it): `--param digits=faure`
    #[arg(long, value_name = "KEY=VALUE", requires = "sequence")]
    param: Vec<String>,
    /// Compute on the adapter instead of the host: the bytes are the same
    #[arg(long, requires = "sequence")]
    gpu: bool,
    #[command(flatten)]
    device: DeviceArguments,
}

impl SamplerArguments {
    /// Returns the number of points, which every sequence has.
    pub(super) fn count(&self) -> u32 {
        self.count.unwrap_or_default()
    }

    /// Returns the sampler for these dimensions.
    pub(super) fn stream(&self, sequence: &str, dims: &[u32]) -> Result<Stream> {
        let registries = Registries::default();
        let overrides = self.overrides(sequence, &registries.catalogue())?;
        let cell = one_cell(&of_flags("points", overrides, &[], &registries)?)?;
        let highest = dims.iter().copied().max().unwrap_or(0);
        let demand = Demand {
            samples: Some(self.count()),
            dimensions: highest.saturating_add(1),
            width: Some(self.width),
        };
        let (sequence, decorrelation) = (&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
        let sampler = registries
            .samplers
            .sampler(sequence, decorrelation, &demand)?;
        let [x, y] = self.pixel;
        if x >= self.width {
            let width = self.width;
            bail!("--pixel {x},{y}: the image is {width} pixels wide; set --width");
        }
        let pixel = y.checked_mul(self.width).and_then(|row| row.checked_add(x));
        let pixel =
            pixel.ok_or_else(|| anyhow!("--pixel {x},{y}: pixels are numbered by 32 bits"))?;
        let gpu = self.gpu.then(|| self.device.open(&registries));
        Ok(Stream {
            sampler,
            pixel,
            seed: self.seed,
            gpu: gpu.transpose()?,
        })
    }

    /// Returns the flags as overrides of an experiment.
    fn overrides(&self, sequence: &str, catalogue: &Catalogue) -> Result<Vec<String>> {
        let named = [
            (Axis::Sequence, sequence),
            (Axis::Decorrelation, &*self.decorrelation),
        ];
        let flags = named
            .iter()
            .filter_map(|(axis, name)| on_axis(*axis, [name]));
        let mut overrides: Vec<String> = flags.collect();
        let entries = named.iter().filter_map(|(axis, name)| {
            let entry = catalogue[*axis].iter().find(|e| e.name == *name);
            Some((*axis, entry?))
        });
        let entries: Vec<(Axis, &Entry)> = entries.collect();
        // An unknown name is answered by the parser, better than a parameter of it would be.
        if entries.len() < 2 {
            return Ok(overrides);
        }
        for param in &self.param {
            let key = param.split('=').next().unwrap_or_default().trim();
            let has = |entry: &Entry| entry.schema.iter().any(|p| p.name == key);
            let owners: Vec<_> = entries.iter().filter(|(_, entry)| has(entry)).collect();
            if owners.is_empty() {
                let known = entries.iter().flat_map(|(_, entry)| &entry.schema);
                let refusal = unknown(key, known.map(|p| p.name));
                let decorrelation = &self.decorrelation;
                bail!("--param {param}: for {sequence} × {decorrelation} {refusal}");
            }
            for (axis, entry) in owners {
                overrides.push(format!("{axis}.{}.{param}", entry.name));
            }
        }
        Ok(overrides)
    }
}

/// A sampler, a pixel of it, and where its numbers are computed.
pub(super) struct Stream {
    pub(super) sampler: Sampler,
    pub(super) pixel: u32,
    seed: u32,
    /// The adapter, unless the host computes.
    gpu: Option<Gpu>,
}

impl Stream {
    /// Returns the words of these samples of a pixel, dimension by dimension.
    pub(super) fn words(
        &self,
        pixel: u32,
        samples: impl IntoIterator<Item = u32>,
        dims: &[u32],
    ) -> Result<Vec<u32>> {
        let coordinate = |sample, dimension: &u32| Coordinate {
            pixel,
            sample,
            dimension: *dimension,
            seed: self.seed,
        };
        let point = |sample| dims.iter().map(move |d| coordinate(sample, d));
        let mut coordinates = samples.into_iter().flat_map(point);
        let Some(gpu) = &self.gpu else {
            return Ok(coordinates.map(|c| self.sampler.sample_u32(c)).collect());
        };
        let mut words = Vec::new();
        loop {
            let batch: Vec<Coordinate> = coordinates.by_ref().take(BATCH).collect();
            if batch.is_empty() {
                return Ok(words);
            }
            let dumped = dump_stream(gpu, &self.sampler, &batch);
            words.extend(dumped.map_err(|reason| anyhow!(reason))?);
        }
    }

    /// Returns the points of the pixel, number by number, in parts that are computed at a time.
    pub(super) fn parts(&self, count: u32, dims: &[u32]) -> impl Iterator<Item = Result<Vec<f64>>> {
        let each = (BATCH / dims.len()).max(1);
        let part =
            move |first: u32| -> Range<u32> { first..count.min(first.saturating_add(each as u32)) };
        (0..count).step_by(each).map(move |first| {
            let words = self.words(self.pixel, part(first), dims)?;
            Ok(words.into_iter().map(fraction).collect())
        })
    }
}

fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(',')
        .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    parsed.ok_or_else(|| "must be two integers, for instance 3,5".to_owned())
}

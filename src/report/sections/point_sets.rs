//! Pictures of the points that the samplers of a run draw.

use super::file_stem;
use crate::config::{Entry, Variant};
use crate::discrepancy::{Budget, PointSet, radial_spectrum};
use crate::report::data::{RunData, sampler_name};
use crate::report::document::*;
use crate::report::plot::panels::{self, Panel};
use crate::report::plot::points::{Cloud, Domain, Pair, interval_counts};
use crate::report::plot::spectrum::{RadialCurve, highest_frequency};
use crate::sampling::dimensions::{DIRECTION, at_bounce, pair_purpose};
use crate::sampling::{Coordinate, Demand, Sampler, SamplerRegistry, to_unit};

/// Points of a pixel that are drawn, 2^m.
const M: u32 = 6;
/// Pixels that are superposed, as many as in Dufay 2017, Fig. 5.13.
const PIXELS: u32 = 150;
/// Points of the spectrum.
const SPECTRUM_POINTS: u32 = 1024;
/// Time for a spectrum, seconds.
const SPECTRUM_SECONDS: f64 = 10.0;
/// Width of the image where no record tells it, pixels.
const IMAGE_WIDTH: u32 = 192;
/// Width of a row of pictures, pixels.
const WIDTH: f64 = 900.0;

/// The section; `None` when no record names a sampler.
pub fn section(data: &RunData) -> Option<Section> {
    let used = samplers(data);
    if used.is_empty() {
        return None;
    }
    let dims = [0, 1].map(|i| at_bounce(0, DIRECTION + i));
    let mut section = Section::new("point-sets", "Point sets");
    section.blocks.push(Block::Paragraph(format!(
        "What the samplers of this run draw in dimensions {} and {}, the path's {}, with seed 1. Records hold \
         no points: these are drawn anew by the scalar twins, which equal the kernels to the bit. All panels of \
         a column have the same axes. From left to right: {n} points of the first pixel with the elementary \
         intervals of their square grid, those without a point tinted; the same points on the disc of directions, \
         radius √x and angle 2πy; the points of {PIXELS} pixels upon each other, the first pixel's in another colour; \
         mean power of {SPECTRUM_POINTS} points against the length of the frequency, from 0.01 to 100 on a logarithmic \
         scale, dashed where white noise lies.",
        dims[0],
        dims[1],
        pair_purpose(dims),
        n = 1 << M
    )));
    let registry = SamplerRegistry::default();
    let mut figures = Vec::new();
    let mut missing = Vec::new();
    for (index, (sequence, decorrelation)) in used.into_iter().enumerate() {
        let name = sampler_name(sequence, decorrelation);
        let source = Source::new(&registry, sequence, decorrelation, image_width(data), dims);
        match source.and_then(|source| source.panels(&name)) {
            Ok(panels) => {
                let drawing = panels::draw(&panels, 4, panels::side(WIDTH, 4));
                let stem = format!("points-{index}-{}", file_stem(&name));
                figures.push(Figure::new(stem, format!("Points of {name}."), drawing));
            }
            Err(reason) => {
                missing.push(Block::Paragraph(format!("{name} is not drawn: {reason}.")))
            }
        }
    }
    if !figures.is_empty() {
        section.blocks.push(Block::Figures(figures));
    }
    section.blocks.extend(missing);
    Some(section)
}

/// Every sampler of the run, in the order of their looks.
fn samplers<'a>(data: &RunData<'a>) -> Vec<(&'a Variant, &'a Variant)> {
    let streams = data.streams.iter().map(|s| (&s.sequence, &s.decorrelation));
    let views = || data.views().map(|(_, view)| view);
    let errors = views().flat_map(|view| view.samplers.iter().flat_map(|s| s.replicates.first()));
    let times = views().flat_map(|view| &view.times);
    let all: Vec<(&Variant, &Variant)> = streams
        .chain(errors.map(|e| (&e.sequence, &e.decorrelation)))
        .chain(times.map(|t| (&t.sequence, &t.decorrelation)))
        .collect();
    let named = |name: &String| {
        let is_it = |pair: &&(&Variant, &Variant)| sampler_name(pair.0, pair.1) == *name;
        all.iter().find(is_it).copied()
    };
    data.samplers.iter().filter_map(named).collect()
}

fn image_width(data: &RunData) -> u32 {
    let views = data.views().map(|(_, view)| view);
    let mut times = views.flat_map(|view| &view.times);
    times.next().map_or(IMAGE_WIDTH, |time| time.resolution[0])
}

/// The variant with every parameter that its entry declares: records of another version may lack one.
fn completed(variant: &Variant, entries: &[Entry]) -> Variant {
    let Some(entry) = entries.iter().find(|entry| entry.name == variant.name) else {
        return variant.clone();
    };
    let mut whole = entry.default_variant();
    for (name, value) in &mut whole.params.0 {
        let recorded = variant.params.0.get(name);
        let same_kind = |v: &&_| std::mem::discriminant(*v) == std::mem::discriminant(value);
        if let Some(recorded) = recorded.filter(same_kind) {
            *value = recorded.clone();
        }
    }
    whole
}

/// Draws pairs of numbers of one sampler.
struct Source {
    /// For the points of a pixel, and for those of the spectrum: some samplers have a set for each number.
    samplers: [Sampler; 2],
    dims: [u32; 2],
}

impl Source {
    fn new(
        registry: &SamplerRegistry,
        sequence: &Variant,
        decorrelation: &Variant,
        width: u32,
        dims: [u32; 2],
    ) -> Result<Self, String> {
        let sequence = completed(sequence, &registry.sequence_entries());
        let decorrelation = completed(decorrelation, &registry.decorrelation_entries());
        let made = |samples| {
            let demand = Demand {
                samples: Some(samples),
                dimensions: dims[1] + 1,
                width: Some(width),
            };
            let made = registry.sampler(&sequence, &decorrelation, &demand);
            made.map_err(|reason| reason.to_string())
        };
        Ok(Self {
            samplers: [made(1 << M)?, made(SPECTRUM_POINTS)?],
            dims,
        })
    }

    /// All points of a sampler in one pixel, as the renderer draws them.
    fn points(&self, sampler: &Sampler, pixel: u32) -> Vec<Pair> {
        let number = |sample, dimension| {
            let at = Coordinate {
                pixel,
                sample,
                dimension,
                seed: 1,
            };
            f64::from(to_unit(sampler.sample_u32(at)))
        };
        let samples = 0..sampler.demand.samples.unwrap_or(0);
        samples
            .map(|sample| self.dims.map(|dimension| number(sample, dimension)))
            .collect()
    }

    fn panels(&self, name: &str) -> Result<[Panel; 4], String> {
        let [few, many] = &self.samplers;
        let points = self.points(few, 0);
        let all: Vec<Pair> = (0..PIXELS)
            .flat_map(|pixel| self.points(few, pixel))
            .collect();
        let power = self.spectrum(many)?;
        let shape = [M.div_ceil(2), M / 2];
        let empty = interval_counts(&points, shape)
            .iter()
            .filter(|&&count| count == 0)
            .count();
        let square = Cloud {
            intervals: Some(shape),
            ..Cloud::new(Domain::Square, points.clone())
        };
        let copies = Cloud {
            highlighted: points.clone(),
            ..Cloud::new(Domain::Square, all)
        };
        let note = match empty {
            0 => "one point in each interval".to_owned(),
            _ => format!("{empty} of {} intervals empty", points.len()),
        };
        let frequencies = format!("frequency 1 to {}", power.len());
        Ok([
            Panel::new(name, note, square),
            Panel::new("disc", "", Cloud::new(Domain::PolarDisc, points)),
            Panel::new(format!("{PIXELS} pixels"), "", copies),
            Panel::new("power", frequencies, RadialCurve(power)),
        ])
    }

    fn spectrum(&self, sampler: &Sampler) -> Result<Vec<f64>, String> {
        let points = self.points(sampler, 0);
        let highest = highest_frequency(points.len());
        let set = PointSet::from_points(&points).map_err(|e| e.to_string())?;
        let found = radial_spectrum(&set, highest, &Budget::seconds(SPECTRUM_SECONDS));
        found.map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{ParamValue, Params};

    fn variant(name: &str, params: &[(&str, ParamValue)]) -> Variant {
        let params = params
            .iter()
            .map(|(name, value)| ((*name).to_owned(), value.clone()));
        Variant {
            name: name.into(),
            params: Params(params.collect()),
            label: name.into(),
        }
    }

    fn source(sequence: &Variant, decorrelation: &str) -> Result<Source, String> {
        let registry = SamplerRegistry::default();
        let decorrelation = variant(decorrelation, &[]);
        Source::new(&registry, sequence, &decorrelation, 192, [2, 3])
    }

    #[test]
    fn parameters_that_a_record_lacks_are_defaults_and_those_it_has_are_kept() {
        let digits = |value: &str| [("digits", ParamValue::Name(value.into()))];
        let first = |sequence: &Variant| {
            let source = source(sequence, "none").unwrap();
            source.points(&source.samplers[0], 0)
        };
        let plain = first(&variant("halton", &digits("plain")));
        assert_eq!(first(&variant("halton", &[])), plain);
        assert_ne!(first(&variant("halton", &digits("faure"))), plain);
        let wrong_kind = [
            ("digits", ParamValue::Flag(true)),
            ("gone", ParamValue::Flag(true)),
        ];
        assert_eq!(first(&variant("halton", &wrong_kind)), plain);
    }

    #[test]
    fn a_sampler_that_cannot_be_made_says_why() {
        let reason = |sequence, decorrelation| source(&variant(sequence, &[]), decorrelation).err();
        assert!(reason("unheard-of", "none").unwrap().contains("unheard-of"));
        assert!(reason("halton", "owen-hash").unwrap().contains("base 2"));
        assert_eq!(reason("sobol", "owen-hash"), None);
    }

    #[test]
    fn every_pixel_of_a_shifted_sampler_draws_other_points_and_of_an_unshifted_one_the_same() {
        let differ = |decorrelation| {
            let source = source(&variant("sobol", &[]), decorrelation).unwrap();
            let few = &source.samplers[0];
            assert_eq!(source.points(few, 0).len(), 64);
            source.points(few, 0) != source.points(few, 1)
        };
        assert!(differ("cranley-patterson"));
        assert!(!differ("none"));
    }
}

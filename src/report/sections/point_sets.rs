//! Pictures of the points that the kernels of a run drew, from the words in its records.

use super::file_stem;
use crate::data::{RunData, without_repeats};
use crate::document::*;
use crate::plot::panels::{self, Panel};
use crate::plot::points::{Cloud, Domain, Pair, interval_counts};
use crate::plot::spectrum::RadialCurve;
use raystone_record::{Recorded, RecordedPoints, StreamRecord, axis};

/// Returns the section; `None` if no record holds points. Nothing is drawn for a sampler without points: today's
/// samplers need not be those of the run.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    let recorded = |name: &String| {
        let of_name = |s: &&Recorded<StreamRecord>| data.names.sampler(s.key) == *name;
        let mut streams = data.streams.iter().filter(of_name);
        streams.find_map(|s| Some((*s, s.body.points.as_ref()?)))
    };
    // However rays are offset, the same words are drawn.
    let drawn = [axis::SEQUENCE, axis::DECORRELATION, axis::KERNELS];
    let keys = data.views().flat_map(|(_, view)| &view.samplers);
    let keys = keys
        .map(|s| &s.key)
        .chain(data.streams.iter().map(|s| s.key));
    let names = keys.map(|key| data.names.sampler(&key.only(&drawn)));
    let names = without_repeats(names.collect());
    let found: Vec<_> = names.iter().map(|name| (name, recorded(name))).collect();
    let (stream, first) = found.iter().find_map(|(_, found)| *found)?;
    let mut section = Section::new("point-sets", "Point sets");
    section.blocks.push(Block::Paragraph(format!(
        "What the samplers of this run drew for dimensions {} and {} ({}), seed {}: words that the run read back \
         from the kernel and recorded. All panels of \
         a column have the same axes. From left to right: {n} points of the first pixel with the elementary \
         intervals of their square grid, those without a point tinted; the same points on the disc of directions, \
         radius √x and angle 2πy; the points of {pixels} pixels in a row upon each other, the first pixel's in another \
         colour; mean power of 1024 points against the length of the frequency, from 0.01 to 100 on a logarithmic \
         scale, dashed where white noise lies.",
        stream.dimensions[0],
        stream.dimensions[1],
        stream.purpose,
        first.seed,
        n = first.samples,
        pixels = first.pixels,
    )));
    let mut figures = Vec::new();
    let mut missing = Vec::new();
    for (index, (name, found)) in found.into_iter().enumerate() {
        match found.and_then(|(_, points)| panels(name, points)) {
            Some(panels) => {
                let stem = format!("points-{index}-{}", file_stem(name));
                let caption = format!("Points of {name}.");
                figures.push(panels::figure(stem, caption, &panels, 4));
            }
            None => missing.push(Block::Paragraph(format!(
                "{name} is not drawn: the records hold none of its points."
            ))),
        }
    }
    section.blocks.push(Block::Figures(figures));
    section.blocks.extend(missing);
    Some(section)
}

/// Returns square, disc, pixels and spectrum; `None` if the record does not hold as many points as it claims.
fn panels(name: &str, recorded: &RecordedPoints) -> Option<[Panel; 4]> {
    let pixels = recorded.points()?;
    let points = pixels.first()?.clone();
    let m = recorded.samples.checked_ilog2()?;
    let shape = [m.div_ceil(2), m / 2];
    let counts = interval_counts(&points, shape);
    let empty = counts.iter().filter(|&&count| count == 0).count();
    let square = Cloud {
        intervals: Some(shape),
        ..Cloud::new(Domain::Square, points.clone())
    };
    let all: Vec<Pair> = pixels.concat();
    let copies = Cloud {
        highlighted: points.clone(),
        ..Cloud::new(Domain::Square, all)
    };
    let note = match empty {
        0 => "one point in each interval".to_owned(),
        _ => format!("{empty} of {} intervals empty", counts.len()),
    };
    let power = recorded.spectrum.clone();
    let frequencies = match power.len() {
        0 => "not computed".to_owned(),
        highest => format!("frequency 1 to {highest}"),
    };
    Some([
        Panel::new(name, note, square),
        Panel::new("disc", "", Cloud::new(Domain::PolarDisc, points)),
        Panel::new(format!("{} pixels", pixels.len()), "", copies),
        Panel::new("power", frequencies, RadialCurve(power)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_from_a_record_as_the_renderer_s_floats() {
        let words: Vec<u32> = (0..16).map(|i: u32| i.wrapping_mul(0x1234_5678)).collect();
        let recorded = RecordedPoints::new([4, 2], 1, &words, vec![1.0; 64]);
        let points = recorded.points().unwrap();
        assert_eq!((points.len(), points[1].len()), (2, 4));
        let unit = |i: usize| f64::from(raystone_sampling::to_unit(words[i]));
        assert_eq!(points[1][3], [unit(14), unit(15)]);
        let panels = panels("known", &recorded).unwrap();
        assert_eq!(panels.len(), 4);
    }

    #[test]
    fn a_record_that_holds_less_than_it_says_is_not_drawn() {
        let mut recorded = RecordedPoints::new([4, 2], 1, &[7; 16], Vec::new());
        assert!(panels("known", &recorded).is_some());
        recorded.samples = 5;
        assert!(panels("known", &recorded).is_none());
        recorded.words = "not base64".into();
        assert!(panels("known", &recorded).is_none());
        let empty = RecordedPoints::new([0, 0], 1, &[], Vec::new());
        assert!(panels("known", &empty).is_none());
    }
}

//! Synthetic streams, costs and spectra.

use super::fixture::{SAMPLERS, Sampler, around, sampled};
use crate::measure::record::*;

pub(super) fn streams() -> Vec<Line> {
    let stream = |sampler: &Sampler| {
        let (sequence, _, _, _, randomised, _) = *sampler;
        let exponent = if sequence == "pixel-hash" {
            -0.48
        } else {
            -0.87
        };
        let star = |i: u32| {
            let n = 4usize << i;
            let value = (n as f64).powf(exponent) * if sequence == "sobol" { 1.1 } else { 1.4 };
            FigureAtCount {
                n,
                value: around(value.min(1.0), if randomised { 0.08 } else { 0.0 }),
            }
        };
        let record = StreamRecord {
            dimensions: [2, 3],
            purpose: "bounce 0: direction".into(),
            named: true,
            worst_of: None,
            randomised,
            seeds: if randomised { 8 } else { 1 },
            pixels: (0..if randomised { 8 } else { 1 }).collect(),
            star: (0..11).map(star).collect(),
            figures: stream_figures(exponent),
            points: Some(points()),
        };
        sampled([""; 2], sampler, Body::Stream(record))
    };
    SAMPLERS.iter().map(stream).collect()
}

/// Two pixels with 16 points each.
fn points() -> RecordedPoints {
    let words: Vec<u32> = (0..64_u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
    RecordedPoints::new([16, 2], 1, &words, vec![1.0; 64])
}

/// Figures of a stream whose D* falls with this exponent.
fn stream_figures(exponent: f64) -> StreamFigures {
    let at = |n: usize| FigureAtCount {
        n,
        value: around(0.3 * (n as f64).powf(exponent), 0.1),
    };
    let slope = Interval {
        value: exponent,
        low: exponent - 0.1,
        high: exponent + 0.1,
    };
    StreamFigures {
        star_slope: Some(slope),
        l2_star: [16, 64, 256].map(at).to_vec(),
        l2_star_slope: Some(slope),
        centered: [16, 64].map(at).to_vec(),
        integrands: vec![IntegrandFigures {
            function: "disk".into(),
            integral: 0.5,
            rmse: [16, 64, 256].map(at).to_vec(),
            slope: Some(slope),
        }],
        pixels: vec![PixelsAtCount {
            n: 64,
            neighbour_angle: 0.7,
            coverage: 0.9,
        }],
    }
}

pub(super) fn costs() -> Vec<Line> {
    let cost = |sampler: &Sampler| {
        let record = SamplerCostRecord {
            ns_per_sample: around(12.5, 0.1),
            loop_ns_per_sample: around(1.5, 0.1),
        };
        sampled([""; 2], sampler, Body::SamplerCost(record))
    };
    SAMPLERS.iter().map(cost).collect()
}

/// Spectra that rise, so that low frequencies are weak.
pub(super) fn spectra(scene: &str, integrator: &str) -> Vec<Line> {
    let spectrum = |sampler: &Sampler| {
        let power = |k: usize| PowerAt {
            frequency: 0.05 * k as f64,
            power: around(0.2 * k as f64, 0.1),
        };
        let filtered = |sigma: f64| FilteredError {
            sigma,
            rmse: around(0.02 / (1.0 + sigma), 0.05),
        };
        let record = SpectrumRecord {
            spp: 32,
            replicates: if sampler.4 { 8 } else { 1 },
            power: (1..10).map(power).collect(),
            low_frequency: Some(around(0.4, 0.1)),
            autocorrelation: Some(around(-0.1, -0.1)),
            filtered: [0.0, 1.0, 2.0].map(filtered).to_vec(),
        };
        sampled([scene, integrator], sampler, Body::Spectrum(record))
    };
    SAMPLERS.iter().map(spectrum).collect()
}

//! A pipeline that is fed, judged and timed.

use super::checks::{Judge, Judged};
use super::scene::{Scene, drawn, lamp};
use super::{FIGURES, IMAGE, INTENSITY, Load, REACH};
use crate::adaptive::{Filter, Smoothing};
use crate::photons::Points;
use crate::pipeline::{Part, Pipeline, PipelineError, Rendered, Source, camera};
use crate::scatter::{Adding, Strategy, Tallies, fault_of_strategy};
use crate::{Medium, Phase, Volume, phase};
use glam::{DVec3, Vec3};
use raystone_bench::run::{Absent, At, Prepared};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::Cell;
use raystone_gpu::{Elapsed, Gpu, GpuError};
use raystone_image::Picture;
use raystone_record::{Key, Note, Reading};
use std::rc::Rc;

/// Steps of the search for the photons of an equal error: quarters of an octave of photons along an axis, from a quarter to twice.
const LADDER: std::ops::RangeInclusive<i32> = -8..=4;

/// Passes of one kind.
struct Passes {
    pipeline: Rc<Pipeline>,
    part: Part,
}

impl Measured for Passes {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.pipeline.replay(self.part)
    }
}

/// A pipeline that passed its checks.
pub(super) struct Ready {
    passes: Vec<Passes>,
    picture: Option<Picture>,
    bytes: f64,
    tallies: Tallies,
    judged: Judged,
    noise: f64,
    /// Of pixels that refraction lights, darkens and leaves, where it does.
    parts: Option<[f64; 3]>,
    /// FLIP, and of these parts.
    flip: f64,
    flips: Option<[f64; 3]>,
    /// Steps of a ray of the view.
    steps: f64,
    photons: usize,
    /// Additions to sums, of photons and of pilots.
    adds: [u64; 2],
    pilots: Option<Piloted>,
    /// The mode that was chosen, and why, where that is left to the program.
    choice: Option<String>,
}

/// What is told of pilots.
struct Piloted {
    photons: usize,
    /// The greatest density of their map.
    density: f64,
    /// Photons of an equal error as a part of those of the reference; with pilots.
    equal: [f64; 2],
}

impl Ready {
    pub(super) fn new(at: &At, cell: &Cell, load: &Load, scene: &Scene) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let seed = u64::from(at.experiment.run.seed);
        let medium = (&scene.volume, &scene.medium);
        let adding = adding(load);
        let fault = fault_of_strategy(gpu, adding.strategy);
        if let Some(fault) = fault.map_err(|error| Absent::Failed(error.to_string()))? {
            return Err(Absent::Failed(fault));
        }
        let source = lamp();
        let mut pipeline = begun(gpu, medium, adding)?;
        turn_to(&mut pipeline, source, load.phase(), &scene.rays)?;
        let adaptive = load.adaptive(seed);
        // Before points: those few find too little for a map.
        pipeline.set_points(load.points(load.photons, seed)?);
        pipeline.set_smoothing(load.smoothing());
        pipeline.set_generality(load.generality())?;
        pipeline.set_mirror(load.mirror(INTENSITY));
        ran("other points", &pipeline.render()?, true)?;
        pipeline.set_adaptive(adaptive);
        let rendered = pipeline.render()?;
        ran("another importance", &rendered, true)?;
        let judge = Judge {
            volume: &scene.volume,
            medium: &scene.medium,
            source: &source,
            rays: &scene.rays,
            truth: &scene.truth,
            side: load.side,
            blur: match load.filter {
                Filter::None => load.content.blur(load.side),
                _ => load.content.blur_of_smooth(load.side),
            },
            // An alias table sends neighbours to places of their own.
            even: load.points != Points::Random && !load.is_shuffled(),
            unit: pipeline.unit(),
            smoothing: load.smoothing(),
            adaptive,
            curved: load.general_ways,
            mirror: load.mirror(INTENSITY),
        };
        let judged = judge.check(&pipeline, &rendered).map_err(Absent::Failed)?;
        let pilots = match pipeline.pilots() {
            None => None,
            Some((pilots, _, map)) => Some(Piloted {
                photons: pilots.len(),
                density: load.greatest_of(map),
                equal: equal(gpu, load, scene, seed)?,
            }),
        };
        Ok(Self {
            photons: pipeline.photons().len(),
            bytes: pipeline.bytes() as f64,
            adds: pipeline.additions()?,
            steps: pipeline.view_steps() as f64 / f64::from(IMAGE * IMAGE),
            passes: timed_parts(pipeline, pilots.is_some(), load.filter != Filter::None),
            picture: drawn(&rendered.image),
            tallies: rendered.tallies,
            judged,
            noise: scene.noise(&rendered.image),
            parts: scene.noise_of_parts(&rendered.image),
            flip: scene.flip(&rendered.image),
            flips: scene.flip_of_parts(&rendered.image),
            pilots,
            choice: load.choice(),
        })
    }
}

fn adding(load: &Load) -> Adding {
    let capacity = load.photons * load.photons * load.side.saturating_mul(REACH) / 2;
    Adding {
        attempts: load.attempts,
        ..Adding::new(load.strategy, capacity)
    }
}

/// Photons that the adaptive pipeline needs for the error of the reference pipeline, which is smoothed by the thesis's blur: as a
/// part of the reference's, without pilots and with them. The error is that from the image of many photons. Where four times as
/// many are not enough, that.
fn equal(gpu: &Gpu, load: &Load, scene: &Scene, seed: u64) -> Result<[f64; 2], Absent> {
    let medium = (&scene.volume, &scene.medium);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let points = load.points(load.photons, seed)?;
    let mut pipeline = Pipeline::new(gpu, medium, adding, lamp(), points)?;
    pipeline.set_view(&scene.rays);
    pipeline.set_mirror(load.mirror(INTENSITY));
    pipeline.set_smoothing(Smoothing {
        filter: Filter::Blur,
        ..Smoothing::default()
    });
    let wanted = scene.noise(&pipeline.render()?.image);
    let reference = pipeline.photons().len() as f64;
    pipeline.set_smoothing(load.smoothing());
    pipeline.set_adaptive(load.adaptive(seed));
    let mut parts = [0.0; 2];
    for step in LADDER {
        let side = f64::from(load.photons) * (f64::from(step) / 4.0).exp2();
        pipeline.set_points(load.points((side.round() as u32).max(1), seed)?);
        let shot = match pipeline.render() {
            // So few photons may all miss the medium; more may not.
            Err(PipelineError::Dark(_)) => continue,
            shot => shot?,
        };
        let noise = scene.noise(&shot.image);
        let photons = pipeline.photons().len() as f64;
        let pilots = pipeline.pilots().map_or(0, |(pilots, ..)| pilots.len()) as f64;
        parts = [photons, photons + pilots].map(|count| count / reference);
        if noise <= wanted {
            break;
        }
    }
    Ok(parts)
}

/// A pipeline that has shown another light, of few points, by another phase function to another view.
pub(super) fn begun(
    gpu: &Gpu,
    (volume, medium): (&Volume, &Medium),
    adding: Adding,
) -> Result<Pipeline, PipelineError> {
    let beam = Source::Beam {
        middle: DVec3::new(0.5, 0.5, -0.5),
        direction: DVec3::Z,
        half: 0.3,
        power: Vec3::ONE,
    };
    let few = [[0.2, 0.3], [0.7, 0.6]].map(|point| (point, 1.0)).to_vec();
    let mut of_volume = volume.clone();
    of_volume.phase = Phase {
        kind: phase::SCHLICK,
        anisotropy: -0.2,
    };
    let mut pipeline = Pipeline::new(gpu, (&of_volume, medium), adding, beam, few)?;
    pipeline.set_view(&camera(
        DVec3::new(0.5, 0.9, -2.0),
        DVec3::splat(0.5),
        0.2,
        4,
    ));
    pipeline.render()?;
    Ok(pipeline)
}

/// Changes light, phase function and view one after the other: each has to run its passes again, and no others.
pub(super) fn turn_to(
    pipeline: &mut Pipeline,
    source: Source,
    phase: Phase,
    rays: &[(DVec3, DVec3)],
) -> Result<(), Absent> {
    pipeline.set_source(source);
    ran("another light", &pipeline.render()?, true)?;
    pipeline.set_phase(phase);
    ran("another phase function", &pipeline.render()?, false)?;
    pipeline.set_view(rays);
    ran("another view", &pipeline.render()?, false)
}

/// Whether what ran after a change was the view, and the photons before it if they had to.
pub(super) fn ran(change: &str, rendered: &Rendered, photons: bool) -> Result<(), Absent> {
    let has = |name: &str| rendered.passes.iter().any(|pass| pass == name);
    if has("gather") && has("photons") == photons {
        return Ok(());
    }
    let wanted = if photons {
        "photons and view"
    } else {
        "the view alone"
    };
    Err(Absent::Failed(format!(
        "after {change} the passes {:?} ran, where {wanted} have to",
        rendered.passes
    )))
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        self.passes
            .iter()
            .map(|passes| passes as &dyn Measured)
            .collect()
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let [_, _, dropped, retries, rmse, bias, bytes, rest @ ..] = &FIGURES;
        let [
            noise,
            count,
            pilots,
            density,
            equal,
            equal_all,
            _,
            _,
            _,
            _,
            conflicts,
            parts @ ..,
        ] = rest;
        let (parts, after) = parts.split_at(3);
        let [view_steps, flip, flips @ .., per_photon, adds, pilot_adds] = after else {
            return Err("figures are missing".to_owned());
        };
        let deposits = self.tallies.deposits as f64;
        let mut readings = vec![
            Reading::exact(dropped, self.judged.dropped),
            Reading::exact(retries, self.tallies.retries as f64 / deposits),
            Reading::exact(rmse, self.judged.rmse),
            Reading::exact(bias, self.judged.bias),
            Reading::exact(bytes, self.bytes),
            Reading::exact(noise, self.noise),
            Reading::exact(count, self.photons as f64),
            Reading::exact(conflicts, self.tallies.retries as f64),
            Reading::exact(view_steps, self.steps),
            Reading::exact(flip, self.flip),
            Reading::exact(per_photon, deposits / self.photons as f64),
            Reading::exact(adds, self.adds.iter().sum::<u64>() as f64),
        ];
        for (passes, samples) in self.passes.iter().zip(samples) {
            readings.extend(times(passes.part, &samples, deposits)?);
        }
        for (figure, noise) in parts.iter().zip(self.parts.into_iter().flatten()) {
            readings.push(Reading::exact(figure, noise));
        }
        for (figure, flip) in flips.iter().zip(self.flips.into_iter().flatten()) {
            readings.push(Reading::exact(figure, flip));
        }
        if let Some(of) = &self.pilots {
            readings.extend([
                Reading::exact(pilots, of.photons as f64),
                Reading::exact(pilot_adds, self.adds[1] as f64),
                Reading::exact(density, of.density),
                Reading::exact(equal, of.equal[0]),
                Reading::exact(equal_all, of.equal[1]),
            ]);
        }
        Ok(readings)
    }

    fn notes(&self) -> Vec<Note> {
        let note = |text: &String| Note {
            at: Key::default(),
            what: "mode".to_owned(),
            text: text.clone(),
        };
        self.choice.iter().map(note).collect()
    }

    fn picture(&self) -> Option<Picture> {
        self.picture.clone()
    }
}

/// The parts of a pipeline that are timed, each with all of its passes.
fn timed_parts(pipeline: Pipeline, has_pilots: bool, is_smoothed: bool) -> Vec<Passes> {
    let mut parts = vec![Part::Photons, Part::View, Part::All];
    if has_pilots {
        parts.push(Part::Pilots);
    }
    if is_smoothed {
        parts.push(Part::Smooth);
    }
    let pipeline = Rc::new(pipeline);
    let passes = |part| Passes {
        pipeline: Rc::clone(&pipeline),
        part,
    };
    parts.into_iter().map(passes).collect()
}

/// Times of passes of one kind, with so many deposits.
fn times(part: Part, samples: &Samples, deposits: f64) -> Result<Vec<Reading>, String> {
    let [deposit, view, ..] = &FIGURES;
    let [pilots, smooth, photons, frame] = [13, 14, 15, 16].map(|at| &FIGURES[at]);
    // Nanoseconds to milliseconds.
    let ms = |figure| samples.ns_per_item(figure, 1e6);
    Ok(match part {
        Part::Photons => vec![samples.ns_per_item(deposit, deposits)?, ms(photons)?],
        Part::View => vec![samples.ns_per_item(view, f64::from(IMAGE * IMAGE))?],
        Part::Pilots => vec![ms(pilots)?],
        Part::Smooth => vec![ms(smooth)?],
        Part::All => vec![ms(frame)?],
    })
}

/// Times by name, and what they should be: two milliseconds for 4000 deposits, and for each other part.
pub(crate) fn known() -> Result<Vec<(&'static str, f64, f64)>, String> {
    let samples = Samples {
        ms: vec![2.0; 3],
        ..Samples::default()
    };
    let known = [
        (Part::Photons, "scatter-deposit-ns/v1", 500.0),
        (Part::Photons, "photon-march-ms/v1", 2.0),
        (Part::View, "scatter-view-ns/v1", 1953.125),
        (Part::Pilots, "photon-pilots-ms/v1", 2.0),
        (Part::Smooth, "photon-smooth-ms/v1", 2.0),
        (Part::All, "photon-frame-ms/v1", 2.0),
    ];
    let of = |(part, id, expected)| {
        let readings = times(part, &samples, 4000.0)?;
        let found = readings.iter().find(|reading| reading.figure == id);
        let value = found.map_or(f64::NAN, |reading| reading.value.value);
        Ok((id, value, expected))
    };
    known.into_iter().map(of).collect()
}

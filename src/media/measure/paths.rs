//! Curved paths: schemes for the ray equation × where steps end, through a lens of Luneburg and a ball of glass.

use super::{cells_of, declare};
use crate::march::{
    Ended, March, Marcher, Path, Rule, Scheme, angle_of, ball_deviation, focus_miss, march_path,
    parallel_rays,
};
use crate::measure::failed;
use crate::medium::{Homogeneity, Key, Medium};
use crate::optics::Optical;
use crate::{procedures, structure};
use glam::{UVec3, Vec3};
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Work};
use raystone_bench::timing::{Measured, Samples};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_core::parameters;
use raystone_core::params::Parameters as _;
use raystone_gpu::{Elapsed, GpuError, probe_arithmetic};
use raystone_record::Reading;
use raystone_record::figure::{Better, Figure, Shown, Spread};
use std::sync::Arc;

/// The name on the axis of integrators, after [`MEDIA`].
const NAME: &str = "paths";
/// Radii of lens and ball, as parts of the box.
const LENS: f64 = 50.0 / 128.0;
const BALL: f64 = 40.0 / 128.0;
/// Refractive index of the ball.
const GLASS: f64 = 1.5;
/// Rays, at equal distances of their heights.
const RAYS: u32 = 1024;
/// Heights of rays, as parts of the radius.
const HEIGHTS: [f64; 2] = [0.04, 0.8];

parameters! {
    /// What bends light.
    enum Target {
        /// a ball of glass in a grid, its border blurred: checked by Snell's law
        Ball = "ball",
        /// a lens of Luneburg in closed form: checked by its focus
        Lens = "lens",
    }

    /// curved paths through a ball of glass or a lens of Luneburg, by one scheme for the ray equation (Pfeuti 2009)
    struct Load {
        /// what bends light
        target: Target = Target::Ball;
        /// scheme for the ray equation
        scheme: Scheme = Scheme::SemiImplicit;
        /// where steps end; of a lens, after a fixed length always
        rule: Rule = Rule::Fixed;
        /// length of a step in voxels; of regions the least, 0 for none
        step: f64 = 1.0, in 0.0..=16.0;
        /// how much n may differ in a region
        epsilon: f64 = 0.01, in 0.0..=1.0;
        /// voxels along each axis
        side: u32 = 128, in 32..=256;
    }
}

static FIGURES: [Figure; 6] = [
    Figure::new(
        "media-angle/v1",
        "error of angles, RMS",
        "degrees",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "media-focus/v1",
        "distance from the focus, mean",
        "voxels",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "media-drift/v1",
        "drift of |v| from n",
        "",
        Better::Lower,
        Shown::Percent,
        Spread::Exact,
    ),
    Figure::new(
        "media-path-steps/v1",
        "steps",
        "per path",
        Better::Lower,
        Shown::Digits(3),
        Spread::Exact,
    ),
    Figure::new(
        "media-capped/v1",
        "paths that used up their steps",
        "",
        Better::Lower,
        Shown::Count,
        Spread::Exact,
    ),
    Figure::new(
        "media-path-ns/v1",
        "time",
        "ns per path",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
];

/// How far the order of sums may move an end, in voxels, velocity included.
const ROUNDED: f32 = 0.1;

pub(super) struct Paths;

impl Measurement for Paths {
    fn name(&self) -> &'static str {
        "media:paths"
    }

    fn plural(&self) -> &'static str {
        "sets of curved paths"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        declare::<Load>(catalogue, NAME, Load::ABOUT);
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        cells_of(plan, &[Axis::Integrator, Axis::Kernels], |name| {
            name == NAME
        })
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?}", experiment.timing)
    }

    fn cost(&self, _: &Cell, cost: &Cost) -> Work {
        Work::kernels(1) + cost.timed(Work::rays(16 * RAYS)) + Work::other(0.3)
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let mut balls: Vec<(u32, Arc<Ball>)> = Vec::new();
        Box::new(cells.iter().map(move |cell| {
            at.say(cell.to_string());
            let load = Load::from_checked(&cell[Axis::Integrator].params);
            let ball = match balls.iter().find(|(side, _)| *side == load.side) {
                _ if load.target == Target::Lens => None,
                Some((_, ball)) => Some(Arc::clone(ball)),
                None => {
                    let volume = procedures::ball(load.side, BALL).map_err(failed)?;
                    let optical = Optical::of(&volume);
                    let ball = Arc::new(Ball { volume, optical });
                    balls.push((load.side, Arc::clone(&ball)));
                    Some(ball)
                }
            };
            let ready = Ready::new(at, cell, &load, ball.as_deref())?;
            Ok(Box::new(ready) as Box<dyn Prepared>)
        }))
    }
}

struct Ball {
    volume: crate::Volume,
    optical: Optical,
}

/// Paths on the device whose ends were judged.
struct Ready {
    marcher: Marcher,
    /// Of angles or distances.
    error: Reading,
    drift: f64,
    steps: f64,
    capped: usize,
}

impl Ready {
    fn new(at: &At, cell: &Cell, load: &Load, ball: Option<&Ball>) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let is_fixed = load.rule == Rule::Fixed || load.target == Target::Lens;
        if is_fixed && load.step <= 0.0 {
            return Err(Absent::Refused(
                "a fixed step of 0 never ends: give `step`".to_owned(),
            ));
        }
        let lens = Optical::Lens {
            size: UVec3::splat(load.side),
            radius: (LENS * f64::from(load.side)) as f32,
        };
        let optical = ball.map_or(&lens, |ball| &ball.optical);
        let regions = match ball {
            Some(ball) if load.rule == Rule::Region => Some(level_map(ball, load.epsilon)?),
            _ => None,
        };
        let march = March {
            scheme: load.scheme,
            step: load.step as f32,
            nudge: 1e-3,
            most_steps: (f64::from(8 * load.side) / load.step.clamp(0.05, 1.0)) as u32,
        };
        let (heights, begins) = begins(load, optical);
        let marcher = Marcher::new(gpu, &march, optical, regions.as_ref(), &begins)?;
        let (ended, _) = marcher.march()?;
        if probe_arithmetic(gpu)?.is_exact() {
            for (begin, found) in begins.iter().zip(&ended).step_by(16) {
                let twin = march_path(&march, optical, regions.as_ref(), *begin);
                if differs(load.scheme, found, &twin) {
                    return Err(Absent::Failed(format!(
                        "{found:?} where the twin has {twin:?}"
                    )));
                }
            }
        }
        let (drift, steps) = drift_and_steps(&ended);
        Ok(Self {
            error: error_of(load, &ended, &heights),
            drift,
            steps,
            capped: ended.iter().filter(|e| optical.holds(e.path.x)).count(),
            marcher,
        })
    }
}

/// Whether a path is not that of the twin. Of Runge and Kutta's sums the driver may choose the order, which moves an end
/// by rounding alone.
fn differs(scheme: Scheme, found: &Ended, twin: &Ended) -> bool {
    if scheme != Scheme::RungeKutta {
        return found != twin;
    }
    let off = (found.path.x - twin.path.x).length() + (found.path.v - twin.path.v).length();
    off > ROUNDED || off.is_nan()
}

fn level_map(ball: &Ball, epsilon: f64) -> Result<Medium, Absent> {
    let registry = structure::registry();
    let map = registry
        .find("level-map")
        .map(|kind| kind.make(&Default::default()));
    let Some(Ok(map)) = map else {
        return Err(Absent::Failed("there is no level map".to_owned()));
    };
    let key = Key::Refraction;
    Ok(Medium::new(&ball.volume, map, Homogeneity { key, epsilon }))
}

/// Heights of rays above the axis, in voxels, and where they begin.
fn begins(load: &Load, optical: &Optical) -> (Vec<f64>, Vec<Path>) {
    let side = f64::from(load.side);
    let radius = side
        * if load.target == Target::Lens {
            LENS
        } else {
            BALL
        };
    let height = |k: u32| {
        let part = (f64::from(k) + 0.5) / f64::from(RAYS);
        radius * (HEIGHTS[0] + (HEIGHTS[1] - HEIGHTS[0]) * part)
    };
    let heights: Vec<f64> = (0..RAYS).map(height).collect();
    let middle = side / 2.0;
    let begins = match load.target {
        Target::Lens => parallel_rays(optical, load.side, radius, &heights),
        Target::Ball => (heights.iter())
            .map(|height| {
                let x = Vec3::new(0.5, (middle + height) as f32, middle as f32);
                Path::new(optical, x, Vec3::X)
            })
            .collect(),
    };
    (heights, begins)
}

/// The greatest drift, and the mean number of steps.
fn drift_and_steps(ended: &[Ended]) -> (f64, f64) {
    let drift = ended.iter().map(|e| e.drift).fold(0.0, f32::max);
    let steps: f64 = ended.iter().map(|e| f64::from(e.steps)).sum();
    (drift.into(), steps / ended.len() as f64)
}

/// Known ends through the middle of a ball, which Snell's law leaves straight, 3° and 4° off; and through the focus of a
/// lens, one of them three voxels beside it: of each the error by name, and what it should be.
pub(crate) fn known() -> [(&'static str, f64, f64); 4] {
    let end = |x: Vec3, before: Vec3, degrees: f32, steps| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Ended {
            path: Path {
                x,
                v: Vec3::new(cos, sin, 0.0),
            },
            before,
            steps,
            drift: 0.125 * steps as f32,
        }
    };
    let bent =
        [3.0, -4.0].map(|degrees| end(Vec3::ZERO, Vec3::ZERO, degrees, 2 + degrees.abs() as u32));
    let load = |target| Load {
        target,
        ..Load::default()
    };
    let side = Load::default().side as f32;
    let (middle, far) = (Vec3::splat(0.5 * side), side * (0.5 + LENS as f32));
    let along = |y: f32| {
        let at = |x: f32| Vec3::new(x, middle.y + y, middle.z);
        end(at(far + 1.0), at(far - 20.0), 0.0, 1)
    };
    let (drift, steps) = drift_and_steps(&bent);
    let of = |load: &Load, ended: &[Ended]| error_of(load, ended, &[0.0; 2]).value.value;
    [
        (
            "error of angles",
            of(&load(Target::Ball), &bent),
            12.5_f64.sqrt(),
        ),
        (
            "distance from a focus",
            of(&load(Target::Lens), &[along(0.0), along(3.0)]),
            focus_error(),
        ),
        ("drift of paths", drift, 0.75),
        ("number of steps", steps, 5.5),
    ]
}

/// Mean of 0 and of the chord from the focus to where a parallel 3 voxels off meets the sphere.
fn focus_error() -> f64 {
    let radius = LENS * f64::from(Load::default().side);
    let back = radius - (radius * radius - 9.0).sqrt();
    0.5 * 3.0_f64.hypot(back)
}

/// Mean distance from the focus, or the root of the mean square of angles' errors.
fn error_of(load: &Load, ended: &[Ended], heights: &[f64]) -> Reading {
    let side = f64::from(load.side);
    let count = ended.len() as f64;
    match load.target {
        Target::Lens => {
            let miss = ended.iter().map(|e| focus_miss(load.side, LENS * side, e));
            Reading::exact(&FIGURES[1], miss.sum::<f64>() / count)
        }
        Target::Ball => {
            let off = |(e, height): (&Ended, &f64)| {
                angle_of(e.path.v) - ball_deviation(GLASS, BALL * side, *height)
            };
            let squares = ended.iter().zip(heights).map(off).map(|off| off * off);
            Reading::exact(&FIGURES[0], (squares.sum::<f64>() / count).sqrt())
        }
    }
}

impl Measured for Ready {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        Ok(self.marcher.march()?.1)
    }
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        vec![self]
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let samples = samples.into_iter().next().unwrap_or_default();
        let counted = [self.drift, self.steps, self.capped as f64];
        readings_of(&self.error, counted, &samples)
    }
}

/// The readings of an error; of drift, steps and paths that used them up; and of times.
fn readings_of(
    error: &Reading,
    [drift, steps, capped]: [f64; 3],
    samples: &Samples,
) -> Result<Vec<Reading>, String> {
    let [_, _, of_drift, of_steps, of_capped, time] = &FIGURES;
    Ok(vec![
        error.clone(),
        Reading::exact(of_drift, drift),
        Reading::exact(of_steps, steps),
        Reading::exact(of_capped, capped),
        samples.ns_per_item(time, f64::from(RAYS))?,
    ])
}

/// Readings by name, and what they should be: 2.048 ms are 2000 ns for each of 1024 rays.
pub(super) fn known_readings() -> Result<[(&'static str, f64, f64); 5], String> {
    let samples = Samples {
        ms: vec![2.048; 3],
        ..Samples::default()
    };
    let error = Reading::exact(&FIGURES[0], 0.5);
    let found = readings_of(&error, [0.125, 40.0, 3.0], &samples)?;
    let of = |id: &str| {
        let reading = found.iter().find(|reading| reading.figure == id);
        reading.map_or(f64::NAN, |reading| reading.value.value)
    };
    Ok([
        ("reading of angles", of("media-angle/v1"), 0.5),
        ("reading of drift", of("media-drift/v1"), 0.125),
        ("reading of steps", of("media-path-steps/v1"), 40.0),
        ("reading of capped paths", of("media-capped/v1"), 3.0),
        ("time of a path", of("media-path-ns/v1"), 2000.0),
    ])
}

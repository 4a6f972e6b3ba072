//! Known turns and rays as measurements report them, before any is timed: what a record says of its times, no second figure
//! of it need contradict.

use super::compactions::rates;
use super::errors::bias_options;
use super::orders::of_turns;
use super::primary::Turns;
use super::structure_times::of_rounds;
use super::times::median_stages;
use crate::animation::last_rounds;
use crate::coherence::known;
use crate::compaction::least_bytes;
use crate::memory;
use crate::ray_sets::readings;
use crate::sampler_cost::ns_per_draw;
use crate::stopping::is_met;
use crate::timing::{Measured, Samples, interleave};
use raystone_accel::{Hit, NO_HIT};
use raystone_config::{StopRule, Timing};
use raystone_core::geometry::Ray;
use raystone_core::params::Choice as _;
use raystone_gpu::compaction::Order;
use raystone_gpu::{Elapsed, GpuError};
use raystone_record::{PrimaryRecord, RayClass, Reading};
use raystone_render::{InOrder, Order as PixelOrder};
use raystone_stats::comparison::LogFigure;
use raystone_stats::interval::Interval;
use raystone_verify::rays::RaySet;
use raystone_verify::shadow_rays::unlike_shadow;
use std::cell::RefCell;

/// A value by name, and what it should be.
type Known = (&'static str, f64, f64);

/// Relative error of a few operations.
const ROUNDING: f64 = 1e-9;
const ROUNDS: usize = 12;

/// Takes them.
///
/// # Errors
/// One is reported as something else: which, and both values.
pub(super) fn check() -> Result<(), String> {
    known::check()?;
    memory::check()?;
    WARM_UPS.into_iter().try_for_each(rounds)?;
    let all = classes()
        .into_iter()
        .chain(turns())
        .chain(per_item()?)
        .chain(stages())
        .chain(stops())
        .chain(frames())
        .chain(margins());
    for (what, found, expected) in all {
        let agrees = (found - expected).abs() <= ROUNDING * expected.abs();
        if !agrees {
            return Err(format!(
                "the {what} of known turns is {found}, and should be {expected}: this program reports wrong times; build it \
                 anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

/// Turns of which each takes a nanosecond more than the one before, whosever it was.
struct Counting<'a> {
    place: usize,
    turns: &'a RefCell<Vec<usize>>,
}

/// By a clock of the device, by that of the wall and by those of the processors, of a turn by its number.
fn taken(turn: usize) -> Elapsed {
    let ms = 1e-9 * turn as f64;
    Elapsed {
        gpu_ms: Some(ms),
        wall_ms: 2.0 * ms,
        cpu_ms: Some(3.0 * ms),
        backwards: false,
    }
}

impl Measured for Counting<'_> {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        let mut turns = self.turns.borrow_mut();
        turns.push(self.place);
        Ok(taken(turns.len()))
    }
}

/// Milliseconds of warming up at most, and turns that three measurements warm up by. At once, each has one for the compiler and two
/// that are compared. Given time, the first goes on until its turns, each one longer than the one before, differ by a twentieth: with
/// the twentieth; the others are as steady from the first two on.
const WARM_UPS: [(u32, usize); 2] = [(0, 9), (60_000, 26)];

/// Whose turn it was, and what three measurements say.
type Turned = (Vec<usize>, Vec<Result<Samples, GpuError>>);

fn interleaved(max_warmup_ms: u32, seed: u64) -> Result<Turned, String> {
    let log = RefCell::default();
    let all = [0, 1, 2].map(|place| Counting { place, turns: &log });
    let timing = Timing {
        rounds: ROUNDS as u32,
        min_warmup_ms: 0,
        max_warmup_ms,
        ..Timing::default()
    };
    let found = interleave(&all, &timing, seed, || ()).map_err(|(_, e)| e.to_string())?;
    Ok((log.take(), found))
}

/// Three measurements in rounds, in an order by the seed: each has one turn in each, none of which warms up, and they take
/// all places, also in orders that no turn of all three makes.
fn rounds((max_warmup_ms, warm_up): (u32, usize)) -> Result<(), String> {
    let wrong = |what: &str| {
        Err(format!(
            "{what} of known turns: this program times wrongly; build it anew, and report what stays wrong"
        ))
    };
    let (log, found) = interleaved(max_warmup_ms, 1)?;
    let order = |seed| interleaved(0, seed).map(|(log, _)| log);
    if order(1)? != order(1)? || order(1)? == order(2)? {
        return wrong("a seed has two orders, or two seeds have the same one");
    }
    let begin = log.len().saturating_sub(3 * ROUNDS);
    let ordered: Vec<&[usize]> = log[begin..].chunks(3).collect();
    let is_round = |round: &&[usize]| (0..3).all(|place| round.contains(&place));
    if begin != warm_up {
        return wrong("another number of turns warm up");
    }
    if !ordered.iter().all(is_round) {
        return wrong("a measurement has no turn, or two, in a round");
    }
    let stood_at = |place, turn| ordered.iter().any(|round| round[turn] == place);
    if !(0..9).all(|k| stood_at(k / 3, k % 3)) {
        return wrong(
            "a measurement never has the first turn of a round, or the second or the last",
        );
    }
    if !ordered
        .iter()
        .any(|round| (0..3).filter(|&k| round[k] == k).count() == 1)
    {
        return wrong("two measurements never change places while the third keeps its own");
    }
    for (place, found) in found.into_iter().enumerate() {
        let samples = found.map_err(|e| e.to_string())?;
        let own = (begin..log.len()).filter(|turn| log[*turn] == place);
        let own: Vec<Elapsed> = own.map(|turn| taken(turn + 1)).collect();
        let of = |ms: fn(&Elapsed) -> f64| own.iter().map(ms).collect::<Vec<f64>>();
        let is_equal = samples.ms == of(|e| e.gpu_ms.unwrap_or_default())
            && samples.wall_ms == of(|e| e.wall_ms)
            && samples.cpu_ms == of(|e| e.cpu_ms.unwrap_or_default());
        if !is_equal {
            return wrong("the samples are not the times");
        }
    }
    Ok(())
}

fn at(found: Option<Interval>) -> f64 {
    found.map_or(f64::NAN, |interval| interval.value)
}

fn last(of: &[f64]) -> f64 {
    of.last().copied().unwrap_or(f64::NAN)
}

/// Four rays, three of which hit, and two of which do what the shadow rays that they stand for do not; one of five is none.
fn classes() -> [Known; 6] {
    let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
    let hit = |triangle| Hit {
        triangle,
        ..Hit::miss(&ray)
    };
    let set = RaySet {
        class: RayClass::Primary,
        rays: vec![ray; 4],
        truth: vec![hit(0), hit(NO_HIT), hit(2), hit(3)],
        shadow: Vec::new(),
    };
    let samples = || Samples {
        ms: vec![7.0],
        wall_ms: vec![2.0],
        cpu_ms: vec![3.0],
    };
    let of = |is_software| {
        let rate = Interval::exact(1.0);
        of_rounds(&set, (vec![1.0], samples()), rate, is_software)
    };
    let [own, of_gpu] = [true, false].map(of);
    let mut with_none = set.rays.clone();
    with_none.push(Ray {
        direction: [f32::NAN; 3],
        ..ray
    });
    let reversed = RaySet {
        class: RayClass::ShadowReversed,
        shadow: vec![0, 2, 1, 3],
        ..set.clone()
    };
    let shadow = RaySet {
        class: RayClass::Shadow,
        ..set.clone()
    };
    let unlike = unlike_shadow(&reversed, &[set.clone(), shadow]);
    [
        (
            "number of rays unlike their shadow rays",
            unlike.map_or(f64::NAN, |count| count as f64),
            2.0,
        ),
        ("share of hits", own.hit_fraction, 0.75),
        ("time by the wall", last(&own.wall_ms), 2.0),
        ("time of processors", last(&own.cpu_ms), 3.0),
        (
            "time of processors beside a GPU",
            of_gpu.cpu_ms.len() as f64,
            0.0,
        ),
        ("number of rays", readings::live(&with_none) as f64, 4.0),
    ]
}

/// Rasterised and traced; in an order of pixels, with eight samples.
fn turns() -> [Known; 5] {
    let turns = Turns {
        raster_ms: vec![1.0; 3],
        traced_ms: vec![2.0; 3],
        ..Turns::default()
    };
    let primary = turns.timed(PrimaryRecord::default());
    let ms = |wall_ms| Elapsed {
        wall_ms,
        ..Elapsed::default()
    };
    let turn = InOrder {
        passes: 16,
        total: ms(24.0),
        first_picture: ms(2.0),
    };
    let order = of_turns(PixelOrder::ALL[0], &[turn; 3], 8.0);
    [
        ("time of rasterising", at(primary.raster_ms), 1.0),
        ("time of tracing", at(primary.traced_ms), 2.0),
        ("time of a sample", at(order.ms_per_spp), 3.0),
        ("time to a first picture", at(order.first_picture_ms), 2.0),
        ("number of passes", order.passes as f64, 16.0),
    ]
}

/// A millisecond for a thousand elements of eight bytes, for a thousand rays after as long a build, and for four pairs of 8
/// samples of 2^14 pixels twice that many ns.
fn per_item() -> Result<Vec<Known>, String> {
    let ms = [1.0; 3];
    let rates: Vec<Reading> = rates(&ms, 1000.0, 8000.0).collect();
    let samples = Samples {
        ms: ms.to_vec(),
        ..Samples::default()
    };
    let times = readings::times(&samples, 1000.0, 1.0)?;
    let value = |all: &[Reading], k: usize| all.get(k).map_or(f64::NAN, |one| one.value.value);
    Ok(vec![
        ("millions of elements a second", value(&rates, 0), 1.0),
        ("gigabytes a second", value(&rates, 1), 0.008),
        (
            "least bytes of a thousand flags",
            least_bytes(Order::Stable, 1000, [16, 250]) as f64,
            12_000.0,
        ),
        (
            "least bytes of what keeps holes",
            least_bytes(Order::WithHoles, 1000, [16, 250]) as f64,
            8000.0,
        ),
        ("time of a ray", value(&times, 0), 1000.0),
        ("time of a ray with building", value(&times, 1), 2000.0),
        ("time of building", value(&times, 2), 1.0),
        (
            "cost of a pair of dimensions",
            ns_per_draw(1.048_576, 4, 8),
            2.0,
        ),
    ])
}

/// Medians, not means or the longest; one stage alone is none.
fn stages() -> [Known; 3] {
    let measured = [[2.0, 7.0], [9.0, 1.0], [3.0, 2.0]].map(|[a, b]| {
        let stages = [("a", a), ("b", b)].map(|(name, ms)| (name.to_owned(), ms));
        std::collections::BTreeMap::from(stages)
    });
    let found = median_stages(&measured);
    let at = |name: &str| found.get(name).copied().unwrap_or(f64::NAN);
    let mut alone = measured.to_vec();
    alone.iter_mut().for_each(|stages| {
        stages.remove("b");
    });
    let alone = median_stages(&alone).len();
    [
        ("time of a stage", at("a"), 3.0),
        ("time of another stage", at("b"), 2.0),
        ("number of stages of one", alone as f64, 0.0),
    ]
}

/// Seven errors about 1.49, whose upper end is 3.25 with a chance of 5 % and 5.42 with 1 %: five looks share the first.
fn stops() -> [Known; 3] {
    let errors = [1.1, 0.4, 2.0, 1.6, 2.9, 0.8, 2.6];
    let error = LogFigure::of_rounds("rounds", &errors);
    let met = |relmse, looks| {
        let rule = StopRule {
            relmse,
            confidence: 0.95,
            tile: None,
        };
        let is_met = error
            .as_ref()
            .is_some_and(|error| is_met(&rule, error, looks));
        f64::from(u8::from(is_met))
    };
    [
        ("end after one look", met(3.3, 1), 1.0),
        ("end after five looks", met(5.4, 5), 0.0),
        ("later end after five looks", met(5.5, 5), 1.0),
    ]
}

/// The last three of four notes, the first of which warmed up.
fn frames() -> [Known; 3] {
    let notes: Vec<Elapsed> = [9.0, 1.0, 2.0, 3.0]
        .map(|ms| Elapsed {
            gpu_ms: Some(ms),
            wall_ms: 10.0 * ms,
            cpu_ms: Some(100.0 * ms),
            backwards: false,
        })
        .to_vec();
    let cost = last_rounds(&notes, 3);
    let sum = |of: &[f64]| of.iter().sum();
    [
        ("time of a frame's passes", sum(&cost.passes_ms), 6.0),
        ("time of a frame by the wall", sum(&cost.wall_ms), 60.0),
        (
            "time of a frame on processors",
            sum(&cost.processor_ms),
            600.0,
        ),
    ]
}

/// A hundredth is shared by four; sixteen samples are rounded to half an ulp each, 2⁻²⁴, beside the reference.
fn margins() -> [Known; 2] {
    let options = bias_options(4, 16, 1e-6);
    let rounding = 16.0 * 0.5_f64.powi(24) * (1.0 + 1e-6) + 1e-6;
    [
        ("level of a bias", options.alpha, 0.0025),
        ("margin of a bias", options.rounding, rounding),
    ]
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}

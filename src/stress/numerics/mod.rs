//! Accumulation and sampling: losses of f32 sums, conversions, digits, mappings and long paths on an adapter, each
//! figure beside the level from which it is an alarm.
//!
//! `docs/stress-numerics.md` explains the figures and levels.

mod conversion;
mod determinism;
mod digits;
mod energy;
mod mappings;
mod rig;
mod sums;

use super::Found;
use super::suite::Suite;
use raystone_gpu::{Gpu, GpuError};
use raystone_record::{Key, axis, figure};
use raystone_render::{IntegratorError, StageError};
use raystone_sampling::SamplerError;
use raystone_scene::SceneError;

/// One thing measured on an adapter, with the level from which it is an alarm.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// The name of the figure.
    pub name: String,
    /// The figure: the larger, the worse.
    pub value: f64,
    /// The largest value that is no alarm; absent where the figure is only there for comparison.
    pub alarm: Option<f64>,
    /// Unit of `value` and `alarm`; empty for plain numbers.
    pub unit: String,
    /// True if `value` is a number and not beyond `alarm`.
    pub passed: bool,
    /// Explanation for the reader: frequency, place, consequences.
    pub note: String,
}

impl Gauge {
    /// Returns a figure for comparison, a plain number.
    fn new(name: impl Into<String>, value: f64, note: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value,
            alarm: None,
            unit: String::new(),
            passed: !value.is_nan(),
            note: note.into(),
        }
    }

    /// Returns the same figure, which must not exceed this.
    fn at_most(self, alarm: f64) -> Self {
        Self {
            alarm: Some(alarm),
            passed: self.value <= alarm,
            ..self
        }
    }

    /// Returns the same figure in a unit.
    fn in_unit(self, unit: &str) -> Self {
        let unit = unit.to_owned();
        Self { unit, ..self }
    }
}

/// A reason why the figures cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum NumericsError {
    /// A kernel does not compile or run.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A scene cannot be made.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A structure is not on the device.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// A sampler cannot be made.
    #[error(transparent)]
    Sampler(#[from] SamplerError),
    /// An integrator cannot be had.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    /// A stream of words cannot be drawn.
    #[error("{0}")]
    Stream(String),
}

/// Measures all figures on `gpu`; `quick` shortens the long ones, at the cost of fewer numbers tried.
///
/// # Errors
/// A kernel does not compile or run, or memory is short.
pub fn run(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let mut figures = sums::figures(gpu)?;
    figures.extend(conversion::figures(gpu, quick)?);
    figures.extend(digits::figures(gpu, quick)?);
    figures.extend(mappings::figures(gpu, quick)?);
    figures.extend(energy::figures(gpu, quick)?);
    figures.extend(determinism::figures(gpu)?);
    Ok(figures)
}

/// Returns all figures with their notes, and the number beyond their level. One that is no number is an alarm without
/// a figure.
pub(crate) fn found(suite: &Suite) -> Result<Found, NumericsError> {
    let mut found = Found::default();
    let gauges = run(suite.gpu(), suite.scope.settings.quick)?;
    for gauge in &gauges {
        let unit = if gauge.unit.is_empty() { "" } else { ", " };
        let subject = format!("{}{unit}{}", gauge.name, gauge.unit);
        let at = Key::default().with(axis::SUBJECT, subject);
        let value = Some(gauge.value).filter(|value| value.is_finite());
        found.add(&at, value.map(|value| (&figure::NUMERICS, value)));
        found.add(&at, gauge.alarm.map(|alarm| (&figure::ALARM, alarm)));
        let what = if gauge.passed { "numerics" } else { "ALARM" };
        found.note(&at, what, gauge.note.clone());
    }
    let alarms = gauges.iter().filter(|gauge| !gauge.passed);
    let alarms: Vec<&str> = alarms.map(|gauge| &*gauge.name).collect();
    found.add(&Key::default(), [(&figure::ALARMS, alarms.len() as f64)]);
    if !alarms.is_empty() {
        found.note(&Key::default(), "beyond their level", alarms.join(", "));
    }
    Ok(found)
}

/// Half the distance from 1 to the next f32, the unit of rounding errors.
const U: f64 = 1.0 / (1 << 24) as f64;

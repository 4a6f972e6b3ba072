//! The product of the axes: points, filters and excludes.

use super::ConfigError;
use super::axis::{Axis, AxisMap};
use super::cells::Cell;
use super::error::Place;
use super::experiment::{Axes, CellSet, Condition, Experiment};
use super::pattern::Selector;
use super::plan::Skipped;
use raystone_core::params::Variant;
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// Limit on the cells of the full product, before excludes.
const MAX_CELLS: usize = 1 << 20;

pub(super) fn check_size(experiment: &Experiment) -> Result<(), ConfigError> {
    let lengths = Cell::FULL.map(|axis| experiment.axes[axis].len());
    let cells = lengths.into_iter().fold(1, usize::saturating_mul);
    if cells <= MAX_CELLS {
        return Ok(());
    }
    Err(ConfigError::TooMany {
        at: Place::start_of(&experiment.source),
        what: "the cells of all axes".to_owned(),
        count: cells,
        limit: MAX_CELLS,
    })
}

/// True if each seed of a sequence and decorrelation gives new samples, or their conflict.
pub(super) trait IsRandomised: Fn(&Variant, &Variant) -> Result<bool, String> {}
impl<F: Fn(&Variant, &Variant) -> Result<bool, String>> IsRandomised for F {}

/// Caches the answer for each pair of variants.
pub(super) fn asked_once(is_randomised: impl IsRandomised) -> impl IsRandomised {
    let known: RefCell<HashMap<[*const Variant; 2], Result<bool, String>>> = RefCell::default();
    move |sequence: &Variant, decorrelation: &Variant| {
        let mut known = known.borrow_mut();
        let pair = [sequence, decorrelation].map(std::ptr::from_ref);
        let answer = known.entry(pair);
        answer
            .or_insert_with(|| is_randomised(sequence, decorrelation))
            .clone()
    }
}

#[derive(Clone)]
pub(super) struct Point<'a>(AxisMap<Option<&'a Arc<Variant>>>);

pub(super) type Shared = AxisMap<Vec<Arc<Variant>>>;

pub(super) fn shared(axes: &Axes) -> Shared {
    let mut shared = Shared::default();
    for (axis, variants) in axes.iter() {
        shared[axis] = variants.iter().cloned().map(Arc::new).collect();
    }
    shared
}

impl Point<'_> {
    fn get(&self, axis: Axis) -> Option<&Variant> {
        self.0[axis].map(|variant| &**variant)
    }

    /// The reason why its sequence and decorrelation are incompatible, if they are.
    pub(crate) fn refusal(&self, is_randomised: &impl IsRandomised) -> Option<String> {
        let sequence = self.get(Axis::Sequence)?;
        is_randomised(sequence, self.get(Axis::Decorrelation)?).err()
    }

    pub(crate) fn cell(&self, is_randomised: &impl IsRandomised) -> Cell {
        let variants = self.0.iter();
        let variants = variants.filter_map(|(axis, variant)| Some((axis, (*variant)?)));
        let mut cell = variants.fold(Cell::default(), |cell, (axis, variant)| {
            cell.sharing(axis, variant)
        });
        let pair = (self.get(Axis::Sequence), self.get(Axis::Decorrelation));
        let randomised = match pair {
            (Some(sequence), Some(decorrelation)) => is_randomised(sequence, decorrelation),
            _ => Ok(false),
        };
        cell.randomised = randomised == Ok(true);
        cell
    }
}

/// Incompatible pairs of sequence and decorrelation, with the number of full cells lost.
pub(super) fn refused(full: &[Point], is_randomised: &impl IsRandomised) -> Vec<Skipped> {
    let mut out: Vec<Skipped> = Vec::new();
    for point in full {
        let Some(reason) = point.refusal(is_randomised) else {
            continue;
        };
        match out.iter_mut().find(|skipped| skipped.reason == reason) {
            Some(skipped) => skipped.cells += 1,
            None => out.push(Skipped {
                cell: point.cell(is_randomised).on(&Cell::STREAM).to_string(),
                reason,
                cells: 1,
            }),
        }
    }
    out
}

/// Removes the cells of one exclude from those that are still wanted.
pub(super) fn excluded(
    exclude: &CellSet,
    experiment: &Experiment,
    full: &[Point],
    wanted: &mut Vec<Point>,
) -> Result<Option<Skipped>, ConfigError> {
    if !exclude.lenient && !full.iter().any(|point| exclude.covers(point)) {
        return Err(ConfigError::UselessExclude {
            at: exclude.at.clone(),
            section: "exclude",
            exclude: exclude.to_string(),
        });
    }
    let includes = &experiment.includes;
    let is_out =
        |point: &Point| exclude.covers(point) && !includes.iter().any(|i| i.touches(point));
    let cells = removed(wanted, is_out);
    Ok((cells > 0).then(|| Skipped {
        cell: exclude.to_string(),
        reason: format!("excluded by {}", exclude.at),
        cells,
    }))
}

/// Checks that an include matches a cell; otherwise it is probably misspelt.
pub(super) fn included(include: &CellSet, full: &[Point]) -> Result<(), ConfigError> {
    if include.lenient || full.iter().any(|point| include.covers(point)) {
        Ok(())
    } else {
        Err(ConfigError::UselessExclude {
            at: include.at.clone(),
            section: "include",
            exclude: include.to_string(),
        })
    }
}

/// Removes such cells, each of which is counted once however many rules fit it; returns their number.
fn removed(wanted: &mut Vec<Point>, is_out: impl Fn(&Point) -> bool) -> usize {
    let before = wanted.len();
    wanted.retain(|point| !is_out(point));
    before - wanted.len()
}

/// Removes the cells that conditions of variants exclude from those that are still wanted.
pub(super) fn unmet(experiment: &Experiment, wanted: &mut Vec<Point>) -> Vec<Skipped> {
    let skipped = experiment.conditions.iter().filter_map(|condition| {
        let cells = removed(wanted, |point| !condition.allows(point));
        let sets: Vec<String> = condition.cells.iter().map(CellSet::to_string).collect();
        (cells > 0).then(|| Skipped {
            cell: format!("{} {}", condition.axis, condition.label),
            reason: format!("goes only with {}", sets.join(", or ")),
            cells,
        })
    });
    skipped.collect()
}

/// All points of the product of the axes in `which`, the last one varying fastest.
pub(super) fn product<'a>(axes: &'a Shared, which: &[Axis]) -> Vec<Point<'a>> {
    let mut points = vec![Point(AxisMap::default())];
    for &axis in which {
        points = points
            .iter()
            .flat_map(|point| {
                axes[axis].iter().map(|variant| {
                    let mut point = point.clone();
                    point.0[axis] = Some(variant);
                    point
                })
            })
            .collect();
    }
    points
}

impl CellSet {
    /// True if the point has every axis that the exclude names, and matches on each.
    pub(super) fn covers(&self, point: &Point) -> bool {
        self.patterns.iter().all(|(axis, patterns)| {
            let variant = point.get(*axis);
            variant.is_some_and(|variant| patterns.iter().any(|p| p.matches(variant)))
        })
    }

    /// True if the point matches on each named axis that it has.
    pub(super) fn touches(&self, point: &Point) -> bool {
        self.patterns.iter().all(|(axis, patterns)| {
            let variant = point.get(*axis);
            variant.is_none_or(|variant| patterns.iter().any(|p| p.matches(variant)))
        })
    }
}

impl Condition {
    /// True if the point has another variant, or matches.
    pub(super) fn allows(&self, point: &Point) -> bool {
        let is_its = |variant: &Variant| variant.label == self.label;
        !point.get(self.axis).is_some_and(is_its) || self.cells.iter().any(|c| c.touches(point))
    }
}

impl Experiment {
    /// True if no rule of the experiment excludes a point.
    pub(super) fn keeps(&self, point: &Point) -> bool {
        let is_excluded = self.excludes.iter().any(|e| e.covers(point));
        (!is_excluded || self.includes.iter().any(|i| i.touches(point)))
            && self.conditions.iter().all(|c| c.allows(point))
    }
}

/// Parses `--only`; each pattern must match a variant of the experiment.
pub(super) fn filter(only: &[String], axes: &Axes) -> Result<Selector, ConfigError> {
    let filter = Selector::parse(only, &Axis::ALL.map(Axis::name))?;
    filter.check(|axis| {
        Axis::from_name(axis).map_or_else(Vec::new, |axis| axes[axis].iter().collect())
    })?;
    Ok(filter)
}

impl Point<'_> {
    /// True if the point matches on every filtered axis that it has.
    pub(super) fn fits(&self, filter: &Selector) -> bool {
        filter.fits(|axis, fits| {
            let variant = Axis::from_name(axis).and_then(|axis| self.get(axis));
            variant.is_none_or(fits)
        })
    }
}

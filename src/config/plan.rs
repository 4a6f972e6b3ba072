//! From axes to the cells that have to be run.
//!
//! Hits are equal to the bit in every structure, so an image does not depend on the structure: its
//! error is measured once per scene, integrator and sampler, with all replicates. Time is measured
//! for every full cell, at few samples per pixel. The plan counts what this saves.

use super::ConfigError;
use super::cells::{SamplerCell, StreamCell, StructureCell, TimeCell};
use super::error::Place;
use super::experiment::{Axes, Exclude, Experiment};
use super::keys::Axis;
use super::pattern::Pattern;
use crate::params::Variant;
use crate::text::nearest;
use std::fmt::{self, Write as _};

/// Cells left out, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// The cells, in words.
    pub cell: String,
    /// Why they are left out.
    pub reason: String,
    /// How many they are (full cells for an exclude).
    pub cells: usize,
}

/// What has to be run, in the order of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Scenes that at least one cell needs.
    pub scenes: Vec<Variant>,
    /// Kernels that at least one cell needs.
    pub kernels: Vec<Variant>,
    /// Structures to build, gate and trace.
    pub structures: Vec<StructureCell>,
    /// Samplers whose error is measured.
    pub samplers: Vec<SamplerCell>,
    /// Full cells whose time is measured.
    pub times: Vec<TimeCell>,
    /// Streams whose discrepancy is measured.
    pub streams: Vec<StreamCell>,
    /// What is left out.
    pub skipped: Vec<Skipped>,
    /// Renders (image × replicate) that measuring the error of every full cell would need.
    pub renders_full_product: usize,
    /// Renders that measuring the error once per sampler needs.
    pub renders_planned: usize,
}

impl Plan {
    /// Expands the axes of `experiment` into cells, without its excludes.
    ///
    /// `only` holds filters `axis=pattern`, several of them in one text behind commas; patterns of
    /// one axis are alternatives, different axes must all fit. `is_randomised` says of a sequence
    /// and a decorrelation whether each seed gives another image (only then are replicates needed),
    /// or why the two make no sense together: such pairs are left out with the reason.
    ///
    /// # Errors
    /// A filter of an unknown axis or without `=`, a filter or an exclude that fits nothing, filters
    /// that leave nothing to run, a reference or a whole product of pairs that make no sense.
    pub fn new(
        experiment: &Experiment,
        only: &[String],
        is_randomised: impl Fn(&Variant, &Variant) -> Result<bool, String>,
    ) -> Result<Self, ConfigError> {
        let reference = &experiment.reference;
        if let Err(reason) = is_randomised(&reference.sequence, &reference.decorrelation) {
            return Err(ConfigError::Refused {
                at: format!("{}: [reference]", experiment.source),
                reason,
            });
        }
        let axes = &experiment.axes;
        check_size(experiment)?;
        let filter = Filter::parse(only, axes)?;
        let full: Vec<_> = product(axes, &Axis::ALL);
        let mut skipped = Vec::new();
        for exclude in &experiment.excludes {
            skipped.extend(excluded(exclude, &full, &filter)?);
        }
        let points = |which: &[Axis]| {
            let mut points = product(axes, which);
            points.retain(|point| {
                filter.fits(point) && !experiment.excludes.iter().any(|e| e.covers(point))
            });
            points
        };
        let refused = refused(&points(&Axis::ALL), &is_randomised);
        let points = |which: &[Axis]| {
            let mut points = points(which);
            points.retain(|point| point.refusal(&is_randomised).is_none());
            points
        };
        let structures = points(&[Axis::Scene, Axis::Accel, Axis::Kernels]);
        let structures: Vec<_> = structures.iter().map(Point::structure).collect();
        let replicates = |cell: &SamplerCell| match cell.randomised {
            true => experiment.replicates,
            false => 1,
        };
        let mut samplers = Vec::new();
        for point in points(&SAMPLER_AXES) {
            let mut cell = point.sampler(&is_randomised);
            cell.replicates = replicates(&cell);
            let traces = |s: &StructureCell| s.scene == cell.scene && s.kernels == cell.kernels;
            match structures.iter().any(traces) {
                true => samplers.push(cell),
                false => skipped.push(untraceable(&cell)),
            }
        }
        let times: Vec<_> = points(&Axis::ALL).iter().map(Point::time).collect();
        let streams = points(&[Axis::Sequence, Axis::Decorrelation, Axis::Kernels]);
        let streams = streams.iter().map(|point| point.stream(&is_randomised));
        let mut plan = Self {
            scenes: axes.scene.clone(),
            kernels: axes.kernels.clone(),
            renders_full_product: full_product(&times, experiment.replicates, &is_randomised),
            renders_planned: samplers.iter().map(|s| s.replicates as usize).sum(),
            structures,
            samplers,
            times,
            streams: streams.collect(),
            skipped,
        };
        plan.scenes
            .retain(|scene| plan.structures.iter().any(|cell| cell.scene == *scene));
        plan.kernels.retain(|kernels| {
            let mut structures = plan.structures.iter();
            let mut streams = plan.streams.iter();
            structures.any(|cell| cell.kernels == *kernels)
                || streams.any(|cell| cell.kernels == *kernels)
        });
        if let (true, Some(first)) = (plan.times.is_empty(), refused.first()) {
            return Err(ConfigError::NothingLeft {
                file: experiment.source.clone(),
                reason: first.reason.clone(),
            });
        }
        plan.skipped.extend(refused);
        if plan.structures.is_empty() {
            return Err(ConfigError::NothingLeft {
                file: experiment.source.clone(),
                reason: format!(
                    "the excludes{} leave no scene with a structure",
                    if only.is_empty() { "" } else { " and --only" }
                ),
            });
        }
        Ok(plan)
    }

    /// All cells of a scene, left out for this reason.
    pub fn all_of(&self, scene: &Variant, reason: String) -> Skipped {
        let structures = self.structures.iter().filter(|c| c.scene == *scene).count();
        let samplers = self.samplers.iter().filter(|c| c.scene == *scene).count();
        let times = self.times.iter().filter(|c| c.scene == *scene).count();
        Skipped {
            cell: format!("{scene}: all structures, samplers and times"),
            reason,
            cells: structures + samplers + times,
        }
    }

    /// The plan in words, for `--dry-run`.
    pub fn describe(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_description(&mut text);
        text
    }

    fn write_description(&self, text: &mut String) -> fmt::Result {
        let labels = |labels: Vec<String>| labels.join(", ");
        writeln!(
            text,
            "{} structures to build, gate and time:",
            self.structures.len()
        )?;
        for scene in &self.scenes {
            let cells = self.structures.iter().filter(|cell| cell.scene == *scene);
            let accels = labels(cells.map(|cell| cell.accel.label.clone()).collect());
            writeln!(text, "  {scene}: {accels}")?;
        }
        writeln!(
            text,
            "{} samplers whose error is measured:",
            self.samplers.len()
        )?;
        for cell in &self.samplers {
            writeln!(text, "  {cell}, replicates: {}", cell.replicates)?;
        }
        writeln!(text, "{} full cells to time", self.times.len())?;
        writeln!(
            text,
            "{} streams whose star discrepancy is measured:",
            self.streams.len()
        )?;
        for cell in &self.streams {
            writeln!(text, "  {cell}")?;
        }
        for skipped in &self.skipped {
            let Skipped {
                cell,
                reason,
                cells,
            } = skipped;
            writeln!(text, "left out: {cell} ({cells} cells): {reason}")?;
        }
        writeln!(
            text,
            "renders for the error: {} (measured for every full cell it would be {})",
            self.renders_planned, self.renders_full_product
        )
    }
}

/// Cells of the full product, before anything is left out.
const MAX_CELLS: usize = 1 << 20;

fn check_size(experiment: &Experiment) -> Result<(), ConfigError> {
    let lengths = Axis::ALL.map(|axis| experiment.axes.variants(axis).len());
    let cells = lengths.into_iter().fold(1, usize::saturating_mul);
    if cells <= MAX_CELLS {
        return Ok(());
    }
    Err(ConfigError::TooMany {
        at: Place::File {
            file: experiment.source.as_str().into(),
            line: 1,
        },
        what: "the cells of all axes".to_owned(),
        count: cells,
        limit: MAX_CELLS,
    })
}

const SAMPLER_AXES: [Axis; 5] = [
    Axis::Scene,
    Axis::Integrator,
    Axis::Sequence,
    Axis::Decorrelation,
    Axis::Kernels,
];

/// A sampler that stays visible although no structure is left for its scene.
fn untraceable(cell: &SamplerCell) -> Skipped {
    Skipped {
        cell: cell.to_string(),
        reason: "no structure is left that could trace this scene with these kernels".to_owned(),
        cells: 1,
    }
}

/// Renders needed if the error of every full cell were measured.
fn full_product(
    times: &[TimeCell],
    replicates: u32,
    is_randomised: &impl Fn(&Variant, &Variant) -> Result<bool, String>,
) -> usize {
    let renders = times.iter().map(|cell| {
        let randomised = is_randomised(&cell.sequence, &cell.decorrelation);
        if randomised == Ok(true) {
            replicates as usize
        } else {
            1
        }
    });
    renders.sum()
}

/// Pairs of a sequence and a decorrelation that make no sense, with the full cells that they cost.
fn refused(
    full: &[Point],
    is_randomised: &impl Fn(&Variant, &Variant) -> Result<bool, String>,
) -> Vec<Skipped> {
    let mut out: Vec<Skipped> = Vec::new();
    for point in full {
        let Some(reason) = point.refusal(is_randomised) else {
            continue;
        };
        match out.iter_mut().find(|skipped| skipped.reason == reason) {
            Some(skipped) => skipped.cells += 1,
            None => out.push(Skipped {
                cell: point.stream(is_randomised).to_string(),
                reason,
                cells: 1,
            }),
        }
    }
    out
}

/// What one exclude takes out of the filtered product.
fn excluded(
    exclude: &Exclude,
    full: &[Point],
    filter: &Filter,
) -> Result<Option<Skipped>, ConfigError> {
    let covered: Vec<_> = full.iter().filter(|point| exclude.covers(point)).collect();
    if covered.is_empty() && !exclude.lenient {
        return Err(ConfigError::UselessExclude {
            at: exclude.at.clone(),
            exclude: exclude.to_string(),
        });
    }
    let cells = covered.iter().filter(|point| filter.fits(point)).count();
    Ok((cells > 0).then(|| Skipped {
        cell: exclude.to_string(),
        reason: format!("excluded by {}", exclude.at),
        cells,
    }))
}

/// A point of the product of some axes.
#[derive(Clone, Copy)]
struct Point<'a>([Option<&'a Variant>; Axis::ALL.len()]);

impl Point<'_> {
    fn get(&self, axis: Axis) -> Option<&Variant> {
        self.0[axis as usize]
    }

    /// The variant on an axis that the point has.
    fn variant(&self, axis: Axis) -> Variant {
        match self.get(axis) {
            Some(variant) => variant.clone(),
            None => unreachable!("cells are made from products of their own axes"),
        }
    }

    /// The same, named after the kernels, too.
    fn with_kernels(&self, axis: Axis) -> Variant {
        self.variant(axis)
            .with_kernels(&self.variant(Axis::Kernels))
    }

    fn structure(&self) -> StructureCell {
        StructureCell {
            scene: self.variant(Axis::Scene),
            accel: self.with_kernels(Axis::Accel),
            kernels: self.variant(Axis::Kernels),
        }
    }

    /// Why its sequence and decorrelation make no sense together, if it has both and they do not.
    fn refusal(
        &self,
        is_randomised: &impl Fn(&Variant, &Variant) -> Result<bool, String>,
    ) -> Option<String> {
        let sequence = self.get(Axis::Sequence)?;
        is_randomised(sequence, self.get(Axis::Decorrelation)?).err()
    }

    fn sampler(
        &self,
        is_randomised: &impl Fn(&Variant, &Variant) -> Result<bool, String>,
    ) -> SamplerCell {
        let StreamCell {
            sequence,
            decorrelation,
            kernels,
            randomised,
        } = self.stream(is_randomised);
        SamplerCell {
            scene: self.variant(Axis::Scene),
            integrator: self.variant(Axis::Integrator),
            sequence,
            decorrelation,
            kernels,
            randomised,
            replicates: 1,
        }
    }

    fn time(&self) -> TimeCell {
        TimeCell {
            scene: self.variant(Axis::Scene),
            accel: self.with_kernels(Axis::Accel),
            sequence: self.variant(Axis::Sequence),
            decorrelation: self.with_kernels(Axis::Decorrelation),
            integrator: self.variant(Axis::Integrator),
            kernels: self.variant(Axis::Kernels),
        }
    }

    fn stream(
        &self,
        is_randomised: &impl Fn(&Variant, &Variant) -> Result<bool, String>,
    ) -> StreamCell {
        let sequence = self.variant(Axis::Sequence);
        let decorrelation = self.with_kernels(Axis::Decorrelation);
        StreamCell {
            randomised: is_randomised(&sequence, &decorrelation) == Ok(true),
            sequence,
            decorrelation,
            kernels: self.variant(Axis::Kernels),
        }
    }
}

/// All points of the product of the axes in `which`, the last one running fastest.
fn product<'a>(axes: &'a Axes, which: &[Axis]) -> Vec<Point<'a>> {
    let mut points = vec![Point([None; Axis::ALL.len()])];
    for &axis in which {
        points = points
            .iter()
            .flat_map(|point| {
                axes.variants(axis).iter().map(|variant| {
                    let mut point = *point;
                    point.0[axis as usize] = Some(variant);
                    point
                })
            })
            .collect();
    }
    points
}

impl Exclude {
    /// Whether the point has every axis that the exclude names, and fits on each.
    fn covers(&self, point: &Point) -> bool {
        self.patterns.iter().all(|(axis, patterns)| {
            let variant = point.get(*axis);
            variant.is_some_and(|variant| patterns.iter().any(|p| p.matches(variant)))
        })
    }
}

/// What `--only` asks for.
struct Filter(Vec<(Axis, Vec<Pattern>)>);

impl Filter {
    fn parse(only: &[String], axes: &Axes) -> Result<Self, ConfigError> {
        let mut filter: Vec<(Axis, Vec<Pattern>)> = Vec::new();
        for text in only.iter().flat_map(|text| split_outside_brackets(text)) {
            let fault = |problem: String| ConfigError::Only {
                text: text.to_owned(),
                problem,
            };
            let (name, pattern) = text
                .split_once('=')
                .ok_or_else(|| fault("no `=` in it".to_owned()))?;
            let name = name.trim();
            let axis = Axis::from_name(name).ok_or_else(|| {
                let known = Axis::ALL.map(Axis::name);
                let near = nearest(name, known).unwrap_or_default();
                fault(format!(
                    "unknown axis `{name}`; did you mean `{near}`? Known: {}",
                    known.join(", ")
                ))
            })?;
            let pattern = Pattern::new(pattern.trim());
            let variants = axes.variants(axis);
            if !variants.iter().any(|variant| pattern.matches(variant)) {
                return Err(ConfigError::NoMatch {
                    at: format!("--only {text}"),
                    axis: axis.name(),
                    pattern: pattern.to_string(),
                    known: variants.iter().map(|v| v.label.clone()).collect(),
                });
            }
            match filter.iter_mut().find(|(other, _)| *other == axis) {
                Some((_, patterns)) => patterns.push(pattern),
                None => filter.push((axis, vec![pattern])),
            }
        }
        Ok(Self(filter))
    }

    /// Whether the point fits on every filtered axis that it has.
    fn fits(&self, point: &Point) -> bool {
        self.0.iter().all(|(axis, patterns)| {
            let variant = point.get(*axis);
            variant.is_none_or(|variant| patterns.iter().any(|p| p.matches(variant)))
        })
    }
}

/// Parts between commas, except commas in round brackets: labels such as `grid(a=1,b=2)` have them.
fn split_outside_brackets(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0;
    let parts = text.split(move |c| {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        c == ',' && depth == 0
    });
    parts.map(str::trim).filter(|part| !part.is_empty())
}

#[cfg(test)]
mod tests {
    use super::split_outside_brackets;

    #[test]
    fn commas_in_brackets_do_not_separate() {
        let parts: Vec<_> = split_outside_brackets("accel=g(a=1,b=2), scene=x,,").collect();
        assert_eq!(parts, ["accel=g(a=1,b=2)", "scene=x"]);
    }
}

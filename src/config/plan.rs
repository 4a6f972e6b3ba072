//! Expands axes into the cells to run.
//!
//! Hits are bit-identical in every structure, so images do not depend on it: the error is measured
//! once per scene, integrator and sampler, with all replicates. Time is measured for every full
//! cell, at few samples per pixel. The plan counts the renders saved.

use super::ConfigError;
use super::axis::Axis;
use super::cells::{Cell, NO_PEER, is_bench};
use super::experiment::Experiment;
use super::pattern::Selector;
use super::product::{
    Point, asked_once, check_size, excluded, filter, included, product, refused, shared, unmet,
};
use raystone_core::params::Variant;
use raystone_core::text::plural;
use std::collections::HashSet;
use std::fmt::{self, Write as _};

/// Omitted cells, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// Description of the cells.
    pub cell: String,
    /// The reason.
    pub reason: String,
    /// Their number: of an exclude or a condition, the full cells that none before it left out.
    pub cells: usize,
}

/// The work of a run, in axis order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Scenes that some cell needs.
    pub scenes: Vec<Variant>,
    /// Kernels that some cell needs.
    pub kernels: Vec<Variant>,
    /// Structures to build, check and trace: see [`Cell::STRUCTURE`].
    pub structures: Vec<Cell>,
    /// Samplers whose error is measured: see [`Cell::SAMPLER`].
    pub samplers: Vec<Cell>,
    /// Full cells whose time is measured: see `FULL`.
    pub times: Vec<Cell>,
    /// External tracers to time: see [`Cell::PEER`].
    pub peers: Vec<Cell>,
    /// Streams whose discrepancy is measured: see [`Cell::STREAM`].
    pub streams: Vec<Cell>,
    /// Cells that need no scene (stream compactions, the stress suite), on all axes that may matter to them.
    pub benches: Vec<Cell>,
    /// Omitted cells.
    pub skipped: Vec<Skipped>,
    /// Number of seeds for the error of a randomised sampler.
    pub replicates: u32,
    /// The filters applied.
    pub only: Vec<String>,
}

/// Refuses a reference sampler whose sequence and decorrelation are incompatible.
fn check_reference(
    experiment: &Experiment,
    is_randomised: impl Fn(&Variant, &Variant) -> Result<bool, String>,
) -> Result<(), ConfigError> {
    let reference = &experiment.reference;
    let asked = is_randomised(&reference.sequence, &reference.decorrelation);
    asked.map(|_| ()).map_err(|reason| ConfigError::Refused {
        at: format!("{}: [reference]", experiment.source),
        reason,
    })
}

impl Plan {
    /// Expands the axes of `experiment` into cells, without its excludes.
    ///
    /// `only` holds [`Selector`] filters. `is_randomised` returns whether each seed of a sequence
    /// and decorrelation gives another image (only then are replicates needed), or why the two are
    /// incompatible: such pairs are skipped with the reason.
    ///
    /// # Errors
    /// A filter with an unknown axis or without `=`, a filter or exclude that matches nothing,
    /// filters that leave nothing, an incompatible reference sampler, or no compatible pair.
    pub fn new(
        experiment: &Experiment,
        only: &[String],
        is_randomised: impl Fn(&Variant, &Variant) -> Result<bool, String>,
    ) -> Result<Self, ConfigError> {
        check_reference(experiment, &is_randomised)?;
        let axes = &experiment.axes;
        check_size(experiment)?;
        let filter = filter(only, axes)?;
        let variants = shared(axes);
        let is_randomised = asked_once(is_randomised);
        let full = product(&variants, &Cell::FULL);
        let mut wanted = full.clone();
        wanted.retain(|point| point.fits(&filter));
        let mut skipped = Vec::new();
        for exclude in &experiment.excludes {
            skipped.extend(excluded(exclude, experiment, &full, &mut wanted)?);
        }
        for include in &experiment.includes {
            included(include, &full)?;
        }
        skipped.extend(unmet(experiment, &mut wanted));
        let refused = refused(&wanted, &is_randomised);
        let renders = !axes[Axis::Integrator].iter().all(is_bench);
        let cells = |which: &[Axis]| -> Vec<Cell> {
            let mut points = product(&variants, which);
            points.retain(|point| {
                is_wanted(experiment, &filter, point) && point.refusal(&is_randomised).is_none()
            });
            points.iter().map(|p| p.cell(&is_randomised)).collect()
        };
        // Cells that render; on axes shared by all integrators, those of any that renders.
        let rendering = |which: &[Axis]| -> Vec<Cell> {
            let mut cells = cells(which);
            cells.retain(|cell| renders && !is_bench(&cell[Axis::Integrator]));
            cells
        };
        let of_images = |which: &[Axis]| {
            if experiment.run.images {
                rendering(which)
            } else {
                Vec::new()
            }
        };
        let mut benches = cells(&Cell::BENCH);
        benches.retain(|cell| is_bench(&cell[Axis::Integrator]));
        let mut peers = rendering(&Cell::PEER);
        peers.retain(|cell| cell[Axis::Peer].name != NO_PEER);
        let structures = rendering(&Cell::STRUCTURE);
        let place = [&Cell::WORLD[..], &[Axis::Kernels]].concat();
        let place = |cell: &Cell| cell.on(&place).identity();
        let places: HashSet<String> = structures.iter().map(place).collect();
        let (samplers, untraceable): (Vec<_>, Vec<_>) =
            (of_images(&Cell::SAMPLER).into_iter()).partition(|cell| places.contains(&place(cell)));
        skipped.extend(untraceable.iter().map(no_structure));
        let plan = Self {
            scenes: needed(&axes[Axis::Scene], Axis::Scene, [&structures, &[], &[]]),
            times: of_images(&Cell::FULL),
            peers,
            streams: of_images(&Cell::STREAM),
            benches,
            structures,
            samplers,
            kernels: Vec::new(),
            skipped,
            replicates: experiment.run.replicates,
            only: only.to_vec(),
        };
        plan.finished(experiment, refused, only)
    }

    /// Adds the kernels and the incompatible pairs.
    fn finished(
        mut self,
        experiment: &Experiment,
        refused: Vec<Skipped>,
        only: &[String],
    ) -> Result<Self, ConfigError> {
        let users = [&self.structures[..], &self.streams, &self.benches];
        self.kernels = needed(&experiment.axes[Axis::Kernels], Axis::Kernels, users);
        let nothing_left = |reason: String| ConfigError::NothingLeft {
            file: experiment.source.clone(),
            reason,
        };
        if let (true, Some(first)) = (
            self.times.is_empty() && self.benches.is_empty(),
            refused.first(),
        ) {
            return Err(nothing_left(first.reason.clone()));
        }
        self.skipped.extend(refused);
        if self.structures.is_empty() && self.benches.is_empty() {
            let filters = if only.is_empty() { "" } else { " and --only" };
            return Err(nothing_left(format!(
                "the excludes and conditions (`when`){filters} leave no scene with a structure"
            )));
        }
        Ok(self)
    }

    /// Number of renders (image × replicate) for this sampler's error.
    pub fn renders(&self, sampler: &Cell) -> u32 {
        if sampler.randomised {
            self.replicates
        } else {
            1
        }
    }

    /// Number of renders with one error measurement per sampler.
    pub fn renders_planned(&self) -> usize {
        self.samplers.iter().map(|s| self.renders(s) as usize).sum()
    }

    /// Number of renders with one error measurement per full cell.
    pub fn renders_full_product(&self) -> usize {
        self.times.iter().map(|c| self.renders(c) as usize).sum()
    }

    /// Distinct combinations of scene and tests of a scene's structures: see [`Cell::WORLD`].
    pub fn worlds(&self, scene: &Variant) -> Vec<Cell> {
        let mut worlds: Vec<Cell> = Vec::new();
        for cell in self.structures.iter().filter(|c| c[Axis::Scene] == *scene) {
            let world = cell.on(&Cell::WORLD);
            if !worlds.contains(&world) {
                worlds.push(world);
            }
        }
        worlds
    }

    /// Returns the cells without a scene, on their relevant axes alone: each cell once.
    pub fn benches_on(&self, axes: &[Axis]) -> Vec<Cell> {
        let mut known = HashSet::new();
        let cells = self.benches.iter().map(|cell| cell.on(axes));
        cells.filter(|cell| known.insert(cell.identity())).collect()
    }

    /// Description of the plan for `--dry-run`.
    pub fn describe(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_description(&mut text);
        text
    }

    fn write_description(&self, text: &mut String) -> fmt::Result {
        writeln!(
            text,
            "{} to build, gate and time:",
            plural(self.structures.len(), "structure")
        )?;
        for scene in &self.scenes {
            let cells = self.structures.iter().filter(|c| c[Axis::Scene] == *scene);
            let accels: Vec<_> = cells
                .map(|c| c.labels(&[Axis::Accel]).join(" · "))
                .collect();
            writeln!(text, "  {scene}: {}", accels.join(", "))?;
        }
        writeln!(
            text,
            "{} whose error is measured:",
            plural(self.samplers.len(), "sampler")
        )?;
        for cell in &self.samplers {
            writeln!(text, "  {cell}, replicates: {}", self.renders(cell))?;
        }
        writeln!(text, "{} to time", plural(self.times.len(), "full cell"))?;
        writeln!(
            text,
            "{} whose star discrepancy is measured:",
            plural(self.streams.len(), "stream")
        )?;
        for cell in &self.streams {
            writeln!(text, "  {cell}")?;
        }
        let axes = [Axis::Integrator, Axis::Kernels];
        let benches = self.benches_on(&axes);
        if !benches.is_empty() {
            let things = plural(benches.len(), "thing");
            writeln!(text, "{things} to measure without a scene:")?;
        }
        for cell in &benches {
            writeln!(text, "  {cell}")?;
        }
        for skipped in &self.skipped {
            let Skipped {
                cell,
                reason,
                cells,
            } = skipped;
            let cells = plural(*cells, "cell");
            writeln!(text, "left out: {cell} ({cells}): {reason}")?;
        }
        writeln!(
            text,
            "renders for the error: {} (measured for every full cell it would be {})",
            self.renders_planned(),
            self.renders_full_product()
        )
    }
}

/// True if a point passes the filters and no exclude applies.
fn is_wanted(experiment: &Experiment, filter: &Selector, point: &Point) -> bool {
    point.fits(filter) && experiment.keeps(point)
}

/// The variants of an axis used by these cells.
fn needed(variants: &[Variant], axis: Axis, users: [&[Cell]; 3]) -> Vec<Variant> {
    let is_used = |v: &&Variant| users.iter().copied().flatten().any(|c| c[axis] == **v);
    variants.iter().filter(is_used).cloned().collect()
}

/// A sampler listed although its scene has no structure left.
fn no_structure(cell: &Cell) -> Skipped {
    Skipped {
        cell: cell.to_string(),
        reason: "no structure is left that could trace this scene with these kernels".to_owned(),
        cells: 1,
    }
}

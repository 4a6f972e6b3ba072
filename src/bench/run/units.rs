//! The registry of measurements, and a plan's units.

use super::cost::{Cost, Work};
use super::measurement::Measurement;
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_record::figure::Figure;
use std::collections::BTreeSet;
use std::fmt;

/// All measurements, in run order.
#[derive(Clone)]
pub struct MeasurementRegistry(pub(super) Vec<&'static dyn Measurement>);

impl MeasurementRegistry {
    /// Adds a cell-by-cell measurement.
    ///
    /// # Errors
    /// Its name or the id of one of its figures is taken.
    pub fn add(&mut self, measurement: &'static dyn Measurement) -> Result<(), String> {
        let name = measurement.name();
        if self.iter().any(|known| known.name() == name) {
            return Err(format!(
                "there is a measurement {name:?} already: choose another name"
            ));
        }
        let mut known: Vec<&str> = raystone_record::figure::FIGURES
            .iter()
            .copied()
            .chain(self.figures())
            .map(|figure| &*figure.id)
            .collect();
        for figure in measurement.figures() {
            if known.contains(&&*figure.id) || !figure.id.contains("/v") {
                return Err(format!(
                    "the figure {:?} of {name:?} needs an id of its own with a version, as in \"my-figure/v1\"",
                    figure.id
                ));
            }
            known.push(&figure.id);
        }
        self.0.push(measurement);
        Ok(())
    }

    /// All measurements.
    pub fn iter(&self) -> impl Iterator<Item = &'static dyn Measurement> {
        self.0.iter().copied()
    }

    /// Figures of added measurements.
    pub fn figures(&self) -> impl Iterator<Item = &'static Figure> {
        self.iter().flat_map(Measurement::figures)
    }

    /// All units of a plan, in run order: scene by scene, then those without a scene.
    pub fn units(&self, experiment: &Experiment, plan: &Plan) -> Vec<Unit> {
        let cells: Vec<_> = (self.iter().map(|m| (m, m.cells(experiment, plan)))).collect();
        let scenes = plan.scenes.iter().map(Some).chain([None]);
        let mut units = Vec::new();
        for scene in scenes {
            for (measurement, cells) in &cells {
                let own = cells.iter().filter(|cell| cell.get(Axis::Scene) == scene);
                units.extend(own.map(|cell| Unit::new(*measurement, cell)));
            }
        }
        units
    }
}

/// A unit of measuring, resuming and sharding.
#[derive(Clone)]
pub struct Unit {
    /// Name, unique in the plan.
    pub name: String,
    /// Its measurement.
    pub measurement: &'static dyn Measurement,
    /// Its cell.
    pub cell: Cell,
}

impl Unit {
    fn new(measurement: &'static dyn Measurement, cell: &Cell) -> Self {
        Self {
            name: measurement.unit_name(cell),
            measurement,
            cell: cell.clone(),
        }
    }

    /// Name of its [measurement](Measurement::name).
    pub fn kind(&self) -> &'static str {
        self.measurement.name()
    }
}

impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        (self.kind(), &self.name, &self.cell) == (other.kind(), &other.name, &other.cell)
    }
}

impl fmt::Debug for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind(), self.name)
    }
}

impl Cost<'_> {
    /// Seconds of a unit, without shared work.
    pub fn seconds_of(&self, unit: &Unit) -> f64 {
        unit.measurement.cost(&unit.cell, self).seconds()
    }

    /// Work of these units, including their scenes and shared parts.
    pub fn whole<'u>(&self, units: impl IntoIterator<Item = &'u Unit>) -> Work {
        let mut whole = Work::default();
        let (mut worlds, mut several) = (BTreeSet::new(), BTreeSet::new());
        for unit in units {
            let cell = &unit.cell;
            whole += unit.measurement.cost(cell, self);
            if cell.get(Axis::Scene).is_some() && worlds.insert(cell.on(&Cell::WORLD).identity()) {
                whole += self.world(cell);
            }
            let shared = unit.measurement.shared_cost(cell, self);
            let name = unit.kind();
            whole += shared
                .filter(|(of, _)| several.insert((name, of.identity())))
                .map_or(Work::default(), |(_, work)| work);
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measurement_from_outside_needs_a_name_and_figures_of_its_own() {
        use raystone_record::figure::{Better::Lower, Shown::Count, Spread::Exact};
        struct Mine(&'static str, &'static [Figure]);
        impl Measurement for Mine {
            fn name(&self) -> &'static str {
                self.0
            }
            fn plural(&self) -> &'static str {
                "mine"
            }
            fn figures(&self) -> &'static [Figure] {
                self.1
            }
            fn cells(&self, _: &Experiment, _: &Plan) -> Vec<Cell> {
                Vec::new()
            }
            fn settings(&self, _: &Experiment, _: &str) -> String {
                String::new()
            }
            fn cost(&self, _: &Cell, _: &Cost) -> Work {
                Work::default()
            }
        }
        static FIGURES: [Figure; 3] = [
            Figure::new("mine/v1", "mine", "", Lower, Count, Exact),
            Figure::new("sah-cost/v1", "cost", "", Lower, Count, Exact),
            Figure::new("mine", "mine", "", Lower, Count, Exact),
        ];
        let add = |registry: &mut MeasurementRegistry, name, figures| {
            registry.add(Box::leak(Box::new(Mine(name, figures))))
        };
        let mut registry = MeasurementRegistry::default();
        let count = registry.iter().count();
        assert!(add(&mut registry, "compaction", &[]).is_err());
        assert!(add(&mut registry, "mine", &FIGURES[1..2]).is_err());
        assert!(add(&mut registry, "mine", &FIGURES[2..]).is_err());
        assert_eq!(add(&mut registry, "mine", &FIGURES[..1]), Ok(()));
        assert!(add(&mut registry, "other", &FIGURES[..1]).is_err());
        assert_eq!(registry.iter().count(), count + 1);
    }
}

//! What a build costs against what it gains: break-even in rays, and time to an image.

use crate::measure::record::{Interval, RayClass, StructureRecord};
use crate::measure::statistics::LEAST_FOR_MEDIAN;
use crate::report::data::{Measured, STRUCTURE_AXES, SceneGroup, View};
use crate::report::document::*;
use crate::report::format;

/// When a structure that is built more slowly has paid for itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BreakEven {
    /// It overtakes after so many million rays.
    After(f64),
    /// It traces no faster.
    Never,
    /// The intervals of the two speeds overlap.
    Undecided,
}

impl BreakEven {
    /// Of a structure against one that is built `extra_build_ms` faster. Speeds in Mrays/s.
    pub fn new(extra_build_ms: f64, slow_build: &Interval, fast_build: &Interval) -> Self {
        if slow_build.high < fast_build.low {
            return Self::Never;
        }
        if slow_build.low <= fast_build.high {
            return Self::Undecided;
        }
        let seconds_per_million = 1.0 / fast_build.value - 1.0 / slow_build.value;
        Self::After(extra_build_ms.max(0.0) * 1e-3 / seconds_per_million)
    }

    fn cell(self) -> Cell {
        match self {
            Self::After(millions) if millions < 0.1 => {
                format::count((millions * 1e6) as u64).into()
            }
            Self::After(millions) => format!("{} M", format::number(millions)).into(),
            Self::Never => "never".into(),
            Self::Undecided => "undecided".into(),
        }
    }
}

/// Speed in a class, if it was measured often enough to have a 95 % interval.
fn rate<'a>(structure: &Measured<'a, StructureRecord>, class: RayClass) -> Option<&'a Interval> {
    let timing = (structure.body.timings.iter()).find(|t| t.class == class)?;
    (timing.ms.len() >= LEAST_FOR_MEDIAN).then_some(&timing.mrays_s)
}

/// Rays after which each structure has caught up with the one that is built fastest, per class.
pub fn break_even_table(scene: &SceneGroup, classes: &[RayClass]) -> Option<Table> {
    let passed: Vec<&Measured<StructureRecord>> = scene
        .structures
        .iter()
        .filter(|s| s.fault().is_none() && !s.timings.is_empty())
        .collect();
    let first = passed
        .iter()
        .min_by(|a, b| a.build_ms.total_cmp(&b.build_ms))?;
    let caption = format!(
        "Break-even: rays after which a structure, its build included, overtakes {}, which is built fastest ({} ms)",
        first.structure,
        format::number(first.build_ms)
    );
    let mut table = Table::new(caption, &["structure", "build, ms"]);
    for class in classes {
        table.add_column(format::ray_class(*class));
    }
    for structure in passed.iter().filter(|s| !std::ptr::eq(s.body, first.body)) {
        let extra_ms = structure.build_ms - first.build_ms;
        let mut row = vec![
            structure.structure.clone().into(),
            format::number(structure.build_ms).into(),
        ];
        row.extend(classes.iter().map(|class| {
            match (rate(structure, *class), rate(first, *class)) {
                (Some(own), Some(other)) => BreakEven::new(extra_ms, own, other).cell(),
                _ => format::ABSENT.into(),
            }
        }));
        table.rows.push(row);
    }
    Some(table)
}

/// Build and rendering together, for one image of few samples and one of many. All structures with
/// the sampler that most of them were timed with.
pub fn time_to_image_table(scene: &SceneGroup, view: &View) -> Option<Table> {
    let structures = view.timed_structures();
    let timed = |sampler: &str| {
        let valid = |s: &&String| view.ms_per_spp(s, sampler).is_some();
        structures.iter().filter(valid).count()
    };
    let sampler = view.samplers.iter().rev().max_by_key(|s| timed(&s.name))?;
    let most_spp = view
        .samplers
        .iter()
        .flat_map(|s| &s.replicates)
        .flat_map(|r| &r.errors)
        .map(|e| e.spp)
        .max()?;
    let caption = format!(
        "Time to image: build + rendering by {} with {}, ms",
        view.name, sampler.name
    );
    let mut table = Table::new(caption, &["structure", "build"]);
    let mut counts = vec![1, most_spp];
    counts.dedup();
    for spp in &counts {
        table.add_column(format!("build + {spp} spp"));
    }
    for name in &structures {
        let Some(time) = view.time(name, &sampler.name) else {
            continue;
        };
        let is_it = |s: &&Measured<StructureRecord>| s.key.agrees(&time.key, &STRUCTURE_AXES);
        let built = scene.structures.iter().find(is_it);
        let (Some(built), Some(ms)) = (built, time.ms_per_spp) else {
            continue;
        };
        let total = |spp: u32| format::number(built.build_ms + ms.value * f64::from(spp));
        let mut row = vec![name.clone().into(), format::number(built.build_ms).into()];
        row.extend(counts.iter().map(|&spp| total(spp).into()));
        table.rows.push(row);
    }
    Some(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speed(value: f64) -> Interval {
        Interval {
            value,
            low: value * 0.95,
            high: value * 1.05,
        }
    }

    #[test]
    fn a_slower_build_pays_after_the_rays_that_make_up_for_it() {
        // 100 ms more; 1 s/M rays against 2 s/M rays: after 0.1 M rays.
        let found = BreakEven::new(100.0, &speed(1.0), &speed(0.5));
        let BreakEven::After(millions) = found else {
            panic!("{found:?}")
        };
        assert!((millions - 0.1).abs() < 1e-12, "{millions}");
    }

    #[test]
    fn a_slower_structure_never_pays_and_overlapping_speeds_decide_nothing() {
        assert_eq!(
            BreakEven::new(100.0, &speed(0.5), &speed(1.0)),
            BreakEven::Never
        );
        assert_eq!(
            BreakEven::new(100.0, &speed(1.0), &speed(0.98)),
            BreakEven::Undecided
        );
    }
}

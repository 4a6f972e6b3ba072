//! A measurement from outside the crate: with this file and one registry line it is planned, timed,
//! resumed, recorded, shown, compared and exported like the program's own.

use crate::support;
use raystone::accel::{Query, RayBatch, Tracer};
use raystone::config::{Cell, Experiment, Plan};
use raystone::gpu::{Elapsed, GpuError};
use raystone::measure::figure::{Better, Figure, Shown, Spread};
use raystone::measure::rays::primary_rays;
use raystone::measure::record::{Line, MeasuredRecord, Reading, Recorded, Samples, all_of, axis};
use raystone::measure::statistics::median_interval;
use raystone::measure::timing::{self, Measured};
use raystone::run::{
    Absent, At, Cost, Existing, Measurement, Preparation, Prepared, Registries, RunOptions, Work,
};
use std::path::Path;
use std::process::Command;

static FIGURES: [Figure; 2] = [
    Figure::new(
        "camera-ns/v1",
        "camera rays, last pixel first",
        "ns per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "camera-rays/v1",
        "camera rays",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
];

/// The camera's rays in reversed order, through every structure.
struct CameraRays;

impl Measurement for CameraRays {
    fn name(&self) -> &'static str {
        "camera-rays"
    }

    fn plural(&self) -> &'static str {
        "sets of camera rays"
    }

    fn figures(&self) -> &'static [Figure] {
        &FIGURES
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.structures.clone()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!("{:?} {:?}", experiment.run.resolution, experiment.timing)
    }

    fn cost(&self, _: &Cell, cost: &Cost) -> Work {
        Work::kernels(1) + cost.timed(Work::rays(768))
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        Box::new(cells.iter().map(move |cell| {
            let stage = at.stage.expect("its cells have a scene");
            let [width, height] = at.experiment.run.resolution;
            let camera = stage.scene.view(width as f32 / height as f32);
            let mut rays = primary_rays(camera, width, height);
            rays.reverse();
            let (gpu, traced) = (at.gpu(cell)?, at.traced(cell)?);
            let tracer = Tracer::new(gpu, &stage.buffers.triangles, traced, Query::Closest)?;
            let batch = tracer.batch(&rays)?;
            Ok(Box::new(Reversed(batch, rays.len())) as Box<dyn Prepared>)
        }))
    }
}

struct Reversed(RayBatch, usize);

impl Measured for Reversed {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.0.trace()
    }
}

impl Prepared for Reversed {
    fn timed(&self) -> Vec<&dyn Measured> {
        vec![self]
    }

    fn readings(&self, samples: Vec<timing::Samples>) -> Result<Vec<Reading>, String> {
        let per_ray = |ms: &[f64]| ms.iter().map(|ms| ms * 1e6 / self.1 as f64).collect();
        let rounds: Vec<f64> = per_ray(&samples[0].ms);
        let median = median_interval(&rounds).ok_or("nothing was timed")?;
        let samples = Samples::Rounds {
            adapter: rounds,
            wall: per_ray(&samples[0].wall_ms),
            processors: per_ray(&samples[0].cpu_ms),
        };
        Ok(vec![
            Reading::new(&FIGURES[0], median).with_samples(samples),
            Reading::exact(&FIGURES[1], self.1 as f64),
        ])
    }
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Output of the program, which does not know the measurement.
fn raystone(arguments: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .args(arguments)
        .output()
        .expect("the program starts");
    String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr)
}

fn cells<'a>(lines: &'a [Line], measurement: &str) -> Vec<Recorded<'a, MeasuredRecord>> {
    let measured = all_of::<MeasuredRecord>(lines);
    measured
        .filter(|cell| cell.measurement == measurement)
        .collect()
}

#[test]
fn a_measurement_from_outside_is_planned_timed_resumed_shown_compared_and_exported() {
    let mut registries = Registries::default();
    let units = |registries: &Registries| {
        let (experiment, plan) =
            support::plan(&read(Path::new("tests/data/tiny.toml")), registries);
        registries.measurements.units(&experiment, &plan).len()
    };
    let before = units(&registries);
    registries
        .measurements
        .add(&CameraRays)
        .expect("a new name");
    assert_eq!(units(&registries), before + 2, "one for each structure");
    let text = read(Path::new("tests/data/tiny.toml"));
    let folder = tempfile::tempdir().expect("a folder");
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    for out in [&first, &second] {
        let (summary, lines) = support::run(&text, &registries, out, None);
        assert_eq!((summary.failed, cells(&lines, "camera-rays").len()), (0, 2));
        for cell in cells(&lines, "camera-rays") {
            let time = cell.reading("camera-ns/v1").expect("a time");
            assert_eq!(time.rounds().len(), 3);
            let rays = cell.reading("camera-rays/v1").expect("a count");
            assert_eq!(rays.value.value, 32.0 * 24.0);
        }
    }
    // A repeated run has nothing left to do.
    let options = RunOptions {
        out: first.clone(),
        existing: Existing::Resume,
        ..RunOptions::default()
    };
    let (experiment, plan) = support::plan(&text, &registries);
    let again = raystone::run::run(&experiment, &plan, &registries, &options).expect("a run");
    assert_eq!(again.kept, before + 2);
    // The program shows it from the records alone.
    let [one, other] = [&first, &second].map(|out| out.to_str().expect("a name"));
    raystone(&["report", one]);
    for file in ["index.html", "summary.md"] {
        let page = read(&first.join(file));
        assert!(page.contains("camera rays, last pixel first"), "{file}");
    }
    let figures = read(&first.join("figures.csv"));
    let of = |accel: &str| {
        figures
            .lines()
            .filter(|l| l.contains(accel) && l.contains("camera-ns/v1"))
            .count()
    };
    assert_eq!((of("bvh"), of("uniform-grid")), (1, 1), "{figures}");
    let exported = folder.path().join("exported");
    raystone(&[
        "export",
        one,
        "--format",
        "csv",
        "--out",
        exported.to_str().expect("a name"),
    ]);
    // Both sides have it, and it is compared by its rounds.
    let compared = raystone(&["compare", one, other, "--json"]);
    assert!(compared.contains("camera-ns/v1"), "{compared}");
}

#[test]
fn one_that_fails_costs_its_cells_alone() {
    struct Wrong;
    impl Measurement for Wrong {
        fn name(&self) -> &'static str {
            "wrong"
        }
        fn plural(&self) -> &'static str {
            "wrong ones"
        }
        fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
            plan.structures.clone()
        }
        fn settings(&self, _: &Experiment, _: &str) -> String {
            String::new()
        }
        fn cost(&self, _: &Cell, _: &Cost) -> Work {
            Work::default()
        }
        fn prepare<'a>(&'a self, _: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
            let absent = |(place, _)| match place {
                0 => Err(Absent::Failed("its answer is wrong".to_owned())),
                _ => Err(Absent::Refused("not on this adapter".to_owned())),
            };
            Box::new(cells.iter().enumerate().map(absent))
        }
    }
    let mut registries = Registries::default();
    registries.measurements.add(&Wrong).expect("a new name");
    let folder = tempfile::tempdir().expect("a folder");
    let text = read(Path::new("tests/data/tiny.toml"));
    let (summary, lines) = support::run(&text, &registries, folder.path(), None);
    assert_eq!((summary.failed, summary.skipped), (1, 1));
    let failed = cells(&lines, "wrong");
    assert_eq!(failed.len(), 1);
    assert_eq!(failed[0].failure.as_deref(), Some("its answer is wrong"));
    assert_eq!(failed[0].key.label(axis::SCENE), "cornell-box");
}

//! A ray-triangle test from outside the crate: one type, one kernel and one registry line;
//! structures, the reference tracer, checks, sweeps and records use it.

use crate::support;
use raystone::accel::triangle::{APART, Meeting, TriangleRecord, TriangleTest, plane_error};
use raystone::accel::{Ray, TriangleSoup, brute_force_hits};
use raystone::config::Axis;
use raystone::integrator::offset;
use raystone::measure::bias::BiasVerdict;
use raystone::measure::record::{
    BiasRecord, Line, ReferenceRecord, StructureRecord, TimeRecord, all_of, axis,
};
use raystone::params::Sources;
use raystone::run::Registries;

/// The test as its paper prints it; a `crooked` one rejects rays with a small second weight, unlike
/// its kernel.
struct AsPublished {
    crooked: bool,
}

fn product(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

fn sum(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl TriangleTest for AsPublished {
    fn name(&self) -> &'static str {
        "as-published"
    }

    fn description(&self) -> &'static str {
        "Möller and Trumbore 1997 in the order of the paper"
    }

    fn kernel(&self) -> &'static str {
        "accel/triangle/as_published"
    }

    fn sources(&self) -> Sources {
        &[(
            "accel/triangle/as_published",
            include_str!("adding_a_triangle_test/as_published.wesl"),
        )]
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, _: &[f32; 3]) -> Meeting {
        let from_first = |v: [f32; 3]| [0, 1, 2].map(|a| v[a] - triangle.v0[a]);
        let [e1, e2, s] = [triangle.v1, triangle.v2, ray.origin].map(from_first);
        let p = product(ray.direction, e2);
        let q = product(s, e1);
        let det = sum(e1, p);
        let (area, side) = (det.abs(), det.signum());
        let (u, v) = (side * sum(s, p), side * sum(ray.direction, q));
        let least = if self.crooked { 1e-3 * area } else { 0.0 };
        if !(area > 0.0 && u >= 0.0 && v >= least && u + v <= area) {
            return APART;
        }
        let t = sum(e2, q) / det;
        Meeting { area, t, u, v }
    }

    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        _: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        [plane_error(triangle, ray, found); 3]
    }
}

static SOUND: AsPublished = AsPublished { crooked: false };
static CROOKED: AsPublished = AsPublished { crooked: true };

fn run(registries: &Registries, axes: &str) -> Vec<Line> {
    let text = std::fs::read_to_string("tests/data/tiny.toml").expect("the experiment");
    let text = text.replace("[axes]\n", &format!("[axes]\n{axes}\n"));
    let text = text.replace("replicates = 2", "replicates = 6");
    let folder = tempfile::tempdir().expect("a folder");
    support::run(&text, registries, folder.path(), None).1
}

/// Verdicts by structure, for a triangle test.
fn verdicts<'a>(lines: &'a [Line], test: &str) -> Vec<(&'a str, bool)> {
    let structures = all_of::<StructureRecord>(lines);
    let of_test = structures.filter(|s| s.key.name(axis::TRIANGLE) == test);
    let passed = |s: raystone::measure::record::Recorded<'a, StructureRecord>| {
        (s.key.name(axis::ACCEL), s.body.failure.is_none())
    };
    of_test.map(passed).collect()
}

#[test]
fn a_test_from_outside_is_gated_timed_and_recorded_beside_the_default_one() {
    let mut registries = Registries::default();
    registries.triangles.register(&SOUND);
    let names = registries.catalogue()[Axis::Triangle].clone();
    assert!(names.iter().any(|entry| entry.name == "as-published"));
    let lines = run(&registries, "triangle = [\"watertight\", \"as-published\"]");
    let usual = verdicts(&lines, "watertight");
    assert!(usual.len() >= 2 && usual.iter().all(|(_, passed)| *passed));
    assert_eq!(verdicts(&lines, "as-published"), usual);
    let kernels = |test: &str| -> Vec<String> {
        let structures = all_of::<StructureRecord>(&lines);
        let of_test = structures.filter(|s| s.key.name(axis::TRIANGLE) == test);
        of_test.map(|s| s.ran.kernel_hash.clone()).collect()
    };
    let (usual, added) = (kernels("watertight"), kernels("as-published"));
    assert!(usual.iter().zip(&added).all(|(a, b)| a != b));
    let times = all_of::<TimeRecord>(&lines);
    let of_test = times.filter(|t| t.key.name(axis::TRIANGLE) == "as-published");
    let failures: Vec<_> = of_test.map(|t| t.body.failure.clone()).collect();
    assert!(!failures.is_empty() && failures.iter().all(Option::is_none));
    let references = all_of::<ReferenceRecord>(&lines);
    let mut of: Vec<&str> = references.map(|r| r.key.name(axis::TRIANGLE)).collect();
    of.dedup();
    assert_eq!(of, ["watertight", "as-published"], "one for each world");
}

#[test]
fn a_test_whose_twin_is_another_fails_every_gate() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let mut registries = Registries::default();
    registries.triangles.register(&CROOKED);
    let lines = run(&registries, "triangle = \"as-published\"");
    let verdicts = verdicts(&lines, "as-published");
    assert!(!verdicts.is_empty());
    assert!(verdicts.iter().all(|(_, passed)| !passed), "{verdicts:?}");
    assert_eq!(
        all_of::<TimeRecord>(&lines)
            .filter(|t| t.mrays_s.is_some())
            .count(),
        0
    );
}

#[test]
fn the_judge_follows_the_test_of_its_soup() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangle = raystone::geometry::Triangle {
        vertices: corners.map(glam::Vec3::from),
    };
    let soup = TriangleSoup::from(vec![TriangleRecord::new(&triangle, 0, 0)]);
    // Its second weight is a ten-thousandth.
    let ray = Ray {
        origin: [0.5, 1e-4, 1.0],
        t_min: 0.0,
        direction: [0.0, 0.0, -1.0],
        t_max: f32::INFINITY,
    };
    let hits = |test: &'static AsPublished| {
        let tests = raystone::accel::Intersection {
            triangle: test,
            ..Default::default()
        };
        brute_force_hits(&soup.clone().intersecting(tests), &[ray])[0].triangle
    };
    assert_eq!(hits(&SOUND), 0);
    assert_eq!(hits(&CROOKED), raystone::accel::NO_HIT);
}

/// Rays sometimes hit the surface they leave again: the axis shows the resulting error, as
/// references are rendered with the default offset.
#[test]
fn a_sweep_over_offsets_shows_the_bias_of_rays_that_are_not_moved() {
    let lines = run(
        &Registries::default(),
        "offset = [\"none\", \"error-bound\"]",
    );
    let references: Vec<_> = all_of::<ReferenceRecord>(&lines).collect();
    assert!(
        references
            .iter()
            .all(|r| r.key.name(axis::OFFSET) == offset::ERROR_BOUND.name)
    );
    let structures = all_of::<StructureRecord>(&lines);
    let worlds = structures.filter(|s| s.key.get(axis::OFFSET).is_some());
    assert_eq!(
        worlds.count(),
        0,
        "structures are the same with every offset"
    );
    let verdict = |name: &str| {
        let biases = all_of::<BiasRecord>(&lines);
        let mut of = biases.filter(|b| b.key.name(axis::OFFSET) == name);
        let found = of.next().expect(name);
        (found.by_design, found.verdict.clone())
    };
    assert_eq!(verdict("none"), (true, BiasVerdict::Biased));
    assert!(!verdict("error-bound").0);
    assert_ne!(verdict("error-bound").1, BiasVerdict::Biased);
}

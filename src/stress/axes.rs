//! Box tests, ray offsets and the cost of triangle tests.

use super::Found;
use super::bench::Expected;
use super::case;
use super::families::Family;
use super::measurement::{Results, Scope};
use super::placement::Placement;
use super::shapes::{Mesh, cube, sphere};
use super::suite::{BRUTE_FORCE, Kind, PLAIN, Suite};
use super::tally::Worst;
use glam::Vec3;
use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{
    AccelError, BoxTest, BuildLog, BuiltBvh, BvhParameters, Counters, CpuTwin as _, Hit,
    Intersection, NO_HIT, Query, Ray, RayBatch, Traced, TriangleSoup,
};
use raystone_bench::run::Absent;
use raystone_config::{Axis, Cell};
use raystone_core::params::Variant;
use raystone_core::random::Pcg32;
use raystone_gpu::Gpu;
use raystone_record::figure::{self, Figure};
use raystone_record::{Key, axis};
use raystone_render::offset::{TransformError, position_error};
use raystone_render::{OffsetRegistry, RayOffset, Stage};
use std::sync::Arc;

/// Families whose rays pass near the sides of boxes.
const BOX_FAMILIES: [&str; 6] = [
    "edges",
    "vertices",
    "axis-parallel",
    "in-plane",
    "origins",
    "needles",
];
/// Structures that find triangles by boxes.
const BOX_STRUCTURES: [&str; 4] = ["bvh", "cwbvh", "roped-bvh", "bvh4"];
/// Number of these in a quick suite.
const BOX_STRUCTURES_IF_QUICK: usize = 2;
/// Rays a case, times those of the cells.
const BOX_RAYS: usize = 4;

/// Bounces of a chain, and rays of a series, times those of the cells.
const BOUNCES: usize = 100;
const OFFSET_RAYS: usize = 16;

/// Bands of the sphere whose triangles are all tested, and of the one that is traversed.
const COST_BANDS: (usize, usize) = (24, 64);
const COST_RAYS: (usize, usize) = (4096, 65_536);
const COST_ROUNDS: usize = 5;
/// The test that costs are compared with.
const PLAIN_TEST: &str = "moeller-trumbore";

/// Returns `true` if the box tests are tried through the structure of a cell.
pub(crate) fn has_box_tests(scope: &Scope, cell: &Cell) -> bool {
    let most = (scope.settings).either([BOX_STRUCTURES.len(), BOX_STRUCTURES_IF_QUICK]);
    BOX_STRUCTURES[..most].contains(&&*cell[Axis::Accel].name)
}

/// Losses of a box test.
#[derive(Clone, Default)]
struct Lost {
    rays: usize,
    hits: usize,
    worst: Option<Worst>,
}

/// Counts the hits that each box test loses, with the default triangle test.
///
/// # Errors
/// The device is lost or hangs.
pub(crate) fn box_tests(suite: &Suite, cells: &[Cell]) -> Results {
    let column = |cell| Ok((suite.kind(cell)?, vec![Lost::default(); BoxTest::ALL.len()]));
    let columns = cells.iter().map(column);
    let mut columns = columns.collect::<Result<Vec<_>, Absent>>()?;
    let rays = BOX_RAYS * suite.scope.settings.rays_of_a_case();
    for family in BOX_FAMILIES.iter().filter_map(|name| Family::named(name)) {
        for case in family.cases(suite.seed, true, rays) {
            let soup = TriangleSoup::new(&case.scene);
            let expected = Expected::new(&soup, &case.rays);
            suite.on_devices(&mut columns, |gpu, (kind, column)| {
                suite.box_case(gpu, &case, &expected, *kind, column)
            })?;
        }
    }
    Ok(columns
        .into_iter()
        .map(|(_, column)| losses(column))
        .collect())
}

/// Returns the losses of the box tests through one structure. Without a pad and a finite reciprocal, they depend on
/// what WGSL leaves open.
fn losses(column: Vec<Lost>) -> Found {
    let mut found = Found::default();
    let tests = || BoxTest::ALL.iter().zip(&column);
    let padded = tests().filter(|(test, _)| test.name != "plain");
    let padded = padded.map(|(test, lost)| [test.pad_ulps as usize, lost.hits]);
    let pad = smallest_sound_pad(padded).map_or(f64::MAX, |pad| pad as f64);
    found.add(&Key::default(), [(&figure::SOUND_PAD, pad)]);
    for (test, lost) in tests() {
        let at = Key::default().with(axis::BOX_TEST, test.name);
        let counts = [
            (&figure::PAD_ULPS, f64::from(test.pad_ulps)),
            (&figure::RAYS, lost.rays as f64),
            (&figure::LOST_HITS, lost.hits as f64),
        ];
        found.add(&at, counts);
        found.look_at(&at, lost.worst.clone());
    }
    found
}

/// Measures chains of mirror bounces in closed meshes with each offset, by the twins on the host.
///
/// # Errors
/// The tree cannot be built, in words.
pub(crate) fn offsets(suite: &Suite, cells: &[Cell]) -> Results {
    let mut found = Found::default();
    let rays = OFFSET_RAYS * suite.scope.settings.rays_of_a_case();
    let places = [1e-6, 1.0, 1e6].map(|scale| Placement { scale, shift: 0.0 });
    for place in places.into_iter().chain([
        Placement {
            scale: 1.0,
            shift: 1e4,
        },
        Placement::FAR,
    ]) {
        for (name, mesh) in closed_meshes(&place) {
            for &offset in OffsetRegistry::default().iter() {
                let triangle = Intersection::default().triangle.name();
                let at = Key::default().with(axis::OFFSET, offset.name);
                let at = at.with(axis::TRIANGLE, triangle).with(axis::MESH, name);
                let at = at.with(axis::PLACE, place);
                let figures = bounce(&mesh, offset, suite.seed, rays);
                let figures = figures.map_err(|error| Absent::Failed(error.to_string()))?;
                found.add(&at, figures);
            }
        }
    }
    Ok(vec![found; cells.len()])
}

/// Measures the times of triangle tests, alone and in a traversal, by rounds in turns.
///
/// # Errors
/// The device is lost or hangs.
pub(crate) fn costs(suite: &Suite, cells: &[Cell]) -> Results {
    let tests = cells.iter().map(|cell| suite.test(cell));
    let tests = tests.collect::<Result<Vec<_>, _>>()?;
    let all = suite.times(&tests, BRUTE_FORCE, COST_BANDS.0, COST_RAYS.0)?;
    let some = suite.times(&tests, PLAIN, COST_BANDS.1, COST_RAYS.1)?;
    let plain_ms = (tests.iter().zip(&some))
        .find(|(test, _)| test.name() == PLAIN_TEST)
        .map(|(_, timed)| timed.ms);
    let found = |((test, all), some): ((&AnyTriangleTest, &Timed), &Timed)| {
        let mut found = Found::default();
        let at = Key::default();
        let ns = all.ms * 1e6 / (all.tests_per_ray * all.rays as f64);
        let figures = [
            (&figure::TEST_BYTES, f64::from(test.bytes())),
            (&figure::NS_PER_TEST, ns),
            (&figure::TESTS_PER_RAY, some.tests_per_ray),
        ];
        found.add(&at, figures);
        let ratio = plain_ms.map(|plain| (&figure::TRAVERSAL_RATIO, some.ms / plain));
        found.add(&at, ratio);
        found
    };
    Ok(tests.iter().zip(&all).zip(&some).map(found).collect())
}

impl Suite<'_> {
    fn box_case(
        &self,
        gpu: &Gpu,
        case: &case::Case,
        expected: &Expected,
        kind: Kind,
        column: &mut [Lost],
    ) -> Result<(), Absent> {
        let mut stage = Stage::new(gpu, case.scene.clone(), Intersection::default())?;
        let Ok(built) = kind.build(&stage.soup) else {
            return Ok(());
        };
        let traced = Traced::upload(&stage.gpu, &*built)?;
        for (box_test, sum) in BoxTest::ALL.iter().zip(column) {
            stage.set_tests(Intersection {
                box_test: *box_test,
                ..Intersection::default()
            });
            let found = stage.closest(&traced, &case.rays)?;
            sum.rays += case.rays.len();
            let pairs = found.answers.iter().zip(expected.of(built.space()));
            let lost = pairs
                .enumerate()
                .filter(|(_, (hit, truth))| !hit.same_bits(truth));
            for (index, _) in lost {
                sum.hits += 1;
                sum.worst.get_or_insert_with(|| {
                    let test = Intersection::default().triangle;
                    let names = [kind.label(), test.name()];
                    let ray = &case.rays[index];
                    let replay = self.replay([case.family, &case.label], names, ray);
                    Worst {
                        what: "lost hit".into(),
                        replay: format!("{replay} --box-test {}", box_test.name),
                    }
                });
            }
        }
        Ok(())
    }

    /// Returns the least time of each triangle test through a structure over a sphere.
    fn times(
        &self,
        tests: &[AnyTriangleTest],
        accel: &str,
        bands: usize,
        count: usize,
    ) -> Result<Vec<Timed>, Absent> {
        let scene = Arc::new(case::scene(sphere(bands, &Placement::ORDINARY), None));
        let cell = Cell::default().with(Axis::Accel, &Variant::plain(accel));
        let kind = self.kind(&cell)?;
        let mut random = Pcg32::with_stream(self.seed, 79);
        let mut one = || Ray::new(random.in_cube().as_vec3(), random.direction().as_vec3());
        let rays: Vec<Ray> = (0..count).map(|_| one()).collect();
        let mut batches: Vec<(Timed, RayBatch)> = Vec::new();
        for test in tests {
            let stage = Stage::new(self.gpu(), Arc::clone(&scene), Self::with(*test))?;
            let built = kind.build(&stage.soup).map_err(Absent::Failed)?;
            let traced = Traced::upload(&stage.gpu, &*built)?;
            let work = stage.count_work(&traced, Query::Closest, &rays)?;
            let work = work.unwrap_or_default();
            let tests: u64 = work.iter().map(|w| u64::from(w.triangle_tests)).sum();
            // Brute force counts nothing: it tests all.
            let tests = if tests == 0 {
                (scene.triangles.len() * count) as u64
            } else {
                tests
            };
            let timed = Timed {
                ms: f64::INFINITY,
                tests_per_ray: tests as f64 / count as f64,
                rays: count,
            };
            let batch = stage.tracer(&traced, Query::Closest)?.batch(&rays)?;
            batch.trace()?;
            batches.push((timed, batch));
        }
        for _ in 0..COST_ROUNDS {
            for (timed, batch) in &mut batches {
                timed.ms = timed.ms.min(batch.trace()?.measured()?.ms());
            }
        }
        Ok(batches.into_iter().map(|(timed, _)| timed).collect())
    }
}

/// A triangle test that was timed.
struct Timed {
    ms: f64,
    tests_per_ray: f64,
    rays: usize,
}

/// Returns the smallest pad that loses no hit, nor does any greater one; each pad is beside the hits that it loses.
fn smallest_sound_pad(padded: impl Iterator<Item = [usize; 2]> + Clone) -> Option<usize> {
    let lossy = padded.clone().filter(|t| t[1] > 0).map(|t| t[0]).max();
    padded.map(|t| t[0]).filter(|pad| Some(*pad) > lossy).min()
}

/// Returns a sphere, a box, the box with faces in the planes of the axes, where coordinates are 0, and that one with
/// two faces nearly, but not quite, in such planes.
fn closed_meshes(place: &Placement) -> [(&'static str, Mesh); 4] {
    let at = |tilt: f32| -> Mesh {
        let mut mesh = cube(5, place);
        let low = raystone_scene::Bounds::of(&mesh).min;
        let moved = |v: Vec3| {
            let v = v - low;
            Vec3::new(v.x, v.y, v.z + tilt * v.x)
        };
        for triangle in &mut mesh {
            triangle.vertices = triangle.vertices.map(moved);
        }
        mesh
    };
    [
        ("sphere", sphere(12, place)),
        ("box", cube(5, place)),
        ("box at 0", at(0.0)),
        ("box at 0, tilted", at(1e-9)),
    ]
}

/// Traces chains of mirror bounces from inside. A flat triangle that a ray has left cannot be hit by it, and a closed
/// mesh cannot be left: chains that do either start again.
fn bounce(
    mesh: &Mesh,
    offset: RayOffset,
    seed: u64,
    rays: usize,
) -> Result<[(&'static Figure, f64); 5], AccelError> {
    let soup = TriangleSoup::new(&case::scene(mesh.clone(), None));
    let built = BuiltBvh::build(&soup, &BvhParameters::default(), &mut BuildLog::default())?;
    let twin = built.twin(&soup);
    let mut random = Pcg32::with_stream(seed, 80);
    let bounds = raystone_scene::Bounds::of(mesh);
    let [low, high] = [bounds.min, bounds.max].map(|v| v.as_dvec3());
    let (centre, reach) = (0.5 * (low + high), 0.1 * (high - low).max_element());
    let (mut traced, mut self_intersections, mut leaks, mut farthest) = (0, 0, 0, 0.0_f64);
    while traced < rays {
        let origin = (centre + reach * random.in_cube()).as_vec3();
        let mut next = Ray::new(origin, random.direction().as_vec3());
        let mut from = NO_HIT;
        for _ in 0..BOUNCES {
            let hit = twin.closest_hit(&next, &mut Counters::default());
            traced += 1;
            let left_itself = hit.triangle == from && from != NO_HIT;
            self_intersections += u32::from(left_itself);
            leaks += u32::from(hit.triangle == NO_HIT);
            if left_itself || hit.triangle == NO_HIT {
                break;
            }
            let Some((mirrored, moved)) = mirror(&soup, &next, &hit, offset) else {
                break;
            };
            farthest = farthest.max(moved);
            from = hit.triangle;
            next = mirrored;
        }
    }
    Ok([
        (&figure::RAYS, traced as f64),
        (&figure::SELF_INTERSECTIONS, f64::from(self_intersections)),
        (&figure::LEAKS, f64::from(leaks)),
        (&figure::BAD_BEGINS, f64::from(self_intersections + leaks)),
        (&figure::FARTHEST_BEGIN, farthest),
    ])
}

/// Returns the mirrored ray, begun as integrators begin it, and how many bounds of the point's error it was moved;
/// `None` where the triangle has no normal.
fn mirror(soup: &TriangleSoup, incoming: &Ray, hit: &Hit, offset: RayOffset) -> Option<(Ray, f64)> {
    let record = soup.records.get(hit.triangle as usize)?;
    let [v0, v1, v2] = record.vertices().map(Vec3::from);
    let (e1, e2) = (v0 - v1, v2 - v0);
    let p = v0 - hit.u * e1 + hit.v * e2;
    let direction = Vec3::from(incoming.direction);
    let normal = e1.cross(e2).try_normalize()?;
    let facing = if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    };
    let error = position_error(v0.into(), e1.into(), e2.into(), &TransformError::default());
    let origin = (offset.offset_point)(p.into(), facing.into(), error);
    let moved = (Vec3::from(origin) - p).as_dvec3().length();
    let unit = f64::from(p.abs().max_element() * f32::EPSILON);
    let bound = f64::from(facing.abs().dot(error.into())) + 2.0 * unit;
    let mirrored = direction - facing * (2.0 * facing.dot(direction));
    let next = Ray::new(origin, mirrored.try_normalize()?);
    Some((next, moved / bound.max(f64::MIN_POSITIVE)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_render::offset;

    #[test]
    fn without_an_offset_chains_meet_their_own_triangle_and_with_a_bound_they_do_not() {
        for (name, mesh) in closed_meshes(&Placement::ORDINARY) {
            let count = |offset: RayOffset| {
                let found = bounce(&mesh, offset, 1, 3000).unwrap();
                let bad = found.iter().find(|(id, _)| id.id == figure::BAD_BEGINS.id);
                bad.unwrap().1
            };
            let none = count(offset::NONE);
            assert!(none > 30.0, "{name}: {none:?}");
            assert_eq!(count(offset::ERROR_BOUND), 0.0, "{name}");
        }
    }

    #[test]
    fn the_smallest_sound_pad_is_above_every_pad_that_loses_hits() {
        let smallest = |pads: &[[usize; 2]]| smallest_sound_pad(pads.iter().copied());
        let mut pads = vec![[0, 7], [2, 0], [3, 1], [4, 0]];
        assert_eq!(smallest(&pads), Some(4));
        pads.push([16, 0]);
        assert_eq!(smallest(&pads), Some(4));
        assert_eq!(smallest(&[[0, 1]]), None);
    }
}

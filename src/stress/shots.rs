//! A million shots at closed meshes from inside, where they are modelled and at Embree's far position:
//! every miss is a crack.

use super::bench::{self, Stage};
use super::case::{Random, ray, ray_text, towards};
use super::families::on_edge;
use super::place::Place;
use super::record::{Record, ShotsRecord, SkippedRecord, Worst};
use super::shapes::{self, Mesh, RADIUS};
use super::suite::{BRUTE_FORCE, PLAIN, Suite};
use super::tally::oracle_ray;
use super::{StressError, case};
use crate::accel::{NO_HIT, Ray};
use crate::config::{Params, Variant};
use crate::integrator::Traced;
use crate::oracle::{Side, exact_truths};
use crate::scene::{Bounds, LoadOptions, Triangle, load};
use glam::Vec3;
use rayon::prelude::*;

/// Bands of the sphere: 16,256 triangles.
const BANDS: usize = 64;
/// Cells along an edge of the plane: 8,192 triangles.
const CELLS: usize = 64;
/// Side of the plane, as in Embree's test, units.
const SIDE: f64 = 200.0;
/// Rays traced at a time.
const CHUNK: usize = 1 << 17;
/// Misses that are looked up in the oracle, a series.
const LOOKED_UP: usize = 64;
/// Points tried as origins inside a model, and how many are wanted at least.
const TRIED: usize = 384;
const LEAST_ORIGINS: usize = 8;

/// What is aimed at.
const AIMS: [&str; 3] = ["random", "vertices", "edges"];

/// A mesh with points from which every ray that is shot hits it.
struct Target {
    name: &'static str,
    place: Place,
    mesh: Mesh,
    /// What is aimed at: a plane ends, and past its border lies nothing.
    aims: Mesh,
    origins: Vec<Vec3>,
    /// Rays from above go down, not anywhere.
    is_plane: bool,
}

impl Suite<'_> {
    /// Shoots at every mesh, through every structure with the default test and through the plain one
    /// with the others.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn shots(&self, progress: &dyn Fn(&str)) -> Result<Vec<Record>, StressError> {
        let mut records = Vec::new();
        for place in [Place::ORDINARY, Place::FAR] {
            for target in self.targets(place, &mut records) {
                progress(&format!("shots: {}, {place}", target.name));
                self.shoot_at(&target, &mut records)?;
            }
        }
        Ok(records)
    }

    fn targets(&self, place: Place, records: &mut Vec<Record>) -> Vec<Target> {
        let mut random = Random::with_stream(self.settings.seed, 77);
        let mut inside = |reach: f64| -> Vec<Vec3> {
            (0..512)
                .map(|_| place.point(reach * random.in_cube()))
                .collect()
        };
        let sphere = shapes::sphere(BANDS, &place);
        let plane = shapes::plane(CELLS, SIDE, &place);
        let mut targets = vec![
            Target {
                name: "sphere",
                place,
                aims: sphere.clone(),
                mesh: sphere,
                origins: inside(0.45 * RADIUS),
                is_plane: false,
            },
            Target {
                name: "plane",
                place,
                aims: within_border(&plane),
                mesh: plane,
                origins: inside(0.2 * SIDE)
                    .iter()
                    .map(|p| *p + Vec3::Y * (0.3 * SIDE) as f32)
                    .collect(),
                is_plane: true,
            },
        ];
        match self.model(place) {
            Ok(model) => targets.push(model),
            Err(reason) => records.push(Record::Skipped(SkippedRecord {
                what: format!("shots at {}, {place}", self.settings.model.display()),
                reason,
            })),
        }
        targets
    }

    /// The model with its holes closed, and points inside it.
    fn model(&self, place: Place) -> Result<Target, String> {
        let path = self.settings.model.to_string_lossy().into_owned();
        let variant = Variant {
            name: path.clone(),
            params: Params::default(),
            label: path,
        };
        let scene = load(&variant, &LoadOptions::default()).map_err(|e| e.to_string())?;
        let mesh = shapes::model(&scene.triangles, &place);
        let mut random = Random::with_stream(self.settings.seed, 78);
        let tried: Vec<Ray> = (0..TRIED)
            .map(|_| {
                ray(
                    place.point(0.7 * RADIUS * random.in_cube()),
                    random.direction().as_vec3(),
                )
            })
            .collect();
        let origins = inside(&mesh, &tried);
        if origins.len() < LEAST_ORIGINS {
            return Err(format!(
                "only {} of {TRIED} points lie inside it",
                origins.len()
            ));
        }
        Ok(Target {
            name: "model",
            place,
            aims: mesh.clone(),
            mesh,
            origins,
            is_plane: false,
        })
    }

    fn shoot_at(&self, target: &Target, records: &mut Vec<Record>) -> Result<(), StressError> {
        let scene = case::scene(target.mesh.clone(), None);
        for (row, test) in self.tests.iter().enumerate() {
            let stage = Stage::new(self.gpu, &scene, Self::with(*test))?;
            let kinds = self.kinds.iter().filter(|kind| match row {
                0 => kind.name() != BRUTE_FORCE,
                _ => kind.name() == PLAIN,
            });
            for kind in kinds {
                let name = (test.name(), kind.name());
                match bench::build(*kind, &stage.soup) {
                    Ok(built) => {
                        let traced = stage.upload(&*built)?;
                        for aim in 0..AIMS.len() {
                            let series = self.series(target, &stage, &traced, name, aim)?;
                            records.push(Record::Shots(series));
                        }
                    }
                    Err(reason) => records.push(Record::Skipped(SkippedRecord {
                        what: format!("{}, {}, {}", name.0, name.1, target.name),
                        reason,
                    })),
                }
            }
        }
        Ok(())
    }

    /// One series: as many shots as the settings want, in chunks.
    fn series(
        &self,
        target: &Target,
        stage: &Stage,
        traced: &Traced,
        (triangle, accel): (&str, &str),
        aim: usize,
    ) -> Result<ShotsRecord, StressError> {
        let mut record = ShotsRecord {
            triangle: triangle.into(),
            accel: accel.into(),
            mesh: target.name.into(),
            triangles: target.mesh.len(),
            place: target.place,
            aim: AIMS[aim].into(),
            rays: 0,
            misses: 0,
            confirmed: 0,
            failure: None,
            worst: None,
        };
        let mut missed: Vec<Ray> = Vec::new();
        let mut chunk = 0;
        while record.rays < self.settings.shots {
            let count = CHUNK.min(self.settings.shots - record.rays);
            let stream = (aim as u64) << 32 | chunk;
            let rays = target.shots(aim, self.settings.seed, stream, count);
            let found = stage.closest(traced, &rays)?;
            record.rays += count;
            chunk += 1;
            let misses = found
                .answers
                .iter()
                .zip(&rays)
                .filter(|(hit, _)| hit.triangle == NO_HIT);
            for (_, ray) in misses {
                record.misses += 1;
                if missed.len() < LOOKED_UP {
                    missed.push(*ray);
                }
            }
            if found.errors != 0 {
                record.failure = bench::error_text(found.errors);
                break;
            }
        }
        let lines: Vec<_> = missed.iter().map(oracle_ray).collect();
        let truths = exact_truths(&target.mesh, &lines);
        record.confirmed = truths.iter().filter(|truth| !truth.hits.is_empty()).count();
        record.worst = missed.first().map(|ray| Worst {
            what: format!("crack in the {}, {}", target.name, target.place),
            replay: ray_text(ray),
        });
        Ok(record)
    }
}

impl Target {
    fn shots(&self, aim: usize, seed: u64, stream: u64, count: usize) -> Vec<Ray> {
        const BLOCK: usize = 4096;
        let block = |block: usize| {
            let mut random = Random::with_stream(seed, stream << 16 | block as u64);
            let rays = BLOCK.min(count - block * BLOCK);
            (0..rays)
                .map(|_| self.shot(aim, &mut random))
                .collect::<Vec<_>>()
        };
        (0..count.div_ceil(BLOCK))
            .into_par_iter()
            .flat_map_iter(block)
            .collect()
    }

    fn shot(&self, aim: usize, random: &mut Random) -> Ray {
        let origin = random.one_of(&self.origins);
        let triangle = random.one_of(&self.aims);
        match aim {
            0 if self.is_plane => towards(origin, random.on(triangle.vertices).as_vec3()),
            0 => ray(origin, random.direction().as_vec3()),
            1 => towards(origin, triangle.vertices[random.below(3)]),
            _ => towards(origin, on_edge(&triangle, random)),
        }
    }
}

/// The triangles that do not touch the border of a level plane.
fn within_border(plane: &[Triangle]) -> Mesh {
    let bounds = Bounds::of(plane);
    let is_inner = |v: &Vec3| {
        [0, 2]
            .iter()
            .all(|&a| v[a] > bounds.min[a] && v[a] < bounds.max[a])
    };
    let inner = plane.iter().filter(|t| t.vertices.iter().all(is_inner));
    inner.copied().collect()
}

/// Origins of those rays that leave the mesh an odd number of times, through insides only.
fn inside(mesh: &[Triangle], rays: &[Ray]) -> Vec<Vec3> {
    let lines: Vec<_> = rays.iter().map(oracle_ray).collect();
    let truths = exact_truths(mesh, &lines);
    let is_inside = |truth: &crate::oracle::ExactTruth| {
        truth.hits.len() % 2 == 1 && truth.hits.iter().all(|hit| hit.side == Side::Inside)
    };
    let pairs = rays.iter().zip(&truths);
    pairs
        .filter(|(_, truth)| is_inside(truth))
        .map(|(ray, _)| Vec3::from(ray.origin))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_inside_a_closed_mesh_are_told_from_points_outside() {
        let mesh = shapes::sphere(8, &Place::ORDINARY);
        let mut random = Random::with_stream(1, 0);
        let mut rays = |radius: f64| -> Vec<Ray> {
            (0..40)
                .map(|_| {
                    let origin = (radius * random.direction()).as_vec3();
                    ray(origin, random.direction().as_vec3())
                })
                .collect()
        };
        assert!(inside(&mesh, &rays(0.8 * RADIUS)).len() > 38);
        assert_eq!(inside(&mesh, &rays(1.1 * RADIUS)).len(), 0);
    }
}

//! A million shots at closed meshes from inside, where they are modelled and at Embree's far position:
//! every miss is a crack.

use super::measurement::Results;
use super::placement::Placement;
use super::shot_meshes::{AIMS, FAMILY, PLANE, SPHERE, ShotMesh};
use super::suite::{Kind, Suite};
use super::tally::Worst;
use super::{Found, bench, case};
use raystone_accel::oracle::exact_truths;
use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{NO_HIT, Ray, Traced};
use raystone_bench::run::Absent;
use raystone_config::Cell;
use raystone_record::figure;
use raystone_record::{Key, axis};
use raystone_render::Stage;
use std::sync::Arc;

/// Rays traced at a time.
const CHUNK: usize = 1 << 17;
/// Misses that are looked up in the oracle, a series.
const LOOKED_UP: usize = 64;

/// A structure and test that shoot at the meshes, and the results.
type Shooter<'a> = (Kind<'a>, AnyTriangleTest, Found);

/// Shoots at every mesh through the structures of the cells with their triangle tests.
///
/// # Errors
/// The device is lost or hangs.
pub(crate) fn shots(suite: &Suite, cells: &[Cell]) -> Results {
    let shooter = |cell| Ok((suite.kind(cell)?, suite.test(cell)?, Found::default()));
    let shooters = cells.iter().map(shooter);
    let mut shooters = shooters.collect::<Result<Vec<Shooter>, Absent>>()?;
    let settings = &suite.scope.settings;
    let model = settings.model.as_ref();
    let model = model.map(|path| path.to_string_lossy().into_owned());
    for place in [Placement::ORDINARY, Placement::FAR] {
        let model = model.as_deref();
        let model = model.filter(|_| !settings.quick || place == Placement::ORDINARY);
        for name in [SPHERE, PLANE].into_iter().chain(model) {
            match ShotMesh::named(name, place, suite.seed) {
                Ok(target) => suite.shoot_at(&target, &mut shooters)?,
                Err(reason) => {
                    let at = Key::default()
                        .with(axis::MESH, name)
                        .with(axis::PLACE, place);
                    for (.., found) in &mut shooters {
                        found.note(&at, "left out", &*reason);
                    }
                }
            }
        }
    }
    Ok(shooters.into_iter().map(|(.., found)| found).collect())
}

impl Suite<'_> {
    fn shoot_at(&self, target: &ShotMesh, shooters: &mut [Shooter]) -> Result<(), Absent> {
        let scene = Arc::new(case::scene(target.mesh.clone(), None));
        let at = Key::default().with(axis::MESH, target.short_name());
        let at = at.with(axis::PLACE, target.place);
        self.on_devices(shooters, |gpu, (kind, test, found)| {
            let stage = Stage::new(gpu, Arc::clone(&scene), Self::with(*test))?;
            match kind.build(&stage.soup) {
                Ok(built) => {
                    let traced = Traced::upload(&stage.gpu, &*built)?;
                    let names = [kind.label(), test.name()];
                    for (aim, aimed_at) in AIMS.iter().enumerate() {
                        let at = at.clone().with(axis::AIM, aimed_at);
                        self.series(target, (&stage, &traced), names, aim, (&at, found))?;
                    }
                }
                Err(reason) => found.note(&at, "left out", reason),
            }
            Ok(())
        })
    }

    /// Traces one series: as many shots as the settings require, in chunks. Shots ended by a kernel's error say nothing of
    /// the mesh.
    fn series(
        &self,
        target: &ShotMesh,
        (stage, traced): (&Stage, &Traced),
        names: [&str; 2],
        aim: usize,
        (at, found): (&Key, &mut Found),
    ) -> Result<(), Absent> {
        let mut failures = Vec::new();
        let mut looked_up: Vec<Ray> = Vec::new();
        let (mut shot, mut misses, mut chunk) = (0, 0, 0);
        let wanted = self.scope.settings.shots_at_a_mesh();
        while shot < wanted && failures.is_empty() {
            let count = CHUNK.min(wanted - shot);
            let stream = (aim as u64) << 32 | chunk;
            let rays = target.shots(aim, self.seed, stream, count);
            let traced = stage.closest(traced, &rays)?;
            shot += count;
            chunk += 1;
            let answers = traced.answers.iter().zip(&rays);
            let missed: Vec<Ray> = answers
                .filter(|(hit, _)| hit.triangle == NO_HIT)
                .map(|(_, ray)| *ray)
                .collect();
            misses += missed.len();
            looked_up.extend(missed.iter().take(LOOKED_UP - looked_up.len()));
            failures.extend(bench::error_text(traced.errors));
        }
        let truths = exact_truths(&target.mesh, &looked_up);
        let confirmed = truths.iter().filter(|truth| !truth.hits.is_empty()).count();
        found.add(at, [(&figure::RAYS, shot as f64)]);
        let counts = [
            (&figure::TRIANGLES, target.mesh.len() as f64),
            (&figure::MISSES, misses as f64),
            (&figure::MISS_SHARE, misses as f64 / shot.max(1) as f64),
            (&figure::CONFIRMED_MISSES, confirmed as f64),
        ];
        found.add(at, counts.into_iter().filter(|_| failures.is_empty()));
        found.failures(at, failures);
        let worst = looked_up.first().map(|ray| Worst {
            what: format!("crack in the {}", target.label()),
            replay: self.replay([FAMILY, &target.label()], names, ray),
        });
        found.look_at(at, worst);
        Ok(())
    }
}

//! A million shots at closed meshes from inside, where they are modelled and at Embree's far position:
//! every miss is a crack.

use super::bench;
use super::placement::Placement;
use super::record::{Findings, Line, Record, Worst, line, skipped};
use super::shot_meshes::{AIMS, FAMILY, PLANE, SPHERE, ShotMesh};
use super::suite::{BRUTE_FORCE, Kind, PLAIN, Progress, Suite, key};
use super::{StressError, case};
use raystone_accel::oracle::exact_truths;
use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{NO_HIT, Ray, Traced};
use raystone_record::figure;
use raystone_record::{Key, axis};
use raystone_render::Stage;
use std::sync::Arc;

/// Rays traced at a time.
const CHUNK: usize = 1 << 17;
/// Misses that are looked up in the oracle, a series.
const LOOKED_UP: usize = 64;

impl Suite<'_> {
    /// Shoots at every mesh, through every structure with the default test and through the plain one
    /// with the others.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub(crate) fn shots(&self, progress: &Progress) -> Result<Vec<Line>, StressError> {
        let mut records = Vec::new();
        let model = self.settings.model.as_ref();
        let model = model.map(|path| path.to_string_lossy().into_owned());
        let model = model.unwrap_or_default();
        if model.is_empty() {
            records.push(skipped(
                Key::default(),
                "shots at a model".into(),
                "none was given",
            ));
        }
        for place in [Placement::ORDINARY, Placement::FAR] {
            for name in [SPHERE, PLANE, &model]
                .into_iter()
                .filter(|name| !name.is_empty())
            {
                if self.settings.quick && name == model && place != Placement::ORDINARY {
                    continue;
                }
                match ShotMesh::named(name, place, self.settings.seed) {
                    Ok(target) => self.shoot_at(&target, &mut records, progress)?,
                    Err(reason) => {
                        let what = format!("shots at {name}, {place}");
                        records.push(skipped(Key::default(), what, reason));
                    }
                }
            }
        }
        Ok(records)
    }

    fn shoot_at(
        &self,
        target: &ShotMesh,
        records: &mut Vec<Line>,
        progress: &Progress,
    ) -> Result<(), StressError> {
        let scene = Arc::new(case::scene(target.mesh.clone(), None));
        let (mesh, place) = (target.short_name(), target.place);
        let mut series: Vec<(AnyTriangleTest, Kind, Vec<Line>)> = Vec::new();
        for (row, test) in self.tests.iter().enumerate() {
            let kinds = self.kinds.iter().filter(|kind| match row {
                0 => kind.name() != BRUTE_FORCE,
                _ => kind.name() == PLAIN,
            });
            series.extend(kinds.map(|kind| (*test, *kind, Vec::new())));
        }
        self.on_devices(&mut series, |gpu, (test, kind, records)| {
            let name = (test.name(), kind.name());
            progress(&format!("shots: {mesh}, {place}, {}, {}", name.0, name.1));
            let stage = Stage::new(gpu, Arc::clone(&scene), Self::with(*test))?;
            match bench::build(*kind, &stage.soup) {
                Ok(built) => {
                    let traced = Traced::upload(&stage.gpu, &*built)?;
                    for (aim, aimed_at) in AIMS.iter().enumerate() {
                        let series = self.series(target, &stage, &traced, name, aim)?;
                        let key = key(*test, *kind).with(axis::MESH, mesh);
                        let key = key.with(axis::PLACE, place).with(axis::AIM, aimed_at);
                        records.push(line(key, Record::Shots(series)));
                    }
                }
                Err(reason) => {
                    let what = format!("{}, {}, {mesh}, {place}", name.0, name.1);
                    records.push(skipped(Key::default(), what, reason));
                }
            }
            Ok(())
        })?;
        records.extend(series.into_iter().flat_map(|(.., records)| records));
        Ok(())
    }

    /// One series: as many shots as the settings want, in chunks.
    fn series(
        &self,
        target: &ShotMesh,
        stage: &Stage,
        traced: &Traced,
        (triangle, accel): (&str, &str),
        aim: usize,
    ) -> Result<Findings, StressError> {
        let mut failures = Vec::new();
        let mut looked_up: Vec<Ray> = Vec::new();
        let (mut shot, mut misses, mut chunk) = (0, 0, 0);
        while shot < self.settings.shots {
            let count = CHUNK.min(self.settings.shots - shot);
            let stream = (aim as u64) << 32 | chunk;
            let rays = target.shots(aim, self.settings.seed, stream, count);
            let found = stage.closest(traced, &rays)?;
            shot += count;
            chunk += 1;
            let answers = found.answers.iter().zip(&rays);
            let missed: Vec<Ray> = answers
                .filter(|(hit, _)| hit.triangle == NO_HIT)
                .map(|(_, ray)| *ray)
                .collect();
            misses += missed.len();
            looked_up.extend(missed.iter().take(LOOKED_UP - looked_up.len()));
            failures.extend(bench::error_text(found.errors));
            if !failures.is_empty() {
                break;
            }
        }
        let truths = exact_truths(&target.mesh, &looked_up);
        let confirmed = truths.iter().filter(|truth| !truth.hits.is_empty()).count();
        let worst = looked_up.first().map(|ray| Worst {
            what: format!("crack in the {}", target.label()),
            replay: self.replay([FAMILY, &target.label()], [accel, triangle], ray),
        });
        let counts = [
            (&figure::TRIANGLES, target.mesh.len()),
            (&figure::RAYS, shot),
            (&figure::MISSES, misses),
            (&figure::CONFIRMED_MISSES, confirmed),
        ];
        Ok(Findings {
            failures,
            worst,
            ..Findings::of(counts.map(|(id, count)| (id, count as f64)))
        })
    }
}

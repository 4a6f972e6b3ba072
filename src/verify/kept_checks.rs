//! A cache of checks of the reference tracer: the verdicts of brute force and the oracle are stored
//! on disk under a hash of everything that they depend on.
//!
//! The hash covers the scene, the tests, every ray with its reference answer, how much was checked,
//! and the program, so that a wrong answer never finds the checks of a right one. Only checks
//! without a fault are stored; a file that is incomplete or has the wrong name is ignored.

use crate::gate::Judge;
use raystone_accel::Intersection;
use raystone_config::Gate;
use raystone_core::atomic::write_atomic;
use raystone_record::JudgeCheck;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::SystemTime;

/// Names a cache folder to use instead of the user's; `off` disables the cache.
pub(crate) const CACHE_VARIABLE: &str = "RAYSTONE_CACHE";

pub(super) struct KeptChecks {
    folder: PathBuf,
    key: String,
}

#[derive(Serialize, Deserialize)]
struct Content {
    key: String,
    checked_unix_s: u64,
    world: [JudgeCheck; 2],
    instances: Option<[JudgeCheck; 2]>,
}

impl KeptChecks {
    /// The place in a folder for a reference with these rays; `None` without a program identity.
    pub(crate) fn of(
        folder: PathBuf,
        judge: &Judge,
        scene_hash: &str,
        intersection: Intersection,
        settings: &Gate,
    ) -> Option<Self> {
        let mut hasher = blake3::Hasher::new();
        let about = format!("{scene_hash} {intersection:?} {settings:?} {}", program()?);
        hasher.update(about.as_bytes());
        let judges = [Some(judge), judge.instances.as_deref()];
        for set in judges.into_iter().flatten().flat_map(|judge| &judge.sets) {
            hasher.update(&(set.rays.len() as u64).to_le_bytes());
            hasher.update(bytemuck::cast_slice(&set.rays));
            hasher.update(bytemuck::cast_slice(&set.truth));
        }
        Some(Self {
            folder,
            key: hasher.finalize().to_hex().to_string(),
        })
    }

    fn path(&self) -> PathBuf {
        self.folder.join(format!("judge-{}.json", self.key))
    }

    /// Restores cached checks; returns true if there were any.
    pub(crate) fn restore(&self, judge: &mut Judge) -> bool {
        let Some(content) = self.read() else {
            return false;
        };
        let since = Some(content.checked_unix_s);
        let kept = |check| JudgeCheck {
            reused_unix_s: since,
            ..check
        };
        [judge.brute_force, judge.oracle] = content.world.map(kept);
        if let (Some(judge), Some(checks)) = (&mut judge.instances, content.instances) {
            [judge.brute_force, judge.oracle] = checks.map(kept);
        }
        true
    }

    fn read(&self) -> Option<Content> {
        let text = std::fs::read_to_string(self.path()).ok()?;
        let (line, sum) = text.trim_end().split_once('\n')?;
        if blake3::hash(line.as_bytes()).to_hex().as_str() != sum {
            return None;
        }
        let content: Content = serde_json::from_str(line).ok()?;
        let checks = content
            .world
            .iter()
            .chain(content.instances.iter().flatten());
        let right = checks.clone().all(|c| c.wrong == 0) && checks.clone().all(|c| c.rays > 0);
        (content.key == self.key && right).then_some(content)
    }

    /// Stores the checks of a sound reference. After a failed write they merely run again.
    pub(crate) fn keep(&self, judge: &Judge) {
        let instances = judge.instances.as_deref();
        if !judge.is_sound() || instances.is_some_and(|judge| !judge.is_sound()) {
            return;
        }
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let checks = |judge: &Judge| [judge.brute_force.clone(), judge.oracle.clone()];
        let content = Content {
            key: self.key.clone(),
            checked_unix_s: now.map_or(0, |d| d.as_secs()),
            world: checks(judge),
            instances: instances.map(checks),
        };
        let Ok(line) = serde_json::to_string(&content) else {
            return;
        };
        let sum = blake3::hash(line.as_bytes()).to_hex();
        let written = std::fs::create_dir_all(&self.folder)
            .and_then(|()| write_atomic(&self.path(), format!("{line}\n{sum}\n").as_bytes()));
        // A cache that cannot be written only costs time.
        drop(written);
    }
}

/// The cache folder, if the cache is enabled.
pub(super) fn folder() -> Option<PathBuf> {
    let named = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    match named(CACHE_VARIABLE) {
        Some(value) if value == "off" => None,
        Some(value) => Some(value.into()),
        None => {
            let cache = named("XDG_CACHE_HOME").map(PathBuf::from);
            let cache = cache.or_else(|| Some(PathBuf::from(named("HOME")?).join(".cache")));
            Some(cache?.join("raystone"))
        }
    }
}

/// Identifies this build of the program.
fn program() -> Option<String> {
    let file = std::fs::metadata(std::env::current_exe().ok()?).ok()?;
    let built = file.modified().ok()?;
    let since = built.duration_since(SystemTime::UNIX_EPOCH).ok()?;
    let version = env!("CARGO_PKG_VERSION");
    Some(format!("{version} {} {}", file.len(), since.as_nanos()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::RaySet;
    use raystone_accel::{Hit, Ray};
    use raystone_record::RayClass;
    use std::path::Path;

    fn judge(t: f32) -> Judge {
        let checked = JudgeCheck {
            rays: 7,
            ..JudgeCheck::default()
        };
        let ray = Ray::new([0.0; 3], [1.0; 3]).between(0.0, t);
        let set = RaySet {
            class: RayClass::Chord,
            truth: vec![Hit::miss(&ray)],
            rays: vec![ray],
            shadow: Vec::new(),
        };
        Judge {
            brute_force: checked.clone(),
            oracle: checked,
            ..Judge::of_sets(vec![set])
        }
    }

    const GATE: Gate = Gate {
        rays: 1,
        brute_force_tests: 1,
        oracle_rays: 1,
        ao_length: 0.0,
        offset: 0.0,
        shadow_orders: false,
    };

    fn place(folder: &Path, judge: &Judge, gate: &Gate) -> KeptChecks {
        let place = KeptChecks::of(
            folder.to_owned(),
            judge,
            "scene",
            Intersection::default(),
            gate,
        );
        place.expect("a program")
    }

    #[test]
    fn sound_checks_are_found_again_for_the_same_answers_only() {
        let folder = tempfile::tempdir().unwrap();
        let sound = judge(1.0);
        let here = place(folder.path(), &sound, &GATE);
        assert!(!here.restore(&mut judge(1.0)));
        here.keep(&sound);
        let mut again = judge(1.0);
        assert!(here.restore(&mut again));
        assert!(again.brute_force.reused_unix_s.is_some() && again.oracle.rays == 7);
        // One bit of an answer, or a larger number of checks.
        let next = 1.0_f32.next_up();
        assert!(!place(folder.path(), &judge(next), &GATE).restore(&mut judge(next)));
        let more = Gate {
            oracle_rays: 2,
            ..GATE
        };
        assert!(!place(folder.path(), &sound, &more).restore(&mut judge(1.0)));
    }

    #[test]
    fn files_that_are_changed_foreign_or_of_a_wrong_judge_count_for_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let sound = judge(1.0);
        let here = place(folder.path(), &sound, &GATE);
        let mut wrong = judge(1.0);
        wrong.oracle.wrong = 1;
        here.keep(&wrong);
        assert!(!here.path().exists());
        here.keep(&sound);
        let whole = std::fs::read_to_string(here.path()).unwrap();
        for changed in [
            whole.replace("\"rays\":7", "\"rays\":8"),
            whole[..40].to_owned(),
        ] {
            assert_ne!(changed, whole);
            std::fs::write(here.path(), changed).unwrap();
            assert!(!here.restore(&mut judge(1.0)));
        }
        let there = place(folder.path(), &judge(2.0), &GATE);
        std::fs::write(there.path(), &whole).unwrap();
        assert!(!there.restore(&mut judge(2.0)));
    }
}

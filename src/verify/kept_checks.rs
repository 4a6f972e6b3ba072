//! A cache of checks of the reference tracer: the verdicts of brute force and the oracle are stored
//! on disk under a hash of everything that they depend on ([`raystone_core::store`]).
//!
//! The hash covers the scene, the tests, every ray with its reference answer, how much was checked,
//! and the program, so that a wrong answer never finds the checks of a right one. Only checks
//! without a fault are stored.

use crate::gate::ReferenceTracer;
use raystone_accel::Intersection;
use raystone_config::Gate;
use raystone_core::clock::Instant;
use raystone_core::store::Kept;
use raystone_record::ReferenceCheck;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where the checks of one judge are kept.
pub(super) struct KeptChecks(Kept);

#[derive(Serialize, Deserialize)]
struct Content {
    checked_unix_s: u64,
    world: [ReferenceCheck; 2],
    instances: Option<[ReferenceCheck; 2]>,
}

impl KeptChecks {
    /// The place in a folder for a reference with these rays; `None` without a program identity.
    pub(crate) fn of(
        folder: &Path,
        reference: &ReferenceTracer,
        scene_hash: &str,
        intersection: Intersection,
        settings: &Gate,
    ) -> Option<Self> {
        let mut hasher = blake3::Hasher::new();
        let judges = [Some(reference), reference.instances.as_deref()];
        for set in judges
            .into_iter()
            .flatten()
            .flat_map(|reference| &reference.sets)
        {
            hasher.update(&(set.rays.len() as u64).to_le_bytes());
            hasher.update(bytemuck::cast_slice(&set.rays));
            hasher.update(bytemuck::cast_slice(&set.truth));
        }
        let settings = format!("{intersection:?} {settings:?}");
        let rays = hasher.finalize().to_hex();
        let depends_on = [
            ("scene", scene_hash),
            ("settings", &settings),
            ("rays", &rays),
        ];
        Kept::new(folder, "checks", &depends_on).map(Self)
    }

    /// Restores cached checks; returns true if there were any.
    pub(crate) fn restore(&self, reference: &mut ReferenceTracer) -> bool {
        let Some(content) = self.read() else {
            return false;
        };
        let since = Some(content.checked_unix_s);
        let kept = |check| ReferenceCheck {
            reused_unix_s: since,
            ..check
        };
        [reference.brute_force, reference.oracle] = content.world.map(kept);
        if let (Some(reference), Some(checks)) = (&mut reference.instances, content.instances) {
            [reference.brute_force, reference.oracle] = checks.map(kept);
        }
        true
    }

    fn read(&self) -> Option<Content> {
        let content: Content = serde_json::from_slice(&self.0.read()?).ok()?;
        let world = content.world.iter();
        let mut checks = world.chain(content.instances.iter().flatten());
        checks
            .all(|check| check.wrong == 0 && check.rays > 0)
            .then_some(content)
    }

    /// Stores the checks of a sound reference. After a failed write they merely run again.
    pub(crate) fn keep(&self, reference: &ReferenceTracer) {
        let instances = reference.instances.as_deref();
        if !reference.is_sound() || instances.is_some_and(|reference| !reference.is_sound()) {
            return;
        }
        let checks =
            |reference: &ReferenceTracer| [reference.brute_force.clone(), reference.oracle.clone()];
        let content = Content {
            checked_unix_s: Instant::unix_s(),
            world: checks(reference),
            instances: instances.map(checks),
        };
        if let Ok(bytes) = serde_json::to_vec(&content) {
            // A cache that cannot be written costs time, nothing else.
            let _ = self.0.write(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::RaySet;
    use raystone_accel::{Hit, Ray};
    use raystone_record::RayClass;

    fn judge(t: f32) -> ReferenceTracer {
        let checked = ReferenceCheck {
            rays: 7,
            ..ReferenceCheck::default()
        };
        let ray = Ray::new([0.0; 3], [1.0; 3]).between(0.0, t);
        let set = RaySet {
            class: RayClass::Chord,
            truth: vec![Hit::miss(&ray)],
            rays: vec![ray],
            shadow: Vec::new(),
        };
        ReferenceTracer {
            brute_force: checked.clone(),
            oracle: checked,
            ..ReferenceTracer::of_sets(vec![set])
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

    fn place(folder: &Path, reference: &ReferenceTracer, gate: &Gate) -> KeptChecks {
        let place = KeptChecks::of(folder, reference, "scene", Intersection::default(), gate);
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
    fn checks_of_a_wrong_judge_or_that_were_changed_count_for_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let sound = judge(1.0);
        let here = place(folder.path(), &sound, &GATE);
        let mut wrong = judge(1.0);
        wrong.oracle.wrong = 1;
        here.keep(&wrong);
        assert!(!here.0.path().exists());
        here.keep(&sound);
        let text = String::from_utf8(here.0.read().unwrap()).unwrap();
        let faulty = text.replacen("\"wrong\":0", "\"wrong\":1", 1);
        assert_ne!(faulty, text);
        here.0.write(faulty.into_bytes()).unwrap();
        assert!(!here.restore(&mut judge(1.0)));
    }
}

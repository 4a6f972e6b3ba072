//! Estimators of tracking against closed forms, sums in f64 that know no structure, and quadratures.

use super::pipeline::medium;
use super::segments::adapter;
use crate::medium::Medium;
use crate::phase::{HENYEY_GREENSTEIN, SCHLICK};
use crate::rays::SegmentRay;
use crate::segments::exact_depth;
use crate::tracking::{Estimate, Estimator, Light, Tracker, TrackingError, single_scattering};
use crate::{Bounds, Phase, Volume, procedures, structure};
use glam::DVec3;
use raystone_gpu::Gpu;

/// Standard errors by which a mean may be off: one of these tests in a million would fail by chance.
const SIGMAS: f64 = 4.9;

fn across() -> Light {
    let origin = DVec3::new(-0.5, 0.4, 0.3);
    Light {
        origin,
        direction: (DVec3::new(1.2, 0.55, 0.7) - origin).normalize(),
        point: DVec3::new(0.5, 1.6, 0.4),
        intensity: 0.0,
        background: 0.0,
    }
}

fn estimate(gpu: &Gpu, volume: &Volume, name: &str, light: &Light, by: Estimator) -> Estimate {
    let medium = medium(volume, name);
    let tracker = Tracker::new(gpu, (volume, &medium), light, by, (1 << 16, 11)).unwrap();
    tracker.estimate().unwrap().0
}

fn depth_between(volume: &Volume, medium: &Medium, a: DVec3, b: DVec3) -> f64 {
    let way = b - a;
    let Some(ray) = SegmentRay::new(volume, medium, a, way.normalize()) else {
        return 0.0;
    };
    let [enter, _] = volume.clip(a, way.normalize()).unwrap();
    let to = ray.to.min((way.length() - enter).max(0.0) as f32);
    exact_depth(medium, &SegmentRay { to, ..ray })
}

#[test]
fn transmittances_of_all_estimators_and_structures_are_unbiased() {
    let Some(gpu) = adapter() else { return };
    let volume = procedures::cloud(20).unwrap();
    let light = across();
    for kind in structure::registry().iter() {
        let medium = medium(&volume, kind.name());
        let ray = SegmentRay::new(&volume, &medium, light.origin, light.direction).unwrap();
        let exact = (-exact_depth(&medium, &ray)).exp();
        assert!((0.05..0.95).contains(&exact), "{exact}");
        let all = [Estimator::Delta, Estimator::Ratio, Estimator::ResidualRatio];
        let found = all.map(|by| estimate(&gpu, &volume, kind.name(), &light, by));
        for (by, found) in all.iter().zip(&found) {
            let off = (found.mean - exact).abs() / found.error;
            assert!(
                off < SIGMAS,
                "{} {by:?}: {found:?}, not {exact}",
                kind.name()
            );
        }
        assert!(found[1].error < found[0].error, "{found:?}");
        assert!(found[2].error <= found[1].error, "{found:?}");
    }
}

#[test]
fn a_medium_without_scattering_has_the_closed_form_and_one_without_absorption_loses_nothing() {
    let Some(gpu) = adapter() else { return };
    let light = Light {
        background: 1.0,
        ..across()
    };
    let dark = Volume::constant(0.0, 1.5, 1.0).unwrap();
    let [enter, leave] = dark.clip(light.origin, light.direction).unwrap();
    let exact = (-1.5 * (leave - enter)).exp();
    let found = estimate(&gpu, &dark, "level-map", &light, Estimator::Paths(8));
    assert!(
        (found.mean - exact).abs() < SIGMAS * found.error,
        "{found:?}, not {exact}"
    );
    let constant = estimate(&gpu, &dark, "level-map", &light, Estimator::ResidualRatio);
    assert!(
        (constant.mean - exact).abs() < 1e-6 && constant.error < 1e-7,
        "{constant:?}"
    );
    // White furnace: every path escapes with weight 1.
    let mut white = procedures::cloud(16).unwrap();
    white.absorption.fill(0.0);
    for (kind, anisotropy) in [(SCHLICK, 0.6), (HENYEY_GREENSTEIN, -0.4)] {
        white.phase = Phase { kind, anisotropy };
        let found = estimate(&gpu, &white, "chebyshev", &light, Estimator::Paths(4096));
        assert_eq!((found.mean, found.ended), (1.0, 0), "{found:?}");
    }
    // A path that is ended is counted.
    let capped = estimate(&gpu, &white, "chebyshev", &light, Estimator::Paths(1));
    assert!(capped.ended > 0 && capped.mean < 1.0, "{capped:?}");
}

#[test]
fn single_scattering_is_that_of_a_quadrature_with_the_light_outside_and_inside() {
    let Some(gpu) = adapter() else { return };
    let fog = Volume::constant(1.2, 0.3, 1.0).unwrap();
    let cloud = procedures::cloud(16).unwrap();
    for (mut volume, name) in [(fog, "dda"), (cloud, "sparse-tree")] {
        for (kind, anisotropy) in [(HENYEY_GREENSTEIN, 0.5), (SCHLICK, -0.5)] {
            volume.phase = Phase { kind, anisotropy };
            for point in [DVec3::new(0.5, 1.6, 0.4), DVec3::new(0.3, 0.85, 0.2)] {
                let light = Light {
                    point,
                    intensity: 2.0,
                    ..across()
                };
                let medium = medium(&volume, name);
                let sigma = |x: DVec3| medium.exact_at(medium.in_voxels(x))[1];
                let depth = |a, b| depth_between(&volume, &medium, a, b);
                let exact = single_scattering(&volume, &light, 2048, sigma, depth).unwrap();
                let found = estimate(&gpu, &volume, name, &light, Estimator::Paths(1));
                let off = (found.mean - exact).abs();
                // Extinction is read as half floats, the albedo is not.
                let slack = SIGMAS * found.error + 1e-3 * exact;
                assert!(off < slack, "{name} {point}: {found:?}, not {exact}");
                let more = estimate(&gpu, &volume, name, &light, Estimator::Paths(64));
                assert!(more.mean > found.mean, "{more:?} of {found:?}");
            }
        }
    }
}

#[test]
fn media_that_tracking_cannot_do_are_refused() {
    let Some(gpu) = adapter() else { return };
    let refused = |change: fn(&mut Volume), light: Light| {
        let mut volume = procedures::cloud(8).unwrap();
        change(&mut volume);
        let medium = medium(&volume, "dda");
        let made = Tracker::new(&gpu, (&volume, &medium), &light, Estimator::Ratio, (64, 0));
        made.err().expect("an error").to_string()
    };
    assert!(refused(|v| v.bounds = Bounds::Sphere, across()).contains("fills its box"));
    assert!(refused(|v| v.absorption.fill(0.3), across()).contains("same share"));
    let away = Light {
        direction: DVec3::NEG_X,
        ..across()
    };
    assert!(refused(|_| (), away).contains(&TrackingError::Misses.to_string()));
}

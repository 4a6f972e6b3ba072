//! Faults of the host that a run has to see: flags that are forgotten, and another light or medium than the one judged.

use super::checks::{Judge, errors, truth_of};
use super::ready::{begun, ran, turn_to};
use super::scene::{lamp, view};
use super::*;
use crate::medium::{Homogeneity, Medium};
use crate::photons::Points;
use crate::pipeline::{Pipeline, Rendered, Source};
use crate::scatter::Adding;
use crate::tests::segments::adapter;
use crate::{Volume, structure};

fn fog(side: u32) -> (Volume, Medium) {
    let mut volume = Volume::new([side; 3], |_| [FOG[0], FOG[1], 1.0]).unwrap();
    volume.phase = PHASE;
    let structure = structure::registry()
        .find("level-map")
        .unwrap()
        .make(&Default::default())
        .unwrap();
    let medium = Medium::new(&volume, structure, Homogeneity::default());
    (volume, medium)
}

#[test]
fn errors_of_an_image_are_parts_of_its_mean() {
    let truth = [1.0, 3.0];
    let intensity = DVec3::new(1.0, 2.0, 3.0);
    // Off by 1, 2 and 0, and by -3, 0 and 0 of a mean of (6 + 18) / 6 = 4.
    let image = [Vec3::new(2.0, 4.0, 3.0), Vec3::new(0.0, 6.0, 9.0)];
    let [rmse, bias] = errors(&truth, intensity, &image);
    assert!((rmse - (14.0_f64 / 6.0).sqrt() / 4.0).abs() < 1e-12);
    assert_eq!(bias, 0.0);
    let image = [Vec3::new(2.0, 4.0, 3.0), Vec3::new(3.0, 6.0, 12.0)];
    let [rmse, bias] = errors(&truth, intensity, &image);
    assert!((rmse - (14.0_f64 / 6.0).sqrt() / 4.0).abs() < 1e-12);
    assert!((bias - 1.0 / 4.0).abs() < 1e-12);
}

#[test]
fn a_flag_that_is_forgotten_fails_the_cell() {
    let Some(gpu) = adapter() else { return };
    let (volume, medium) = fog(8);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let rays = view();
    // Light, phase function, view, points: the change, whether photons run, and what a run says.
    type Change<'a> = (&'a dyn Fn(&mut Pipeline), bool);
    let points = vec![([0.5, 0.5], 1.0), ([0.4, 0.6], 1.0)];
    let changes: [Change; 4] = [
        (&|pipeline| pipeline.set_source(lamp()), true),
        (&|pipeline| pipeline.set_phase(PHASE), false),
        (&|pipeline| pipeline.set_view(&rays), false),
        (&|pipeline| pipeline.set_points(points.clone()), true),
    ];
    for (change, photons) in changes {
        let mut pipeline = begun(&gpu, (&volume, &medium), adding).unwrap();
        change(&mut pipeline);
        assert!(ran("a change", &pipeline.render().unwrap(), photons).is_ok());
        let mut pipeline = begun(&gpu, (&volume, &medium), adding).unwrap();
        change(&mut pipeline);
        pipeline.forget();
        let Err(Absent::Failed(reason)) = ran("a change", &pipeline.render().unwrap(), photons)
        else {
            panic!("not seen");
        };
        assert!(
            reason.contains("after a change the passes [] ran"),
            "{reason}"
        );
    }
}

#[test]
fn another_light_or_medium_than_the_one_judged_fails_the_cell() {
    let Some(gpu) = adapter() else { return };
    let (volume, medium) = fog(12);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let rays = view();
    let mut pipeline = begun(&gpu, (&volume, &medium), adding).unwrap();
    turn_to(&mut pipeline, lamp(), PHASE, &rays).unwrap();
    let set = point_set(Points::Hammersley, 96, 0).unwrap();
    pipeline.set_points(set.into_iter().map(|point| (point, 1.0)).collect());
    let rendered = pipeline.render().unwrap();
    let truth = truth_of(&volume, &medium, LAMP, &rays);
    let (source, twice) = (
        lamp(),
        Source::Point {
            position: LAMP,
            intensity: INTENSITY * 2.0,
        },
    );
    let judge = Judge {
        volume: &volume,
        medium: &medium,
        source: &source,
        rays: &rays,
        truth: &truth,
        side: 12,
        blur: Content::Fog.blur(12),
        even: true,
        unit: pipeline.unit(),
        smoothing: Default::default(),
        adaptive: None,
        curved: false,
        mirror: None,
    };
    let judged = judge.check(&pipeline, &rendered).unwrap();
    assert!(judged.rmse < 0.05 && judged.dropped == 0.0, "{judged:?}");
    let says = |judge: Judge, rendered: &Rendered, what: &str| {
        let reason = judge.check(&pipeline, rendered).unwrap_err();
        assert!(reason.contains(what), "{reason}");
    };
    let other = Judge {
        source: &twice,
        ..judge
    };
    says(other, &rendered, "photons carry");
    // Denser fog.
    let thick = Volume::new([12; 3], |_| [1.3, 0.3, 1.0]).unwrap();
    let dense = Medium::new(&thick, medium.structure.clone(), Homogeneity::default());
    let other = Judge {
        medium: &dense,
        ..judge
    };
    says(other, &rendered, "planes in f64 say");
    // A quadrature of twice the light, and an image whose last pixels are those of others.
    let bright: Vec<f64> = truth.iter().map(|value| 2.0 * value).collect();
    let other = Judge {
        truth: &bright,
        ..judge
    };
    says(other, &rendered, "from the quadrature");
    let mut turned = rendered.clone();
    turned.image.reverse();
    says(judge, &turned, "of the view is");
    let mut short = rendered;
    short.tallies.deposits -= short.tallies.deposits / 50;
    says(judge, &short, "the number of deposits");
}

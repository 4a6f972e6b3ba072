//! Photons to an image, against sums and quadratures in f64 and against tracking.

use super::segments::adapter;
use crate::medium::{Homogeneity, Medium};
use crate::phase::{HENYEY_GREENSTEIN, SCHLICK};
use crate::photons::{ImportanceMap, Points, Warp, point_set};
use crate::pipeline::{Photon, Pipeline, Source, camera};
use crate::scatter::{Adding, Strategy};
use crate::tracking::{Estimator, Light, Tracker, single_scattering};
use crate::{Bounds, Phase, Volume, procedures, structure};
use glam::{DVec3, Vec3};
use raystone_core::params::Choice as _;
use raystone_gpu::Gpu;

const SIGMA: f64 = 1.5;

pub(super) fn medium(volume: &Volume, name: &str) -> Medium {
    let registry = structure::registry();
    let structure = registry
        .find(name)
        .unwrap()
        .make(&Default::default())
        .unwrap();
    Medium::new(volume, structure, Homogeneity::default())
}

/// The unit cube, with the same fog in all voxels: σ is 1.5, and 0.8 of it scatters.
pub(super) fn fog(resolution: [u32; 3]) -> Volume {
    let mut fog = Volume::new(resolution, |_| [1.2, 0.3, 1.0]).unwrap();
    fog.phase = Phase {
        kind: HENYEY_GREENSTEIN,
        anisotropy: 0.4,
    };
    fog
}

pub(super) fn points(points: Points, side: u32, seed: u64) -> Vec<([f64; 2], f64)> {
    let set = point_set(points, side, seed).unwrap();
    set.into_iter().map(|point| (point, 1.0)).collect()
}

pub(super) const LAMP: Source = Source::Point {
    position: DVec3::new(0.3, 2.0, 0.4),
    intensity: Vec3::new(2.0, 1.0, 0.5),
};

pub(super) fn beam() -> Source {
    Source::Beam {
        middle: DVec3::new(-0.2, 0.45, 0.55),
        direction: DVec3::new(1.0, 0.11, -0.07).normalize(),
        half: 0.2,
        power: Vec3::new(3.0, 1.0, 0.25),
    }
}

fn view(side: u32) -> Vec<(DVec3, DVec3)> {
    camera(
        DVec3::new(0.6, 0.4, -1.6),
        DVec3::new(0.5, 0.5, 0.5),
        0.35,
        side,
    )
}

/// What photons leave in each voxel of a fog of one extinction, from the planes between voxels alone.
fn exact_deposits(medium: &Medium, photons: &[Photon]) -> Vec<[f64; 6]> {
    let mut sums = vec![[0.0; 6]; medium.field.len()];
    for photon in photons {
        let words = photon.ray.words().map(f64::from);
        let origin = DVec3::new(words[0], words[1], words[2]);
        let along = DVec3::new(words[4], words[5], words[6]);
        let end = words[7];
        let mut cuts = vec![0.0, end];
        for axis in 0..3 {
            let planes = 0..=medium.resolution[axis];
            cuts.extend(planes.map(|k| (f64::from(k) - origin[axis]) / along[axis]));
        }
        cuts.retain(|t| (0.0..=end).contains(t));
        cuts.sort_by(f64::total_cmp);
        for piece in cuts.windows(2) {
            let at = origin + along * ((piece[0] + piece[1]) / 2.0);
            let voxel = at.max(DVec3::ZERO).as_uvec3().min(medium.resolution - 1);
            let way = ((-SIGMA * piece[0]).exp() - (-SIGMA * piece[1]).exp()) / SIGMA;
            let energy = photon.energy.as_dvec3() * way;
            let direction = photon.direction.as_dvec3() * (energy.element_sum() / 3.0);
            let sum = &mut sums[medium.voxel_index(voxel) as usize];
            for k in 0..3 {
                sum[k] += energy[k];
                sum[3 + k] += direction[k];
            }
        }
    }
    sums
}

/// The greatest difference of a voxel's sums from those in f64, as a part of the largest; and that of all energy.
pub(super) fn deposit_error(gpu: &Gpu, name: &str, strategy: Strategy) -> [f64; 2] {
    let volume = fog([17, 12, 20]);
    let medium = medium(&volume, name);
    let adding = Adding::new(strategy, 1 << 16);
    let points = points(Points::Jitter, 16, 4);
    let made = Pipeline::new(gpu, (&volume, &medium), adding, beam(), points);
    let mut pipeline = made.unwrap();
    // A photon through a wrong number of voxels raises an error, or does not end.
    if pipeline.render().is_err() {
        return [f64::INFINITY; 2];
    }
    let exact = exact_deposits(&medium, pipeline.photons());
    let found = pipeline.radiance().unwrap();
    let largest = exact.as_flattened().iter().fold(0.0, |a: f64, b| a.max(*b));
    let mut worst = 0.0_f64;
    for (found, exact) in found.as_flattened().iter().zip(exact.as_flattened()) {
        worst = worst.max((f64::from(*found) - exact).abs() / largest);
    }
    // Σ deposits σ = Φ (1 - exp(-σ L)) of each photon.
    let lost =
        |p: &Photon| f64::from(p.energy.element_sum()) * -(-SIGMA * f64::from(p.ray.to)).exp_m1();
    let expected: f64 = pipeline.photons().iter().map(lost).sum();
    let kept = |sums: &[f32; 6]| sums[..3].iter().map(|v| f64::from(*v)).sum::<f64>();
    let kept = SIGMA * found.iter().map(kept).sum::<f64>();
    [worst, (kept / expected - 1.0).abs()]
}

#[test]
fn photons_leave_in_each_voxel_what_planes_in_f64_say_and_all_energy_that_is_lost_on_their_way() {
    let Some(gpu) = adapter() else { return };
    for kind in structure::registry().iter() {
        let [worst, all] = deposit_error(&gpu, kind.name(), Strategy::Fixed64);
        println!("{}: {worst:.2e}, {all:.2e}", kind.name());
        assert!(worst < 1e-5 && all < 2e-6, "{}: {worst} {all}", kind.name());
    }
    for strategy in Strategy::ALL.iter().copied() {
        let [worst, all] = deposit_error(&gpu, "level-map", strategy);
        println!("{strategy:?}: {worst:.2e}, {all:.2e}");
        // Half a unit is 2^-12 of the largest deposit at most, which a voxel's diagonal allows, 1.9 times what these
        // photons leave on their way along x.
        let slack = if strategy == Strategy::Fixed32 {
            1.9 * 2_f64.powi(-12)
        } else {
            1e-5
        };
        assert!(worst < slack && all < slack, "{strategy:?}: {worst} {all}");
    }
}

/// ∫ σ dt of the fog between two positions.
fn depth_of_fog(volume: &Volume, a: DVec3, b: DVec3) -> f64 {
    let way = b - a;
    let span = volume.clip(a, way.normalize());
    span.map_or(0.0, |[enter, leave]| {
        SIGMA * (way.length().min(leave) - enter).max(0.0)
    })
}

/// Radiance of a point light that is scattered once in fog, along a ray, by a quadrature in f64.
fn exact_light(volume: &Volume, light: &Light) -> f64 {
    let depth = |a, b| depth_of_fog(volume, a, b);
    single_scattering(volume, light, 1024, |_| SIGMA, depth).unwrap_or(0.0)
}

fn light_of(ray: &(DVec3, DVec3)) -> Light {
    Light {
        origin: ray.0,
        direction: ray.1,
        point: DVec3::new(0.3, 2.0, 0.4),
        intensity: 2.0,
        background: 0.0,
    }
}

/// Root of the mean square of the differences from the quadrature, as a part of the mean.
pub(super) fn image_error(gpu: &Gpu, volume: &Volume, name: &str, photons: u32) -> f64 {
    error_of_points(gpu, volume, name, points(Points::Hammersley, photons, 0))
}

fn error_of_points(gpu: &Gpu, volume: &Volume, name: &str, points: Vec<([f64; 2], f64)>) -> f64 {
    let medium = medium(volume, name);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let rays = view(12);
    let made = Pipeline::new(gpu, (volume, &medium), adding, LAMP, points);
    let mut pipeline = made.unwrap();
    pipeline.set_view(&rays);
    let image = pipeline.render().unwrap().image;
    let exact = rays.iter().map(|ray| exact_light(volume, &light_of(ray)));
    let (mut square, mut mean) = (0.0, 0.0);
    for (found, exact) in image.iter().zip(exact) {
        assert!((f64::from(found.x) - 2.0 * f64::from(found.y)).abs() < 1e-4);
        square += (f64::from(found.x) - exact).powi(2);
        mean += exact;
    }
    let count = image.len() as f64;
    (square / count).sqrt() / (mean / count)
}

#[test]
fn images_of_fog_converge_to_a_quadrature_as_the_grid_is_refined() {
    let Some(gpu) = adapter() else { return };
    let mut last = f64::INFINITY;
    for side in [4, 8, 16, 32] {
        let error = image_error(&gpu, &fog([side; 3]), "level-map", 256);
        println!("{side}³ voxels: {error:.5}");
        assert!(error < 0.7 * last, "{side}: {error} after {last}");
        last = error;
    }
    assert!(last < 0.01, "{last}");
    // Boxes of other sizes and another phase function.
    let mut flat = fog([24, 18, 12]);
    flat.high = DVec3::new(1.0, 0.9, 0.6);
    flat.phase = Phase {
        kind: SCHLICK,
        anisotropy: -0.5,
    };
    let error = image_error(&gpu, &flat, "min-max", 256);
    assert!(error < 0.03, "{error}");
}

#[test]
fn photons_by_importance_weigh_less_where_they_are_many() {
    let Some(gpu) = adapter() else { return };
    let value = |cell: usize| if cell % 8 < 4 { 1.0 } else { 3.0 };
    let map = ImportanceMap::new((0..64).map(value).collect()).unwrap();
    let volume = fog([16; 3]);
    let even = points(Points::Hammersley, 192, 0);
    let warp = |(point, _): &([f64; 2], f64)| map.sent(Warp::Hierarchical, *point);
    let warped: Vec<_> = even.iter().map(warp).collect();
    let unweighted = warped.iter().map(|(at, _)| (*at, 1.0)).collect();
    let error = |points| error_of_points(&gpu, &volume, "dda", points);
    let [even, warped, unweighted] = [even, warped, unweighted].map(error);
    println!("{even:.4}, by importance {warped:.4}, without weights {unweighted:.4}");
    assert!(warped < 2.0 * even, "{warped} of {even}");
    assert!(unweighted > 5.0 * warped, "{unweighted} of {warped}");
}

#[test]
fn random_photons_have_a_small_bias_and_a_variance_that_falls_with_their_number() {
    let Some(gpu) = adapter() else { return };
    let volume = procedures::cloud(24).unwrap();
    let medium = medium(&volume, "sparse-tree");
    let rays = view(4);
    let light = |ray| {
        Tracker::new(
            &gpu,
            (&volume, &medium),
            &light_of(ray),
            Estimator::Paths(1),
            (1 << 15, 7),
        )
    };
    let reference: Vec<[f64; 2]> = rays
        .iter()
        .map(|ray| {
            let found = light(ray).unwrap().estimate().unwrap().0;
            [found.mean, found.error]
        })
        .collect();
    let mut variances = Vec::new();
    for side in [64, 128] {
        let runs: Vec<Vec<Vec3>> = (0..12)
            .map(|seed| {
                let points = points(Points::Random, side, 100 + seed);
                let adding = Adding::new(Strategy::Fixed64, 0);
                let made = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, points);
                let mut pipeline = made.unwrap();
                pipeline.set_view(&rays);
                pipeline.render().unwrap().image
            })
            .collect();
        let count = runs.len() as f64;
        let (mut variance, mut bias, mut all) = (0.0, 0.0, 0.0);
        for (pixel, [exact, error]) in reference.iter().enumerate() {
            let values = || runs.iter().map(|run| f64::from(run[pixel].x));
            let mean = values().sum::<f64>() / count;
            let of = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
            variance += of;
            bias += mean - exact;
            all += exact;
            // The grid blurs a cloud by a voxel; chance does the rest.
            let slack = 5.0 * (of / count + error * error).sqrt() + 0.06 * exact;
            assert!(
                (mean - exact).abs() <= slack,
                "{pixel}: {mean}, not {exact}"
            );
        }
        println!(
            "{side}²: bias {:.4}, deviation {:.4}",
            bias / all,
            (variance * reference.len() as f64).sqrt() / all
        );
        // Chance, by the means of whole images, and 3 % for the blur of the grid.
        let means = runs
            .iter()
            .map(|run| run.iter().map(|v| f64::from(v.x)).sum::<f64>());
        let middle = all + bias;
        let chance = means.map(|m| (m - middle).powi(2)).sum::<f64>() / (count - 1.0) / count;
        let slack = 5.0 * chance.sqrt() + 0.03 * all;
        assert!(bias.abs() < slack, "{bias} of {all}, beyond {slack}");
        variances.push(variance);
    }
    // Four times the photons: a quarter of the variance.
    let ratio = variances[0] / variances[1];
    assert!((2.0..8.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_camera_that_moves_costs_the_view_alone() {
    let Some(gpu) = adapter() else { return };
    let volume = fog([8; 3]);
    let medium = medium(&volume, "dda");
    let adding = Adding::new(Strategy::Fixed64, 0);
    let some = points(Points::Grid, 16, 0);
    let made = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, some.clone());
    let mut pipeline = made.unwrap();
    pipeline.set_view(&view(4));
    let all = ["photons", "resolve", "gather"];
    let first = pipeline.render().unwrap();
    assert_eq!(first.passes, all);
    let again = pipeline.render().unwrap();
    assert!(again.passes.is_empty() && again.image == first.image);
    let mut last = first.image;
    let mut changed = |pipeline: &mut Pipeline, passes: &[&str]| {
        let found = pipeline.render().unwrap();
        assert_eq!(found.passes, passes);
        assert_ne!(found.image, last);
        // What was kept gives what a new pipeline gives.
        last = found.image;
    };
    let above = camera(DVec3::new(0.5, 0.9, -2.0), DVec3::splat(0.5), 0.2, 4);
    pipeline.set_view(&above);
    changed(&mut pipeline, &all[2..]);
    pipeline.set_phase(Phase::ISOTROPIC);
    changed(&mut pipeline, &all[2..]);
    pipeline.set_source(beam());
    changed(&mut pipeline, &all);
    pipeline.set_points(points(Points::Random, 16, 1));
    changed(&mut pipeline, &all);
    let thin = Volume::new([8; 3], |_| [0.2, 0.1, 1.0]).unwrap();
    let over = self::medium(&thin, "dda");
    pipeline.set_medium(&thin, &over).unwrap();
    pipeline.set_view(&above);
    changed(&mut pipeline, &all);
    let made = Pipeline::new(
        &gpu,
        (&thin, &over),
        adding,
        beam(),
        points(Points::Random, 16, 1),
    );
    let mut fresh = made.unwrap();
    fresh.set_view(&above);
    assert_eq!(fresh.render().unwrap().image, last);
}

#[test]
fn lights_and_media_that_give_no_photons_are_refused() {
    let Some(gpu) = adapter() else { return };
    let volume = fog([8; 3]);
    let medium = medium(&volume, "dda");
    let refused = |volume: &Volume, source: Source, adding: Adding| {
        let some = points(Points::Grid, 16, 0);
        Pipeline::new(&gpu, (volume, &medium), adding, source, some)
            .and_then(|mut pipeline| pipeline.render())
            .unwrap_err()
            .to_string()
    };
    let sound = Adding::new(Strategy::Fixed64, 0);
    let lamp = |position| Source::Point {
        position,
        intensity: Vec3::ONE,
    };
    let inside = refused(&volume, lamp(DVec3::splat(0.4)), sound);
    assert!(inside.contains("lies in the box"), "{inside}");
    let near = refused(&volume, lamp(DVec3::new(1.001, 0.1, 0.1)), sound);
    assert!(near.contains("too near"), "{near}");
    let away = Source::Beam {
        middle: DVec3::splat(3.0),
        direction: DVec3::X,
        half: 0.1,
        power: Vec3::ONE,
    };
    assert!(refused(&volume, away, sound).contains("no photon of 256"));
    let crooked = Source::Beam {
        middle: DVec3::ZERO,
        direction: DVec3::ONE,
        half: 0.1,
        power: Vec3::ONE,
    };
    assert!(refused(&volume, crooked, sound).contains("length 1"));
    let mut ball = volume.clone();
    ball.bounds = Bounds::Sphere;
    assert!(refused(&ball, LAMP, sound).contains("fills its box"));
    let short = refused(&volume, LAMP, Adding::new(Strategy::Sort, 100));
    assert!(short.contains("a list of 100 deposits"), "{short}");
    let bits = Adding {
        bits: 24,
        ..Adding::new(Strategy::Fixed32, 0)
    };
    let many = Pipeline::new(
        &gpu,
        (&volume, &medium),
        bits,
        LAMP,
        points(Points::Grid, 512, 0),
    );
    let many = many.unwrap().render().unwrap_err().to_string();
    assert!(many.contains("went round"), "{many}");
}

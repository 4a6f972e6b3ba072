//! Paths through several media at once: the oracle path by path, closed forms and quadratures of the sum of their coefficients,
//! scenes whose light is the same by one medium, a furnace, and who scatters by count.

use crate::kinds::KindChecks;
use crate::media_tests::{
    EYE, clouds, coefficients, depth, empty, floor, fog, gate, gpu, image, optical_depth, path,
    placed, rays, with_renderer, word,
};
use crate::trial_media::several_media;
use glam::{DVec3, Vec3, vec3};
use raystone_gpu::{Gpu, GpuError};
use raystone_render::ConfiguredIntegrator;
use raystone_scene::{Light, SceneData, SceneMedium};
use raystone_volume::{Bounds, Phase, Volume, phase};
use std::f64::consts::PI;

const SIZE: [u32; 2] = [24, 20];

fn plain(most: i64) -> ConfiguredIntegrator {
    path(&[
        depth(most),
        word("primary", "centre"),
        word("roulette", "none"),
    ])
}

/// A scene that holds these media instead of its own.
fn holding(mut scene: SceneData, volumes: &[Volume]) -> SceneData {
    let media = volumes.iter().map(|v| SceneMedium::new(v.clone(), "dda"));
    scene.media = media.map(Result::unwrap).collect();
    scene
}

/// Nothing but these media under a sky of 1.
fn under_sky(volumes: &[Volume]) -> SceneData {
    holding(empty(volumes[0].clone(), "dda"), volumes)
}

/// The volume in another box, or in the ball of it.
fn at(volume: Volume, low: [f64; 3], high: [f64; 3], bounds: Bounds) -> Volume {
    let [low, high] = [low, high].map(DVec3::from_array);
    let placed = Volume {
        low,
        high,
        bounds,
        ..volume
    };
    placed.checked().unwrap()
}

/// Two boxes that overlap, a third beside them, and a ball in the first.
fn absorbers() -> Vec<Volume> {
    let cloud = clouds(0.0, 3.0);
    vec![
        placed(fog(0.0, 0.3), None),
        at(
            fog(0.0, 0.5),
            [-0.2, -0.5, -0.5],
            [1.3, 0.9, 1.1],
            Bounds::Box,
        ),
        at(cloud, [-1.3, -0.2, 0.8], [-0.4, 0.5, 1.5], Bounds::Box),
        at(
            fog(0.0, 0.9),
            [-0.6, -0.5, -0.7],
            [0.2, 0.3, 0.1],
            Bounds::Sphere,
        ),
    ]
}

fn depth_of_all(volumes: &[Volume], from: DVec3, to: DVec3) -> f64 {
    volumes.iter().map(|v| optical_depth(v, from, to)).sum()
}

/// Means over an image of several runs, each of which has seeds of its own.
fn means(
    gpu: &Gpu,
    scene: &SceneData,
    integrator: &ConfiguredIntegrator,
    (runs, samples): (u32, u32),
) -> Result<Vec<DVec3>, GpuError> {
    with_renderer(gpu, scene, SIZE, integrator, |renderer, _| {
        let run = |seed: u32| {
            let shots = renderer.render(&[samples], 977 * seed + 5)?;
            let pixels = &shots[0].image.pixels;
            let all = pixels.iter().map(|p| DVec3::from_array(p.map(f64::from)));
            Ok(all.sum::<DVec3>() / pixels.len() as f64)
        };
        (0..runs).map(run).collect()
    })
}

/// Mean and its standard error, of each channel.
fn with_error(means: &[DVec3]) -> [DVec3; 2] {
    let runs = means.len() as f64;
    let mean = means.iter().sum::<DVec3>() / runs;
    let spread: DVec3 = means.iter().map(|m| (*m - mean) * (*m - mean)).sum();
    [mean, (spread / (runs * (runs - 1.0))).map(f64::sqrt)]
}

/// By how many standard errors two scenes differ, in the channel that differs most.
fn apart(gpu: &Gpu, scenes: [&SceneData; 2], integrator: &ConfiguredIntegrator) -> f64 {
    let [one, other] = scenes.map(|scene| {
        let found = means(gpu, scene, integrator, (16, 64)).unwrap();
        with_error(&found)
    });
    let error = (one[1] * one[1] + other[1] * other[1]).map(f64::sqrt);
    println!("{} ± {} and {} ± {}", one[0], one[1], other[0], other[1]);
    ((one[0] - other[0]) / error).abs().max_element()
}

#[test]
fn single_paths_through_several_media_are_those_of_the_oracle() {
    let gpu = gpu();
    let trials = several_media(&KindChecks::default()).unwrap();
    assert!(trials.iter().all(|trial| trial.scene.media.len() > 1));
    for trial in trials {
        for (name, changes) in &trial.trials {
            assert_eq!(*name, "path");
            let fault = gate(&gpu, &trial.scene, &path(changes));
            assert_eq!(fault, None, "{} {changes:?}", trial.scene.name);
        }
    }
}

#[test]
fn media_that_absorb_nothing_are_a_furnace_where_they_overlap() {
    let gpu = gpu();
    let ball = |volume| at(volume, [-0.8, -0.4, -1.2], [0.9, 0.9, 0.4], Bounds::Sphere);
    let furnace = |volumes: &[Volume]| {
        let integrator = path(&[depth(20), word("roulette", "none")]);
        let found = image(&gpu, &under_sky(volumes), SIZE, &integrator, 64).unwrap();
        let off = found.iter().map(|p| (*p - DVec3::ONE).abs().max_element());
        off.fold(0.0, f64::max)
    };
    let clear = [placed(fog(0.35, 0.0), Some(0.7)), ball(clouds(0.9, 0.0))];
    assert_eq!(furnace(&clear), 0.0);
    let mut absorbs = clear;
    absorbs[1] = ball(clouds(0.9, 0.1));
    assert!(furnace(&absorbs) > 0.01);
}

#[test]
fn absorbers_let_pass_the_product_of_what_each_does() {
    const SAMPLES: u32 = 256;
    let gpu = gpu();
    let volumes = absorbers();
    let scene = under_sky(&volumes);
    let found = image(&gpu, &scene, SIZE, &plain(2), SAMPLES).unwrap();
    let eye = EYE.as_dvec3();
    let (mut excess, mut variance) = (0.0, 0.0);
    for (pixel, direction) in found.iter().zip(rays(&scene, SIZE)) {
        let passes = (-depth_of_all(&volumes, eye, eye + direction * 50.0)).exp();
        let of_pixel = passes * (1.0 - passes) / f64::from(SAMPLES);
        let off = (pixel.x - passes).abs();
        // 480 pixels: one in 10⁵ such images has a pixel beyond 5.7.
        assert!(off < 5.7 * of_pixel.sqrt() + 1e-4, "{pixel} for {passes}");
        excess += pixel.x - passes;
        variance += of_pixel;
    }
    let off = excess / f64::sqrt(variance);
    println!("{off:.2} standard errors");
    assert!(off.abs() < 4.5, "{off} standard errors");
}

#[test]
fn shadow_rays_lose_the_product_of_what_each_medium_takes() {
    let gpu = gpu();
    let mut volumes = absorbers();
    let light = DVec3::new(0.1, 3.0, 0.2);
    let worst = |volumes: &[Volume], samples: u32| {
        let mut scene = holding(floor(volumes[0].clone(), "dda"), volumes);
        scene.lights = vec![Light::Point {
            position: light.as_vec3(),
            intensity: Vec3::splat(7.0),
        }];
        let found = image(&gpu, &scene, [16, 16], &plain(1), samples).unwrap();
        let eye = scene.view(1.0).eye.as_dvec3();
        let differs = found
            .iter()
            .zip(rays(&scene, [16, 16]))
            .map(|(pixel, ray)| {
                let point = eye - ray * ((eye.y + 1.5) / ray.y);
                let way = light - point;
                let lit = 0.5 / PI * 7.0 * way.normalize().y / way.length_squared();
                pixel.x / (lit * (-depth_of_all(volumes, point, light)).exp()) - 1.0
            });
        let differs: Vec<f64> = differs.collect();
        let mean = differs.iter().sum::<f64>() / differs.len() as f64;
        let worst = differs.iter().map(|d| d.abs()).fold(0.0, f64::max);
        [worst, mean.abs()]
    };
    // What is scattered is lost, too; and the cloud is to be in the way.
    volumes[1] = at(
        fog(0.2, 0.5),
        [-0.2, -0.5, -0.5],
        [1.0, 0.9, 0.9],
        Bounds::Box,
    );
    volumes[2] = at(
        clouds(1.0, 1.0),
        [-0.8, -0.4, -0.9],
        [0.7, 0.6, 0.5],
        Bounds::Box,
    );
    let [cloudy, _] = worst(&volumes, 1);
    let [_, mean] = worst(&volumes, 256);
    volumes.remove(2);
    let [even, _] = worst(&volumes, 1);
    println!("{even:.2e}; with a cloud {cloudy:.2e} of one sample, {mean:.2e} of all");
    assert!(even < 2e-5, "{even}");
    assert!(mean < 2e-3 && cloudy > 1e-3, "{mean} {cloudy}");
}

/// A lamp beside what an empty scene holds.
fn lit(mut scene: SceneData) -> SceneData {
    scene.environment = vec3(0.2, 0.3, 0.5);
    scene.lights = vec![Light::Point {
        position: vec3(1.3, 1.5, 1.0),
        intensity: Vec3::splat(5.0),
    }];
    scene
}

#[test]
fn two_media_of_half_a_density_are_one_of_all() {
    let gpu = gpu();
    let integrator = plain(6);
    for (half, whole) in [
        (fog(0.5, 0.1), fog(1.0, 0.2)),
        (clouds(2.0, 0.5), clouds(4.0, 1.0)),
    ] {
        let [half, whole] = [half, whole].map(|volume| placed(volume, Some(0.5)));
        let two = lit(under_sky(&[half.clone(), half.clone()]));
        let one = lit(under_sky(&[whole]));
        let off = apart(&gpu, [&two, &one], &integrator);
        assert!(off < 4.5, "{off} standard errors");
        let alone = lit(under_sky(&[half]));
        assert!(apart(&gpu, [&alone, &one], &integrator) > 30.0);
    }
}

/// Voxels of noise within a border of none, from a place of a grid on.
fn patch(resolution: [u32; 3], from: u32, width: u32) -> Volume {
    Volume::new(resolution, |p| {
        let voxel = (p * DVec3::from_array(resolution.map(f64::from))).floor();
        let local = DVec3::new(voxel.x - f64::from(from), voxel.y, voxel.z);
        let most = DVec3::new(
            f64::from(width),
            f64::from(resolution[1]),
            f64::from(resolution[2]),
        );
        let is_inner = local.cmpgt(DVec3::ZERO).all() && local.cmplt(most - 1.0).all();
        let some = (local.dot(DVec3::new(3.0, 5.0, 7.0)) % 4.0 + 1.0) as f32;
        let density = if is_inner { some } else { 0.0 };
        [density, 0.25 * density, 1.0]
    })
    .unwrap()
}

#[test]
fn two_fogs_side_by_side_are_one_grid_that_holds_both() {
    let gpu = gpu();
    let place = |volume, from, to| at(volume, [from, -0.6, -0.7], [to, 0.8, 0.6], Bounds::Box);
    let grid = patch([8, 8, 8], 0, 8);
    let fogs = [place(grid.clone(), -1.0, 0.0), place(grid, 0.0, 1.0)];
    let [first, second] = [0, 8].map(|from| patch([16, 8, 8], from, 8));
    let sum = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a + b).collect();
    let both = Volume {
        scattering: sum(&first.scattering, &second.scattering),
        absorption: sum(&first.absorption, &second.absorption),
        ..first
    };
    let both = place(both, -1.0, 1.0);
    for position in [DVec3::new(-0.33, 0.1, 0.2), DVec3::new(0.71, -0.3, 0.1)] {
        let own = &fogs[usize::from(position.x > 0.0)];
        let [a, b] = [own, &both].map(|v| coefficients(v, position));
        assert!((a[1] - b[1]).abs() < 1e-6 && a[1] > 0.0, "{a:?} {b:?}");
    }
    let [two, one] = [under_sky(&fogs), under_sky(&[both])].map(lit);
    let off = apart(&gpu, [&two, &one], &plain(6));
    assert!(off < 4.5, "{off} standard errors");
}

fn with_phase(volume: Volume, anisotropy: f32) -> Volume {
    Volume {
        phase: Phase {
            kind: phase::HENYEY_GREENSTEIN,
            anisotropy,
        },
        ..volume
    }
}

/// Light that two media scatter once, mean over an image, by a quadrature.
fn scattered_once(volumes: &[Volume; 2], all: &[DVec3], light: DVec3) -> f64 {
    const STEPS: i32 = 300;
    let eye = EYE.as_dvec3();
    let (near, far) = (2.0, 6.0);
    let width = (far - near) / f64::from(STEPS);
    let mut sum = 0.0;
    for direction in all {
        for k in 0..STEPS {
            let x = eye + *direction * (near + (f64::from(k) + 0.5) * width);
            let way = light - x;
            let cosine = direction.dot(way.normalize());
            let scattered = |volume: &Volume| {
                let is_inside = x.cmpge(volume.low).all() && x.cmple(volume.high).all();
                let g = f64::from(volume.phase.anisotropy);
                let phase = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5);
                f64::from(u8::from(is_inside)) * coefficients(volume, x)[0] * phase / (4.0 * PI)
            };
            let there: f64 = volumes.iter().map(scattered).sum();
            if there > 0.0 {
                let passed = depth_of_all(volumes, eye, x) + depth_of_all(volumes, x, light);
                sum += 5.0 * there * (-passed).exp() * width / way.length_squared();
            }
        }
    }
    sum / all.len() as f64
}

#[test]
fn light_scattered_once_by_either_medium_is_that_of_a_quadrature() {
    let gpu = gpu();
    let second = at(
        fog(0.3, 0.6),
        [-0.5, -0.9, -0.6],
        [1.2, 0.5, 0.9],
        Bounds::Box,
    );
    let volumes = [placed(fog(0.8, 0.1), Some(0.6)), with_phase(second, -0.5)];
    let light = DVec3::new(1.6, 1.5, 1.4);
    let mut scene = under_sky(&volumes);
    scene.environment = Vec3::ZERO;
    scene.lights = vec![Light::Point {
        position: light.as_vec3(),
        intensity: Vec3::splat(5.0),
    }];
    let expected = scattered_once(&volumes, &rays(&scene, SIZE), light);
    let [mean, error] = with_error(&means(&gpu, &scene, &plain(1), (16, 64)).unwrap());
    println!("{} ± {}, quadrature {expected}", mean.x, error.x);
    assert!(
        (mean.x - expected).abs() < 4.5 * error.x,
        "{mean} {expected}"
    );
    assert!(error.x < 0.02 * expected);
}

/// How often the first and the second medium scatter what comes from the front, of so many samples of each pixel: light from
/// there has an exact transmittance of more than a quarter, and the second medium's albedo is a quarter of the first's.
fn shares(gpu: &Gpu, sigma: [f32; 2]) -> [u32; 2] {
    const SAMPLES: u32 = 96;
    let volumes = [fog(sigma[0], 0.0), fog(0.25 * sigma[1], 0.75 * sigma[1])];
    let volumes = volumes.map(|v| at(v, [-3.0, -3.0, -0.5], [3.0, 3.0, 0.5], Bounds::Box));
    let mut scene = under_sky(&volumes);
    scene.environment = Vec3::ZERO;
    let towards = (-EYE).normalize();
    scene.lights = vec![Light::Directional {
        direction: towards,
        irradiance: Vec3::splat((4.0 * PI) as f32),
    }];
    let mut counts = [0, 0];
    with_renderer(gpu, &scene, SIZE, &plain(1), |renderer, _| {
        for seed in 0..SAMPLES {
            let shots = renderer.render(&[1], 31 * seed + 1)?;
            for pixel in &shots[0].image.pixels {
                match pixel[0] {
                    x if x > 0.3 => counts[0] += 1,
                    x if x > 0.0 => counts[1] += 1,
                    _ => {}
                }
            }
        }
        Ok(())
    })
    .unwrap();
    counts
}

#[test]
fn media_scatter_in_proportion_to_their_extinctions() {
    let gpu = gpu();
    for sigma in [[0.5, 0.3], [0.2, 0.6]] {
        let [first, second] = shares(&gpu, sigma);
        let all = f64::from(first + second);
        let part = f64::from(sigma[0] / (sigma[0] + sigma[1]));
        let off = (f64::from(first) - part * all) / (all * part * (1.0 - part)).sqrt();
        println!("{first} and {second}: {off:.2} standard errors");
        assert!(off.abs() < 4.5 && all > 15_000.0, "{first} {second}");
    }
}

/// In colours each channel against the sum of both media as it has them.
#[test]
fn coloured_media_scatter_and_absorb_each_channel_as_their_sum_does() {
    let gpu = gpu();
    let tints = [
        [vec3(1.0, 0.6, 0.2), vec3(0.3, 0.5, 1.0)],
        [vec3(0.2, 1.0, 0.7), vec3(1.0, 0.1, 0.4)],
    ];
    let boxes = |volume: [Volume; 2]| volume.map(|volume| placed(volume, Some(0.4)));
    for volumes in [
        boxes([fog(0.7, 0.2), fog(0.4, 0.5)]),
        boxes([clouds(3.0, 1.0), clouds(1.0, 2.0)]),
    ] {
        let mut two = lit(under_sky(&volumes));
        let pairs = volumes.iter().zip(tints);
        let tinted = pairs.map(|(v, tints)| SceneMedium::tinted(v.clone(), tints, "dda").unwrap());
        two.media = tinted.collect();
        let [found, error] = with_error(&means(&gpu, &two, &plain(4), (16, 64)).unwrap());
        for channel in 0..3 {
            let sum = |of: fn(&Volume) -> &Vec<f32>, kind: usize| -> Vec<f32> {
                let parts = [0, 1].map(|k| {
                    let tint = tints[k][kind][channel];
                    of(&volumes[k]).iter().map(move |x| tint * x)
                });
                let [a, b] = parts;
                a.zip(b).map(|(a, b)| a + b).collect()
            };
            let summed = Volume {
                scattering: sum(|v| &v.scattering, 0),
                absorption: sum(|v| &v.absorption, 1),
                ..volumes[0].clone()
            };
            let one = lit(under_sky(&[summed]));
            let [expected, other] = with_error(&means(&gpu, &one, &plain(4), (16, 64)).unwrap());
            let (mean, expected) = (found[channel], expected[channel]);
            let error = error[channel].hypot(other[channel]);
            println!("{channel}: {mean} for {expected}, ± {error}");
            assert!((mean - expected).abs() < 4.5 * error, "{channel}");
            assert!(error < 0.02 * expected);
        }
    }
}

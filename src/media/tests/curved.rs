//! Light that is refracted on its way to the grid, against closed forms: foci of a lens of Luneburg and of a ball, Snell's law and total
//! internal reflection at a slab, and all energy.

use super::pipeline::{fog, points};
use super::segments::adapter;
use crate::march::ball_deviation;
use crate::medium::{Homogeneity, Key, Medium};
use crate::photons::Points;
use crate::pipeline::ways::{Steps, Ways};
use crate::pipeline::{Generality, Mirror, Pipeline, PipelineError, Source, camera};
use crate::scatter::{Adding, Strategy};
use crate::{Volume, procedures, structure};
use glam::{DVec3, Vec3};
use raystone_gpu::{Composition, Gpu, KernelLibrary};

fn medium_of(volume: &Volume) -> Medium {
    let registry = structure::registry();
    let kind = registry.find("level-map").unwrap();
    let homogeneity = Homogeneity {
        key: Key::Refraction,
        epsilon: 0.0,
    };
    Medium::new(volume, kind.make(&Default::default()).unwrap(), homogeneity)
}

/// A ball of glass in a medium of one extinction.
fn ball(side: u32, centre: DVec3, radius: f64, sigma: f32) -> Volume {
    ball_within(1.0, side, centre, radius, sigma)
}

/// The same in a medium of this index.
fn ball_within(outside: f32, side: u32, centre: DVec3, radius: f64, sigma: f32) -> Volume {
    let inside = |p: DVec3| (p - centre).length() < radius;
    let part = |p| procedures::coverage_of(side, p, inside);
    let of = |n| [0.8 * sigma, 0.2 * sigma, n];
    procedures::covered(side, part, of(outside), |_| of(1.5)).unwrap()
}

fn beam(middle: DVec3, direction: DVec3, half: f64) -> Source {
    Source::Beam {
        middle,
        direction,
        half,
        power: Vec3::ONE,
    }
}

/// What a grid of photons leaves, with the power that meets the box.
fn left(gpu: &Gpu, volume: &Volume, source: Source, side: u32) -> (Medium, Vec<[f32; 6]>, f64) {
    let medium = medium_of(volume);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let points = points(Points::Grid, side, 0);
    let mut pipeline = Pipeline::new(gpu, (volume, &medium), adding, source, points).unwrap();
    pipeline.set_view(&camera(
        DVec3::new(0.6, 0.4, -1.6),
        DVec3::splat(0.5),
        0.35,
        4,
    ));
    pipeline.render().unwrap();
    let power = pipeline
        .photons()
        .iter()
        .map(|p| f64::from(p.energy.x))
        .sum();
    let radiance = pipeline.radiance().unwrap();
    (medium, radiance, power)
}

#[test]
fn kernels_of_straight_media_know_nothing_of_what_bends_light() {
    let library = KernelLibrary::default();
    let straight = |name: &str| {
        Composition::new(&format!("media/{name}"))
            .with("structure", "volume/structure/level_map")
            .with("scatter", "media/scatter/swap")
            .feature("general", false)
    };
    for name in ["photons", "gather"] {
        let composed = library.compose(&straight(name)).unwrap();
        let bends = |module: &&String| {
            ["optics", "bend", "curved"]
                .iter()
                .any(|word| module.contains(word))
        };
        assert_eq!(composed.modules.iter().find(bends), None, "{name}");
        assert!(!composed.wgsl.contains("optic") && !composed.wgsl.contains("gradient"));
        // Where light is bent, there is all of that.
        let curved = straight(&format!("curved/{name}")).feature("regions", true);
        assert!(library.compose(&curved).unwrap().wgsl.contains("gradient"));
    }
}

#[test]
fn a_ball_of_glass_turns_ways_as_snells_law_does() {
    let (centre, radius) = (DVec3::splat(0.5), 0.3);
    let volume = ball(96, centre, radius, 1.0);
    let medium = medium_of(&volume);
    let way = |steps, height: f64| {
        let ways = Ways::of(&volume, &medium, steps).unwrap();
        let origin = DVec3::new(0.0, 48.0 + height * radius * 96.0, 48.0);
        let chords = ways.way(origin, DVec3::X);
        chords[chords.len() - 1].direction
    };
    for steps in [Steps::Regions, Steps::Short(0.125)] {
        let mut square = 0.0;
        for k in 0..8 {
            let height = 0.1 + 0.1 * f64::from(k);
            let direction = way(steps, height);
            let off =
                direction.y.atan2(direction.x).to_degrees() - ball_deviation(1.5, 1.0, height);
            assert!(direction.z.abs() < 1e-9);
            square += off * off / 8.0;
        }
        println!("{steps:?}: {:.3}° RMS", square.sqrt());
        // What the blurred border leaves.
        assert!(square.sqrt() < 1.0, "{steps:?}: {}°", square.sqrt());
    }
}

#[test]
fn a_ball_reflects_the_sky_as_a_mirror_of_its_form() {
    let Some(gpu) = adapter() else { return };
    // The direction of a mirrored ray does not depend on what surrounds the ball.
    for outside in [1.0, 1.25] {
        reflects_the_sky(&gpu, outside);
    }
}

fn reflects_the_sky(gpu: &Gpu, outside: f32) {
    let (centre, radius) = (DVec3::splat(0.5), 0.3);
    let volume = ball_within(outside, 64, centre, radius, 1e-3);
    let medium = medium_of(&volume);
    let source = beam(DVec3::new(0.5, 2.0, 0.5), DVec3::NEG_Y, 0.2);
    let list = points(Points::Grid, 16, 0);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let mut pipeline = Pipeline::new(gpu, (&volume, &medium), adding, source, list).unwrap();
    let heights: Vec<f64> = (1..=12).map(|k| 0.1 * f64::from(k)).collect();
    let ray = |height: &f64| (DVec3::new(0.5, 0.5 + radius * height, -1.0), DVec3::Z);
    pipeline.set_view(&heights.iter().map(ray).collect::<Vec<_>>());
    let bare = pipeline.render().unwrap().image;
    // Looked for where there is none.
    let generality = Generality {
        mirror: true,
        ..Generality::default()
    };
    pipeline.set_generality(generality).unwrap();
    assert_eq!(pipeline.render().unwrap().image, bare);
    for part in [1.0, 0.25] {
        let zenith = Vec3::new(1.0, 2.0, 0.5);
        pipeline.set_mirror(Some(Mirror {
            index: 0.5 * (outside + 1.5),
            part,
            zenith,
        }));
        let image = pipeline.render().unwrap().image;
        for ((height, seen), bare) in heights.iter().zip(image).zip(&bare) {
            if *height > 1.15 {
                assert_eq!(seen, *bare, "beside the border");
            }
            if *height > 0.95 {
                continue;
            }
            // A normal of (0, h, −√(1 − h²)) turns the ray to a height of 2 h √(1 − h²).
            let exact = 2.0 * height * (1.0 - height * height).sqrt();
            let found = f64::from(seen.y / (2.0 * part));
            println!("height {height:.1}, part {part}: {found:.4} for {exact:.4}");
            assert!((found - exact).abs() < 0.05, "{found} for {exact}");
            assert!((seen.y / seen.x - 2.0).abs() < 0.05 && seen.z < seen.x);
        }
    }
}

#[test]
fn the_caustic_of_a_ball_peaks_where_its_focus_is() {
    let Some(gpu) = adapter() else { return };
    let (side, radius, n) = (64, 0.2, 1.5_f64);
    let centre = DVec3::new(0.5, 0.5, 0.35);
    let volume = ball(side, centre, radius, 0.01);
    let half = 0.05;
    let source = beam(DVec3::new(0.5, 0.5, -0.1), DVec3::Z, half);
    let (medium, radiance, _) = left(&gpu, &volume, source, 128);
    // The four columns around the axis.
    let on_axis = |z: u32| {
        let of =
            |x: u32, y: u32| radiance[medium.voxel_index(glam::UVec3::new(x, y, z)) as usize][0];
        let middle = side / 2;
        f64::from(
            of(middle, middle)
                + of(middle - 1, middle)
                + of(middle, middle - 1)
                + of(middle - 1, middle - 1),
        )
    };
    let peak = (0..side)
        .max_by(|a, b| on_axis(*a).total_cmp(&on_axis(*b)))
        .unwrap();
    let found = (f64::from(peak) + 0.5) / f64::from(side) - centre.z;
    // Paraxial rays meet at n R / (2 (n - 1)) from the middle, those at the border of the beam at b / sin δ.
    let paraxial = n * radius / (2.0 * (n - 1.0));
    let border = half * 2.0_f64.sqrt();
    let marginal = border / -ball_deviation(n, radius, border).to_radians().sin();
    println!(
        "peak {found:.4}, paraxial {paraxial:.4}, marginal {marginal:.4}, {:.1} times",
        on_axis(peak) / on_axis(2)
    );
    let voxel = 1.0 / f64::from(side);
    assert!(
        found > marginal - 2.0 * voxel && found < paraxial + 2.0 * voxel,
        "{found}"
    );
    assert!(on_axis(peak) > 8.0 * on_axis(2));
}

#[test]
fn a_lens_of_luneburg_gathers_a_beam_at_its_far_side() {
    let Some(gpu) = adapter() else { return };
    let (side, radius) = (64, 0.3);
    let volume = Volume::new([side; 3], |p| {
        let square = (p - 0.5).length_squared() / (radius * radius);
        [0.01, 0.0, (2.0 - square.min(1.0)).sqrt() as f32]
    });
    let volume = volume.unwrap();
    let source = beam(DVec3::new(-0.2, 0.5, 0.5), DVec3::X, 0.15);
    let (_, radiance, _) = left(&gpu, &volume, source, 128);
    let most = (0..radiance.len()).max_by(|a, b| radiance[*a][0].total_cmp(&radiance[*b][0]));
    let voxel = crate::volume::voxel_at(volume.resolution, most.unwrap());
    let at = (DVec3::from(voxel.map(f64::from)) + 0.5) / f64::from(side);
    let off = (at - DVec3::new(0.5 + radius, 0.5, 0.5)) * f64::from(side);
    println!("brightest at {at:.4}, {off:.2} voxels from the focus");
    assert!(off.abs().max_element() <= 1.5, "{off}");
}

#[test]
fn a_smooth_slab_refracts_by_snells_law_and_reflects_all_beyond_the_critical_angle() {
    let Some(gpu) = adapter() else { return };
    // Cubes of 1 / 32; the index falls from 1.5 to 1 over eight of them around z = 0.75.
    let mut volume = Volume::new([128, 8, 48], |p| {
        let part = ((p.z * 48.0 - 20.0) / 8.0).clamp(0.0, 1.0);
        let smooth = part * part * (3.0 - 2.0 * part);
        [0.001, 0.0, (1.5 - 0.5 * smooth) as f32]
    });
    if let Ok(volume) = &mut volume {
        volume.high = DVec3::new(4.0, 0.25, 1.5);
    }
    let volume = volume.unwrap();
    let mut reflected = 0;
    for angle in 34..=50 {
        let theta = f64::from(angle).to_radians();
        let direction = DVec3::new(theta.sin(), 0.0, theta.cos());
        let middle = DVec3::new(0.2, 0.125, 0.0) - 0.2 * direction;
        let (medium, radiance, power) = left(&gpu, &volume, beam(middle, direction, 0.05), 16);
        let layer = |z: u32| {
            let mut sums = [0.0; 2];
            for y in 0..8 {
                for x in 0..128 {
                    let one = radiance[medium.voxel_index(glam::UVec3::new(x, y, z)) as usize];
                    // Each of three colours has the same energy; directions are times their mean.
                    sums = [sums[0] + f64::from(one[0]), sums[1] + f64::from(one[3])];
                }
            }
            sums
        };
        let (above, below) = (layer(29), layer(6));
        let height = 1.0 / 32.0;
        let sine = 1.5 * theta.sin();
        if sine < 1.0 {
            let cosine = (1.0 - sine * sine).sqrt();
            let passed = above[0] * cosine / (power * height);
            let turned = above[1] / above[0];
            println!("{angle}°: {passed:.4} passed, sine {turned:.5} for {sine:.5}");
            // Next to the critical angle a small error of the sine is a large one of the cosine.
            let slack = if angle < 41 { 0.01 } else { 0.03 };
            assert!((passed - 1.0).abs() < slack, "{angle}°: {passed}");
            assert!(
                (turned - sine).abs() < 1e-3,
                "{angle}°: {turned}, not {sine}"
            );
        } else {
            reflected += 1;
            assert_eq!(above[0], 0.0, "{angle}°");
            // There and back.
            let twice = below[0] * theta.cos() / (power * height);
            println!("{angle}°: {twice:.4} below");
            assert!((twice - 2.0).abs() < 0.02, "{angle}°: {twice}");
        }
    }
    // 41.8°.
    assert_eq!(reflected, 9);
}

#[test]
fn a_thick_medium_keeps_all_energy_whatever_bends_its_ways() {
    let Some(gpu) = adapter() else { return };
    for n in ["ball", "noise"] {
        let mut volume = ball(24, DVec3::splat(0.5), 0.25, 32.0);
        if n == "noise" {
            let noise = procedures::cube_noise();
            let refraction = |k: usize| {
                let voxel = crate::volume::voxel_at(volume.resolution, k);
                1.5 + 0.3 * noise(DVec3::from(voxel.map(f64::from)) / 24.0)
            };
            volume.refraction = (0..24 * 24 * 24).map(refraction).collect();
        }
        let source = beam(DVec3::new(0.5, 0.5, -0.1), DVec3::Z, 0.3);
        let (_, radiance, power) = left(&gpu, &volume, source, 48);
        let kept: f64 = radiance.iter().map(|sums| f64::from(sums[0])).sum();
        println!("{n}: {:.3e}", 32.0 * kept / power - 1.0);
        // exp(-32) leaves.
        assert!((32.0 * kept / power - 1.0).abs() < 2e-6, "{n}");
    }
}

#[test]
fn a_refractive_medium_of_voxels_that_are_no_cubes_is_refused() {
    let Some(gpu) = adapter() else { return };
    let mut volume = ball(8, DVec3::splat(0.5), 0.3, 1.0);
    volume.high.z = 2.0;
    let medium = medium_of(&volume);
    let adding = Adding::new(Strategy::Fixed64, 0);
    let some = points(Points::Grid, 4, 0);
    let made = Pipeline::new(
        &gpu,
        (&volume, &medium),
        adding,
        super::pipeline::LAMP,
        some.clone(),
    );
    let Err(PipelineError::Voxels(size)) = made.map(|_| ()) else {
        panic!("not refused")
    };
    assert_eq!(size.z, 0.25);
    // The same index everywhere bends nothing.
    let mut even = fog([8, 8, 4]);
    even.refraction.fill(1.4);
    let over = medium_of(&even);
    assert!(Pipeline::new(&gpu, (&even, &over), adding, super::pipeline::LAMP, some).is_ok());
}

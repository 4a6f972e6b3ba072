//! What a medium does not ask for changes no image, and is left out: counted in steps, sums and bytes.

use super::pipeline::{LAMP, fog, medium, points};
use super::segments::adapter;
use crate::phase::Phase;
use crate::photons::Points;
use crate::pipeline::{Generality, Pipeline, camera};
use crate::scatter::{Adding, Strategy};
use crate::voxels::{Counted, Mesh, border_of, covered};
use crate::{Homogeneity, Medium, Volume, procedures, structure};
use glam::{DVec3, UVec3, Vec3};
use raystone_core::params::{ParamValue, Params};
use raystone_gpu::Gpu;

const SIDE: u32 = 24;

fn cloud(phase: Phase) -> Volume {
    Volume {
        phase,
        ..procedures::cloud(SIDE).unwrap()
    }
}

/// Image, steps of the view, bytes that photons write to, and deposits.
fn rendered(gpu: &Gpu, volume: &Volume, generality: Generality) -> (Vec<Vec3>, u64, u64, u64) {
    let medium = medium(volume, "level-map");
    let adding = Adding::new(Strategy::Fixed64, 0);
    let points = points(Points::Hammersley, 64, 0);
    let mut pipeline = Pipeline::new(gpu, (volume, &medium), adding, LAMP, points).unwrap();
    pipeline.set_view(&camera(
        DVec3::new(0.6, 0.4, -1.6),
        DVec3::splat(0.5),
        0.35,
        32,
    ));
    pipeline.set_generality(generality).unwrap();
    let found = pipeline.render().unwrap();
    let deposits = found.tallies.deposits;
    (
        found.image,
        pipeline.view_steps(),
        pipeline.bytes(),
        deposits,
    )
}

/// RMSE of an image from another one, as a part of its mean.
fn off(image: &[Vec3], from: &[Vec3]) -> f64 {
    let square: f32 = (image.iter().zip(from))
        .map(|(a, b)| (*a - *b).length_squared())
        .sum();
    let mean: f32 = from.iter().map(|pixel| pixel.element_sum()).sum();
    let count = 3.0 * from.len() as f64;
    (f64::from(square) / count).sqrt() / (f64::from(mean) / count)
}

#[test]
fn voxels_in_which_nothing_scatters_are_crossed_at_once_and_unseen() {
    let Some(gpu) = adapter() else { return };
    let by_one = Generality {
        empty: true,
        ..Generality::default()
    };
    let volume = cloud(fog([1; 3]).phase);
    let skipped = rendered(&gpu, &volume, Generality::default());
    let stepped = rendered(&gpu, &volume, by_one);
    println!("cloud: {} steps in the place of {}", skipped.1, stepped.1);
    assert!(off(&skipped.0, &stepped.0) < 1e-6);
    assert!(skipped.1 * 10 < stepped.1 * 9);
    let fog = fog([SIDE; 3]);
    let skipped = rendered(&gpu, &fog, Generality::default());
    let stepped = rendered(&gpu, &fog, by_one);
    assert_eq!((skipped.0, skipped.1), (stepped.0, stepped.1));
}

#[test]
fn energy_that_no_view_reads_is_left_out_unseen() {
    let Some(gpu) = adapter() else { return };
    let all = Generality {
        unread: true,
        ..Generality::default()
    };
    let volume = cloud(fog([1; 3]).phase);
    let [few, all_of] = [Generality::default(), all].map(|of| rendered(&gpu, &volume, of));
    println!("cloud: {} deposits in the place of {}", few.3, all_of.3);
    assert!(off(&few.0, &all_of.0) < 1e-6);
    assert!(few.3 < all_of.3);
    let fog = fog([SIDE; 3]);
    let [few, all] = [Generality::default(), all].map(|of| rendered(&gpu, &fog, of));
    assert_eq!((few.0, few.3), (all.0, all.3));
}

#[test]
fn directions_that_no_phase_function_asks_for_are_half_of_all_sums() {
    let Some(gpu) = adapter() else { return };
    let with = Generality {
        directions: true,
        ..Generality::default()
    };
    let volume = cloud(Phase::ISOTROPIC);
    let [without, with] = [Generality::default(), with].map(|all| rendered(&gpu, &volume, all));
    assert_eq!(without.0, with.0);
    assert_eq!(2 * without.2, with.2);
    // Another phase function makes photons run again, where directions are missing.
    let medium = medium(&volume, "level-map");
    let adding = Adding::new(Strategy::Fixed64, 0);
    let list = points(Points::Hammersley, 16, 0);
    let mut pipeline = Pipeline::new(&gpu, (&volume, &medium), adding, LAMP, list).unwrap();
    pipeline.set_view(&camera(
        DVec3::new(0.6, 0.4, -1.6),
        DVec3::splat(0.5),
        0.35,
        8,
    ));
    let has_photons = |pipeline: &mut Pipeline| {
        let passes = pipeline.render().unwrap().passes;
        passes.iter().any(|pass| pass == "photons")
    };
    pipeline.set_generality(Generality::default()).unwrap();
    assert!(has_photons(&mut pipeline) && !pipeline.is_directed());
    pipeline.set_phase(fog([1; 3]).phase);
    assert!(has_photons(&mut pipeline) && pipeline.is_directed());
    pipeline.set_phase(Phase::ISOTROPIC);
    assert!(!has_photons(&mut pipeline));
    pipeline.set_phase(fog([1; 3]).phase);
    let image = pipeline.render().unwrap().image;
    let mut fresh = pipeline;
    fresh.set_generality(Generality::default()).unwrap();
    let again = fresh.render().unwrap().image;
    assert!(off(&image, &again) < 1e-6);
}

#[test]
fn ways_as_if_light_were_bent_are_straight_where_it_is_not() {
    let Some(gpu) = adapter() else { return };
    let curved = Generality {
        curves: true,
        ..Generality::default()
    };
    for volume in [fog([SIDE; 3]), cloud(fog([1; 3]).phase)] {
        let straight = rendered(&gpu, &volume, Generality::default());
        let bent = rendered(&gpu, &volume, curved);
        let off = off(&bent.0, &straight.0);
        println!(
            "{off:.1e} off, {} steps for {}, {} deposits for {}",
            bent.1, straight.1, bent.3, straight.3
        );
        assert!(off > 0.0 && off < 1e-3, "{off}");
    }
}

#[test]
fn photons_that_miss_the_medium_add_nothing() {
    let Some(gpu) = adapter() else { return };
    let all = Generality {
        missed: true,
        ..Generality::default()
    };
    let volume = fog([SIDE; 3]);
    let [few, all] = [Generality::default(), all].map(|of| rendered(&gpu, &volume, of));
    assert_eq!((few.0, few.3), (all.0, all.3));
}

#[test]
fn levels_in_which_no_cube_is_homogeneous_answer_nothing() {
    let volume = cloud(fog([1; 3]).phase);
    for name in ["level-map", "min-max"] {
        let of = |whole: bool| {
            let params = [("whole".to_owned(), ParamValue::Flag(whole))];
            let kind = structure::registry().find(name).unwrap().clone();
            let made = kind.make(&Params(params.into())).unwrap();
            Medium::new(&volume, made, Homogeneity::default())
        };
        let [few, all] = [false, true].map(of);
        let mut fetches = [0, 0];
        for place in 0..SIDE.pow(3) {
            let voxel = UVec3::new(place % SIDE, place / SIDE % SIDE, place / (SIDE * SIDE));
            let [a, b] = &mut fetches;
            assert_eq!(few.region_of(voxel, a), all.region_of(voxel, b), "{voxel}");
        }
        println!(
            "{name}: levels to {} for {}, {} bytes for {}, fetches {} for {}",
            few.top,
            all.top,
            few.bytes(),
            all.bytes(),
            fetches[0],
            fetches[1]
        );
        assert!(few.top < all.top && few.bytes() < all.bytes());
        assert!(fetches[0] <= fetches[1] && (name == "level-map" || fetches[0] < fetches[1]));
    }
}

#[test]
fn cells_are_counted_where_a_triangle_comes_near_and_nowhere_else() {
    let Some(gpu) = adapter() else { return };
    let middle = DVec3::splat(0.5);
    let low = DVec3::new(0.21, 0.3, 0.17);
    for (name, mesh) in [
        ("sphere", Mesh::sphere(middle, 0.4, 24)),
        (
            "torus",
            Mesh::torus(middle, DVec3::new(0.6, 0.0, 0.8), [0.3, 0.1], 48),
        ),
        ("box", Mesh::cuboid(low, low + DVec3::new(0.5, 0.25, 0.625))),
    ] {
        for side in [7, 32] {
            let of = |counted| covered(&gpu, &mesh, side, counted).unwrap();
            let [all, some] = [Counted::All, Counted::Border].map(of);
            assert_eq!(all, some, "{name}");
            let border = border_of(&mesh, side);
            let near: u32 = border.iter().map(|word| word.count_ones()).sum();
            let is_cut = |part: &&f32| **part > 0.0 && **part < 1.0;
            let cut = all.iter().filter(is_cut).count();
            println!("{name}, {side}³: {near} voxels near, {cut} of them cut");
            assert!(near >= cut as u32 && f64::from(near) < 0.75 * f64::from(side.pow(3)));
        }
    }
}

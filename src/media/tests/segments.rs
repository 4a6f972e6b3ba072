use super::{media, volumes};
use crate::medium::{Homogeneity, Key, Medium};
use crate::rays::{SegmentRay, random_and_hard};
use crate::segments::{Walker, exact_depth, first_difference, walk_ray, wrong_segment};
use crate::{procedures, structure};
use glam::DVec3;
use rayon::prelude::*;
use raystone_gpu::{AdapterChoice, Gpu, KernelLibrary, probe_arithmetic};

/// Rays of all media together.
const RAYS: usize = 1_000_000;

#[test]
fn every_structure_answers_what_its_voxels_say() {
    media().par_iter().for_each(|(name, _, medium)| {
        medium.validate(1).unwrap_or_else(|e| panic!("{name}: {e}"));
    });
}

#[test]
fn a_wrong_answer_of_any_array_is_seen() {
    let volume = &volumes()[0];
    for kind in structure::registry().iter() {
        let structure = kind.make(&Default::default()).unwrap();
        let medium = Medium::new(volume, structure, Homogeneity::default());
        let middle = medium.pairs.len() / 2;
        // The pair that a voxel in the middle of the medium uses: found by changing each until one is seen.
        let seen = |pair: usize| {
            let mut faulty = medium.clone();
            faulty.pairs[pair][1] ^= 1;
            faulty.validate(1).is_err()
        };
        let pairs = medium.pairs.len();
        assert!(
            (0..pairs)
                .step_by((pairs / 256).max(1))
                .chain([middle, 0])
                .any(seen),
            "{}",
            kind.name()
        );
    }
}

#[test]
fn bounds_hold_on_a_million_random_and_hard_rays_and_depths_are_those_of_f64() {
    let media = media();
    let each = RAYS / media.len() + 1;
    let worst = media
        .par_iter()
        .enumerate()
        .map(|(k, (name, volume, medium))| {
            let mut worst = 0.0_f64;
            for ray in random_and_hard(volume, medium, each, k as u64) {
                if let Some(wrong) = wrong_segment(medium, &ray, 2) {
                    panic!("{name}: {wrong} of {ray:?}");
                }
                let depth = walk_ray(medium, &ray, |_, _, _| ()).depth;
                let error = ((-f64::from(depth)).exp() - (-exact_depth(medium, &ray)).exp()).abs();
                assert!(error < 1e-6, "{name}: {error} of {ray:?}");
                worst = worst.max(error);
            }
            worst
        });
    let worst = worst.reduce(|| 0.0, f64::max);
    println!("the largest error of a transmittance is {worst:.2e}");
    assert!(worst > 0.0);
}

#[test]
fn the_optical_depth_of_a_constant_medium_is_its_closed_form() {
    let volume = &volumes()[3];
    for kind in structure::registry().iter() {
        let structure = kind.make(&Default::default()).unwrap();
        let medium = Medium::new(volume, structure, Homogeneity::default());
        let (from, to) = (DVec3::new(-1.0, 0.2, 0.3), DVec3::new(2.0, 0.8, 0.9));
        let ray = SegmentRay::new(volume, &medium, from, (to - from).normalize()).unwrap();
        let walked = walk_ray(&medium, &ray, |_, _, _| ());
        // The box is a third of the way between both points.
        let exact = 2.5 * (to - from).length() / 3.0;
        assert!(
            (f64::from(walked.depth) - exact).abs() < 1e-6,
            "{}: {walked:?}",
            kind.name()
        );
        assert_eq!(walked.steps, 1);
    }
}

/// An adapter that computes like the host; none says so.
pub(crate) fn adapter() -> Option<Gpu> {
    let gpu = raystone_gpu::open(&AdapterChoice::Best, KernelLibrary::default());
    let gpu = gpu.unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"));
    let exact = probe_arithmetic(&gpu).unwrap().is_exact();
    if !exact {
        eprintln!("skipped for want of an adapter that computes like the host");
    }
    exact.then_some(gpu)
}

#[test]
fn kernels_walk_as_their_twins_do() {
    let Some(gpu) = adapter() else { return };
    for kind in structure::registry().iter() {
        for (k, volume) in volumes().iter().enumerate() {
            let structure = kind.make(&Default::default()).unwrap();
            let homogeneity = Homogeneity {
                key: Key::Both,
                epsilon: 0.1,
            };
            let medium = Medium::new(volume, structure, homogeneity);
            let rays = random_and_hard(volume, &medium, 4096, 7);
            let walker = Walker::new(&gpu, &medium, &rays, true).unwrap();
            let (found, _) = walker.walk().unwrap();
            let differs = first_difference(&medium, &rays, &found);
            assert_eq!(differs, None, "{} over volume {k}", kind.name());
        }
    }
}

#[test]
fn the_level_map_needs_fewer_steps_than_voxels_and_a_key_decides_how_many() {
    let volume = procedures::glass_ball(32).unwrap();
    let steps = |name: &str, key: Key, epsilon: f64| {
        let registry = structure::registry();
        let structure = registry
            .find(name)
            .unwrap()
            .make(&Default::default())
            .unwrap();
        let medium = Medium::new(&volume, structure, Homogeneity { key, epsilon });
        let rays = random_and_hard(&volume, &medium, 512, 1);
        let steps = rays
            .iter()
            .map(|ray| walk_ray(&medium, ray, |_, _, _| ()).steps);
        steps.sum::<u32>()
    };
    let voxels = steps("dda", Key::Refraction, 0.01);
    let cubes = steps("level-map", Key::Refraction, 0.01);
    assert!(cubes * 4 < voxels * 3, "{cubes} of {voxels}");
    assert_eq!(cubes, steps("min-max", Key::Refraction, 0.01));
    assert_eq!(cubes, steps("sparse-tree", Key::Refraction, 0.01));
    assert!(steps("level-map", Key::Refraction, 0.6) < cubes);
    assert_eq!(
        steps("level-map", Key::Empty, 0.0),
        steps("dda", Key::Empty, 0.0)
    );
}

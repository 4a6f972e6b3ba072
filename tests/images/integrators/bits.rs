//! Bit-exact equality: same seed, other slices, other structures.

use super::MAX_DEPTH;
use crate::support::*;
use raystone::image::Image;
use raystone::integrator::Renderer;
use raystone::params::{ParamValue, Variant};

fn bits(image: &Image) -> Vec<[u32; 3]> {
    image.pixels.iter().map(|p| p.map(f32::to_bits)).collect()
}

fn last(renderer: &Renderer, spps: &[u32], seed: u32) -> Vec<[u32; 3]> {
    let shots = renderer.render(spps, seed).expect("a render");
    assert_eq!(renderer.error_word().expect("a status"), 0, "error word");
    bits(&shots.last().expect("a snapshot").image)
}

#[test]
fn a_seed_gives_the_same_bits_again_and_another_seed_gives_others() {
    let stage = Stage::builtin(gpu(), "furnace-box", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    for sampler in in_turn("samplers of a seed", samplers(2)) {
        let what = path(MAX_DEPTH);
        let renderer = stage.renderer(gpu(), &traced, &sampler, &what, [16, 16], false);
        let first = last(&renderer, &[2], 7);
        assert_eq!(first, last(&renderer, &[2], 7), "{}", sampler.label());
        let other = last(&renderer, &[2], 8);
        // A sampler without pixel and seed in it draws the same for every seed.
        assert_eq!(first != other, sampler.is_random(), "{}", sampler.label());
    }
}

#[test]
fn an_image_does_not_depend_on_how_its_samples_and_rows_are_cut() {
    let stage = Stage::builtin(gpu(), "furnace-box", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("sobol", "cranley-patterson");
    // The first slice of an unknown kernel is 512 samples: this image needs two.
    let renderer = stage.renderer(
        gpu(),
        &traced,
        &sampler,
        &path(MAX_DEPTH),
        [200, 144],
        false,
    );
    let whole = last(&renderer, &[4], 11);
    let sliced = |steps: &[(u32, u32)]| {
        renderer.reset().expect("a device");
        for &(first, count) in steps {
            renderer.add_samples(first, count, 11).expect("samples");
        }
        bits(&renderer.image().expect("an image"))
    };
    assert_eq!(whole, sliced(&[(0, 1), (1, 1), (2, 1), (3, 1)]));
    assert_eq!(whole, sliced(&[(0, 1), (1, 3)]));
    assert_ne!(whole, sliced(&[(0, 1), (1, 2)]), "a sample less");
    assert_ne!(whole, sliced(&[(1, 4)]), "other samples");
    // A renderer that begins with its cautious first slice.
    let fresh = stage.renderer(
        gpu(),
        &traced,
        &sampler,
        &path(MAX_DEPTH),
        [200, 144],
        false,
    );
    assert_eq!(whole, last(&fresh, &[4], 11));
}

#[test]
fn the_images_at_powers_of_two_are_those_of_renders_of_their_own() {
    let stage = Stage::builtin(gpu(), "furnace-box", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("sobol", "cranley-patterson");
    let renderer = stage.renderer(gpu(), &traced, &sampler, &path(MAX_DEPTH), [16, 16], false);
    let kept = renderer.render(&[1, 2, 4], 5).expect("a render");
    let spps: Vec<u32> = kept.iter().map(|shot| shot.spp).collect();
    assert_eq!(spps, [1, 2, 4]);
    let kept: Vec<_> = kept.iter().map(|shot| bits(&shot.image)).collect();
    for (image, spp) in kept.iter().zip(spps) {
        assert_eq!(*image, last(&renderer, &[spp], 5), "{spp} samples");
    }
    assert!(kept[0] != kept[1] && kept[1] != kept[2]);
}

/// The images of `bvh` and of the structures whose turn it is, by name.
fn images(stage: &Stage, what: &Variant) -> Vec<(&'static str, Vec<[u32; 3]>)> {
    let sampler = sampler("pixel-hash", "none");
    let image = |kind: &'static dyn raystone::accel::AccelKind| {
        let traced = stage.traced(gpu(), kind);
        let renderer = stage.renderer(gpu(), &traced, &sampler, what, [16, 16], false);
        (kind.name(), last(&renderer, &[4], 9))
    };
    let kinds = inline_structures().into_iter();
    let others = in_turn(
        "structures of an image",
        kinds.filter(|kind| kind.name() != "bvh"),
    );
    std::iter::once(structure("bvh"))
        .chain(others)
        .map(image)
        .collect()
}

#[test]
fn every_structure_gives_the_same_image_to_the_bit() {
    if !is_exact(gpu()) {
        return;
    }
    let whats = [
        path(MAX_DEPTH),
        integrator_variant("ao", &[]),
        integrator_variant("primary", &[]),
    ];
    let sphere = [("triangles", ParamValue::Integer(2000))];
    for what in &whats {
        let mut seen = Vec::new();
        for (scene, changes) in [("cornell-box", &[][..]), ("displaced-sphere", &sphere)] {
            let images = images(&Stage::builtin(gpu(), scene, changes), what);
            for (name, image) in &images {
                assert_eq!(*image, images[0].1, "{scene}, {what}, {name}");
            }
            // Images without content would be equal, too: each scene has its own.
            assert!(!seen.contains(&images[0].1), "{scene}, {what}");
            seen.push(images[0].1.clone());
        }
    }
}

//! A fault that shows under a non-default triangle test; `tests/mutants` plants all others.

use crate::support;
use crate::support::{
    Pcg, brute_force, build, default_params, differences, kernels_with, open, scenes, trace,
};
use raystone::accel::{AccelKind, BruteForce, Intersection, TriangleRegistry};

#[test]
fn a_ray_along_a_face_of_a_box_that_hits_what_lies_behind_it_is_seen() {
    if !support::is_exact(support::gpu()) {
        return;
    }
    let tests = Intersection {
        triangle: TriangleRegistry::default()
            .get("moeller-trumbore")
            .expect("a test"),
        ..Intersection::default()
    };
    let allowed = "all(outside <= allowance(triangle, ray, inverse, found) + pad)";
    let [sound, faulty] = [allowed, "true"].map(|to| {
        let gpu = open(kernels_with("accel/triangle", &[(allowed, to)]));
        let wrong = |seed| {
            let mut rng = Pcg::new(seed);
            let soup = scenes::lattice_soup(&mut rng, 200, 6).intersecting(tests);
            let mut rays = scenes::lattice_rays(&mut rng, 2048, 6);
            rays.extend(scenes::aimed_rays(&mut rng, &soup, 2048));
            let built = build(
                &BruteForce,
                &soup,
                &default_params(&BruteForce.parameters()),
            );
            let found = trace(&gpu, &*built, &soup, &rays, &[]).hits;
            differences(&brute_force(&soup, &rays), &found).len()
        };
        (40..44).map(wrong).sum::<usize>()
    });
    assert_eq!(sound, 0);
    assert!(faulty > 0, "not seen");
}

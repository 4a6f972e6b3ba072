//! The division on the host against every triangle for every ray, and its counts in closed form.

use super::Division;
use crate::fixtures::{lattice, soup};
use crate::{NO_HIT, Query, Ray, brute_force_hits};
use raystone_core::params::{ParamValue, Params};
use raystone_core::random::Pcg32 as Pcg;

fn params(naive: i64, levels: i64) -> Params {
    let numbers = [("naive", naive), ("levels", levels), ("capacity", 1 << 20)];
    let set = numbers.map(|(name, x)| (name.to_owned(), ParamValue::Integer(x)));
    Params(set.into_iter().collect())
}

fn rays(rng: &mut Pcg, count: usize) -> Vec<Ray> {
    let one = |_| Ray {
        origin: [0, 1, 2].map(|_| 7.0 * rng.uniform() as f32 - 0.5),
        t_min: 0.0,
        direction: rng.direction().as_vec3().into(),
        t_max: f32::INFINITY,
    };
    (0..count).map(one).collect()
}

#[test]
fn a_division_finds_what_every_triangle_for_every_ray_finds() {
    let mut rng = Pcg::new(5);
    let soup = lattice(6);
    let mut rays = rays(&mut rng, 400);
    rays[3].origin[1] = f32::NAN;
    rays[4].direction = [0.0; 3];
    rays[5].t_max = 0.5;
    let expected = brute_force_hits(&soup, &rays);
    for (naive, levels) in [(1, 40), (8, 40), (3, 2), (1, 1), (1024, 40)] {
        let found = Division::new(&soup, &params(naive, levels), Query::Closest, &rays)
            .expect("a division");
        assert_eq!(found.levels.len(), levels as usize);
        for (ray, (found, expected)) in found.hits.iter().zip(&expected).enumerate() {
            let bits = |hit: &crate::Hit| (hit.triangle, hit.t.to_bits());
            assert_eq!(bits(found), bits(expected), "ray {ray}, {naive} {levels}");
        }
        let any = Division::new(&soup, &params(naive, levels), Query::Any, &rays);
        let any = any.expect("a division");
        let is_hit = |hit: &crate::Hit| hit.triangle != NO_HIT;
        assert!(any.hits.iter().map(is_hit).eq(expected.iter().map(is_hit)));
        assert!(any.tests < found.tests);
    }
}

/// Triangles apart from each other along a line, and rays across it at each: every ray stays in one problem.
#[test]
fn pairs_and_tests_are_those_of_halves() {
    let soup = soup((0..64).map(|k| {
        let x = k as f32;
        [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 0.5, 0.0]]
    }));
    let at = |k: u32| Ray {
        origin: [(k / 4) as f32 + 0.1, 0.1 + 0.01 * (k % 4) as f32, -1.0],
        t_min: 0.0,
        direction: [0.0, 0.0, 1.0],
        t_max: f32::INFINITY,
    };
    let rays: Vec<Ray> = (0..256).map(at).collect();
    let found = Division::new(&soup, &params(1, 40), Query::Closest, &rays).expect("a division");
    for (level, counts) in found.levels.iter().enumerate() {
        let problems = if level <= 6 { 1 << level } else { 0 };
        let pairs = if level <= 6 { 256 } else { 0 };
        assert_eq!(
            (counts.problems, counts.pairs),
            (problems, pairs),
            "level {level}"
        );
    }
    assert_eq!(found.tests, 256);
    // Problems of four rays: with four naive ones, halves of two triangles are not divided.
    let found = Division::new(&soup, &params(8, 40), Query::Closest, &rays).expect("a division");
    assert_eq!(found.tests, 256 * 8);
}

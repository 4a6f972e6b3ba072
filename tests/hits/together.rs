//! What is asked of every structure that answers rays together.

use crate::support::scenes;
use crate::support::{Pcg, assert_same_hits, brute_force, build, trace};
use raystone::accel::{AccelKind, Hit, NO_HIT, Ray, TriangleSoup};
use raystone::gpu::Gpu;
use raystone::params::Params;

/// Closest and any hits of a set of rays, all traced at once.
pub fn answers(
    gpu: &Gpu,
    soup: &TriangleSoup,
    (kind, params): (&dyn AccelKind, &Params),
    rays: &[Ray],
) -> (Vec<Hit>, Vec<bool>) {
    let built = build(kind, soup, params);
    let any = trace(gpu, &*built, soup, rays, &["any"]).found();
    (trace(gpu, &*built, soup, rays, &[]).hits, any)
}

/// Panics unless both are those of brute force.
pub fn assert_right(
    what: &str,
    gpu: &Gpu,
    soup: &TriangleSoup,
    (kind, params): (&dyn AccelKind, &Params),
    rays: &[Ray],
) {
    let expected = brute_force(soup, rays);
    let (hits, any) = answers(gpu, soup, (kind, params), rays);
    let what = format!("{what} {params:?}");
    assert_same_hits(&what, rays, &expected, &hits);
    let blocked: Vec<bool> = expected.iter().map(|h| h.triangle != NO_HIT).collect();
    assert_eq!(any, blocked, "{what}: any hit");
}

/// Rays of all kinds: aimed, on the lattice, cut at hits, and none at all.
pub fn mixed_rays(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> Vec<Ray> {
    let mut rays = scenes::aimed_rays(rng, soup, count);
    rays.extend(scenes::lattice_rays(rng, count, 16));
    let hits = brute_force(soup, &rays);
    rays.extend(scenes::cut_at_hits(&rays, &hits));
    rays[5].origin[1] = f32::NAN;
    rays[6].direction = [f32::INFINITY, 0.0, f32::NAN];
    rays[7].direction = [0.0; 3];
    rays[8].t_max = f32::INFINITY;
    rays[9].origin = [1e30, -1e30, 1e30];
    rays
}

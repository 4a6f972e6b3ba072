//! Images of Cook–Torrance surfaces against the papers' formulas, integrated in f64: R. Cook, K.
//! Torrance, "A reflectance model for computer graphics", 1982 (masking and Fresnel's equations),
//! and B. Walter et al., "Microfacet models for refraction through rough surfaces", 2007 (the
//! factor 4 instead of 1982's π, and Smith's masking). Mitsuba has no such material.

use super::{replicates, scene_of};
use glam::{DVec3, Vec3};
use raystone::geometry::Camera;
use raystone::scene::{CookTorrance, Fresnel, Light, Masking, Material, SceneData};
use statrs::function::erf::erf;
use std::f64::consts::PI;

const BASE: f64 = 0.2;
const SPECULAR: f64 = 0.7;
/// Point of the plane y = 0 that is viewed.
const TARGET: Vec3 = Vec3::new(0.3, 0.0, -0.2);

/// Roughness, index of refraction, masking, Fresnel; and the tolerance of an image. Smith's
/// integral is approximated, by at most 0.35 % for each of the two directions.
const MATERIALS: [(f64, f64, Masking, Fresnel, f64); 5] = [
    (0.15, 1.5, Masking::VCavities, Fresnel::Exact, 1e-3),
    (0.3, 1.8, Masking::VCavities, Fresnel::Schlick, 1e-3),
    (0.7, 2.5, Masking::VCavities, Fresnel::Exact, 1e-3),
    (0.3, 1.5, Masking::Smith, Fresnel::Exact, 7e-3),
    (0.8, 2.0, Masking::Smith, Fresnel::Schlick, 7e-3),
];

/// F of 1982, or Schlick's polynomial.
fn fresnel(kind: Fresnel, c: f64, n: f64) -> f64 {
    if kind == Fresnel::Schlick {
        let straight = ((n - 1.0) / (n + 1.0)).powi(2);
        return straight + (1.0 - straight) * (1.0 - c).powi(5);
    }
    let g = (n * n + c * c - 1.0).sqrt();
    let ratio = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    0.5 * ((g - c) / (g + c)).powi(2) * (1.0 + ratio * ratio)
}

/// Smith's masking of Beckmann facets (Walter et al., before eq. 27).
fn smith(cosine: f64, m: f64) -> f64 {
    let a = cosine / (m * (1.0 - cosine * cosine).max(1e-18).sqrt());
    2.0 / (1.0 + erf(a) + (-a * a).exp() / (a * PI.sqrt()))
}

/// Reflectance times the cosine of `i`, about the normal y.
fn reflected(
    (m, n, masking, kind, _): (f64, f64, Masking, Fresnel, f64),
    o: DVec3,
    i: DVec3,
) -> f64 {
    let h = (o + i).normalize();
    let (n_h, n_o, n_i, o_h) = (h.y, o.y, i.y, o.dot(h));
    let alpha = n_h.min(1.0).acos();
    let d = (-(alpha.tan() / m).powi(2)).exp() / (PI * m * m * alpha.cos().powi(4));
    let g = match masking {
        Masking::VCavities => (2.0 * n_h * n_o / o_h).min(2.0 * n_h * n_i / o_h).min(1.0),
        Masking::Smith => smith(n_o, m) * smith(n_i, m),
    };
    BASE / PI * n_i + SPECULAR * fresnel(kind, o_h, n) * d * g / (4.0 * n_o)
}

/// Its integral over all directions from above, by midpoints in cosine and angle.
fn albedo(of: (f64, f64, Masking, Fresnel, f64), o: DVec3) -> f64 {
    const CELLS: u32 = 700;
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(CELLS);
    let one = |k: u32| {
        let (cos, (sin_phi, cos_phi)) =
            (middle(k / CELLS), (2.0 * PI * middle(k % CELLS)).sin_cos());
        let sin = (1.0 - cos * cos).sqrt();
        reflected(of, o, DVec3::new(sin * cos_phi, cos, sin * sin_phi))
    };
    (0..CELLS * CELLS).map(one).sum::<f64>() * 2.0 * PI / f64::from(CELLS * CELLS)
}

/// The plane y = 0 of a material, seen from a direction.
fn plane(of: (f64, f64, Masking, Fresnel, f64), from: Vec3, degrees: f32) -> SceneData {
    let material = CookTorrance {
        diffuse: Vec3::splat(BASE as f32),
        specular: Vec3::splat(SPECULAR as f32),
        roughness: of.0 as f32,
        ior: of.1 as f32,
        masking: of.2,
        fresnel: of.3,
    };
    let camera = Camera::upright(TARGET + 3.0 * from, TARGET, degrees);
    let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
    let corners = corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec();
    scene_of(
        &[(corners, 0)],
        vec![Material::cook_torrance("plane", &material)],
        camera,
    )
}

/// Direction from the viewed point, at this elevation and azimuth in degrees.
fn towards(elevation: f32, around: f32) -> Vec3 {
    let (up, out) = elevation.to_radians().sin_cos();
    let (z, x) = around.to_radians().sin_cos();
    Vec3::new(out * x, up, out * z)
}

#[test]
fn a_cook_torrance_plane_in_parallel_light_is_what_the_papers_say() {
    // At the mirror direction, next to it, towards the light, at a grazing angle.
    let views = [(40.0, 180.0), (55.0, 150.0), (70.0, 20.0), (15.0, 190.0)];
    let light = towards(40.0, 0.0);
    for of in MATERIALS {
        let mut found_out = false;
        for (elevation, around) in views {
            let from = towards(elevation, around);
            let mut scene = plane(of, from, 0.05);
            scene.lights = vec![Light::Directional {
                direction: -light,
                irradiance: Vec3::splat(3.0),
            }];
            let found = replicates(scene, 1, [2, 2], 4, 1).0[0].mean();
            let value = |of| 3.0 * reflected(of, from.as_dvec3(), light.as_dvec3());
            let expected = value(of);
            println!("{of:?} from {elevation}°, {around}°: {found} for {expected}");
            // The view covers 0.05°, of a lobe of some degrees.
            assert!(
                (found / expected - 1.0).abs() < of.4,
                "{of:?}: {found} for {expected}"
            );
            let rougher = value((1.1 * of.0, of.1, of.2, of.3, of.4));
            found_out |= (found / rougher - 1.0).abs() > 5.0 * of.4;
        }
        assert!(
            found_out,
            "{of:?}: a surface a tenth rougher looks the same"
        );
    }
}

#[test]
fn a_cook_torrance_plane_under_a_white_sky_has_the_albedo_of_the_quadrature() {
    for of in MATERIALS {
        for elevation in [80.0, 45.0, 12.0] {
            let from = towards(elevation, 35.0);
            let mut scene = plane(of, from, 0.05);
            scene.environment = Vec3::ONE;
            let images = replicates(scene, 1, [8, 8], 256, 6);
            let means: Vec<f64> = images.0.iter().map(|image| image.mean()).collect();
            let found = crate::support::Estimate::of(&means);
            let expected = albedo(of, from.as_dvec3());
            println!("{of:?} at {elevation}°: {found:?} for {expected}");
            assert!(found.error < 1e-3 * expected, "{found:?} proves nothing");
            let excess = (found.mean - expected).abs() - 5.0 * found.error;
            assert!(
                excess < of.4 * expected,
                "{of:?} at {elevation}°: {found:?} for {expected}"
            );
        }
    }
}

//! Surfaces: mirrors after a diffuse bounce, glass, every glossy material, boxes in which light goes round.

use super::closed::{fresnel, over_hemisphere, polygon};
use super::lamps::{FLOOR, NEAR, on_floor, path};
use super::{KnownImage, View};
use crate::mesh::Mesh;
use crate::path_oracle::scattered;
use crate::trial_scenes::Trial;
use glam::{DVec3, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_core::params::ParamValue;
use raystone_scene::{
    self as scene, CookTorrance, Fresnel, Light, Masking, Material, SceneError, reflectance_of_ior,
};
use std::f64::consts::PI;

/// All of them.
pub(super) fn images() -> Result<Vec<KnownImage>, SceneError> {
    let mut all = vec![
        mirrors()?.turned(),
        glass()?.turned(),
        materials()?.turned(),
        base_colour()?.turned(),
    ];
    let early = ("roulette_depth", ParamValue::Integer(1));
    for (name, depth, roulette) in [
        ("furnace, emission alone", 0_i32, "none"),
        ("furnace, two bounces", 2, "none"),
        ("furnace, eight bounces", 8, "throughput"),
        ("furnace, five bounces by albedo", 5, "albedo"),
    ] {
        let mut trial = path(depth.into(), &[("roulette", roulette)]);
        trial.1.push(early.clone());
        all.push(furnace(name, depth, trial)?.turned());
    }
    Ok(all)
}

fn without_roulette(depth: i64) -> Trial {
    path(depth, &[("roulette", "none")])
}

/// A floor beside a mirror under a white sky, and two mirrors that face each other below it.
fn mirrors() -> Result<KnownImage, SceneError> {
    const TINT: Vec3 = vec3(0.95, 0.85, 0.7);
    /// What a path rises or falls while it passes from one mirror to the other.
    const STEP: f32 = 0.29;
    let mut mesh = on_floor("mirrors", Vec3::ONE)?;
    let mirror = mesh.material(Material::mirror("mirror", TINT));
    let wall = [vec3(0.0, 0.0, -1.5), 2.0 * Vec3::Y, 3.0 * Vec3::Z];
    mesh.plain(wall, mirror);
    for x in [3.0, 4.0] {
        mesh.plain([vec3(x, -3.0, -1.0), 1.5 * Vec3::Y, 2.0 * Vec3::Z], mirror);
    }
    let tint = TINT.as_dvec3();
    // What of the sky the wall hides, it reflects: what goes down to the wall goes on upwards.
    let floor = |point: Vec3| {
        let [c, a, b] = wall.map(Vec3::as_dvec3);
        let corners = [c, c + a, c + a + b, c + b];
        let part = polygon(point.as_dvec3(), DVec3::Y, &corners) / PI;
        FLOOR.as_dvec3() * (DVec3::splat(1.0 - part) + part * tint)
    };
    let [close, away] = [vec3(0.3, 0.0, 0.1), vec3(1.2, 0.0, -0.4)];
    let (seen, from) = (vec3(0.0, 0.25, 0.0), vec3(0.5, 0.15, 0.0));
    let met = seen + vec3(from.x, -from.y, 0.0) * (seen.y / from.y);
    let half = vec3(0.5, -0.5 * STEP, 0.0);
    let views = vec![
        View::new("floor by the mirror", close, NEAR, floor(close)),
        View::new("floor away from it", away, NEAR, floor(away)),
        View::new("floor in the mirror", seen, from, tint * floor(met)),
        // Met at 0.195 and every 0.29 below the upper edge of 1.5: five times.
        View::new(
            "five mirrors",
            vec3(4.0, -1.695, 0.0),
            -half,
            tint.powf(5.0),
        ),
    ];
    let scene = mesh.done(Vec::new());
    Ok(KnownImage {
        name: "mirrors",
        scene,
        trial: without_roulette(8),
        views,
    })
}

/// A slab and a pane of glass between a bright wall and the dimmer one that they reflect.
fn glass() -> Result<KnownImage, SceneError> {
    const TINT: Vec3 = vec3(0.9, 0.8, 0.95);
    const INDEX: f32 = 1.5;
    let [behind, before] = [vec3(1.0, 0.5, 0.8), vec3(0.6, 1.0, 0.4)];
    let camera = Camera::upright(vec3(0.0, 0.0, 3.0), Vec3::ZERO, 45.0);
    let mut mesh = Mesh::new("glass", camera, Vec3::ZERO)?;
    let [slab, pane, far, near] = [
        Material::dielectric("slab", TINT, INDEX),
        Material::thin_dielectric("pane", TINT, INDEX),
        Material::diffuse("far", Vec3::ZERO).emitting_from_front(behind),
        Material::diffuse("near", Vec3::ZERO).emitting_from_front(before),
    ]
    .map(|m| mesh.material(m));
    mesh.block(vec3(-3.0, -3.0, 0.0), vec3(2.5, 6.0, 0.2), slab);
    mesh.plain([vec3(0.5, -3.0, 0.1), 2.5 * Vec3::X, 6.0 * Vec3::Y], pane);
    let [x, y] = [20.0 * Vec3::X, 20.0 * Vec3::Y];
    mesh.plain([vec3(-10.0, -10.0, -2.0), x, y], far);
    mesh.plain([vec3(-10.0, -10.0, 4.0), y, x], near);
    // Light is tinted at each passage of a surface, and goes to and fro inside.
    let [tint, behind, before] = [TINT, behind, before].map(Vec3::as_dvec3);
    let seen = |name, at: Vec3, from: Vec3, is_thin: bool| {
        let r = fresnel(from.as_dvec3().normalize().z, INDEX.into());
        let radiance = match is_thin {
            true => {
                let both = 2.0 * r / (1.0 + r);
                (1.0 - both) * tint * behind + both * before
            }
            false => {
                let through = (1.0 - r) / (1.0 + r) * tint * tint;
                through * behind + r * before + through * r * before
            }
        };
        View::new(name, at, from, radiance)
    };
    let views = vec![
        seen("slab", vec3(-1.5, 0.1, 0.2), vec3(0.3, 0.2, 2.8), false),
        seen(
            "slab, aslant",
            vec3(-1.8, 0.0, 0.2),
            vec3(2.0, 0.3, 1.2),
            false,
        ),
        seen("pane", vec3(1.5, 0.1, 0.1), vec3(-0.5, -0.4, 2.4), true),
        seen(
            "pane, aslant",
            vec3(1.6, 0.1, 0.1),
            vec3(-1.7, -0.4, 0.8),
            true,
        ),
    ];
    let scene = mesh.done(Vec::new());
    Ok(KnownImage {
        name: "glass",
        scene,
        trial: without_roulette(16),
        views,
    })
}

/// Every kind of glossy material under a white sky and light from one direction.
fn materials() -> Result<KnownImage, SceneError> {
    const WAY: Vec3 = vec3(0.5, -1.0, 0.3);
    const STRENGTH: Vec3 = vec3(2.0, 1.0, 0.5);
    let base = vec3(0.5, 0.3, 0.2);
    let cook = |masking, fresnel, roughness| {
        let of = CookTorrance {
            diffuse: base,
            specular: vec3(0.3, 0.5, 0.6),
            roughness,
            ior: 1.6,
            masking,
            fresnel,
        };
        Material::cook_torrance("cook-torrance", &of)
    };
    let glossy = [
        (
            "phong",
            Material::phong("phong", base, Vec3::splat(0.4), 12.0),
        ),
        (
            "V-cavities",
            cook(Masking::VCavities, Fresnel::Schlick, 0.4),
        ),
        ("Smith", cook(Masking::Smith, Fresnel::Exact, 0.5)),
        (
            "plastic",
            Material::principled("plastic", base, 0.0, 0.5, reflectance_of_ior(1.5)),
        ),
        ("metal", Material::principled("metal", base, 1.0, 0.6, 0.04)),
        (
            "between",
            Material::principled("between", base, 0.4, 0.7, 0.08),
        ),
    ];
    let camera = Camera::upright(vec3(0.0, 3.0, 5.0), Vec3::ZERO, 45.0);
    let mut mesh = Mesh::new("materials", camera, Vec3::ONE)?;
    let mut views = Vec::new();
    // The plane z = 0 of the formulas is y = 0 here: (x, y, z) are (z, x, y) there.
    let local = |v: Vec3| vec3(v.z, v.x, v.y).as_dvec3().normalize();
    for (k, (name, material)) in glossy.into_iter().enumerate() {
        let middle = vec3(2.0 * k as f32, 0.0, 0.0);
        let from = match k % 2 {
            0 => vec3(-0.3, 0.5, -0.1),
            _ => vec3(0.5, 0.3, 0.2),
        };
        let out = local(from);
        let of_sky = over_hemisphere(SKY_CELLS, |d| scattered(&material, out, d));
        let of_light = scattered(&material, out, local(-WAY)) * STRENGTH.as_dvec3();
        let radiance = of_sky + of_light;
        views.push(View::new(name, middle, from, radiance));
        let id = mesh.material(material);
        mesh.plain([middle - 0.5 * (Vec3::X + Vec3::Z), Vec3::Z, Vec3::X], id);
    }
    let mut scene = mesh.done(Vec::new());
    scene.lights = vec![Light::Directional {
        direction: WAY,
        irradiance: STRENGTH,
    }];
    Ok(KnownImage {
        name: "materials",
        scene,
        trial: path(1, &[]),
        views,
    })
}

/// Rows of cells of the sky over glossy materials: twice as many change the sixth digit.
const SKY_CELLS: u32 = 150;

/// What `primary` shows of a floor and a lamp seen aslant.
fn base_colour() -> Result<KnownImage, SceneError> {
    const SHINING: Vec3 = vec3(0.3, 0.0, 2.0);
    let mut mesh = on_floor("base colour", Vec3::ZERO)?;
    let base = vec3(0.2, 0.9, 0.1);
    let lamp = mesh.material(Material::diffuse("lamp", base).emitting(SHINING));
    mesh.plain([vec3(-1.0, 1.0, -1.0), Vec3::X, Vec3::Z], lamp);
    let view = |name, at: Vec3, from: Vec3, base: Vec3, emission: Vec3| {
        let cosine = from.as_dvec3().normalize().y.abs();
        let shown = base.as_dvec3() * cosine + emission.as_dvec3();
        View::new(name, at, from, shown)
    };
    let views = vec![
        view(
            "floor",
            vec3(1.0, 0.0, 0.5),
            vec3(0.3, 0.2, 0.4),
            FLOOR,
            Vec3::ZERO,
        ),
        view(
            "lamp",
            vec3(-0.6, 1.0, -0.4),
            vec3(0.2, 0.5, 0.1),
            base,
            SHINING,
        ),
        view(
            "sky",
            vec3(0.0, 0.5, 2.0),
            vec3(0.0, -0.3, -0.6),
            Vec3::ZERO,
            Vec3::ZERO,
        ),
    ];
    let scene = mesh.done(Vec::new());
    Ok(KnownImage {
        name: "base colour",
        scene,
        trial: ("primary", Vec::new()),
        views,
    })
}

/// A closed box that emits 1 − a and reflects a: radiance 1 − aᵏ⁺¹ after k bounces.
fn furnace(name: &'static str, depth: i32, trial: Trial) -> Result<KnownImage, SceneError> {
    const ALBEDO: Vec3 = vec3(0.8, 0.6, 0.3);
    let mut scene = scene::named("furnace-box")?;
    let wall = Material::diffuse("wall", ALBEDO).emitting(Vec3::ONE - ALBEDO);
    scene.materials = vec![wall];
    let shown = DVec3::ONE - ALBEDO.as_dvec3().powf(f64::from(depth + 1));
    let views = vec![
        View::new("wall", vec3(0.7, 0.6, 1.0), vec3(-0.4, -0.2, -0.8), shown),
        View::new(
            "corner",
            vec3(0.98, 0.0, 0.99),
            vec3(-0.5, 0.4, -0.6),
            shown,
        ),
    ];
    Ok(KnownImage {
        name,
        scene,
        trial,
        views,
    })
}

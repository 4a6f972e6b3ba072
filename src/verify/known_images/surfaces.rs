//! Surfaces: images of the material kinds, all glossy materials, boxes with interreflection.

use super::closed::over_hemisphere;
use super::lamps::{FLOOR, on_floor, path};
use super::{KnownImage, View};
use crate::materials::{MaterialChecks, MaterialRegistry};
use crate::mesh::Mesh;
use crate::path_oracle::scattered;
use crate::trial_scenes::Trial;
use glam::{DVec3, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_core::params::ParamValue;
use raystone_scene::{self as scene, Light, Material, SceneError};

pub(super) fn images(kinds: &MaterialRegistry) -> Result<Vec<KnownImage>, SceneError> {
    let mut all = Vec::new();
    for kind in kinds.iter() {
        all.extend((kind.images)()?.into_iter().map(KnownImage::turned));
    }
    all.extend([materials(kinds)?.turned(), base_colour()?.turned()]);
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

/// Every glossy material kind under a white sky and light from one direction.
fn materials(kinds: &MaterialRegistry) -> Result<KnownImage, SceneError> {
    const WAY: Vec3 = vec3(0.5, -1.0, 0.3);
    const STRENGTH: Vec3 = vec3(2.0, 1.0, 0.5);
    let planes = |kind: &'static MaterialChecks| {
        let planes = (kind.planes)().into_iter();
        planes.map(move |(name, material)| (kind, name, material))
    };
    let camera = Camera::upright(vec3(0.0, 3.0, 5.0), Vec3::ZERO, 45.0);
    let mut mesh = Mesh::new("materials", camera, Vec3::ONE)?;
    let mut views = Vec::new();
    // The plane z = 0 of the formulas is y = 0 here: (x, y, z) are (z, x, y) there.
    let local = |v: Vec3| vec3(v.z, v.x, v.y).as_dvec3().normalize();
    for (k, (kind, name, material)) in kinds.iter().flat_map(planes).enumerate() {
        let middle = vec3(2.0 * k as f32, 0.0, 0.0);
        let from = match k % 2 {
            0 => vec3(-0.3, 0.5, -0.1),
            _ => vec3(0.5, 0.3, 0.2),
        };
        let out = local(from);
        let of_sky = over_hemisphere(SKY_CELLS, |d| scattered(kind, &material, out, d));
        let of_light = scattered(kind, &material, out, local(-WAY)) * STRENGTH.as_dvec3();
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

/// Rows of sky cells over glossy materials; doubling them changes the sixth digit.
const SKY_CELLS: u32 = 150;

/// The `primary` view of a floor and a lamp seen at an angle.
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

//! Smooth glass: Fresnel's equations choose between reflection and refraction.

use super::*;
use crate::known_images::View;
use crate::known_images::closed;
use crate::known_images::lamps::path;
use crate::trial_scenes::{camera, depth};
use raystone_core::geometry::Camera;
use raystone_scene::DIELECTRIC;

pub(crate) static CHECKS: MaterialChecks = MaterialChecks {
    balls,
    trials,
    images,
    ..MaterialChecks::new(
        &DIELECTRIC,
        |surface| Box::new(Dielectric(surface)),
        mitsuba,
    )
};

struct Dielectric<'a>(&'a Surface<'a>);

/// Schlick's polynomial for a cosine on the optically thinner side.
pub(super) fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).max(0.0).powi(5)
}

pub(super) fn normal_reflectance(index: f64) -> f64 {
    ((index - 1.0) / (index + 1.0)).powi(2)
}

/// Reflectance for unpolarised light between media of these indices, and the cosine of the
/// refracted direction; `None` at total internal reflection.
pub(super) fn fresnel(cos: f64, from: f64, to: f64) -> Option<(f64, f64)> {
    let sin_2 = (1.0 - cos * cos) * (from / to).powi(2);
    if sin_2 >= 1.0 {
        return None;
    }
    let beyond = (1.0 - sin_2).sqrt();
    let across = (from * cos - to * beyond) / (from * cos + to * beyond);
    let along = (to * cos - from * beyond) / (to * cos + from * beyond);
    Some(((across * across + along * along) / 2.0, beyond))
}

impl Bsdf for Dielectric<'_> {
    fn sample(&self, [u, _]: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let surface = self.0;
        let (index, is_thin) = (parameter(surface, 0), parameter(surface, 1) > 0.5);
        let (from, to) = if is_thin || surface.side > 0.0 {
            (1.0, index)
        } else {
            (index, 1.0)
        };
        let cos = surface.normal.dot(surface.out).min(1.0);
        let delta = |direction, weight, medium| Bounce {
            direction,
            weight,
            density: None,
            medium,
        };
        let passed = fresnel(cos, from, to);
        let reflectance = passed.map_or(1.0, |(exact, beyond)| {
            let r = if parameter(surface, 2) > 0.5 {
                schlick(
                    normal_reflectance(index),
                    if from > to { beyond } else { cos },
                )
            } else {
                exact
            };
            if is_thin { 2.0 * r / (1.0 + r) } else { r }
        });
        let Some((_, beyond)) = passed.filter(|_| u >= rounding.share(reflectance)) else {
            let direction =
                rounding.direction(kept(surface, mirrored(surface.out, surface.normal)));
            return Some(delta(direction, DVec3::ONE, 1.0));
        };
        if is_thin {
            return Some(delta(-surface.out, surface.base, 1.0));
        }
        let ratio = from / to;
        let refracted = -ratio * surface.out + (ratio * cos - beyond) * surface.normal;
        let direction = rounding.direction(kept(surface, refracted.normalize()));
        let scale = ratio * ratio;
        Some(delta(direction, surface.base * scale, 1.0 / scale))
    }

    fn evaluate(&self, _: DVec3, _: &mut Rounding) -> Option<Reflected> {
        None
    }

    fn is_delta(&self) -> bool {
        true
    }
}

fn mitsuba(material: &Material, _: &Color, id: &str, warnings: &mut Vec<String>) -> String {
    if number(material, 2) > 0.0 {
        warnings.push(format!(
            "material {}: Mitsuba takes Fresnel's equations, not Schlick's polynomial",
            material.name
        ));
    }
    let is_thin = number(material, 1) > 0.0;
    let kind = if is_thin {
        "thindielectric"
    } else {
        "dielectric"
    };
    let Vec3 { x, y, z } = material.base_color;
    format!(
        r#"    <bsdf type="{kind}" {id}>
        <float name="int_ior" value="{}"/>
        <float name="ext_ior" value="1"/>
        <rgb name="specular_transmittance" value="{x} {y} {z}"/>
    </bsdf>
"#,
        number(material, 0)
    )
}

fn balls() -> Vec<(Option<usize>, Material)> {
    let glass = Material::dielectric("glass", vec3(0.9, 1.0, 0.9), 1.5);
    vec![(Some(7), glass.with_schlick())]
}

/// Glass balls, nested, a pane, a mirror, tints, and a lamp seen through all of them.
fn trials() -> Result<Vec<TrialScene>, SceneError> {
    let camera = camera(
        vec3(0.3, 1.3, 4.1),
        vec3(0.1, 0.8, 0.0),
        vec3(-0.08, 1.0, 0.0),
    );
    let mut mesh = Mesh::new("glass", camera, vec3(0.5, 0.6, 0.9))?;
    let [floor, mirror, clear, green, dense, pane, lamp] = [
        Material::diffuse("floor", vec3(0.6, 0.55, 0.5)),
        Material::mirror("mirror", vec3(0.9, 0.85, 0.8)),
        Material::dielectric("clear", Vec3::ONE, 1.5),
        Material::dielectric("green", vec3(0.7, 0.95, 0.8), 1.33),
        Material::dielectric("bubble", Vec3::ONE, 0.7),
        Material::thin_dielectric("pane", vec3(0.9, 0.8, 0.95), 1.6),
        Material::diffuse("lamp", Vec3::splat(0.4)).emitting(vec3(9.0, 8.0, 6.0)),
    ]
    .map(|m| mesh.material(m));
    mesh.plain([vec3(-4.0, 0.0, -4.0), 8.0 * Vec3::Z, 8.0 * Vec3::X], floor);
    mesh.plain(
        [vec3(-2.0, 0.1, -2.0), 4.0 * Vec3::X, 2.5 * Vec3::Y],
        mirror,
    );
    mesh.ball(vec3(-0.7, 0.75, 0.2), 0.7, clear);
    mesh.ball(vec3(-0.7, 0.75, 0.2), 0.35, dense);
    mesh.block(vec3(0.5, 0.1, -0.4), vec3(0.8, 1.2, 0.8), green);
    mesh.plain(
        [vec3(-1.8, 0.2, 1.1), vec3(1.9, 0.0, 0.4), 1.4 * Vec3::Y],
        pane,
    );
    mesh.plain([vec3(-0.8, 2.9, -0.6), 1.4 * Vec3::X, 1.2 * Vec3::Z], lamp);
    Ok(vec![TrialScene {
        scene: mesh.done(Vec::new()),
        trials: vec![("path", vec![depth(12)])],
    }])
}

/// A slab and a pane of glass between a bright wall and a dimmer one that they reflect.
fn images() -> Result<Vec<KnownImage>, SceneError> {
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
    // Light is tinted at each surface crossing, and is reflected back and forth inside.
    let [tint, behind, before] = [TINT, behind, before].map(Vec3::as_dvec3);
    let seen = |name, at: Vec3, from: Vec3, is_thin: bool| {
        let r = closed::fresnel(from.as_dvec3().normalize().z, INDEX.into());
        let radiance = if is_thin {
            let both = 2.0 * r / (1.0 + r);
            (1.0 - both) * tint * behind + both * before
        } else {
            let through = (1.0 - r) / (1.0 + r) * tint * tint;
            through * behind + r * before + through * r * before
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
    Ok(vec![KnownImage {
        name: "glass",
        scene,
        trial: path(16, &[("roulette", "none")]),
        views,
    }])
}

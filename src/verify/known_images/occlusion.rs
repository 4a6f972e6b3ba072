//! Ambient occlusion at several radii: beside a wall, in a corner, below a plate.

use super::closed::{corner, polygon, segment};
use super::lamps::{NEAR, on_floor};
use super::{KnownImage, View};
use glam::{DVec3, Vec3, vec3};
use raystone_core::params::ParamValue;
use raystone_scene::{Material, SceneData, SceneError};
use std::f64::consts::PI;

const LOW: f32 = 0.2;

pub(super) fn images() -> Result<Vec<KnownImage>, SceneError> {
    let mut all = Vec::new();
    for (name, radius) in [
        ("occlusion, short rays", 0.25),
        ("occlusion", 0.5),
        ("occlusion, longer rays", 1.0),
    ] {
        all.push(with_radius(name, walls()?, near(radius), Some(radius)));
    }
    let (scene, views) = far()?;
    all.push(with_radius("occlusion, endless rays", scene, views, None));
    Ok(all)
}

/// The image with rays of this length; unlimited if `None`.
fn with_radius(
    name: &'static str,
    scene: SceneData,
    views: Vec<View>,
    radius: Option<f64>,
) -> KnownImage {
    let image = KnownImage {
        name,
        scene,
        trial: ("ao", Vec::new()),
        views,
    };
    let mut image = image.turned();
    let diagonal = 2.0 * f64::from(image.scene.bounds().radius());
    let part = radius.map_or(10.0, |radius| radius / diagonal);
    image.trial.1 = vec![("radius", ParamValue::Number(part))];
    image
}

/// Two walls that form a corner, and a plate.
fn walls() -> Result<SceneData, SceneError> {
    let mut mesh = on_floor("walls", Vec3::ZERO)?;
    let wall = mesh.material(Material::diffuse("wall", Vec3::splat(0.5)));
    mesh.plain([vec3(0.0, 0.0, -3.0), 3.0 * Vec3::Y, 6.0 * Vec3::Z], wall);
    mesh.plain([vec3(0.0, 0.0, -3.0), 3.0 * Vec3::X, 3.0 * Vec3::Y], wall);
    mesh.plain([vec3(2.5, LOW, 1.5), 3.0 * Vec3::X, 3.0 * Vec3::Z], wall);
    Ok(mesh.done(Vec::new()))
}

/// Unoccluded fractions for rays too short to reach the ends of the walls and the plate.
fn near(radius: f64) -> Vec<View> {
    let part = |distance: f32| (f64::from(distance) / radius).min(1.0);
    let view = |name, point, free| View::new(name, point, NEAR, DVec3::splat(free));
    let [close, closer, aside] = [0.3_f32, 0.15, 0.4];
    let [a, b] = [close, aside].map(part);
    vec![
        view("wall", vec3(close, 0.0, 1.0), 1.0 - segment(a)),
        view(
            "close to the wall",
            vec3(closer, 0.0, 1.0),
            1.0 - segment(part(closer)),
        ),
        view(
            "corner",
            vec3(close, 0.0, aside - 3.0),
            1.0 - segment(a) - segment(b) + corner(a, b),
        ),
        // Occluded: cosine below height over length; cosine-weighted, the square of that ratio.
        view("plate", vec3(4.0, 0.0, 3.0), part(LOW).powi(2)),
        view("nothing", vec3(-3.0, 0.0, 0.0), 1.0),
    ]
}

/// A plate above that rays of any length meet.
fn far() -> Result<(SceneData, Vec<View>), SceneError> {
    let mut mesh = on_floor("plate", Vec3::ZERO)?;
    let plate = mesh.material(Material::diffuse("plate", Vec3::splat(0.5)));
    let [at, along, across] = [vec3(0.2, 1.0, -0.5), vec3(1.0, 0.4, 0.0), 1.3 * Vec3::Z];
    mesh.plain([at, along, across], plate);
    let corners = [at, at + along, at + along + across, at + across].map(Vec3::as_dvec3);
    let view = |(name, x, z): (&str, f32, f32)| {
        let point = vec3(x, 0.0, z);
        let hidden = polygon(point.as_dvec3(), DVec3::Y, &corners) / PI;
        View::new(name, point, NEAR, DVec3::splat(1.0 - hidden))
    };
    let views = [("below", 0.6, 0.1), ("beside", -0.5, 0.3)]
        .map(view)
        .into();
    Ok((mesh.done(Vec::new()), views))
}

//! A floor below lights without triangles: points, spots, light from far away, a measured luminaire, spheres, a map.

use super::closed::{map_irradiance, map_radiance, over_hemisphere, sphere};
use super::lamps::{NEAR, on_floor, path, reflected};
use super::{KnownImage, View};
use crate::trial_scenes::Trial;
use glam::{DVec3, Mat3, Quat, Vec3, vec3};
use raystone_scene::{Daylight, EnvironmentMap, IesProfile, Light, SceneError};
use std::sync::Arc;

/// All of them.
pub(super) fn images() -> Result<Vec<KnownImage>, SceneError> {
    let mut all = vec![points()?.turned(), far_and_measured()?.turned()];
    for (name, names) in [
        ("sphere lights", &[("lights", "all")][..]),
        ("sphere lights, by the light", &[("strategy", "light")]),
        ("sphere lights, by the material", &[("strategy", "bsdf")]),
    ] {
        all.push(spheres(name, path(1, names))?.turned());
    }
    for (name, strategy) in [("map", "mis-balance"), ("map, by the light", "light")] {
        all.push(map(name, path(1, &[("strategy", strategy)]))?);
    }
    all.push(sky()?);
    Ok(all)
}

/// The sky over scenes without a light: its radiance as `docs/shading.md` has it.
fn sky() -> Result<KnownImage, SceneError> {
    let [up, key] = [vec3(0.1, 1.0, -0.2), vec3(-0.4, 0.7, 0.5)].map(Vec3::normalize);
    let scale = vec3(1.5, 1.0, 0.5);
    let mut scene = on_floor("sky", scale)?.done(Vec::new());
    scene.daylight = Some(Daylight {
        up,
        key,
        reach: f32::MAX,
    });
    let radiance = |d: DVec3| {
        let t = ((d.dot(up.as_dvec3()) + 0.6) / 1.4).clamp(0.0, 1.0);
        let grey = 0.12 + 0.38 * t * t * (3.0 - 2.0 * t);
        let bright = 10.0 * d.dot(key.as_dvec3()).max(0.0).powi(16);
        scale.as_dvec3() * (DVec3::splat(grey) + bright * DVec3::new(1.0, 0.96, 0.9))
    };
    // Directions above z = 0 stand for those above y = 0.
    let floor = over_hemisphere(300, |d| d.z * radiance(DVec3::new(d.y, d.z, d.x)));
    let [ahead, behind] = [vec3(-0.3, 0.8, 0.5), vec3(0.6, 0.1, -0.8)].map(Vec3::normalize);
    let seen = |name, d: Vec3| View::new(name, Vec3::Y + d, -d, radiance(d.as_dvec3()));
    Ok(KnownImage {
        name: "sky",
        scene,
        trial: path(1, &[]),
        views: vec![
            View::new("floor", Vec3::ZERO, NEAR, reflected(floor)),
            seen("ahead", ahead),
            seen("behind", behind),
        ],
    })
}

fn image(
    name: &'static str,
    lights: Vec<Light>,
    trial: Trial,
    views: Vec<View>,
) -> Result<KnownImage, SceneError> {
    let mut scene = on_floor(name, Vec3::ZERO)?.done(Vec::new());
    scene.lights = lights;
    Ok(KnownImage {
        name,
        scene,
        trial,
        views,
    })
}

/// From a place to a point of the floor: the distance, the cosine there, and that to this axis of a light.
fn towards(place: Vec3, point: Vec3, axis: Vec3) -> [f64; 3] {
    let way = (point - place).as_dvec3();
    let direction = way.normalize();
    let axis = axis.as_dvec3().normalize();
    [way.length(), -direction.y, direction.dot(axis)]
}

/// A point in red, a spot in green, and one without decay in blue.
fn points() -> Result<KnownImage, SceneError> {
    const POINT: Vec3 = vec3(0.3, 1.5, -0.2);
    const SPOTS: [[Vec3; 2]; 2] = [
        [vec3(-0.5, 2.0, 0.4), vec3(0.2, -1.0, -0.1)],
        [vec3(0.6, 1.8, 0.5), vec3(-0.3, -1.0, -0.4)],
    ];
    const CONE: [f32; 2] = [0.2, 0.5];
    let spot = |k: usize, intensity, decay| Light::Spot {
        position: SPOTS[k][0],
        direction: SPOTS[k][1],
        intensity,
        inner: CONE[0],
        outer: CONE[1],
        decay,
    };
    let lights = vec![
        Light::Point {
            position: POINT,
            intensity: vec3(6.0, 0.0, 0.0),
        },
        spot(0, vec3(0.0, 20.0, 0.0), true),
        spot(1, vec3(0.0, 0.0, 3.0), false),
    ];
    let irradiance = |point: Vec3| {
        let [d, cos, _] = towards(POINT, point, Vec3::Y);
        let red = 6.0 * cos / (d * d);
        let [green, blue] = [0, 1].map(|k| {
            let [d, cos, on_axis] = towards(SPOTS[k][0], point, SPOTS[k][1]);
            let [inner, outer] = CONE.map(|angle| f64::from(angle).cos());
            let step = ((on_axis - outer) / (inner - outer)).clamp(0.0, 1.0);
            let decay = if k == 0 { 20.0 / (d * d) } else { 3.0 };
            decay * cos * step * step
        });
        DVec3::new(red, green, blue)
    };
    let view = |(name, x, z): (&str, f32, f32)| {
        let point = vec3(x, 0.0, z);
        View::new(name, point, NEAR, reflected(irradiance(point)))
    };
    let places = [
        ("below", 0.0, 0.2),
        ("in both half-shadows", -0.5, -0.35),
        ("far off", 3.0, 2.0),
    ];
    let views = places.map(view).into();
    image(
        "points and spots",
        lights,
        path(1, &[("lights", "all")]),
        views,
    )
}

/// Candela by vertical and horizontal angle of a luminaire without symmetries.
const LUMINAIRE: &str = "TILT=NONE\n1 -1 2 4 5 1 2 0 0 0\n0.5 1 0\n0 30 50 80\n0 70 180 270 360\n\
                         90 60 40 10\n90 80 20 30\n90 50 70 5\n90 40 10 60\n90 60 40 10\n";

/// Light from far away in red, a luminaire in green.
fn far_and_measured() -> Result<KnownImage, SceneError> {
    const WAY: Vec3 = vec3(0.4, -1.0, -0.7);
    const HEIGHT: f32 = 1.6;
    let profile = IesProfile::parse("luminaire", LUMINAIRE)
        .map_err(|e| SceneError::malformed(std::path::Path::new("luminaire"), "", e.to_string()))?;
    // Its nadir points down, its horizontal angle begins at +x and grows towards +z.
    let axes = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y);
    let lights = vec![
        Light::Directional {
            direction: WAY,
            irradiance: vec3(4.0, 0.0, 0.5),
        },
        Light::Ies {
            position: HEIGHT * Vec3::Y,
            rotation: Quat::from_mat3(&axes).normalize(),
            color: vec3(0.0, 1.0, 0.0),
            profile: Arc::new(profile),
        },
    ];
    let facing = -WAY.as_dvec3().normalize().y;
    // Vertical and horizontal angle, and the candela of the file there, before its two multipliers.
    let places = [
        ("below the luminaire", 0.0_f64, 0.0_f64, 90.0),
        ("at a measured angle", 30.0, 70.0, 80.0),
        ("between vertical angles", 40.0, 270.0, 25.0),
        ("between horizontal angles", 50.0, 125.0, 45.0),
    ];
    let view = |(name, vertical, horizontal, candela): (&str, f64, f64, f64)| {
        let [v, h] = [vertical, horizontal].map(f64::to_radians);
        let off = f64::from(HEIGHT) * v.tan();
        let point = DVec3::new(off * h.cos(), 0.0, off * h.sin()).as_vec3();
        let distance = f64::from(HEIGHT) / v.cos();
        let green = 0.5 * 2.0 * candela * v.cos() / (distance * distance);
        let irradiance = DVec3::new(4.0 * facing, green, 0.5 * facing);
        View::new(name, point, NEAR, reflected(irradiance))
    };
    let views = places.map(view).into();
    let trial = path(1, &[("lights", "all")]);
    image("far and measured lights", lights, trial, views)
}

/// Two spheres, one large and near, one small and bright.
fn spheres(name: &'static str, trial: Trial) -> Result<KnownImage, SceneError> {
    let is_by_material = name.ends_with("material");
    let mut balls = vec![(vec3(0.2, 1.1, -0.3), 0.9_f32, vec3(1.0, 2.0, 3.0))];
    if !is_by_material {
        balls.push((vec3(-1.5, 0.6, 1.2), 0.02, vec3(9e3, 4e3, 1e3)));
    }
    let lights = balls
        .iter()
        .map(|(center, radius, radiance)| Light::Sphere {
            center: *center,
            radius: *radius,
            radiance: *radiance,
        });
    let at = |point: Vec3| {
        let one = |(center, radius, radiance): &(Vec3, f32, Vec3)| {
            let offset = (*center - point).as_dvec3();
            sphere(offset, DVec3::Y, (*radius).into()) * radiance.as_dvec3()
        };
        reflected(balls.iter().map(one).sum())
    };
    let mut views: Vec<View> = [("below", Vec3::ZERO), ("beside", vec3(-1.4, 0.0, 0.4))]
        .map(|(name, point)| View::new(name, point, NEAR, at(point)))
        .into();
    let (center, radius, radiance) = balls[0];
    let front = center + radius * Vec3::Z;
    views.push(View::new("seen", front, 0.4 * Vec3::Z, radiance.as_dvec3()));
    image(name, lights.collect(), trial, views)
}

/// A map that is brighter towards one side and the horizon, turned.
fn map(name: &'static str, trial: Trial) -> Result<KnownImage, SceneError> {
    const TURN: f32 = 0.4;
    let texel = |k: u32| {
        let (x, y) = ((k % 12) as f32, (k / 12) as f32);
        let sun = if (x, y) == (3.0, 1.0) { 4.0 } else { 0.0 };
        vec3(0.2 + 0.1 * x, 0.3 + 0.3 * y + sun, 1.5 - 0.1 * x)
    };
    let texels = (0..72).map(texel).collect();
    let map = EnvironmentMap::new("map", [12, 6], texels, &mut Vec::new());
    let map = map.map_err(|e| SceneError::malformed(std::path::Path::new("map"), "", e))?;
    let turn = f64::from(TURN);
    let floor = reflected(map_irradiance(&map, turn));
    let mut views = vec![View::new("floor", Vec3::ZERO, NEAR, floor)];
    for (polar, azimuth) in [(0.3_f64, 0.2_f64), (1.1, 2.0), (1.4, 4.4)] {
        let (sin, cos) = polar.sin_cos();
        let direction = DVec3::new(azimuth.sin() * sin, cos, -azimuth.cos() * sin).as_vec3();
        let seen = map_radiance(&map, turn, polar, azimuth);
        let eye = Vec3::Y;
        views.push(View::new("sky", eye + direction, -direction, seen));
    }
    let lights = vec![Light::Environment {
        map: Arc::new(map),
        scale: 1.0,
        turn: TURN,
    }];
    image(name, lights, trial, views)
}

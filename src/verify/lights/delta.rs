//! Delta lights: points, spots and directional lights, and their shared code with luminaires.

use super::ies::candela;
use super::{LightChecks, LightTwin};
use crate::known_images::lamps::{NEAR, path, reflected};
use crate::known_images::lights::image;
use crate::known_images::{KnownImage, View};
use crate::mitsuba::{Export, ExportError, vector};
use crate::path_oracle::{LightSample, Rounding};
use glam::{DVec3, Vec2, Vec3, vec3};
use raystone_image::Image;
use raystone_scene::{LIGHT_KINDS, Light, SceneError};
use std::fmt::Write as _;

pub(super) static POINTS: LightChecks = LightChecks {
    points: || {
        vec![Light::Point {
            position: vec3(-1.5, 1.2, 0.8),
            intensity: vec3(1.0, 0.3, 0.2),
        }]
    },
    ..LightChecks::new(LIGHT_KINDS[3], LightTwin::Alone(sample), mitsuba)
};

pub(super) static SPOTS: LightChecks = LightChecks {
    points: spots,
    images,
    ..LightChecks::new(LIGHT_KINDS[4], LightTwin::Alone(sample), spot_in_mitsuba)
};

pub(super) static DIRECTIONAL: LightChecks = LightChecks {
    points: || {
        vec![Light::Directional {
            direction: vec3(0.4, -1.0, -0.7),
            irradiance: vec3(0.2, 0.3, 0.6),
        }]
    },
    ..LightChecks::new(LIGHT_KINDS[6], LightTwin::Alone(sample), mitsuba)
};

fn spots() -> Vec<Light> {
    let spot = |x: f32, inner, decay| Light::Spot {
        position: vec3(x, 2.5, 1.0),
        direction: vec3(-0.5 * x, -1.6, -0.6),
        intensity: vec3(2.0, 3.0, 2.5),
        inner,
        outer: 0.6,
        decay,
    };
    // The last is nearly sharp: its cosines differ by 0.008.
    vec![
        spot(0.8, 0.25, true),
        spot(-0.9, 0.25, false),
        spot(0.1, 0.585, true),
    ]
}

/// Distance of lights at infinity.
pub(super) const FAR: f64 = 1e30;

/// A sample of one of these lights or of a luminaire.
pub(super) fn sample(
    light: &Light,
    from: DVec3,
    _: [f64; 2],
    rounding: &mut Rounding,
) -> Option<LightSample> {
    let towards = |place: Vec3| {
        let to_light = place.as_dvec3() - from;
        (to_light.normalize(), to_light.length())
    };
    let (direction, distance, radiance) = match light {
        Light::Point {
            position,
            intensity,
        } => {
            let (direction, distance) = towards(*position);
            (
                direction,
                distance,
                intensity.as_dvec3() / (distance * distance),
            )
        }
        Light::Spot {
            position,
            direction: axis,
            intensity,
            inner,
            outer,
            decay,
        } => {
            let (direction, distance) = towards(*position);
            let [inner, outer] = [inner, outer].map(|angle| f64::from(*angle).cos());
            let cos = -direction.dot(axis.as_dvec3().normalize());
            let step = ((cos - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
            let falloff = if *decay { distance * distance } else { 1.0 };
            (
                direction,
                distance,
                intensity.as_dvec3() * (step * step / falloff),
            )
        }
        Light::Ies {
            position,
            rotation,
            color,
            profile,
        } => {
            let (direction, distance) = towards(*position);
            let candela = candela(profile, *rotation, -direction, rounding);
            let falloff = distance * distance;
            (direction, distance, color.as_dvec3() * (candela / falloff))
        }
        Light::Directional {
            direction,
            irradiance,
        } => (
            -direction.as_dvec3().normalize(),
            FAR,
            irradiance.as_dvec3(),
        ),
        _ => return None,
    };
    (radiance.max_element() > 0.0).then_some(LightSample {
        direction,
        distance,
        radiance,
        density: None,
        triangles: None,
    })
}

fn mitsuba(export: &mut Export<'_>, _: usize, light: &Light) -> Result<(), ExportError> {
    let (kind, element, place, unit) = match light {
        Light::Directional { direction, .. } => (
            "directional",
            "vector name=\"direction\"",
            direction,
            "irradiance",
        ),
        Light::Point { position, .. } => {
            ("point", "point name=\"position\"", position, "intensity")
        }
        _ => return Ok(()),
    };
    let _ = write!(
        export.xml,
        r#"    <emitter type="{kind}">
        <{element} value="{}"/>
        <rgb name="{unit}" value="{}"/>
    </emitter>
"#,
        vector(*place),
        vector(light.color())
    );
    Ok(())
}

/// Size of a spot's projected texture; the falloff from centre to edge spans this many texels.
const SPOT_EDGE: u32 = 512;

/// Mitsuba's spots fade linearly in the angle: a sharp-edged one projects our falloff.
fn spot_in_mitsuba(
    export: &mut Export<'_>,
    number: usize,
    light: &Light,
) -> Result<(), ExportError> {
    let &Light::Spot {
        position,
        direction,
        inner,
        outer,
        decay,
        ..
    } = light
    else {
        return Ok(());
    };
    let refused = |reason| Err(ExportError::light(number, light, reason));
    if !decay {
        return refused("all of Mitsuba's spots fall off with the distance");
    }
    if outer >= 1.5 {
        return refused("a cone of 86 degrees or more throws no picture on a plane");
    }
    let colour = vector(light.color());
    let name = format!("textures/spot-{number}.exr");
    let [bright, dark] = [inner.cos(), outer.cos()];
    let shown = |at: u32| {
        let [x, y] = [at % SPOT_EDGE, at / SPOT_EDGE];
        let place = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) * (2.0 / SPOT_EDGE as f32) - 1.0;
        let cosine = 1.0 / (1.0 + (place * outer.tan()).length_squared()).sqrt();
        let step = ((cosine - dark) / (bright - dark).max(1e-4)).clamp(0.0, 1.0);
        [step * step; 3]
    };
    let texels = (0..SPOT_EDGE * SPOT_EDGE).map(shown).collect();
    export.write_radiance(&name, &Image::new(SPOT_EDGE, SPOT_EDGE, texels)?)?;
    let degrees = outer.to_degrees();
    let _ = write!(
        export.xml,
        r#"    <emitter type="spot">
        <transform name="to_world">
            <lookat origin="{}" target="{}" up="{}"/>
        </transform>
        <float name="cutoff_angle" value="{degrees}"/>
        <float name="beam_width" value="{degrees}"/>
        <rgb name="intensity" value="{colour}"/>
        <texture name="texture" type="bitmap">
            <string name="filename" value="{name}"/>
            <boolean name="raw" value="true"/>
            <string name="wrap_mode" value="clamp"/>
        </texture>
    </emitter>
"#,
        vector(position),
        vector(position + direction.normalize()),
        vector(direction.normalize().any_orthonormal_vector())
    );
    Ok(())
}

/// Distance from a position to a floor point, and the cosines at the floor and to the axis.
fn seen_from(place: Vec3, point: Vec3, axis: Vec3) -> [f64; 3] {
    let way = (point - place).as_dvec3();
    let direction = way.normalize();
    let axis = axis.as_dvec3().normalize();
    [way.length(), -direction.y, direction.dot(axis)]
}

/// A point light in red, a spot in green, and one without decay in blue.
fn images() -> Result<Vec<KnownImage>, SceneError> {
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
        let [d, cos, _] = seen_from(POINT, point, Vec3::Y);
        let red = 6.0 * cos / (d * d);
        let [green, blue] = [0, 1].map(|k| {
            let [d, cos, on_axis] = seen_from(SPOTS[k][0], point, SPOTS[k][1]);
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
    let trial = path(1, &[("lights", "all")]);
    Ok(vec![image("points and spots", lights, trial, views)?])
}

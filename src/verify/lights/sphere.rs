//! Spheres: uniform over the solid angle of the visible cap, or over the area from inside.

use super::{LightChecks, LightTwin};
use crate::known_images::lamps::{NEAR, path, reflected};
use crate::known_images::lights::image;
use crate::known_images::{KnownImage, View, closed};
use crate::mitsuba::{Export, ExportError, vector};
use crate::path_oracle::hits::Segment;
use crate::path_oracle::{LightSample, around};
use crate::trial_scenes::Trial;
use glam::{DVec3, Vec3, vec3};
use raystone_scene::{LIGHT_KINDS, Light, SceneError};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

pub(super) static CHECKS: LightChecks = LightChecks {
    points,
    images,
    ..LightChecks::new(
        LIGHT_KINDS[2],
        LightTwin::Alone(|light, from, point, _| Ball::of(light)?.sample(from, point)),
        mitsuba,
    )
};

fn points() -> Vec<Light> {
    let ball = |center, radius, power: f32| Light::Sphere {
        center,
        radius,
        radiance: power * vec3(1.0, 0.8, 0.5),
    };
    vec![
        ball(vec3(0.9, 1.6, 0.3), 0.25, 6.0),
        ball(vec3(-0.9, 0.05, 0.9), 0.04, 300.0),
    ]
}

fn mitsuba(export: &mut Export<'_>, number: usize, light: &Light) -> Result<(), ExportError> {
    let Light::Sphere { center, radius, .. } = light else {
        return Ok(());
    };
    let inside = |v: &Vec3| v.distance(*center) < *radius;
    let mut corners = export.scene.triangles.iter().flat_map(|t| &t.vertices);
    if corners.any(inside) {
        let reason = "something is inside, where Mitsuba's spheres do not shine";
        return Err(ExportError::light(number, light, reason));
    }
    let _ = write!(
        export.xml,
        r#"    <shape type="sphere">
        <point name="center" value="{}"/>
        <float name="radius" value="{radius}"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="{}"/></emitter>
    </shape>
"#,
        vector(*center),
        vector(light.color())
    );
    Ok(())
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball {
    centre: DVec3,
    radius: f64,
    pub radiance: DVec3,
}

impl Ball {
    pub(crate) fn of(light: &Light) -> Option<Self> {
        let Light::Sphere {
            center,
            radius,
            radiance,
        } = light
        else {
            return None;
        };
        Some(Self {
            centre: center.as_dvec3(),
            radius: f64::from(*radius),
            radiance: radiance.as_dvec3(),
        })
    }

    /// 1 - cos of the half angle it subtends; `None` from inside.
    fn cap(&self, from: DVec3) -> Option<f64> {
        let sin_2 = self.radius * self.radius / from.distance_squared(self.centre);
        (sin_2 < 1.0).then(|| sin_2 / (1.0 + (1.0 - sin_2).sqrt()))
    }

    /// Distance of the first intersection with a ray.
    pub(crate) fn meet(&self, ray: &Segment) -> Option<f64> {
        let to_centre = self.centre - ray.origin;
        let along = to_centre.dot(ray.direction);
        let across = to_centre - along * ray.direction;
        let half_2 = self.radius * self.radius - across.length_squared();
        if half_2 < 0.0 {
            return None;
        }
        let half = half_2.sqrt();
        [along - half, along + half].into_iter().find(|d| *d > 0.0)
    }

    pub(crate) fn sample(&self, from: DVec3, [u, v]: [f64; 2]) -> Option<LightSample> {
        let direction = match self.cap(from) {
            Some(cap) => {
                let below = u * cap;
                let ring = (below * (2.0 - below)).max(0.0).sqrt();
                let (sin, cos) = (TAU * v).sin_cos();
                let axis = (self.centre - from).normalize();
                around(axis, DVec3::new(ring * cos, ring * sin, 1.0 - below))
            }
            None => {
                let z = 1.0 - 2.0 * u;
                let ring = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (TAU * v).sin_cos();
                let point = self.centre + self.radius * DVec3::new(ring * cos, ring * sin, z);
                (point - from).normalize()
            }
        };
        // A direction that just misses is treated as one along the edge.
        let edge = (self.centre - from).dot(direction).max(0.0);
        let distance = self
            .meet(&Segment::endless(from, direction, None))
            .unwrap_or(edge);
        Some(LightSample {
            direction,
            distance,
            radiance: self.radiance,
            density: Some(self.density(from, direction)),
            triangles: None,
        })
    }

    /// Cosine of a direction to the normal at a point of the sphere.
    pub(crate) fn cosine(&self, point: DVec3, direction: DVec3) -> f64 {
        (point - self.centre).dot(direction).abs() / self.radius
    }

    /// Density with which [`Ball::sample`] finds this direction.
    pub(crate) fn density(&self, from: DVec3, direction: DVec3) -> f64 {
        if let Some(cap) = self.cap(from) {
            return 1.0 / (TAU * cap);
        }
        let ray = Segment::endless(from, direction, None);
        let distance = self.meet(&ray).unwrap_or_default();
        let normal = (from + distance * direction - self.centre) / self.radius;
        distance * distance / (4.0 * PI * self.radius * self.radius * normal.dot(direction))
    }
}

fn images() -> Result<Vec<KnownImage>, SceneError> {
    [
        ("sphere lights", &[("lights", "all")][..]),
        ("sphere lights, by the light", &[("strategy", "light")]),
        ("sphere lights, by the material", &[("strategy", "bsdf")]),
    ]
    .map(|(name, names)| shown(name, path(1, names)))
    .into_iter()
    .collect()
}

/// Two spheres, one large and near, one small and bright.
fn shown(name: &'static str, trial: Trial) -> Result<KnownImage, SceneError> {
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
            closed::sphere(offset, DVec3::Y, (*radius).into()) * radiance.as_dvec3()
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

//! A floor below triangle lights: unequal, small, grazing, occluded, one-sided and two-sided.

use super::closed::polygon;
use super::{KnownImage, View};
use crate::mesh::Mesh;
use glam::{DVec3, Vec2, Vec3, vec3};
use raystone_core::geometry::Triangle;
use raystone_core::params::ParamValue;
use raystone_scene::{Material, SceneData, SceneError};
use std::f64::consts::PI;

/// Colour of the floor y = 0.
pub(crate) const FLOOR: Vec3 = vec3(0.6, 0.5, 0.4);
/// Offset of the camera from a floor point: so close that no lamp is in between.
pub(crate) const NEAR: Vec3 = vec3(0.02, 0.05, -0.04);

/// A rectangle that emits from the side from which `along`, `across` turn counter-clockwise.
#[derive(Clone, Copy)]
struct Lamp {
    corner: Vec3,
    along: Vec3,
    across: Vec3,
    radiance: Vec3,
}

impl Lamp {
    fn irradiance(&self, point: Vec3) -> DVec3 {
        let normal = self.along.cross(self.across);
        if normal.dot(point - self.corner) <= 0.0 {
            return DVec3::ZERO;
        }
        let [c, a, b] = [self.corner, self.along, self.across].map(Vec3::as_dvec3);
        let corners = [c, c + a, c + a + b, c + b];
        polygon(point.as_dvec3(), DVec3::Y, &corners) * self.radiance.as_dvec3()
    }

    fn build(&self, mesh: &mut Mesh) {
        let lamp = Material::diffuse("lamp", Vec3::ZERO).emitting_from_front(self.radiance);
        let lamp = mesh.material(lamp);
        mesh.plain([self.corner, self.along, self.across], lamp);
    }
}

/// Radiance of the floor with this irradiance.
pub(crate) fn reflected(irradiance: DVec3) -> DVec3 {
    FLOOR.as_dvec3() / PI * irradiance
}

pub(crate) fn on_floor(name: &str, sky: Vec3) -> Result<Mesh, SceneError> {
    on_floor_of(name, sky, 6.0)
}

/// The same with this half-width.
fn on_floor_of(name: &str, sky: Vec3, half: f32) -> Result<Mesh, SceneError> {
    let camera = raystone_core::geometry::Camera::upright(vec3(0.0, 2.0, 5.0), Vec3::ZERO, 45.0);
    let mut mesh = Mesh::new(name, camera, sky)?;
    let floor = mesh.material(Material::diffuse("floor", FLOOR));
    let corner = vec3(-half, 0.0, -half);
    mesh.plain([corner, 2.0 * half * Vec3::Z, 2.0 * half * Vec3::X], floor);
    Ok(mesh)
}

/// Parameters of `path`: maximum depth, and named options.
pub(crate) fn path(depth: i64, names: &[(&'static str, &str)]) -> super::Trial {
    let mut parameters = vec![("max_depth", ParamValue::Integer(depth))];
    let named = |(key, name): &(&'static str, &str)| (*key, ParamValue::Name((*name).to_owned()));
    parameters.extend(names.iter().map(named));
    ("path", parameters)
}

/// The floor is no wider than necessary: ray offsets scale with its size.
fn lit(name: &str, lamps: &[Lamp]) -> Result<SceneData, SceneError> {
    let mut mesh = on_floor_of(name, Vec3::ZERO, 1.0)?;
    lamps.iter().for_each(|lamp| lamp.build(&mut mesh));
    Ok(mesh.done(Vec::new()))
}

fn views(lamps: &[Lamp], points: &[Vec3]) -> Vec<View> {
    let view = |point: &Vec3| {
        let irradiance = lamps.iter().map(|lamp| lamp.irradiance(*point)).sum();
        let name = format!("at {} {}", point.x, point.z);
        View::new(&name, *point, NEAR, reflected(irradiance))
    };
    points.iter().map(view).collect()
}

pub(super) fn images() -> Result<Vec<KnownImage>, SceneError> {
    let mut all = Vec::new();
    let mut add = |name, lamps: &[Lamp], points: &[Vec3], trial| -> Result<(), SceneError> {
        let image = KnownImage {
            name,
            scene: lit(name, lamps)?,
            trial,
            views: views(lamps, points),
        };
        all.push(image.turned());
        Ok(())
    };
    let spots = [Vec3::ZERO, vec3(0.9, 0.0, -0.7)];
    for (name, names) in [
        ("unequal lamps", &[("light_choice", "power")][..]),
        (
            "unequal lamps, chosen evenly",
            &[("light_choice", "uniform")],
        ),
        ("unequal lamps, by a tree", &[("light_choice", "tree")]),
        ("unequal lamps, all", &[("lights", "all")]),
    ] {
        add(name, &UNEQUAL, &spots, path(1, names))?;
    }
    for (name, strategy) in [
        ("wide lamp", "mis-balance"),
        ("wide lamp, power heuristic", "mis-power"),
        ("wide lamp, by the material", "bsdf"),
        ("wide lamp, by the light", "light"),
    ] {
        add(name, &WIDE, &spots, path(1, &[("strategy", strategy)]))?;
    }
    add("ceiling", &CEILING, &spots, path(1, &[]))?;
    add("small lamp", &SMALL, &spots, path(1, &[]))?;
    let close = [Vec3::ZERO, vec3(0.05, 0.0, -0.03)];
    add(
        "grazing lamps",
        &GRAZING,
        &close,
        path(1, &[("lights", "all")]),
    )?;
    let tree = path(1, &[("light_choice", "tree")]);
    add("grazing lamps, by a tree", &GRAZING, &close, tree)?;
    all.push(triangles()?.turned());
    all.push(facets()?.turned());
    all.push(occluded()?.turned());
    all.push(sides()?.turned());
    Ok(all)
}

/// A small faceted ball near the origin and far from the surface it lights: the error of its own
/// points is small compared with that of incoming rays, so it easily shadows itself.
fn facets() -> Result<KnownImage, SceneError> {
    let radiance = vec3(2e4, 3e4, 1e4);
    let mut mesh = on_floor_of("ball of facets", Vec3::ZERO, 6.0)?;
    let lamp = Material::diffuse("lamp", Vec3::ZERO).emitting_from_front(radiance);
    let lamp = mesh.material(lamp);
    let first = mesh.scene.triangles.len();
    mesh.ball(vec3(0.0, 0.4, 0.0), 0.03, lamp);
    let scene = mesh.done(Vec::new());
    let irradiance = |point: Vec3| -> DVec3 {
        let facets = scene.triangles[first..].iter();
        let seen = facets.filter(|facet| {
            let [a, b, c] = facet.vertices;
            (b - a).cross(c - a).dot(point - a) > 0.0
        });
        let part = |facet: &Triangle| {
            let corners = facet.vertices.map(Vec3::as_dvec3);
            polygon(point.as_dvec3(), DVec3::Y, &corners)
        };
        seen.map(part).sum::<f64>() * radiance.as_dvec3()
    };
    let views = [vec3(0.1, 0.0, 5.5), vec3(-4.2, 0.0, 3.6)].map(|point| {
        let name = format!("at {} {}", point.x, point.z);
        View::new(&name, point, NEAR, reflected(irradiance(point)))
    });
    Ok(KnownImage {
        name: "ball of facets",
        views: Vec::from(views),
        scene,
        trial: path(1, &[("lights", "all")]),
    })
}

/// One is 60 times as powerful as the other, in other colours.
const UNEQUAL: [Lamp; 2] = [
    Lamp {
        corner: vec3(-1.0, 1.2, -0.4),
        along: vec3(0.2, 0.0, 0.0),
        across: vec3(0.0, 0.0, 0.2),
        radiance: vec3(1000.0, 100.0, 10.0),
    },
    Lamp {
        corner: vec3(0.3, 1.6, -0.5),
        along: vec3(1.0, 0.0, 0.0),
        across: vec3(0.0, 0.0, 1.0),
        radiance: vec3(0.05, 0.2, 0.4),
    },
];

/// Covers a large part of the hemisphere.
const WIDE: [Lamp; 1] = [Lamp {
    corner: vec3(-1.3, 0.9, -1.2),
    along: vec3(2.5, 0.0, 0.0),
    across: vec3(0.0, 0.0, 2.1),
    radiance: vec3(2.0, 3.0, 4.0),
}];

/// Overhead: nearly all of its light is found by material sampling.
const CEILING: [Lamp; 1] = [Lamp {
    corner: vec3(-11.0, 0.5, -9.0),
    along: vec3(20.0, 0.0, 0.0),
    across: vec3(0.0, 0.0, 19.0),
    radiance: vec3(1.0, 0.8, 0.6),
}];

/// One centimetre wide.
const SMALL: [Lamp; 1] = [Lamp {
    corner: vec3(0.4, 2.0, 0.3),
    along: vec3(0.01, 0.0, 0.0),
    across: vec3(0.0, 0.0, 0.01),
    radiance: vec3(8e4, 5e4, 9e4),
}];

/// Red light grazes the floor, green grazes floor and lamp, blue grazes the lamp.
const GRAZING: [Lamp; 3] = [
    Lamp {
        corner: vec3(4.0, 0.02, -0.5),
        along: vec3(0.0, 0.0, 1.0),
        across: vec3(0.0, 0.08, 0.0),
        radiance: vec3(3e4, 0.0, 0.0),
    },
    Lamp {
        corner: vec3(-3.0, 0.05, -0.5),
        along: vec3(1.0, 0.0, 0.0),
        across: vec3(0.0, 0.0, 1.0),
        radiance: vec3(0.0, 3e4, 0.0),
    },
    Lamp {
        corner: vec3(0.5, 0.2, 0.02),
        along: vec3(0.0, 0.8, 0.0),
        across: vec3(1.0, 0.0, 0.0),
        radiance: vec3(0.0, 0.0, 400.0),
    },
];

/// Two triangles that do not form a rectangle, of unequal power.
fn triangles() -> Result<KnownImage, SceneError> {
    let lamps = [
        (
            [
                vec3(-0.9, 0.8, -0.6),
                vec3(0.4, 1.1, -0.7),
                vec3(0.1, 0.9, 0.8),
            ],
            vec3(2.0, 3.0, 1.0),
        ),
        (
            [
                vec3(0.8, 0.7, 0.2),
                vec3(1.2, 0.9, 0.1),
                vec3(1.0, 0.8, 0.5),
            ],
            vec3(9.0, 1.0, 4.0),
        ),
    ];
    let mut mesh = on_floor_of("triangles", Vec3::ZERO, 1.0)?;
    for (corners, radiance) in lamps {
        let lamp =
            mesh.material(Material::diffuse("lamp", Vec3::ZERO).emitting_from_front(radiance));
        mesh.triangle(corners, [Vec2::ZERO; 3], lamp);
    }
    let view = |point: Vec3| {
        let one = |(corners, radiance): ([Vec3; 3], Vec3)| {
            let corners = corners.map(Vec3::as_dvec3);
            polygon(point.as_dvec3(), DVec3::Y, &corners) * radiance.as_dvec3()
        };
        let irradiance = lamps.into_iter().map(one).sum();
        View::new(
            &format!("at {} {}", point.x, point.z),
            point,
            NEAR,
            reflected(irradiance),
        )
    };
    let views = vec![view(Vec3::ZERO), view(vec3(0.6, 0.0, 0.3))];
    Ok(KnownImage {
        name: "triangles",
        scene: mesh.done(Vec::new()),
        trial: path(1, &[]),
        views,
    })
}

const SHADED: Lamp = Lamp {
    corner: vec3(-0.5, 2.0, -0.5),
    along: vec3(1.0, 0.0, 0.0),
    across: vec3(0.0, 0.0, 1.0),
    radiance: vec3(4.0, 5.0, 6.0),
};

/// A lamp behind the edge of a plate half-way up, and a plate so close to the floor that a ray with
/// too large an offset starts above it.
fn occluded() -> Result<KnownImage, SceneError> {
    /// Edge of the plate, which extends from there towards +x.
    const EDGE: f32 = -0.1;
    /// Start of the low plate, and its height.
    const LOW: [f32; 2] = [-3.0, 5e-4];
    let mut mesh = on_floor("occluded lamp", Vec3::ZERO)?;
    SHADED.build(&mut mesh);
    let plate = mesh.material(Material::diffuse("plate", Vec3::splat(0.5)));
    mesh.plain([vec3(EDGE, 1.0, -2.0), 2.6 * Vec3::X, 4.0 * Vec3::Z], plate);
    mesh.plain([vec3(LOW[0], LOW[1], -0.5), 0.4 * Vec3::X, Vec3::Z], plate);
    let mut views = Vec::new();
    for (name, x) in [
        ("full", -0.8_f32),
        ("penumbra", -0.3),
        ("deep penumbra", 0.0),
        ("umbra", 0.4),
    ] {
        // Visible up to the projection of the plate's edge onto the lamp's plane.
        let end = (x + 2.0 * (EDGE - x)).clamp(-0.5, 0.5);
        let visible = Lamp {
            along: (end + 0.5) * Vec3::X,
            ..SHADED
        };
        let point = vec3(x, 0.0, 0.1);
        let irradiance = if end > -0.5 {
            visible.irradiance(point)
        } else {
            DVec3::ZERO
        };
        views.push(View::new(name, point, NEAR, reflected(irradiance)));
    }
    // The whole lamp is behind the low plate, at less than 60 degrees above the floor.
    let hidden = vec3(LOW[0] - 1e-4, 0.0, 0.0);
    let from = vec3(-0.05, 0.02, 0.01);
    views.push(View::new("below a low plate", hidden, from, DVec3::ZERO));
    let scene = mesh.done(Vec::new());
    Ok(KnownImage {
        name: "occluded lamp",
        scene,
        trial: path(1, &[]),
        views,
    })
}

/// A one-sided and a two-sided lamp, seen and emitting in front and behind.
fn sides() -> Result<KnownImage, SceneError> {
    let lamp = |z: f32, radiance| Lamp {
        corner: vec3(0.0, 0.2, z),
        along: 0.6 * Vec3::Y,
        across: 0.5 * Vec3::Z,
        radiance,
    };
    let one = lamp(0.1, vec3(6.0, 0.0, 2.0));
    let two = lamp(-0.6, vec3(0.0, 5.0, 3.0));
    let mut mesh = on_floor("sides of lamps", Vec3::ZERO)?;
    one.build(&mut mesh);
    let both = mesh.material(Material::diffuse("sheet", Vec3::ZERO).emitting(two.radiance));
    mesh.plain([two.corner, two.along, two.across], both);
    let back = Lamp {
        along: two.across,
        across: two.along,
        ..two
    };
    let lit = |x: f32| {
        let point = vec3(x, 0.0, 0.0);
        let irradiance = [one, two, back].map(|lamp| lamp.irradiance(point));
        (point, reflected(irradiance.into_iter().sum()))
    };
    let middle = |lamp: &Lamp| lamp.corner + 0.5 * (lamp.along + lamp.across);
    let (before, bright) = lit(0.5);
    let (behind, dim) = lit(-0.5);
    let seen = |name, lamp: &Lamp, x: f32, radiance: Vec3| {
        View::new(name, middle(lamp), vec3(x, 0.1, 0.05), radiance.as_dvec3())
    };
    let views = vec![
        View::new("floor before", before, NEAR, bright),
        View::new("floor behind", behind, NEAR, dim),
        seen("front of one", &one, 0.3, one.radiance),
        seen("back of one", &one, -0.3, Vec3::ZERO),
        seen("front of two", &two, 0.3, two.radiance),
        seen("back of two", &two, -0.3, two.radiance),
    ];
    let scene = mesh.done(Vec::new());
    Ok(KnownImage {
        name: "sides of lamps",
        scene,
        trial: path(1, &[]),
        views,
    })
}

//! Nodes against f64: what they hold, what they meet, and published values.

use super::enclosing::enclosing;
use super::node::{
    Bounding, FAR, LEAST_INFLATION, Node, empty_around, meets_ball, meets_box, node_of_ray, pair,
};
use super::primitives::{Primitive, Primitives};
use super::{Apex, Bound, Built, Options, Order, RayHierarchy, Union};
use crate::bounds::Bounds;
use crate::fixtures::lattice;
use crate::{BuiltAccel as _, Intersection, Structure as _};
use glam::{DVec3, Vec3};
use raystone_core::random::Pcg32 as Pcg;
use raystone_gpu::{Composition, KernelLibrary};

const BOUNDING: Bounding = Bounding {
    inflation: LEAST_INFLATION as f32,
    exact_apex: true,
};

fn direction(rng: &mut Pcg) -> Vec3 {
    rng.direction().as_vec3()
}

fn cap(axis: [f32; 3], angle: f64) -> Node {
    Node {
        cosine: angle.cos() as f32,
        sine: angle.sin() as f32,
        reach: FAR,
        ..empty_around([0.0; 3], axis)
    }
}

fn ball(x: f32, radius: f32) -> Node {
    Node {
        radius,
        ..cap([1.0, 0.0, 0.0], 0.1)
    }
    .at([x, 0.0, 0.0])
}

impl Node {
    fn at(self, centre: [f32; 3]) -> Self {
        Self { centre, ..self }
    }

    /// True if a ray belongs to the node, in f64.
    fn holds(&self, origin: Vec3, direction: Vec3) -> bool {
        let off = (origin.as_dvec3() - Vec3::from(self.centre).as_dvec3()).length();
        let (axis, v) = (Vec3::from(self.axis).as_dvec3(), direction.as_dvec3());
        off <= f64::from(self.radius)
            && (self.cosine == -1.0 || axis.angle_between(v) <= self.angle())
    }
}

/// Distance of a point from a ray, f64.
fn distance(origin: Vec3, direction: Vec3, point: DVec3) -> f64 {
    let w = point - origin.as_dvec3();
    let d = direction.as_dvec3().normalize();
    (w - d * w.dot(d).max(0.0)).length()
}

/// Rays that differ as much as `spread` says, from 0 to 1, at any scale and place.
fn bundle(rng: &mut Pcg, count: usize, spread: f32) -> Vec<(Vec3, Vec3)> {
    let scale = 10.0_f32.powf(8.0 * rng.uniform_f32() - 4.0);
    let place = 1000.0 * scale * rng.uniform_f32() * direction(rng);
    let main = direction(rng);
    let ray = |_| {
        let origin = place + scale * spread * rng.uniform_f32() * direction(rng);
        let turned = main + 4.0 * spread * rng.uniform_f32() * direction(rng);
        (
            origin,
            turned * 10.0_f32.powf(6.0 * rng.uniform_f32() - 3.0),
        )
    };
    (0..count).map(ray).collect()
}

fn leaves(rays: &[(Vec3, Vec3)]) -> Vec<Node> {
    let leaf = |(o, v): &(Vec3, Vec3)| node_of_ray(o.to_array(), v.to_array(), 1e30, &BOUNDING);
    rays.iter().map(leaf).collect()
}

#[test]
fn unions_are_those_of_the_published_examples() {
    let all = pair(&ball(0.0, 1.0), &ball(4.0, 0.5), &BOUNDING);
    assert!(
        (all.centre[0] - 1.75).abs() < 1e-6 && (all.radius - 2.75).abs() < 1e-4,
        "{all:?}"
    );
    let all = pair(
        &cap([1.0, 0.0, 0.0], 0.1),
        &cap([0.0, 1.0, 0.0], 0.2),
        &BOUNDING,
    );
    assert!((all.angle() - 0.935_398).abs() < 1e-5, "{all:?}");
    assert!((all.axis[0] - 0.670_882).abs() < 1e-6 && (all.axis[1] - 0.741_564).abs() < 1e-6);
    let inner = [0.1_f32.cos(), 0.1_f32.sin(), 0.0];
    let all = pair(&cap([1.0, 0.0, 0.0], 0.5), &cap(inner, 0.2), &BOUNDING);
    assert_eq!(all.axis, [1.0, 0.0, 0.0]);
    assert!((all.angle() - 0.5).abs() < 1e-5, "{all:?}");
}

#[test]
fn tests_are_those_of_the_published_examples() {
    let meets = |angle: f64, centre: [f32; 3], radius: f32| {
        meets_ball(&cap([1.0, 0.0, 0.0], angle), centre, radius, &BOUNDING)
    };
    assert!(meets(0.2, [3.0, 1.0, 0.0], 0.40) && !meets(0.2, [3.0, 1.0, 0.0], 0.38));
    // The printed test says the opposite of both.
    assert!(meets(2.0, [3.0, 1.0, 0.0], 0.5) && !meets(2.0, [-3.0, 1.0, 0.0], 0.5));
    // Behind the apex.
    assert!(!meets(0.2, [-3.0, 0.3, 0.0], 0.5));
}

#[test]
fn every_node_holds_its_rays_however_it_was_made() {
    let mut rng = Pcg::new(5);
    for round in 0..4000 {
        let spread = 10.0_f32.powf(-6.0 * rng.uniform_f32());
        let rays = bundle(&mut rng, 2 + round % 30, spread);
        for pairwise in [false, true] {
            let node = enclosing(&mut leaves(&rays), pairwise, &BOUNDING);
            for (origin, v) in &rays {
                assert!(
                    node.holds(*origin, *v),
                    "{round} {pairwise}: {node:?} {origin:?} {v:?}"
                );
            }
        }
    }
    // Without the inflation some do not.
    let bare = Bounding {
        inflation: 0.0,
        ..BOUNDING
    };
    let mut lost = 0;
    for _ in 0..400 {
        let rays = bundle(&mut rng, 16, 0.01);
        let leaf = |(o, v): &(Vec3, Vec3)| node_of_ray(o.to_array(), v.to_array(), 1e30, &bare);
        let mut nodes: Vec<Node> = rays.iter().map(leaf).collect();
        let node = enclosing(&mut nodes, false, &bare);
        lost += rays.iter().filter(|(o, v)| !node.holds(*o, *v)).count();
    }
    assert!(lost > 100, "{lost} rays lost without the inflation");
}

/// Roger 2008, equation 3.1, as printed.
fn printed(node: &Node, centre: Vec3, radius: f32) -> bool {
    let (w, axis) = (
        (centre - Vec3::from(node.centre)).as_dvec3(),
        Vec3::from(node.axis).as_dvec3(),
    );
    let along = w.dot(axis);
    let across = w.cross(axis).length();
    let angle = node.angle();
    along * angle.tan() + f64::from(radius + node.radius) / angle.cos() >= across
}

#[test]
fn no_test_loses_what_a_ray_of_the_node_meets() {
    let mut rng = Pcg::new(6);
    let linear = Bounding {
        exact_apex: false,
        ..BOUNDING
    };
    let (mut met, mut wide, mut lost_as_printed, mut refused) = (0, 0, 0, 0);
    for round in 0..6000 {
        let spread = if round % 2 == 0 {
            rng.uniform_f32()
        } else {
            10.0_f32.powf(-6.0 * rng.uniform_f32())
        };
        let rays = bundle(&mut rng, 2 + round % 6, spread);
        let node = enclosing(&mut leaves(&rays), round % 3 == 0, &BOUNDING);
        let size = 1e-3 + 0.3 * (rays[0].0 - rays[1].0).length();
        for _ in 0..8 {
            // Balls that one of the rays just touches, and others anywhere.
            let (o, v) = rays[rng.below(rays.len())];
            let radius = size * rng.uniform_f32();
            let aside = v.cross(direction(&mut rng)).normalize_or_zero();
            let far = size * 10.0_f32.powf(4.0 * rng.uniform_f32() - 1.0);
            let off = 1.1 * radius * rng.uniform_f32().sqrt();
            let centre = o + v.normalize() * far + aside * off;
            let is_met =
                |(o, v): &(Vec3, Vec3)| distance(*o, *v, centre.as_dvec3()) <= f64::from(radius);
            let found =
                [BOUNDING, linear].map(|b| meets_ball(&node, centre.to_array(), radius, &b));
            let corner = Vec3::splat(radius);
            // Rounded outwards.
            let low = (centre - corner).to_array().map(f32::next_down);
            let high = (centre + corner).to_array().map(f32::next_up);
            let boxed = meets_box(&node, low, high, &BOUNDING);
            if rays.iter().any(is_met) {
                met += 1;
                assert!(
                    found[0] && found[1] && boxed,
                    "{round}: {found:?} {boxed} {node:?}"
                );
                if node.angle() > std::f64::consts::FRAC_PI_2 {
                    wide += 1;
                    lost_as_printed += usize::from(!printed(&node, centre, radius));
                }
            }
            refused += usize::from(!found[0]);
        }
    }
    assert!(
        met > 5000 && wide > 200 && refused > 500,
        "{met} {wide} {refused}"
    );
    assert!(lost_as_printed * 2 > wide, "{lost_as_printed} of {wide}");
}

#[test]
fn a_primitive_reaches_to_the_farthest_corner_of_a_box() {
    let primitive = Primitive {
        centre: [1.0, 2.0, 3.0],
        radius: 7.0,
        low: [-1.0; 3],
        first: 0,
        high: [9.0; 3],
        end: 1,
    };
    // 2, 3 and 6 from the centre, whose squares sum to 7²; the nearer sides are 1, 0 and 5 off.
    for far in 0..8 {
        let mut bounds = Bounds {
            min: [0.0, 2.0, -2.0],
            max: [2.0, 2.0, 8.0],
        };
        for (axis, reach) in [2.0, 3.0, 6.0].into_iter().enumerate() {
            if far >> axis & 1 == 0 {
                bounds.min[axis] = primitive.centre[axis] - reach;
            } else {
                bounds.max[axis] = primitive.centre[axis] + reach;
            }
        }
        assert_eq!(primitive.farthest(&bounds), 7.0, "corner {far}");
    }
}

#[test]
fn a_node_ends_where_its_rays_end() {
    let node = node_of_ray([0.0; 3], [0.0, 0.0, 2.0], 3.0, &BOUNDING);
    let meets = |z: f32| meets_ball(&node, [0.0, 0.0, z], 1.0, &BOUNDING);
    assert!(meets(7.0) && !meets(7.01) && !meets(-1.01));
    let meets = |z: f32| meets_box(&node, [-1.0, -1.0, z], [1.0, 1.0, z], &BOUNDING);
    assert!(meets(6.0) && !meets(6.01) && !meets(-0.01));
}

/// Every pass with every feature that a parameter chooses, without a device.
#[test]
fn every_pass_is_a_valid_kernel() {
    const COUNTED: [&str; 3] = ["keys", "gather", "answers"];
    let library = KernelLibrary::default();
    let plain = Options::default();
    let sets = [
        plain.clone(),
        Options {
            bundle: 3,
            cluster: 5,
            bound: Bound::Both,
            ..plain.clone()
        },
        Options {
            bound: Bound::Box,
            union: Union::Pairwise,
            branching: 64,
            ..plain.clone()
        },
        Options {
            order: Order::Hash,
            chunks: 2,
            apex: Apex::Linear,
            ..plain.clone()
        },
        Options {
            order: Order::Morton,
            fused: false,
            reach: false,
            dual: 2,
            ..plain
        },
    ];
    for options in sets {
        let built = Built {
            primitives: Primitives::new(&lattice(1), &options),
            bounds: lattice(1).bounds(),
            options,
        };
        let passes = RayHierarchy::kernels();
        for pass in passes
            .iter()
            .filter(|name| name.contains("/passes/") && !name.ends_with("/store"))
        {
            let is = |name: &str| pass.ends_with(&format!("/{name}"));
            let counted = COUNTED.into_iter().any(is);
            let kernel = Composition::new(pass)
                .constant("CHILDREN", 4)
                .feature("builds_tree", is("gather") || is("leaves") || is("unions"));
            let kernel = built
                .buffers()
                .activate(Intersection::default().activate(kernel));
            for feature in [
                "any",
                "counted",
                "alpha_masks",
                "texels",
                "compacted",
                "dual",
            ] {
                let on = match feature {
                    "counted" => counted,
                    "compacted" => is("plan"),
                    "dual" => is("expand"),
                    _ => true,
                };
                let kernel = kernel.clone().feature(feature, on);
                library
                    .compose(&kernel)
                    .unwrap_or_else(|e| panic!("{pass}, {feature}: {e}"));
            }
        }
    }
}

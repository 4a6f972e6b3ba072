//! Instances under transforms that nearly flatten space.

use super::super::case::Maker;
use super::super::placement::Placement;
use super::super::shapes::{RADIUS, sphere};
use super::directions::from_the_middle;
use glam::{DMat3, DQuat, DVec3, Vec3};
use raystone_accel::Ray;
use raystone_core::random::Pcg32;
use raystone_scene::{Assembly, Transform};

/// Instances in a scene.
const COPIES: usize = 12;

fn rotation(random: &mut Pcg32) -> DMat3 {
    let turn = std::f64::consts::TAU * random.uniform();
    DMat3::from_quat(DQuat::from_axis_angle(random.direction(), turn))
}

/// Returns spheres, squeezed along a random direction to `thickness`, about the origin.
fn squeezed(random: &mut Pcg32, thickness: f64, spread: f64) -> Option<Assembly> {
    let mut assembly = Assembly::default();
    let object = assembly.add_object(sphere(8, &Placement::ORDINARY)).ok()?;
    for copy in 0..COPIES {
        let mirrored = if copy % 2 == 0 { 1.0 } else { -1.0 };
        let squeeze = DMat3::from_diagonal(DVec3::new(mirrored, 1.0, thickness));
        let linear = rotation(random) * squeeze * rotation(random);
        let columns = [0, 1, 2].map(|k| linear.col(k).as_vec3());
        let translation = (spread * random.in_cube()).as_vec3();
        // Transforms beyond the limit on condition numbers are left out.
        let _ = assembly.place(object, Transform::new(columns, translation));
    }
    (!assembly.instances().is_empty()).then_some(assembly)
}

/// Makes one sphere, scaled about the origin, and directions of every length.
fn scaled(maker: &mut Maker) {
    for scale in [1e-6, 1e6] {
        let place = Placement { scale, shift: 0.0 };
        maker.add_placed(
            format!("{place}"),
            |_| {
                let mut assembly = Assembly::default();
                let object = assembly.add_object(sphere(12, &Placement::ORDINARY)).ok()?;
                let columns = [0, 1, 2].map(|k| (DMat3::IDENTITY.col(k) * scale).as_vec3());
                let to_world = Transform::new(columns, Vec3::ZERO);
                assembly.place(object, to_world).ok()?;
                Some(assembly)
            },
            |_, random, count| {
                let mesh = sphere(12, &place);
                let one = |_| from_the_middle(&place, &mesh, random);
                (0..count).map(one).collect()
            },
        );
    }
}

pub(super) fn instances(maker: &mut Maker) {
    scaled(maker);
    let thicknesses: &[f64] = if maker.quick {
        &[1.0, 1e-5]
    } else {
        &[1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5]
    };
    for &thickness in thicknesses {
        // The flat list of triangles is rounded in the world: far off, thinner copies have no inside.
        let spreads: &[f64] = if thickness < 1e-3 {
            &[0.0]
        } else {
            &[0.0, 100.0]
        };
        for &spread in spreads {
            let label = format!("thickness {thickness:e}, {spread} apart");
            maker.add_placed(
                label,
                |random| squeezed(random, thickness, spread),
                |assembly, random, count| {
                    let one = |_| {
                        let instance = random.one_of(assembly.instances());
                        // Rounding far from the origin may carry any point but the middle outside.
                        let reach = if spread > 0.0 { 0.0 } else { 0.2 * RADIUS };
                        let p = (reach * random.in_cube()).as_vec3();
                        let from = instance.to_world.point(p);
                        Ray::new(from, random.direction().as_vec3())
                    };
                    (0..count).map(one).collect()
                },
            );
        }
    }
}

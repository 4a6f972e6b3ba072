//! Copies under transforms that ordinary scenes lack: sheared, tiny, mirrored, flat, turned by exactly an eighth, at the origin
//! without a translation, and large ones as far away as single precision is coarse; and a body so deep in small ones that trees
//! have more than 32 levels. A scene of the gate, for what becomes of rays and boxes under such transforms.

use crate::mesh::Mesh;
use crate::trial_scenes::camera;
use glam::{Vec2, Vec3, vec3};
use raystone_core::geometry::Triangle;
use raystone_scene::{Assembly, Material, SceneData, SceneError, Transform};

/// Exponents of two of the nested triangles around a corner.
const NESTED: std::ops::Range<i32> = -60..17;

/// The scene.
///
/// # Errors
/// A built-in scene is missing, or a transform is refused.
pub fn strained_copies() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(2.9, 2.1, 3.3), vec3(0.1, 0.4, 0.2), Vec3::Y);
    let mesh = || Mesh::new("strained-copies", camera, Vec3::ONE);
    let mut body = mesh()?;
    // Its edges run along the axes of the object.
    body.block(vec3(-0.5, -0.25, -0.5), vec3(1.0, 0.75, 1.0), 0);
    body.triangle(
        [
            vec3(0.5, 0.5, 0.0),
            vec3(0.75, 1.0, 0.25),
            vec3(0.5, 0.5, 0.5),
        ],
        [Vec2::ZERO; 3],
        0,
    );
    let mut assembly = Assembly::default();
    let objects = [body.scene.triangles, nested()];
    let placed = objects
        .into_iter()
        .try_for_each(|object| assembly.add_object(object).map(drop));
    let placed = placed.and_then(|()| {
        assembly.place(1, Transform::IDENTITY)?;
        places()
            .into_iter()
            .try_for_each(|to_world| assembly.place(0, to_world).map(drop))
    });
    placed.map_err(|source| SceneError::Instance {
        name: "strained-copies".to_owned(),
        source,
    })?;
    let mut scene = mesh()?.scene;
    scene.materials = vec![Material::diffuse("copy", Vec3::splat(0.6))];
    scene.triangles = assembly
        .instances()
        .iter()
        .flat_map(|one| assembly.copy(one))
        .collect();
    scene.material_ids = vec![0; scene.triangles.len()];
    let mirrored = assembly.instances().iter().flat_map(|one| {
        let count = assembly.objects()[one.object as usize].len();
        std::iter::repeat_n(one.to_world.is_mirrored(), count)
    });
    scene.mirrored = mirrored.collect();
    scene.uvs = Vec::new();
    scene.assembly = Some(assembly);
    Ok(scene)
}

/// Triangles around a corner, each half as large as the one before: a level of a tree each.
fn nested() -> Vec<Triangle> {
    let around = |exponent| {
        let size = 2.0_f32.powi(exponent);
        Triangle {
            vertices: [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| size * axis),
        }
    };
    NESTED.map(around).collect()
}

fn places() -> [Transform; 11] {
    let sheared = [
        vec3(1.0, 0.25, 0.0),
        vec3(0.75, 1.0, -0.5),
        vec3(-0.5, 0.25, 1.0),
    ];
    // An eighth of a turn, without rounding.
    let turned = [
        vec3(1.0, 1.0, 0.0),
        vec3(-1.0, 1.0, 0.0),
        vec3(0.0, 0.0, 1.0),
    ];
    let scaled = |columns: [Vec3; 3], by: f32| columns.map(|column| by * column);
    // Turned, then flattened: rounding of rays is 10,000 times as large across as along, and boxes have to grow.
    let crushed = [vec3(1.0, 1e-4, 0.0), vec3(-1.0, 1e-4, 0.0), Vec3::Z];
    let upright = [Vec3::X, Vec3::Y, Vec3::Z];
    [
        // Without a translation, and so like no copy at all at first sight.
        Transform::new(scaled(sheared, 0.5), Vec3::ZERO),
        Transform::new(turned, vec3(2.0, 0.25, -1.5)),
        Transform::new(scaled(turned, 0.25), vec3(0.25, 1.5, 0.75)),
        Transform::new(scaled(sheared, 1e-5), vec3(0.5, 0.75, 1.25)),
        Transform::new([-sheared[0], sheared[1], sheared[2]], vec3(-2.25, 1.0, 0.5)),
        Transform::new([Vec3::X, 1e-4 * Vec3::Y, Vec3::Z], vec3(0.5, -1.0, 0.25)),
        Transform::new(scaled(sheared, 300.0), vec3(1e5, -3e4, 2e4)),
        Transform::new(scaled(turned, 1e3), vec3(-9e4, 8e4, -1e5)),
        Transform::new(scaled(upright, 2e3), vec3(2e4, 7e4, 9e4)),
        Transform::new(crushed, vec3(-1.0, -1.5, 1.75)),
        Transform::new(scaled(crushed, 300.0), vec3(-3e4, 6e4, 1e5)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gate::{Checks, ReferenceTracer};
    use raystone_accel::{AccelRegistry, BuildLog, TriangleSoup};
    use raystone_config::Gate;
    use raystone_core::params::Params;

    #[test]
    fn it_is_deep_and_its_reference_is_sound() {
        let scene = strained_copies().expect("a scene");
        let soup = TriangleSoup::new(&scene);
        let registry = AccelRegistry::default();
        let depth = |name: &str| {
            let kind = registry.get(name).expect("a structure");
            let built = kind.build(&soup, &Params::default(), &mut BuildLog::default());
            built.unwrap_or_else(|e| panic!("{e}")).stats().depth
        };
        assert!(
            depth("bvh").is_some_and(|depth| depth > 32),
            "{:?}",
            depth("bvh")
        );
        let settings = Gate {
            rays: 1024,
            ..Gate::default()
        };
        let camera = scene.view(1.0);
        let checks = Checks::Repeated;
        let reference = ReferenceTracer::new(&scene, &soup, camera, &settings, 1, checks);
        let reference = reference.unwrap_or_else(|e| panic!("{e}"));
        let instances = reference.instances.as_deref().expect("copies");
        for reference in [&reference, instances] {
            assert!(reference.is_sound(), "{:?}", reference.first_wrong());
        }
    }
}

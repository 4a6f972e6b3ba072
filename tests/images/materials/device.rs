//! One material on the device.

use glam::{DVec3, Vec3};
use raystone::accel::TriangleSoup;
use raystone::gpu::{
    Bindings, Composition, Gpu, Pipeline, Player, Recording, Storage, UniformValues,
};
use raystone::integrator::SceneBuffers;
use raystone::scene::{MATERIAL_KINDS, Material};
use std::sync::Arc;

/// The shading normal; not an axis, so that the basis matters.
const NORMAL: Vec3 = Vec3::new(0.48, 0.6, 0.64);

/// A query: sample a direction from two numbers, or evaluate a given one.
#[derive(Debug, Clone, Copy)]
pub enum Ask {
    Sample([f32; 2]),
    Tell(DVec3),
}

/// In the local frame.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    pub direction: DVec3,
    pub pdf: f64,
    pub weight: DVec3,
}

pub struct Device {
    gpu: Gpu,
    kernel: Arc<Pipeline>,
}

/// The basis of T. Duff et al. 2017 around the normal, as columns.
fn basis() -> [DVec3; 3] {
    let n = NORMAL.as_dvec3();
    let a = -1.0 / (1.0 + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + n.x * n.x * a, b, -n.x),
        DVec3::new(b, 1.0 + n.y * n.y * a, -n.y),
        n,
    ]
}

fn to_world(local: DVec3) -> Vec3 {
    let [x, y, z] = basis();
    (local.x * x + local.y * y + local.z * z).as_vec3()
}

/// The direction as seen by the kernel: rounded in world space.
pub fn rounded(local: DVec3) -> DVec3 {
    to_local(to_world(local))
}

fn to_local(world: Vec3) -> DVec3 {
    let world = world.as_dvec3();
    DVec3::from_array(basis().map(|axis| axis.dot(world)))
}

impl Device {
    pub fn new(gpu: Gpu) -> Self {
        let mut kernel = Composition::new("test/bsdf").feature("several_materials", true);
        for kind in MATERIAL_KINDS {
            kernel = kernel.feature(kind.feature, true);
        }
        let kernel = gpu.pipeline(&kernel, true);
        Self {
            kernel: kernel.unwrap_or_else(|e| panic!("{e}")),
            gpu,
        }
    }

    /// Queries a material, seen from the local direction `o`.
    pub fn ask(&self, material: &Material, o: DVec3, asks: &[Ask]) -> Vec<Answer> {
        let viewer = to_world(o).extend(0.0).to_array();
        let row = |ask: &Ask| match *ask {
            Ask::Sample([u, v]) => [viewer, [u, v, 0.0, 1.0]],
            Ask::Tell(i) => [viewer, to_world(i).extend(0.0).to_array()],
        };
        let rows: Vec<[[f32; 4]; 2]> = asks.iter().map(row).collect();
        let asked = self.gpu.storage("asked", &rows).expect("a buffer");
        let count = asks.len() as u32;
        let answers = Storage::scratch("answers", u64::from(count) * 32);
        let mut bindings = self.tables(material);
        bindings
            .buffer("asked", &asked)
            .buffer("answers", &answers)
            .uniform(
                "asking",
                UniformValues::new()
                    .vec("normal", &NORMAL.to_array())
                    .u32("count", count),
            );
        let mut recording = Recording::new();
        recording
            .run("ask", &self.kernel, &bindings, [count.div_ceil(64), 1, 1])
            .download("answers", &answers);
        let played = Player::new(&self.gpu).play(&recording).expect("it plays");
        let words: Vec<[f32; 8]> = played.download("answers").expect("answers");
        let answer = |w: &[f32; 8]| Answer {
            direction: to_local(Vec3::from_slice(w)),
            pdf: f64::from(w[3]),
            weight: Vec3::from_slice(&w[4..]).as_dvec3(),
        };
        words.iter().map(answer).collect()
    }

    /// The tables of a scene with only this material, as the program makes them.
    fn tables(&self, material: &Material) -> Bindings {
        let mut scene = crate::support::builtin("single-triangle", &[]);
        scene.materials = vec![material.clone()];
        scene.material_ids.fill(0);
        let soup = TriangleSoup::new(&scene);
        let buffers = SceneBuffers::upload(&self.gpu, &scene, &soup).expect("buffers that fit");
        buffers.bindings
    }
}

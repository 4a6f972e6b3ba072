//! Scenes built from a few polygons, balls and blocks, for trial scenes and known images.

use glam::{Vec2, Vec3, vec2, vec3};
use raystone_core::geometry::{Camera, Triangle};
use raystone_scene::{self as scene, Material, SceneData, SceneError, Texture};
use std::f32::consts::{PI, TAU};

pub(super) struct Mesh {
    pub scene: SceneData,
}

impl Mesh {
    /// An empty scene with a camera under a sky of this radiance.
    pub(crate) fn new(name: &str, camera: Camera, environment: Vec3) -> Result<Self, SceneError> {
        let scene = SceneData {
            name: name.to_owned(),
            triangles: Vec::new(),
            material_ids: Vec::new(),
            materials: Vec::new(),
            camera: Some(camera),
            environment,
            daylight: None,
            ..scene::named("single-triangle")?
        };
        Ok(Self { scene })
    }

    pub(crate) fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    pub(crate) fn triangle(&mut self, corners: [Vec3; 3], uv: [Vec2; 3], material: u32) {
        self.scene.triangles.push(Triangle { vertices: corners });
        self.scene.uvs.push(uv);
        self.scene.material_ids.push(material);
    }

    /// A parallelogram with texture coordinates over `uv`.
    pub(crate) fn quad(
        &mut self,
        [corner, along, across]: [Vec3; 3],
        uv: [Vec2; 2],
        material: u32,
    ) {
        let p = |u: f32, v: f32| corner + u * along + v * across;
        let t = |u: f32, v: f32| vec2(uv[0].x.lerp(uv[1].x, u), uv[0].y.lerp(uv[1].y, v));
        let [a, b, c, d] = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            let corners = [a, b, c].map(|(u, v)| p(u, v));
            self.triangle(corners, [a, b, c].map(|(u, v)| t(u, v)), material);
        }
    }

    pub(crate) fn plain(&mut self, quad: [Vec3; 3], material: u32) {
        self.quad(quad, [Vec2::ZERO, Vec2::ONE], material);
    }

    /// A box; corners run counter-clockwise seen from outside.
    pub(crate) fn block(&mut self, low: Vec3, size: Vec3, material: u32) {
        let high = low + size;
        let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
        for [along, across] in [[x, y], [y, z], [z, x]] {
            self.plain([low, across, along], material);
            self.plain([high, -along, -across], material);
        }
    }

    /// A faceted ball; corners run counter-clockwise seen from outside.
    pub(crate) fn ball(&mut self, centre: Vec3, radius: f32, material: u32) {
        const ROWS: u32 = 9;
        let at = |row: u32, column: u32| {
            let (theta, phi) = (
                PI * row as f32 / ROWS as f32,
                TAU * column as f32 / (2 * ROWS) as f32 + 0.1,
            );
            let ring = theta.sin();
            centre + radius * vec3(ring * phi.cos(), theta.cos(), ring * phi.sin())
        };
        for row in 0..ROWS {
            for column in 0..2 * ROWS {
                let (next, below) = (column + 1, row + 1);
                let [a, b, c, d] = [
                    at(row, column),
                    at(row, next),
                    at(below, next),
                    at(below, column),
                ];
                if row > 0 {
                    self.triangle([a, b, c], [Vec2::ZERO; 3], material);
                }
                if below < ROWS {
                    self.triangle([a, c, d], [Vec2::ZERO; 3], material);
                }
            }
        }
    }

    pub(crate) fn done(mut self, textures: Vec<Texture>) -> SceneData {
        if textures.is_empty() {
            self.scene.uvs.clear();
        }
        self.scene.textures = textures;
        self.scene
    }
}

trait Lerp {
    fn lerp(self, to: Self, t: f32) -> Self;
}

impl Lerp for f32 {
    fn lerp(self, to: Self, t: f32) -> Self {
        self + t * (to - self)
    }
}

//! One small file of each format, read anew before anything is rendered, beside what its text says by hand: kernels and
//! oracles start from what a loader returns.

use crate::colors::decode_color;
use crate::known_scenes::{Known, with};
use crate::light::Light;
use crate::{Daylight, SceneData, Wrap, named};
use glam::{DVec3, Vec2, Vec3};
use raystone_core::files;
use raystone_core::geometry::Camera;
use raystone_core::params::ParamValue;

mod defaults;
mod further;
mod rare;

/// In a folder that no machine has.
static FILES: &[(&str, &[u8])] = &[
    ("known:/a.gltf", include_bytes!("known_files/a.gltf")),
    ("known:/a.obj", include_bytes!("known_files/a.obj")),
    ("known:/a.mtl", include_bytes!("known_files/a.mtl")),
    ("known:/a.png", include_bytes!("known_files/a.png")),
    ("known:/a.ply", include_bytes!("known_files/a.ply")),
    ("known:/a.xml", include_bytes!("known_files/a.xml")),
    ("known:/a.vol", include_bytes!("known_files/a.vol")),
    ("known:/a.npy", include_bytes!("known_files/a.npy")),
    ("known:/b.gltf", include_bytes!("known_files/b.gltf")),
    ("known:/b.obj", include_bytes!("known_files/b.obj")),
    ("known:/b.ply", include_bytes!("known_files/b.ply")),
    ("known:/b.xml", include_bytes!("known_files/b.xml")),
    ("known:/b.vol", include_bytes!("known_files/b.vol")),
    ("known:/b.npy", include_bytes!("known_files/b.npy")),
    ("known:/c.gltf", include_bytes!("known_files/c.gltf")),
    ("known:/c.obj", include_bytes!("known_files/c.obj")),
    ("known:/c.mtl", include_bytes!("known_files/c.mtl")),
    ("known:/c.ply", include_bytes!("known_files/c.ply")),
    ("known:/c.hdr", include_bytes!("known_files/c.hdr")),
    ("known:/c.pfm", include_bytes!("known_files/c.pfm")),
    ("known:/d.gltf", include_bytes!("known_files/d.gltf")),
    ("known:/d.obj", include_bytes!("known_files/d.obj")),
    ("known:/d.mtl", include_bytes!("known_files/d.mtl")),
    ("known:/d.ply", include_bytes!("known_files/d.ply")),
    ("known:/d.hdr", include_bytes!("known_files/d.hdr")),
];

/// What they say.
///
/// # Errors
/// One is not read at all, or lacks a part.
pub(crate) fn values() -> Result<Vec<Known>, String> {
    files::embed(FILES);
    let read = |name: &str| named(name).map_err(|e| e.to_string());
    let mut all = Values::default();
    all.gltf(&read("known:/a.gltf")?)?;
    all.obj(&read("known:/a.obj")?)?;
    all.ply(&read("known:/a.ply")?)?;
    all.nori(&read("known:/a.xml")?)?;
    all.media()?;
    defaults::values(&mut all)?;
    further::values(&mut all)?;
    rare::values(&mut all)?;
    Ok(all.0)
}

#[derive(Default)]
struct Values(Vec<Known>);

/// Part of a list that a file fills.
fn part<'a, T>(all: &'a [T], index: usize, what: &str) -> Result<&'a T, String> {
    all.get(index).ok_or_else(|| {
        format!(
            "a known scene has {} {what}, and not number {index}",
            all.len()
        )
    })
}

impl Values {
    fn vector(&mut self, what: &'static str, found: Vec3, expected: [f64; 3]) {
        let found = found.as_dvec3().to_array();
        (self.0).extend((0..3).map(|k| (what, found[k], expected[k])));
    }

    fn corners(
        &mut self,
        what: &'static str,
        scene: &SceneData,
        triangle: usize,
        expected: [[f64; 3]; 3],
    ) -> Result<(), String> {
        let found = part(&scene.triangles, triangle, "triangles")?;
        for (corner, expected) in found.vertices.into_iter().zip(expected) {
            self.vector(what, corner, expected);
        }
        Ok(())
    }

    /// Where the eye is, where it looks, and how wide, in degrees.
    fn camera(
        &mut self,
        what: &'static str,
        scene: &SceneData,
        eye: [f64; 3],
        forward: [f64; 3],
        fov: f64,
    ) -> Result<(), String> {
        let Some(Camera {
            eye: found,
            target,
            up,
            vertical_fov_degrees,
        }) = scene.camera
        else {
            return Err("a known scene has no camera".to_owned());
        };
        self.vector(what, found, eye);
        self.vector(what, (target - found).normalize_or_zero(), forward);
        self.vector(what, up, [0.0, 1.0, 0.0]);
        self.0.push((what, f64::from(vertical_fov_degrees), fov));
        Ok(())
    }

    /// A camera that is turned by 90° about y looks along −x; lights below a node that is turned by 90° about z, and by
    /// as much about x themselves.
    fn gltf(&mut self, scene: &SceneData) -> Result<(), String> {
        let wide = 0.8_f64.to_degrees();
        self.camera(
            "camera of glTF",
            scene,
            [1.0, 2.0, 3.0],
            [-1.0, 0.0, 0.0],
            wide,
        )?;
        for light in &scene.lights {
            match light {
                Light::Point {
                    position,
                    intensity,
                } => {
                    self.vector("place of a point light", *position, [0.0, 6.0, 0.0]);
                    self.vector("intensity of a point light", *intensity, [8.0, 4.0, 2.0]);
                }
                Light::Spot {
                    position,
                    direction,
                    intensity,
                    inner,
                    outer,
                    ..
                } => {
                    self.vector("place of a spot light", *position, [0.0, 0.0, 7.0]);
                    let along = direction.normalize_or_zero();
                    self.vector("direction of a spot light", along, [0.0, 1.0, 0.0]);
                    self.vector("intensity of a spot light", *intensity, [2.0, 4.0, 4.0]);
                    let angles = Vec3::new(*inner, *outer, 0.0);
                    self.vector("angles of a spot light", angles, [0.1, 0.3, 0.0]);
                }
                _ => {}
            }
        }
        self.0
            .push(("number of lights", scene.lights.len() as f64, 2.0));
        // Columns of a matrix: x becomes 2 y, y becomes -3 x.
        let turned = [[10.0, 20.0, 30.0], [10.0, 22.0, 30.0], [7.0, 20.0, 30.0]];
        self.corners("triangle of a matrix", scene, 0, turned)?;
        // Half of a target, 2 along z; then a quarter of 8 along z, and three quarters of what stands one along x from a
        // joint that is turned by 90° about z and 4 along x.
        let skinned = [[3.0, -0.75, 4.0], [3.25, 0.0, 4.0], [2.25, -0.5, 4.0]];
        self.corners("triangle of a skin", scene, 1, skinned)?;
        self.gltf_materials(scene)
    }

    /// Coordinates are stretched, then turned by 90° from u to v's other side, then moved (KHR_texture_transform).
    fn gltf_materials(&mut self, scene: &SceneData) -> Result<(), String> {
        let textured = part(&scene.materials, 0, "materials")?;
        self.vector("base colour of glTF", textured.base_color, [0.2, 0.4, 0.6]);
        let [roughness, metallic] = [textured.source.roughness, textured.source.metallic];
        let source = Vec3::new(roughness.unwrap_or(-1.0), metallic.unwrap_or(-1.0), 0.0);
        self.vector("roughness and metal of glTF", source, [0.75, 0.25, 0.0]);
        let placed = textured
            .base_color_texture
            .ok_or("a known material has no texture")?;
        for (corner, expected) in [
            ([0.0, 0.0], [0.25, 0.5, 0.0]),
            ([1.0, 0.0], [0.25, -1.5, 0.0]),
            ([0.0, 1.0], [3.25, 0.5, 0.0]),
        ] {
            let moved = placed.linear * Vec2::from_array(corner) + placed.offset;
            self.vector("transform of a texture", moved.extend(0.0), expected);
        }
        let wraps = [Wrap::Mirrored, Wrap::Clamp];
        let same = f64::from(placed.wrap == wraps);
        self.0.push(("agreement of a texture's wraps", same, 1.0));
        let uvs = part(&scene.uvs, 0, "coordinates")?;
        self.vector("coordinates of glTF", uvs[2].extend(0.0), [0.0, 1.0, 0.0]);
        self.texels(scene)?;
        let glowing = part(&scene.materials, 1, "materials")?;
        self.vector("emission of glTF", glowing.emission, [4.0, 2.0, 1.0]);
        Ok(())
    }

    /// Red and green above blue and white.
    fn texels(&mut self, scene: &SceneData) -> Result<(), String> {
        let texels = &part(&scene.textures, 0, "textures")?.texels;
        for (index, expected) in [
            (0, [1.0, 0.0, 0.0]),
            (1, [0.0, 1.0, 0.0]),
            (2, [0.0, 0.0, 1.0]),
        ] {
            let [r, g, b, _] = part(texels, index, "texels")?.map(|x| f32::from(x) / 255.0);
            self.vector("texel of a PNG", Vec3::new(r, g, b), expected);
        }
        Ok(())
    }

    /// v points down; an emitter is what a statement says before the face.
    fn obj(&mut self, scene: &SceneData) -> Result<(), String> {
        let first = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0]];
        self.corners("triangle of OBJ", scene, 0, first)?;
        let uvs = part(&scene.uvs, 0, "coordinates")?;
        self.vector("coordinates of OBJ", uvs[0].extend(0.0), [0.25, 0.875, 0.0]);
        let of = |index: usize| -> Result<_, String> {
            let material = *part(&scene.material_ids, index, "triangles")?;
            part(&scene.materials, material as usize, "materials")
        };
        let (first, last) = (of(0)?, of(scene.triangles.len().saturating_sub(1))?);
        self.vector("colour of MTL", first.base_color, [0.25, 0.5, 0.75]);
        self.vector("emission of MTL", last.emission, [3.0, 2.0, 1.0]);
        let count = scene.triangles.len() as f64;
        self.0.push(("number of triangles of OBJ", count, 12.0));
        self.texels(scene)
    }

    /// Bytes of sRGB: 51 is a fifth, of which 0.033105 is shown. The file has no light: the sky's is at the left, above
    /// and in front.
    fn ply(&mut self, scene: &SceneData) -> Result<(), String> {
        let colors = part(&scene.colors, 0, "colours")?.map(decode_color);
        let expected = [[1.0, 0.0, 0.0], [0.0, 0.033_104_767, 0.0], [0.0, 0.0, 1.0]];
        for (found, expected) in colors.into_iter().zip(expected) {
            let near = found.distance(DVec3::from_array(expected)) < OF_COLORS;
            self.0
                .push(("agreement of a colour of PLY", f64::from(near), 1.0));
        }
        // Over what stands on the y axis and is seen from the side of z.
        let key = scene.daylight.map(|_| Daylight::default().key);
        let key = key.ok_or("a known scene without lights has no sky")?;
        for is_there in [key.x < 0.0, key.y > 0.5, key.z > 0.0] {
            (self.0).push(("side of the light of a sky", f64::from(is_there), 1.0));
        }
        Ok(())
    }

    /// The whole width is seen under 90°, of which the half of a height of one half is atan 1/2. The cube is stretched by 1, 2
    /// and 3, turned by 90° about y, which brings z to x, and moved by 5 along x.
    fn nori(&mut self, scene: &SceneData) -> Result<(), String> {
        let fov = 2.0 * 0.5_f64.atan().to_degrees();
        self.camera(
            "camera of Nori",
            scene,
            [0.0, 1.0, 10.0],
            [0.0, 0.0, -1.0],
            fov,
        )?;
        let first = [[2.0, 0.0, 1.0], [2.0, 0.0, -1.0], [8.0, 0.0, -1.0]];
        self.corners("triangle of Nori", scene, 0, first)?;
        let material = part(&scene.materials, 0, "materials")?;
        self.vector("albedo of Nori", material.base_color, [0.5, 0.25, 0.125]);
        self.vector("radiance of Nori", material.emission, [4.0, 5.0, 6.0]);
        Ok(())
    }

    /// Grids of 4 × 3 × 2 voxels with the numbers from 1, x fastest, and the inside of a cube.
    fn media(&mut self) -> Result<(), String> {
        let medium = |name: &str| -> Result<_, String> {
            let scene = with(&[
                ("medium", ParamValue::Name(name.to_owned())),
                ("scattering", ParamValue::Number(0.5)),
                ("medium_voxels", ParamValue::Integer(4)),
            ])?;
            let medium = scene.media.into_iter().next();
            Ok(medium.ok_or("a known scene has no medium")?.volume)
        };
        for name in ["known:/a.vol", "known:/a.npy"] {
            let volume = medium(name)?;
            let [x, y, z] = volume.resolution.map(|n| n as f32);
            self.vector("voxels of a file", Vec3::new(x, y, z), [4.0, 3.0, 2.0]);
            for (index, expected) in [(0, 0.5), (3, 2.0), (23, 12.0)] {
                let found = f64::from(*part(&volume.scattering, index, "voxels")?);
                self.0.push(("density of a file", found, expected));
            }
            if name.ends_with("vol") {
                self.vector("corner of a .vol", volume.low.as_vec3(), [-1.0, -2.0, -3.0]);
                self.vector("corner of a .vol", volume.high.as_vec3(), [3.0, 4.0, 5.0]);
            }
        }
        let cube = medium("known:/a.obj")?;
        let least = cube
            .scattering
            .iter()
            .fold(f32::MAX, |least, x| least.min(*x));
        let most = cube
            .scattering
            .iter()
            .fold(0.0, |most: f32, x| most.max(*x));
        let filled = Vec3::new(least, most, cube.scattering.len() as f32);
        self.vector("density of a filled cube", filled, [0.5, 0.5, 64.0]);
        Ok(())
    }
}

/// Of colours in two words.
const OF_COLORS: f64 = 1e-4;

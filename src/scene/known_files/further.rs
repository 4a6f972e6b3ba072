//! A third file of each format: parts that the others lack, and images of linear light.

use super::{OF_COLORS, Values, part};
use crate::colors::decode_color;
use crate::{AlphaChannel, AlphaMask, DIELECTRIC, PHONG, PRINCIPLED, SceneData, decode_normal};
use glam::{DVec3, Vec3};
use std::path::Path;

/// What each of them is, in turn.
pub(super) fn values(all: &mut Values) -> Result<(), String> {
    let read = |name: &str| crate::named(name).map_err(|e| e.to_string());
    all.strips(&read("known:/c.gltf")?)?;
    all.counted_back(&read("known:/c.obj")?)?;
    let first = [[0.0; 3], [1.5, 0.0, 0.0], [0.0, 2.5, 300.0]];
    all.corners(
        "triangle of big-endian PLY",
        &read("known:/c.ply")?,
        0,
        first,
    )?;
    all.radiance()
}

impl Values {
    fn colors(
        &mut self,
        scene: &SceneData,
        triangle: usize,
        expected: [[f64; 3]; 3],
    ) -> Result<(), String> {
        let found = part(&scene.colors, triangle, "colours")?.map(decode_color);
        for (found, expected) in found.into_iter().zip(expected) {
            let near = found.distance(DVec3::from_array(expected)) < OF_COLORS;
            (self.0).push(("agreement of a colour of a vertex", f64::from(near), 1.0));
        }
        Ok(())
    }

    /// Of a material by its kind and parameters.
    fn material(
        &mut self,
        scene: &SceneData,
        name: &str,
        kind: &str,
        expected: &[f64],
    ) -> Result<(), String> {
        let found = scene
            .materials
            .iter()
            .find(|material| material.name == name);
        let found = found.ok_or_else(|| format!("a known scene has no material {name}"))?;
        let same = found.kind.name == kind && found.parameters.len() == expected.len();
        (self.0).push(("agreement of a material's kind", f64::from(same), 1.0));
        let pairs = found.parameters.iter().zip(expected);
        let pairs = pairs
            .map(|(found, expected)| ("parameter of a material", f64::from(*found), *expected));
        self.0.extend(pairs);
        Ok(())
    }

    /// A strip whose last vertex is another one, twice as wide: normals become half as wide. A fan that is scaled by (2, 3, 4), turned by 90°
    /// about z, and moved.
    fn strips(&mut self, scene: &SceneData) -> Result<(), String> {
        let second = [[2.0, 0.0, 0.0], [2.0, 1.0, 2.0], [0.0, 1.0, 0.0]];
        self.corners("triangle of a strip", scene, 1, second)?;
        let last = [[1.0, 2.0, 3.0], [-2.0, 2.0, 3.0], [-2.0, 4.0, 11.0]];
        self.corners("triangle of a fan", scene, 3, last)?;
        let [word, ..] = *part(&scene.normals, 0, "normals")?;
        let found = decode_normal(word).unwrap_or_default();
        let near = found.distance(DVec3::new(0.3, 0.8, 0.0).normalize()) < OF_NORMALS;
        (self.0).push(("agreement of a stretched normal", f64::from(near), 1.0));
        self.colors(
            scene,
            0,
            [[1.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 1.0]],
        )?;
        let uvs = part(&scene.uvs, 0, "coordinates")?;
        self.vector(
            "second coordinates of glTF",
            uvs[2].extend(0.0),
            [0.0, 0.75, 0.0],
        );
        let bent = part(&scene.materials, 0, "materials")?.normal_texture;
        let bent = bent.map_or(f64::NAN, |used| f64::from(used.scale));
        self.0.push(("scale of a texture of normals", bent, 0.25));
        self.material(scene, "bent", PRINCIPLED.name, &[0.25, 0.5, 0.04])?;
        self.material(scene, "glass", DIELECTRIC.name, &[1.25, 0.0])?;
        self.material(scene, "pane", DIELECTRIC.name, &[1.5, 1.0])
    }

    /// Indices from the last statement back; both surfaces of glass filter; v points up. An image without alpha is a mask by its luminance,
    /// 0.2126 · 100 + 0.7152 · 150 + 0.0722 · 200 = 143 to the byte, and is left where it is two thirds at least.
    fn counted_back(&mut self, scene: &SceneData) -> Result<(), String> {
        let first = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        self.corners("triangle by indices from the end", scene, 0, first)?;
        self.colors(
            scene,
            0,
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        )?;
        let words = part(&scene.normals, 0, "normals")?;
        for (word, expected) in
            words
                .iter()
                .zip([[0.0, 0.6, 0.8], [0.0, 0.6, 0.8], [0.6, 0.0, 0.8]])
        {
            let found = decode_normal(*word).unwrap_or_default();
            let near = found.distance(DVec3::from_array(expected)) < OF_NORMALS;
            (self.0).push(("agreement of a normal of OBJ", f64::from(near), 1.0));
        }
        self.material(scene, "glossy", PHONG.name, &[0.25, 0.25, 0.25, 20.0])?;
        self.material(scene, "plastic", PRINCIPLED.name, &[0.25, 0.5, 0.25])?;
        self.material(scene, "glass", DIELECTRIC.name, &[1.25, 0.0])?;
        self.vector(
            "filter of glass",
            part(&scene.materials, 2, "materials")?.base_color,
            [0.5; 3],
        );
        let leaf = part(&scene.materials, 3, "materials")?;
        let placed = leaf
            .base_color_texture
            .ok_or("a known material has no texture")?;
        let diagonal = Vec3::new(placed.linear.x_axis.x, placed.linear.y_axis.y, 0.0);
        self.vector("scale of a texture of MTL", diagonal, [2.0, 3.0, 0.0]);
        self.vector(
            "offset of a texture of MTL",
            placed.offset.extend(0.0),
            [0.25, -2.5, 0.0],
        );
        (self.0).push(("mask by luminance", f64::from(leaf.mask.is_some()), 1.0));
        let grey = AlphaChannel::Luminance.value([100, 150, 200, 7]);
        self.0
            .push(("luminance of a texel", f64::from(grey), 143.0));
        let mask = AlphaMask {
            cutoff: Some(0.5),
            ..AlphaMask::even(0.75)
        };
        let least = mask.threshold().map_or(f64::NAN, f64::from);
        self.0
            .push(("least value of a mask", least, 170.0 * 65536.0));
        Ok(())
    }

    /// Bytes 128 of exponents 1 and 3 beyond 128 are 1 and 4, of twice the exposure; rows of a PFM go up.
    fn radiance(&mut self) -> Result<(), String> {
        for (name, size, expected) in [
            ("known:/c.hdr", [2, 1], [[0.5, 0.25, 0.125], [2.0; 3]]),
            ("known:/c.pfm", [1, 2], [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]),
        ] {
            let image = raystone_image::read_linear(Path::new(name)).map_err(|e| e.to_string())?;
            let same = [image.width, image.height] == size;
            (self.0).push(("agreement of an image's size", f64::from(same), 1.0));
            for (found, expected) in image.pixels.into_iter().zip(expected) {
                self.vector("radiance of an image", found.into(), expected);
            }
        }
        Ok(())
    }
}

/// Of normals in words of sixteen bits.
const OF_NORMALS: f64 = 3e-4;

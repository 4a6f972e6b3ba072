//! Properties of a loaded scene: extent, size in bytes, emitters, content hash.

use super::texture::texel_room;
use super::{
    Bounds, EnvironmentMap, InstanceError, Light, LightList, SceneData, SceneError, Transform,
    normals,
};
use glam::{Vec2, Vec3};
use raystone_core::geometry::Triangle;
use std::mem::size_of_val;
use std::path::Path;
use std::sync::Arc;

/// Bump this when the order or meaning of the hashed bytes changes.
const HASH_VERSION: &[u8] = b"raystone scene 2";

impl SceneData {
    /// Bounding box of all triangles in scene units.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(&self.triangles)
    }

    /// Replaces an instance's transform, moves its triangles and rehashes the scene.
    ///
    /// # Errors
    /// The instance does not exist, or the transform is singular or not finite.
    pub fn move_instance(
        &mut self,
        instance: usize,
        to_world: Transform,
    ) -> Result<(), InstanceError> {
        let instances = 0;
        let missing = InstanceError::NoSuchInstance {
            instance,
            instances,
        };
        let assembly = self.assembly.as_mut().ok_or(missing)?;
        let before = assembly.instances().get(instance).map(|i| i.to_world);
        let turns = before.is_some_and(|from| from.is_mirrored() != to_world.is_mirrored());
        assembly.move_to(instance, to_world)?;
        let moved = &assembly.instances()[instance];
        let first = moved.first as usize;
        let mut count = 0;
        for (triangle, copy) in self.triangles[first..].iter_mut().zip(assembly.copy(moved)) {
            *triangle = copy;
            count += 1;
        }
        let corners = self.normals.iter_mut().skip(first).take(count);
        for (words, from) in corners.zip(std::iter::repeat(before).flatten()) {
            *words = normals::moved(*words, &from, &to_world);
        }
        if turns {
            self.mirrored.resize(self.triangles.len(), false);
            for mirrored in &mut self.mirrored[first..first + count] {
                *mirrored = !*mirrored;
            }
        }
        self.hash = self.content_hash();
        Ok(())
    }

    /// Lights the scene with an environment map instead of a constant radiance or the default sky.
    /// The map is reduced until the scene's tables fit into `table_bytes`.
    ///
    /// # Errors
    /// The map cannot be read.
    pub(super) fn under(mut self, file: &Path, table_bytes: u64) -> Result<Self, SceneError> {
        let map = EnvironmentMap::read(file, &mut self.report.warnings)?;
        let mapped = self.uvs.len().max(self.normals.len());
        let texels: usize = self.textures.iter().map(|t| t.texels.len()).sum();
        let room = texel_room(table_bytes, mapped).saturating_sub(texels as u64);
        let map = map.within(4 * room, &mut self.report.warnings);
        if let Some(sky) = self.daylight.take() {
            let note = sky.note();
            self.report.warnings.retain(|line| *line != note);
        }
        self.environment = Vec3::ZERO;
        self.lights.push(Light::Environment {
            map: Arc::new(map),
            scale: 1.0,
            turn: 0.0,
        });
        let problems = LightList::of(&self).problems;
        let new = problems
            .into_iter()
            .filter(|line| !self.report.warnings.contains(line));
        let new: Vec<String> = new.collect();
        self.report.warnings.extend(new);
        self.hash = self.content_hash();
        Ok(self)
    }

    /// True if the front of a triangle is the side from which its corners turn clockwise.
    pub fn is_mirrored(&self, triangle: usize) -> bool {
        self.mirrored.get(triangle).copied().unwrap_or(false)
    }

    /// Corners of a triangle, counter-clockwise seen from its front.
    pub fn outward(&self, triangle: usize) -> [Vec3; 3] {
        let [a, b, c] = self.triangles[triangle].vertices;
        if self.is_mirrored(triangle) {
            [a, c, b]
        } else {
            [a, b, c]
        }
    }

    /// The scene with all corners in [`Self::outward`] order. Drops the assembly if anything was
    /// mirrored, as those triangles are no longer copies of an object.
    #[must_use]
    pub(super) fn turned_outward(mut self) -> Self {
        let mirrored = std::mem::take(&mut self.mirrored);
        for (id, _) in mirrored.iter().enumerate().filter(|(_, is_so)| **is_so) {
            self.triangles[id].vertices.swap(1, 2);
            if let Some(uvs) = self.uvs.get_mut(id) {
                uvs.swap(1, 2);
            }
            if let Some(normals) = self.normals.get_mut(id) {
                normals.swap(1, 2);
            }
            if let Some(colors) = self.colors.get_mut(id) {
                colors.swap(1, 2);
            }
            self.assembly = None;
        }
        self
    }

    /// Size of the scene's arrays in bytes: triangles, per-corner and per-triangle data, texels, voxels.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.triangles[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.mirrored[..])
            + size_of_val(&self.material_ids[..])
            + self
                .textures
                .iter()
                .map(|texture| size_of_val(&texture.texels[..]))
                .sum::<usize>()
            + self
                .media
                .iter()
                .map(|medium| size_of_val(&medium.volume.scattering[..]) * 3)
                .sum::<usize>()
    }

    /// Indices of emissive triangles with non-zero area, ascending.
    pub fn emitters(&self) -> Vec<u32> {
        let emits: Vec<bool> = self
            .materials
            .iter()
            .map(|material| material.emission.max_element() > 0.0)
            .collect();
        if !emits.contains(&true) {
            return Vec::new();
        }
        (0u32..)
            .zip(&self.triangles)
            .zip(&self.material_ids)
            .filter(|((_, triangle), id)| emits[**id as usize] && !triangle.has_zero_area())
            .map(|((index, _), _)| index)
            .collect()
    }

    /// BLAKE3 (hex) of vertices, texture coordinates, vertex normals and colours, materials,
    /// textures, camera and environment; names are excluded. Every list is preceded by its length,
    /// so that no two scenes hash the same bytes.
    pub(super) fn content_hash(&self) -> String {
        let mut hash = Hash(blake3::Hasher::new());
        hash.bytes(HASH_VERSION);
        hash.bytes(bytemuck::cast_slice::<Triangle, u8>(&self.triangles));
        hash.bytes(bytemuck::cast_slice::<[Vec2; 3], u8>(&self.uvs));
        hash.bytes(bytemuck::cast_slice::<u32, u8>(&self.material_ids));
        self.hash_materials(&mut hash);
        if !self.normals.is_empty() {
            hash.bytes(bytemuck::cast_slice::<[u32; 3], u8>(&self.normals));
        }
        if !self.colors.is_empty() {
            let words = self.colors.as_flattened().as_flattened();
            hash.bytes(b"colors of vertices");
            hash.bytes(bytemuck::cast_slice::<u32, u8>(words));
        }
        if !self.mirrored.is_empty() {
            hash.bytes(bytemuck::cast_slice(&self.mirrored));
        }
        for texture in &self.textures {
            hash.bytes(bytemuck::cast_slice(&[texture.width, texture.height]));
            hash.bytes(texture.texels.as_flattened());
        }
        if let Some(camera) = &self.camera {
            let lens = Vec3::splat(camera.vertical_fov_degrees);
            hash.vectors(&[camera.eye, camera.target, camera.up, lens]);
        }
        hash.vectors(&[self.environment]);
        for light in &self.lights {
            // As above: plain fields, printed with all digits.
            hash.bytes(format!("{light:?}").as_bytes());
        }
        if let Some(sky) = &self.daylight {
            hash.vectors(&[sky.up, sky.key, Vec3::splat(sky.reach)]);
        }
        for medium in &self.media {
            hash.bytes(b"medium");
            hash.bytes(&medium.words());
        }
        if let Some(assembly) = &self.assembly {
            for object in assembly.objects() {
                hash.bytes(bytemuck::cast_slice::<Triangle, u8>(object));
            }
            for instance in assembly.instances() {
                hash.bytes(&instance.object.to_le_bytes());
                hash.bytes(bytemuck::bytes_of(&instance.to_world));
            }
        }
        hash.0.finalize().to_hex().to_string()
    }

    fn hash_materials(&self, hash: &mut Hash) {
        hash.bytes(&self.materials.len().to_le_bytes());
        for material in &self.materials {
            let texture = material.base_color_texture;
            let texture = texture.map_or(-1, |used| i64::from(used.texture));
            hash.bytes(material.kind.name.as_bytes());
            hash.bytes(bytemuck::cast_slice(&material.parameters));
            hash.bytes(&texture.to_le_bytes());
            hash.vectors(&[material.base_color, material.emission]);
            if !material.emits_both_sides {
                hash.bytes(b"one-sided");
            }
            // The derived Debug text is complete and deterministic for plain fields.
            hash.bytes(format!("{:?}", material.source).as_bytes());
        }
        for (id, material) in self.materials.iter().enumerate() {
            for (slot, used) in material.texture_uses().iter().enumerate() {
                let used = used.filter(|used| slot > 0 || !used.is_plain());
                if let Some(used) = used {
                    hash.bytes(format!("{id} {slot} {used:?}").as_bytes());
                }
            }
        }
        for (id, material) in self.materials.iter().enumerate() {
            if let Some(mask) = material.mask {
                hash.bytes(format!("{id} {mask:?}").as_bytes());
            }
        }
    }
}

struct Hash(blake3::Hasher);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn vectors(&mut self, vectors: &[Vec3]) {
        self.bytes(bytemuck::cast_slice(vectors));
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin::tests::load_default;
    use crate::{Daylight, Light, MIRROR, TextureUse, Transform};
    use glam::{Mat4, Vec3, vec3};

    #[test]
    fn the_hash_sees_every_part_of_the_scene() {
        let scene = load_default("cornell-box");
        type Change = fn(&mut crate::SceneData);
        let changes: [(&str, Change); 15] = [
            ("vertex", |s| s.triangles[3].vertices[1].x += 1e-3),
            ("material id", |s| s.material_ids[0] = 1),
            ("reflectance", |s| s.materials[0].base_color.y += 1e-3),
            ("kind", |s| s.materials[0].kind = &MIRROR),
            ("parameter", |s| s.materials[0].parameters.push(1.5)),
            ("emission", |s| s.materials[0].emission.z += 1e-3),
            ("sides", |s| s.materials[0].emits_both_sides = false),
            ("light", |s| {
                s.lights.push(Light::Point {
                    position: Vec3::X,
                    intensity: Vec3::ONE,
                });
            }),
            ("normal", |s| s.normals.push([1, 2, 3])),
            ("color", |s| s.colors.push([[1, 2]; 3])),
            ("texture", |s| {
                s.materials[0].normal_texture = Some(TextureUse::plain(0));
            }),
            ("source", |s| s.materials[0].source.ior = Some(1.5)),
            ("camera", |s| s.camera = None),
            ("environment", |s| s.environment.x += 1e-3),
            ("daylight", |s| s.daylight = Some(Daylight::default())),
        ];
        for (what, change) in changes {
            let mut changed = scene.clone();
            change(&mut changed);
            assert_ne!(changed.content_hash(), scene.hash, "{what}");
        }
        let mut renamed = scene.clone();
        renamed.name = "another name".into();
        renamed.materials[0].name = "another name".into();
        assert_eq!(renamed.content_hash(), scene.hash);
    }

    #[test]
    fn emitters_are_the_triangles_of_emitting_materials_that_have_an_area() {
        let mut scene = load_default("cornell-box");
        let emitters = scene.emitters();
        assert_eq!(emitters.len(), 2);
        for &index in &emitters {
            let id = scene.material_ids[index as usize] as usize;
            assert!(scene.materials[id].emission.x > 0.0);
        }
        let flattened = &mut scene.triangles[emitters[0] as usize].vertices;
        flattened[2] = flattened[1];
        assert_eq!(scene.emitters(), emitters[1..]);
    }

    #[test]
    fn a_copy_is_mirrored_while_its_transform_is() {
        let mut scene = load_default("instances");
        let mirror = Mat4::from_scale(vec3(-2.0, 2.0, 2.0));
        let turn = Mat4::from_rotation_y(1.0);
        let before = scene.clone();
        for (step, is_so) in [(mirror, true), (mirror * turn, true), (turn, false)] {
            scene
                .move_instance(1, Transform::from_matrix(step))
                .unwrap();
            let assembly = scene.assembly.as_ref().unwrap();
            let moved = &assembly.instances()[1];
            let own = moved.first as usize..moved.first as usize + assembly.copy(moved).count();
            for id in 0..scene.triangles.len() {
                let wanted = if own.contains(&id) {
                    is_so
                } else {
                    before.is_mirrored(id)
                };
                assert_eq!(scene.is_mirrored(id), wanted, "triangle {id}");
            }
        }
    }

    #[test]
    fn bytes_are_36_of_vertices_and_4_of_material_per_triangle() {
        let scene = load_default("triangle-soup");
        assert_eq!(scene.bytes(), scene.triangles.len() * 40);
    }
}

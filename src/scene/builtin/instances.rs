//! Copies of four bumpy objects in a lattice, each translated, rotated, unevenly scaled and
//! sometimes mirrored: a benchmark for two-level structures.

use super::super::builder::{Look, SceneBuilder};
use super::super::{Material, Transform};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use super::sphere::SphereGrid;
use glam::{DMat3, DVec3, Mat3, Vec3};
use raystone_core::geometry::Triangle;
use raystone_core::parameters;
use raystone_core::random::Pcg32;

const OBJECTS: u32 = 4;
/// Bound on the distance of an object's points from its centre.
const OBJECT_RADIUS: f64 = 1.3;
/// Size of objects at overlap 1, relative to what fits into a cell.
const LARGEST: f64 = 6.0;

parameters! {
    /// `instances`.
    pub(super) struct Instances {
        /// number of copies
        count: usize = 64, in 1..=4096;
        /// most triangles of an object
        detail: usize = 320, in 8..=2000;
        /// 0: boxes of copies stay apart; 1: copies reach across six cells
        overlap: f64 = 0.2, in 0.0..=1.0;
        /// seed of places, turns and scales
        seed: u64 = 1, in 0..=i64::MAX as u64;
    }
}

impl BuiltinScene for Instances {
    const NAME: &'static str = "instances";
    const DESCRIPTION: &'static str =
        "copies of four bumpy objects, moved, turned and scaled, under a white sky";

    fn build(&self) -> (SceneBuilder, Look) {
        let Self { count, detail, .. } = *self;
        let mut pcg = Pcg32::with_stream(self.seed, Pcg32::DEFAULT_STREAM);
        let mut builder = SceneBuilder::new(false, count * detail);
        for index in 0..OBJECTS {
            builder.add_object(object(index, detail));
        }
        let cells = (1..).find(|n| n * n * n >= count).unwrap_or(1);
        for index in 0..count {
            let cell = [
                index % cells,
                index / cells % cells,
                index / (cells * cells),
            ];
            let to_world = transform(&mut pcg, cell, cells, self.overlap);
            builder.place(index as u32 % OBJECTS, to_world, index as u32 % 3);
        }
        let colors = [(0.75, 0.4, 0.3), (0.4, 0.65, 0.4), (0.4, 0.5, 0.75)];
        let materials = colors.map(|color| Material::diffuse("copy", color.into()));
        let eye = Vec3::new(1.7, 1.3, 2.5);
        let look = Look::under_sky(materials.into(), eye, Vec3::splat(0.5), 40.0);
        (builder, look)
    }
}

/// A closed bumpy sphere around the origin.
fn object(index: u32, detail: usize) -> Vec<Triangle> {
    let mut builder = SceneBuilder::new(false, detail);
    let frequency = 0.7 + 0.45 * f64::from(index);
    let radius = |direction: DVec3| {
        let sin = |x: f64, phase: f64| sin_cos_turns(frequency * x + phase).0;
        1.0 + 0.29 * sin(direction.x, 0.1) * sin(direction.y, 0.35) * sin(direction.z, 0.6)
    };
    SphereGrid::with_at_most(detail).push(&mut builder, 0, |direction| {
        (radius(direction) * direction).as_vec3()
    });
    builder.into_triangles()
}

/// Random placement of a copy in its cell of the unit cube; one in eight is mirrored.
fn transform(pcg: &mut Pcg32, cell: [usize; 3], cells: usize, overlap: f64) -> Transform {
    let mut uniform = || f64::from(pcg.uniform_f32());
    let edge = 1.0 / cells as f64;
    let fitting = 0.5 * edge / OBJECT_RADIUS;
    let mut scale = [0.0; 3].map(|_| fitting * (0.5 + 0.5 * uniform()));
    let largest = scale.into_iter().fold(0.0, f64::max);
    let slack = 0.5 * edge - largest * OBJECT_RADIUS;
    let offset = cell.map(|c| (c as f64 + 0.5) * edge + slack * (2.0 * uniform() - 1.0));
    let rotation = rotation([uniform(), uniform(), uniform()]);
    if uniform() < 0.125 {
        scale[0] = -scale[0];
    }
    let grown = 1.0 + (LARGEST - 1.0) * overlap;
    let linear = rotation * DMat3::from_diagonal(DVec3::from_array(scale) * grown);
    let linear: Mat3 = linear.as_mat3();
    Transform::new(
        [linear.x_axis, linear.y_axis, linear.z_axis],
        DVec3::from_array(offset).as_vec3(),
    )
}

/// A uniformly distributed rotation from three uniform numbers (K. Shoemake, "Uniform random
/// rotations", Graphics Gems III, 1992), using products that are identical on every platform.
fn rotation([a, b, c]: [f64; 3]) -> DMat3 {
    let (s1, c1) = sin_cos_turns(b);
    let (s2, c2) = sin_cos_turns(c);
    let (r1, r2) = ((1.0 - a).sqrt(), a.sqrt());
    let [x, y, z, w] = [s1 * r1, c1 * r1, s2 * r2, c2 * r2];
    DMat3::from_cols(
        DVec3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        ),
        DVec3::new(
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        ),
        DVec3::new(
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            1.0 - 2.0 * (x * x + y * y),
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_with;
    use super::*;
    use crate::{Bounds, SceneData};
    use raystone_core::params::ParamValue;

    fn scene(count: i64, overlap: f64) -> SceneData {
        let count = ("count", ParamValue::Integer(count));
        load_with(
            "instances",
            &[count, ("overlap", ParamValue::Number(overlap))],
        )
    }

    fn boxes(scene: &SceneData) -> Vec<Bounds> {
        let assembly = scene.assembly.as_ref().unwrap();
        let copies = assembly.instances().iter();
        copies
            .map(|instance| Bounds::of(&assembly.copy(instance).collect::<Vec<_>>()))
            .collect()
    }

    fn overlapping_pairs(boxes: &[Bounds]) -> usize {
        let overlap = |a: &Bounds, b: &Bounds| a.min.max(b.min).cmplt(a.max.min(b.max)).all();
        let after = |i: usize| boxes[i + 1..].iter().filter(move |b| overlap(&boxes[i], b));
        (0..boxes.len()).map(|i| after(i).count()).sum()
    }

    #[test]
    fn boxes_stay_apart_without_overlap_and_meet_more_and_more_with_it() {
        let pairs = |overlap| overlapping_pairs(&boxes(&scene(125, overlap)));
        let counts = [0.0, 0.2, 0.5, 1.0].map(pairs);
        assert_eq!(counts[0], 0);
        assert!(counts.is_sorted() && counts[1] > 100, "{counts:?}");
        assert!(counts[3] > 125 * 124 / 4, "{counts:?}");
    }

    #[test]
    fn every_count_places_that_many_copies_and_some_are_mirrored() {
        for count in [1, 7, 64, 4096] {
            let scene = scene(count, 0.2);
            let assembly = scene.assembly.as_ref().unwrap();
            assert_eq!(assembly.instances().len(), count as usize);
            assert_eq!(assembly.triangles(), scene.triangles.len() as u64);
            let mirrored =
                |i: &&super::super::super::Instance| i.to_world.parts().0.determinant() < 0.0;
            let mirrored = assembly.instances().iter().filter(mirrored).count();
            assert!(
                count < 64 || (mirrored * 16 > count as usize && mirrored * 4 < count as usize)
            );
            for instance in assembly.instances() {
                assert!(instance.to_world.condition() < 8.0);
            }
        }
    }

    #[test]
    fn a_moved_copy_moves_its_triangles_and_changes_the_hash() {
        let mut scene = scene(8, 0.0);
        let before = scene.clone();
        let there = Transform::new([Vec3::X, Vec3::Y, Vec3::Z], Vec3::splat(5.0));
        scene.move_instance(3, there).unwrap();
        let first = scene.assembly.as_ref().unwrap().instances()[3].first as usize;
        let count = scene.assembly.as_ref().unwrap().objects()[3].len();
        for (index, (a, b)) in before.triangles.iter().zip(&scene.triangles).enumerate() {
            let is_moved = (first..first + count).contains(&index);
            assert_eq!(a != b, is_moved, "triangle {index}");
        }
        assert_ne!(before.hash, scene.hash);
        assert!(scene.move_instance(8, there).is_err());
    }
}

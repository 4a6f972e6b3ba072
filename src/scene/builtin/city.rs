//! A town of unit cubes: houses with stepped gables, towers and gardens between streets. Only
//! visible faces exist, as in the block-world meshes that papers measure, such as Rungholt.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use glam::Vec3;
use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// `city`.
    pub(super) struct City {
        /// most triangles: the largest square town that has no more
        triangles: usize = 60_000, in 2..=50_000_000;
        /// seed of the houses (PCG, O'Neill 2014)
        seed: u64 = 1, in 0..=i64::MAX as u64;
    }
}

/// Columns along an edge of a plot, including its two streets.
const PLOT: usize = 14;
/// Width of a street in columns.
const STREET: usize = 3;

const PAVING: u32 = 0;
const GRASS: u32 = 1;
const WALL: u32 = 2;
const ROOF: u32 = 3;
const LEAVES: u32 = 4;

impl BuiltinScene for City {
    const NAME: &'static str = "city";
    const DESCRIPTION: &'static str =
        "a town of unit cubes under a white sky: houses with stepped gables, towers, gardens";

    fn build(&self) -> (SceneBuilder, Look) {
        let town = Town::with_at_most(self.triangles, self.seed);
        let mut builder = SceneBuilder::new(false, town.triangles());
        town.push(&mut builder);
        let materials = vec![
            Material::diffuse("paving", Vec3::new(0.45, 0.44, 0.42)),
            Material::diffuse("grass", Vec3::new(0.25, 0.42, 0.16)),
            Material::diffuse("wall", Vec3::new(0.74, 0.68, 0.56)),
            Material::diffuse("roof", Vec3::new(0.56, 0.24, 0.17)),
            Material::diffuse("leaves", Vec3::new(0.16, 0.32, 0.12)),
        ];
        let edge = town.edge as f32;
        let eye = edge * Vec3::new(0.42, 0.34, 0.72);
        let target = edge * Vec3::new(0.0, -0.04, 0.06);
        (builder, Look::under_sky(materials, eye, target, 45.0))
    }
}

/// The cubes on a square of the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Column {
    height: i32,
    /// Cubes below this one belong to the wall.
    wall: i32,
    top: u32,
}

impl Column {
    const fn flat(top: u32) -> Self {
        Self {
            height: 0,
            wall: 0,
            top,
        }
    }

    fn side(&self, cube: i32) -> u32 {
        if cube < self.wall { WALL } else { self.top }
    }
}

#[derive(Debug, Clone, Copy)]
struct Plot {
    /// First column of the house in each direction, and one past its last.
    house: [[i32; 2]; 2],
    /// Height of its walls in cubes.
    walls: i32,
    /// Axis across its ridge; `None` for a flat roof.
    gable: Option<usize>,
    /// Columns with trees.
    trees: [[i32; 2]; 3],
}

impl Plot {
    /// The plot at this row and column of the town, independent of the town's size.
    fn new(seed: u64, row: usize, column: usize) -> Self {
        let mut random = Pcg32::with_stream(seed, (row as u64) << 32 | column as u64);
        let mut between =
            |least: i32, most: i32| least + random.below((most - least + 1) as usize) as i32;
        let yard = (PLOT - STREET) as i32;
        let is_tower = between(0, 15) == 0;
        let house = [0, 1].map(|_| {
            let length = if is_tower { 5 } else { between(5, 9) };
            let first = STREET as i32 + between(1, yard - length - 1);
            [first, first + length]
        });
        Self {
            house,
            walls: if is_tower {
                between(14, 26)
            } else {
                between(3, 7)
            },
            gable: (!is_tower).then(|| between(0, 1) as usize),
            trees: [0; 3].map(|_| [0; 2].map(|_| between(STREET as i32, PLOT as i32 - 1))),
        }
    }

    fn column(&self, at: [i32; 2]) -> Column {
        let is_inside =
            |axis: usize| (self.house[axis][0]..self.house[axis][1]).contains(&at[axis]);
        if is_inside(0) && is_inside(1) {
            let step = |axis: usize| {
                let [first, end] = self.house[axis];
                (at[axis] - first + 1).min(end - at[axis])
            };
            return Column {
                height: self.walls + self.gable.map_or(0, step),
                wall: self.walls,
                top: ROOF,
            };
        }
        if at.iter().any(|c| *c < STREET as i32) {
            return Column::flat(PAVING);
        }
        match self.trees.iter().position(|tree| *tree == at) {
            Some(tree) => Column {
                height: 2 + tree as i32,
                wall: 1,
                top: LEAVES,
            },
            None => Column::flat(GRASS),
        }
    }
}

struct Town {
    /// Columns along an edge of the town, and of the stored square.
    edge: usize,
    stored: usize,
    columns: Vec<Column>,
}

impl Town {
    /// The largest town of at most `triangles` triangles, at least 2.
    fn with_at_most(triangles: usize, seed: u64) -> Self {
        // A column has at least a visible top.
        let stored = (triangles / 2).isqrt().max(1);
        let plots = stored.div_ceil(PLOT);
        let plot = |i: usize| Plot::new(seed, i / plots, i % plots);
        let plots_of: Vec<Plot> = (0..plots * plots).map(plot).collect();
        let column = |i: usize| {
            let (row, column) = (i / stored, i % stored);
            let plot = plots_of[row / PLOT * plots + column / PLOT];
            plot.column([(row % PLOT) as i32, (column % PLOT) as i32])
        };
        let columns = (0..stored * stored).map(column).collect();
        let mut town = Self {
            edge: 1,
            stored,
            columns,
        };
        let (mut fits, mut too_large) = (1, stored + 1);
        while too_large - fits > 1 {
            town.edge = fits.midpoint(too_large);
            if town.triangles() <= triangles {
                fits = town.edge;
            } else {
                too_large = town.edge;
            }
        }
        town.edge = fits;
        town
    }

    /// Height at a place; 0 outside.
    fn height(&self, row: Option<usize>, column: Option<usize>) -> i32 {
        let inside = |c: Option<usize>| c.filter(|c| *c < self.edge);
        match (inside(row), inside(column)) {
            (Some(row), Some(column)) => self.columns[row * self.stored + column].height,
            _ => 0,
        }
    }

    /// Heights of the four neighbours: previous and next row, then columns.
    fn beside(&self, row: usize, column: usize) -> [i32; 4] {
        [
            self.height(row.checked_sub(1), Some(column)),
            self.height(Some(row + 1), Some(column)),
            self.height(Some(row), column.checked_sub(1)),
            self.height(Some(row), Some(column + 1)),
        ]
    }

    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let edge = self.edge;
        (0..edge).flat_map(move |row| (0..edge).map(move |column| (row, column)))
    }

    fn triangles(&self) -> usize {
        let faces = |(row, column): (usize, usize)| {
            let height = self.columns[row * self.stored + column].height;
            let sides = self
                .beside(row, column)
                .map(|other| (height - other).max(0));
            1 + sides.iter().sum::<i32>() as usize
        };
        2 * self.places().map(faces).sum::<usize>()
    }

    /// Adds the visible triangles, counter-clockwise from outside, centred at the origin.
    fn push(&self, builder: &mut SceneBuilder) {
        let half = self.edge as i32 / 2;
        for (row, column) in self.places() {
            let here = self.columns[row * self.stored + column];
            let (x, z) = (row as i32 - half, column as i32 - half);
            let point = |dx: i32, y: i32, dz: i32| glam::IVec3::new(x + dx, y, z + dz).as_vec3();
            let top = [[0, 0], [0, 1], [1, 1], [1, 0]].map(|[dx, dz]| point(dx, here.height, dz));
            builder.push_quad(top, here.top);
            // Feet of each side, ordered so that the wall above faces outwards.
            let feet = [
                [[0, 0], [0, 1]],
                [[1, 1], [1, 0]],
                [[1, 0], [0, 0]],
                [[0, 1], [1, 1]],
            ];
            for ([a, b], other) in feet.into_iter().zip(self.beside(row, column)) {
                for cube in other..here.height {
                    let wall = [(a, cube), (b, cube), (b, cube + 1), (a, cube + 1)];
                    let quad = wall.map(|([dx, dz], y)| point(dx, y, dz));
                    builder.push_quad(quad, here.side(cube));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_with;
    use super::*;
    use raystone_core::geometry::Triangle;
    use raystone_core::params::ParamValue;
    use std::collections::HashMap;

    fn city(triangles: i64, seed: i64) -> crate::SceneData {
        let changes = [("triangles", triangles), ("seed", seed)];
        load_with("city", &changes.map(|(k, v)| (k, ParamValue::Integer(v))))
    }

    #[test]
    fn it_has_nearly_as_many_triangles_as_allowed_and_never_more() {
        for most in [2, 3, 9, 1_000, 60_000, 500_000] {
            let count = city(most, 1).triangles.len() as i64;
            assert!(count <= most, "{count} of {most}");
            assert!(most < 1_000 || count * 100 > 90 * most, "{count} of {most}");
        }
        assert_ne!(city(5_000, 1).hash, city(5_000, 2).hash);
    }

    /// Faces agree in orientation on every inner edge; only the edge of the ground is open.
    #[test]
    fn its_surface_is_closed_but_for_the_edge_of_the_ground_and_faces_outwards() {
        let scene = city(20_000, 7);
        let mut balance: HashMap<[[i32; 3]; 2], i32> = HashMap::new();
        let corner = |v: Vec3| v.as_ivec3().to_array();
        for Triangle { vertices } in &scene.triangles {
            for k in 0..3 {
                let (a, b) = (corner(vertices[k]), corner(vertices[(k + 1) % 3]));
                *balance.entry([a, b]).or_default() += 1;
                *balance.entry([b, a]).or_default() -= 1;
            }
        }
        let open = balance.iter().filter(|(_, n)| **n != 0);
        let bounds = scene.bounds();
        for ([a, b], n) in open {
            assert_eq!((a[1], b[1], n.abs()), (0, 0, 1));
            let on_edge = |axis: usize| {
                let ends = [bounds.min[axis] as i32, bounds.max[axis] as i32];
                a[axis] == b[axis] && ends.contains(&a[axis])
            };
            assert!(on_edge(0) || on_edge(2), "{a:?} {b:?}");
        }
        let up = |t: &Triangle| {
            let [a, b, c] = t.vertices;
            (b - a).cross(c - a).y
        };
        assert!(scene.triangles.iter().all(|t| up(t) >= 0.0));
        assert_eq!(
            scene.triangles.iter().map(up).sum::<f32>(),
            2.0 * {
                let size = bounds.max - bounds.min;
                size.x * size.z
            }
        );
    }

    #[test]
    fn houses_have_walls_and_roofs_and_do_not_stand_on_streets() {
        let scene = city(60_000, 1);
        for material in [PAVING, GRASS, WALL, ROOF, LEAVES] {
            assert!(scene.material_ids.contains(&material), "{material}");
        }
        for row in 0..40 {
            for column in 0..40 {
                let [[x0, x1], [z0, z1]] = Plot::new(3, row, column).house;
                assert!(x0 > STREET as i32 && z0 > STREET as i32);
                assert!(x1 <= PLOT as i32 && z1 <= PLOT as i32);
            }
        }
    }
}

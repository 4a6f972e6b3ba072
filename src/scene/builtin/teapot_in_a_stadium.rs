//! Teapot in a stadium: a small detailed object in a scene a thousand times larger, which defeats
//! uniform grids (Haines, Ray Tracing News 1988).

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use super::teapot_patches::tessellate;
use glam::Vec3;
use raystone_core::parameters;

parameters! {
    /// `teapot-in-a-stadium`.
    pub(super) struct TeapotInAStadium {
        /// quadrilaterals along each edge of the teapot's 32 patches; 10 gives 6,320 triangles
        subdivision: usize = 10, in 2..=500;
    }
}

const TEAPOT: u32 = 0;
const FIELD: u32 = 1;
const ROWS: [u32; 2] = [2, 3];

/// Edge of the field, units; the teapot is about 6.4 long.
const FIELD_EDGE: f32 = 10_000.0;
const FIELD_CELLS: usize = 96;
/// Rows of seats, and straight segments per row.
const ROW_COUNT: usize = 24;
const ROW_PIECES: usize = 128;
/// Radius of the first row, and size of each.
const FIRST_RADIUS: f32 = 2500.0;
const ROW_DEPTH: f32 = 90.0;
const ROW_HEIGHT: f32 = 50.0;
/// The teapot floats this far above the field, so that its flat bottom does not coincide with it.
const LIFT: f32 = 0.01;

impl BuiltinScene for TeapotInAStadium {
    const NAME: &'static str = "teapot-in-a-stadium";
    const DESCRIPTION: &'static str =
        "the Utah teapot on the field of a stadium a thousand times its size, white sky";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::default();
        for triangle in tessellate(self.subdivision) {
            builder.push(triangle.map(|v| v + LIFT * Vec3::Y), TEAPOT);
        }
        let along = |i: usize| FIELD_EDGE * (i as f32 / FIELD_CELLS as f32 - 0.5);
        builder.push_grid(FIELD_CELLS, FIELD, |i, k| {
            Vec3::new(along(i), 0.0, along(k))
        });
        push_rows(&mut builder);
        let materials = vec![
            Material::diffuse("teapot", Vec3::new(0.8, 0.55, 0.3)),
            Material::diffuse("field", Vec3::new(0.3, 0.5, 0.25)),
            Material::diffuse("row", Vec3::splat(0.6)),
            Material::diffuse("other row", Vec3::new(0.3, 0.35, 0.55)),
        ];
        let (eye, target) = (Vec3::new(2.5, 3.4, 8.2), Vec3::new(0.2, 1.9, 0.0));
        (builder, Look::under_sky(materials, eye, target, 40.0))
    }
}

/// Concentric steps, each with an upright riser and a level tread.
fn push_rows(builder: &mut SceneBuilder) {
    let at = |radius: f32, height: f32, piece: usize| {
        let (sin, cos) = sin_cos_turns((piece % ROW_PIECES) as f64 / ROW_PIECES as f64);
        Vec3::new(radius * cos as f32, height, radius * sin as f32)
    };
    for row in 0..ROW_COUNT {
        let radius = FIRST_RADIUS + ROW_DEPTH * row as f32;
        let outer = radius + ROW_DEPTH;
        let bottom = ROW_HEIGHT * row as f32;
        let top = bottom + ROW_HEIGHT;
        for piece in 0..ROW_PIECES {
            let pair = |radius, height| [at(radius, height, piece), at(radius, height, piece + 1)];
            let ([a, b], [d, c], [f, e]) =
                (pair(radius, bottom), pair(radius, top), pair(outer, top));
            let material = ROWS[row % 2];
            builder.push_quad([a, b, c, d], material);
            builder.push_quad([d, c, e, f], material);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{load_default, load_with};
    use super::*;
    use crate::Bounds;
    use raystone_core::geometry::Triangle;
    use raystone_core::params::ParamValue;

    fn teapot(subdivision: usize) -> Vec<Triangle> {
        let triangles = tessellate(subdivision).into_iter();
        triangles.map(|vertices| Triangle { vertices }).collect()
    }

    #[test]
    fn the_teapot_has_newells_extent_and_6320_triangles() {
        let triangles = teapot(10);
        assert_eq!(triangles.len(), 6320);
        let bounds = Bounds::of(&triangles);
        let published = Bounds {
            min: Vec3::new(-3.0, 0.0, -2.0),
            max: Vec3::new(3.434, 3.15, 2.0),
        };
        assert!((bounds.min - published.min).abs().max_element() < 1e-3);
        assert!((bounds.max - published.max).abs().max_element() < 1e-3);
    }

    #[test]
    fn no_triangle_of_the_teapot_is_degenerate_and_finer_ones_have_more() {
        for subdivision in [2, 3, 5, 10, 16] {
            let triangles = teapot(subdivision);
            assert_eq!(
                triangles.iter().find(|t| t.has_zero_area()),
                None,
                "{subdivision}"
            );
            // 32 patches, of which 8 meet a pole and lose a triangle per cell there.
            let n = subdivision;
            assert_eq!(triangles.len(), 2 * 32 * n * n - 8 * n);
        }
    }

    #[test]
    fn the_teapot_matches_a_public_tessellation_of_it() {
        let folder = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../../shared/scenes/utah-teapot"
        );
        let Ok(text) = std::fs::read_to_string(format!("{folder}/teapot.obj")) else {
            println!("skipped: {folder} is absent");
            return;
        };
        let ours: Vec<Vec3> = tessellate(10).into_iter().flatten().collect();
        let mut compared = 0;
        for line in text.lines().filter(|line| line.starts_with("v ")) {
            let numbers: Vec<f32> = line[2..]
                .split_whitespace()
                .map(|word| word.parse().unwrap())
                .collect();
            let vertex = Vec3::from_slice(&numbers);
            let distance = |p: &Vec3| p.distance(vertex);
            let nearest = ours.iter().map(distance).fold(f32::INFINITY, f32::min);
            assert!(nearest < 5e-3, "{vertex} is {nearest} away");
            compared += 1;
        }
        assert!(compared > 3000);
    }

    #[test]
    fn the_stadium_is_a_thousand_times_the_teapot() {
        let scene = load_default("teapot-in-a-stadium");
        let extent = scene.bounds().max - scene.bounds().min;
        assert_eq!(extent.x, FIELD_EDGE);
        let field_and_rows = 2 * FIELD_CELLS * FIELD_CELLS + 4 * ROW_COUNT * ROW_PIECES;
        assert_eq!(scene.triangles.len(), 6320 + field_and_rows);
        let fine = load_with(
            "teapot-in-a-stadium",
            &[("subdivision", ParamValue::Integer(20))],
        );
        assert_eq!(fine.triangles.len(), 2 * 32 * 400 - 160 + field_and_rows);
    }
}

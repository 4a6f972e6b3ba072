//! Curling strands around a ball, with normals that change from pixel to pixel, so secondary rays
//! are incoherent (Laine's hairball in closed form; Dufay 2017 expects no gain there).

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use glam::{DVec3, Vec3};
use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// `hairball`.
    pub(super) struct Hairball {
        /// number of triangles; the last strand may be shorter
        triangles: usize = 60_000, in 1..=50_000_000;
        /// seed of the strands (PCG, O'Neill 2014)
        seed: u64 = 1, in 0..=i64::MAX as u64;
    }
}

/// Pieces of a strand, each a three-sided prism.
const PIECES: usize = 20;
const SIDES: usize = 3;
/// Distances from the centre where strands begin and end.
const ROOT: f64 = 0.15;
const TIP: f64 = 1.0;
/// Thickness at the root, tapering to a tenth at the tip.
const THICKNESS: f64 = 0.012;

impl BuiltinScene for Hairball {
    const NAME: &'static str = "hairball";
    const DESCRIPTION: &'static str = "strands that curl out of a ball under a white sky: neighbouring rays have nothing in common";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::new(false, self.triangles);
        let mut pcg = Pcg32::with_stream(self.seed, Pcg32::DEFAULT_STREAM);
        let mut number = 0;
        while builder.len() < self.triangles {
            let strand = Strand::new(&mut pcg);
            let rings: Vec<_> = (0..=PIECES)
                .map(|i| strand.ring(i as f64 / PIECES as f64))
                .collect();
            for rings in rings.windows(2) {
                for side in 0..SIDES {
                    let next = (side + 1) % SIDES;
                    let [a, b] = [rings[0][side], rings[0][next]];
                    let [c, d] = [rings[1][next], rings[1][side]];
                    for triangle in [[a, b, c], [a, c, d]] {
                        if builder.len() < self.triangles {
                            builder.push(triangle, number % 3);
                        }
                    }
                }
            }
            number += 1;
        }
        let colors = [(0.65, 0.45, 0.3), (0.75, 0.6, 0.4), (0.45, 0.3, 0.22)];
        let materials = colors.map(|color| Material::diffuse("strand", color.into()));
        let look = Look::under_sky(materials.into(), Vec3::new(0.0, 0.6, 2.9), Vec3::ZERO, 42.0);
        (builder, look)
    }
}

struct Strand {
    /// Along the line, and across it.
    axes: [DVec3; 3],
    /// Curl radius at the tip, number of turns, and phase.
    curl: f64,
    turns: f64,
    phase: f64,
}

impl Strand {
    fn new(pcg: &mut Pcg32) -> Self {
        let mut uniform = || f64::from(pcg.uniform_f32());
        let z = 2.0 * uniform() - 1.0;
        let (sin, cos) = sin_cos_turns(uniform());
        let radius = (1.0 - z * z).sqrt();
        let out = DVec3::new(radius * cos, radius * sin, z);
        let across = DVec3::new(-sin, cos, 0.0);
        Self {
            axes: [out, across, out.cross(across)],
            curl: 0.05 + 0.15 * uniform(),
            turns: 0.5 + 2.0 * uniform(),
            phase: uniform(),
        }
    }

    /// Centre line of the strand, from 0 at the root to 1 at the tip.
    fn middle(&self, t: f64) -> DVec3 {
        let [out, across, up] = self.axes;
        let (sin, cos) = sin_cos_turns(self.phase + self.turns * t);
        let curl = self.curl * t;
        out * (ROOT + (TIP - ROOT) * t) + (across * cos + up * sin) * curl
    }

    /// Corners around the centre line.
    fn ring(&self, t: f64) -> [Vec3; SIDES] {
        let [_, across, up] = self.axes;
        let thickness = THICKNESS * (1.0 - 0.9 * t);
        std::array::from_fn(|side| {
            let (sin, cos) = sin_cos_turns(side as f64 / SIDES as f64);
            (self.middle(t) + (across * cos + up * sin) * thickness).as_vec3()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_with;
    use raystone_core::params::ParamValue;

    fn hairball(triangles: i64, seed: i64) -> crate::SceneData {
        let changes = [("triangles", triangles), ("seed", seed)];
        load_with(
            "hairball",
            &changes.map(|(k, v)| (k, ParamValue::Integer(v))),
        )
    }

    #[test]
    fn it_has_as_many_triangles_as_asked_for_and_is_a_ball_in_all_directions() {
        let scene = hairball(12_345, 1);
        assert_eq!(scene.triangles.len(), 12_345);
        let bounds = scene.bounds();
        assert!(bounds.max.max_element() < 1.25 && bounds.min.min_element() > -1.25);
        assert!(bounds.max.min_element() > 0.9 && bounds.min.max_element() < -0.9);
        let long =
            |t: &raystone_core::geometry::Triangle| t.vertices[0].distance(t.vertices[1]) > 0.2;
        assert!(!scene.triangles.iter().any(long));
    }

    #[test]
    fn the_same_seed_gives_the_same_strands_and_fewer_triangles_the_first_of_them() {
        let (all, few) = (hairball(600, 3), hairball(400, 3));
        assert_eq!(all.triangles[..400], few.triangles[..]);
        assert_ne!(hairball(600, 4).hash, all.hash);
    }
}

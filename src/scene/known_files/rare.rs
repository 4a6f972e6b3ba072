//! A fourth file of each format: numbers at the ends of their types, and values that files may give in part.

use super::{Values, part};
use crate::ies::IesProfile;
use crate::known_scenes::with;
use crate::polygon::triangulate;
use glam::{DVec3, Vec3};
use raystone_core::geometry::Triangle;
use std::path::Path;

/// In planes from 90° on by the half: those before are their mirror image about 270°, that at 130° comes again at 410°.
const HALF: &str = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 3 1 2 0 0 0\n1 1 40\n0 90\n90 130 270\n5 10\n5 20\n5 40\n";

/// What each of them is, in turn.
pub(super) fn values(all: &mut Values) -> Result<(), String> {
    let read = |name: &str| crate::named(name).map_err(|e| e.to_string());
    let words = [
        [0.0; 3],
        [40_000.0, 0.0, 0.0],
        [50_000.0, -5.0, 100_000_000.0],
    ];
    all.corners("triangle of words", &read("known:/d.ply")?, 0, words)?;
    all.bytes(&read("known:/d.gltf")?)?;
    all.coordinates(&read("known:/d.obj")?)?;
    all.corrected()?;
    all.half()?;
    all.upright()?;
    all.crossing();
    Ok(())
}

impl Values {
    /// Of a normalised byte both −128 and −127 are −1. Weights of 1/8 and 3/8 are a quarter and three quarters, of joints at 8 along z and
    /// at 4 along x.
    fn bytes(&mut self, scene: &crate::SceneData) -> Result<(), String> {
        let plain = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, -1.0]];
        self.corners("triangle of bytes", scene, 0, plain)?;
        let moved = plain.map(|[x, y, z]| [x + 3.0, y, z + 2.0]);
        self.corners("triangle of a skin of light weights", scene, 1, moved)
    }

    /// From the last of four coordinates back. Of one number a scale along v is 1, and an offset 0.
    fn coordinates(&mut self, scene: &crate::SceneData) -> Result<(), String> {
        let uvs = *part(&scene.uvs, 0, "coordinates")?;
        for (found, expected) in uvs.into_iter().zip([[0.25, 0.25], [1.0, 1.0], [0.5, 0.0]]) {
            let [u, v] = expected;
            self.vector("coordinates from the end", found.extend(0.0), [u, v, 0.0]);
        }
        let wide = part(&scene.materials, 0, "materials")?;
        let placed = wide
            .base_color_texture
            .ok_or("a known material has no texture")?;
        let diagonal = Vec3::new(placed.linear.x_axis.x, placed.linear.y_axis.y, 0.0);
        self.vector("scale along u alone", diagonal, [2.0, 1.0, 0.0]);
        self.vector(
            "offset along u alone",
            placed.offset.extend(0.0),
            [0.25, 0.0, 0.0],
        );
        Ok(())
    }

    /// A radiance of 2 of twice the exposure, whose channels were multiplied by 1, 2 and 4.
    fn corrected(&mut self) -> Result<(), String> {
        let image = raystone_image::read_linear(Path::new("known:/d.hdr"));
        let image = image.map_err(|e| e.to_string())?;
        let found = *part(&image.pixels, 0, "pixels")?;
        self.vector("corrected radiance", found.into(), [1.0, 0.5, 0.25]);
        Ok(())
    }

    /// Between 40 at 270° and 20 at 410° the plane at 360° has 40 − 20 · 90 / 140.
    fn half(&mut self) -> Result<(), String> {
        let profile = IesProfile::parse("a half", HALF).map_err(|e| e.to_string())?;
        for (degrees, expected) in [
            (0.0_f64, 40.0 - 20.0 * 90.0 / 140.0),
            (50.0, 20.0),
            (90.0, 10.0),
            (270.0, 40.0),
        ] {
            let (y, x) = degrees.to_radians().sin_cos();
            let found = profile.intensity(DVec3::new(x, y, 0.0));
            self.0
                .push(("intensity of half a luminaire", found, expected));
        }
        Ok(())
    }

    /// A pyramid on the plane z = 0, alike from all sides: seen from the right, the front, which is at −y, and above.
    fn upright(&mut self) -> Result<(), String> {
        const BASE: [[f32; 3]; 4] = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 0.0],
        ];
        let side = |k: usize| [BASE[k], BASE[(k + 1) % 4], [1.0, 1.0, 2.0]];
        let below = [[BASE[0], BASE[3], BASE[2]], [BASE[0], BASE[2], BASE[1]]];
        let mut scene = with(&[])?;
        scene.triangles = (0..4)
            .map(side)
            .chain(below)
            .map(|corners| Triangle::from(corners.map(Vec3::from)))
            .collect();
        (scene.camera, scene.framing) = (None, None);
        let camera = scene.view(1.0);
        let towards = (camera.eye - camera.target).signum();
        self.vector("side from which a scene is seen", towards, [1.0, -1.0, 1.0]);
        self.vector("axis that a scene stands along", camera.up, [0.0, 0.0, 1.0]);
        Ok(())
    }

    /// Around its first corner more than once: no fan covers it, and it is told.
    fn crossing(&mut self) {
        let around = [
            [0.0, 0.0],
            [1.0, 0.0],
            [0.0, 1.0],
            [-1.0, 0.0],
            [0.0, -1.0],
            [3.0, 1.0],
        ];
        let corners = around.map(|[x, y]| Vec3::new(x, y, 0.0));
        let told = triangulate(&corners, |_| {});
        (self.0).push(("word on a face that crosses itself", f64::from(told), 1.0));
    }
}

//! The mirror direction, times the base colour.

use super::*;
use crate::known_images::View;
use crate::known_images::closed::polygon;
use crate::known_images::lamps::{FLOOR, NEAR, on_floor, path};
use raystone_scene::MIRROR;

pub(crate) static CHECKS: MaterialChecks = MaterialChecks {
    images,
    ..MaterialChecks::new(&MIRROR, |surface| Box::new(Mirror(surface)), mitsuba)
};

struct Mirror<'a>(&'a Surface<'a>);

impl Bsdf for Mirror<'_> {
    fn sample(&self, _: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        let direction = kept(self.0, mirrored(self.0.out, self.0.normal));
        Some(Bounce {
            direction: rounding.direction(direction),
            weight: self.0.base,
            density: None,
            medium: 1.0,
        })
    }

    fn evaluate(&self, _: DVec3, _: &mut Rounding) -> Option<Reflected> {
        None
    }

    fn is_delta(&self) -> bool {
        true
    }
}

fn mitsuba(_: &Material, color: &Color, id: &str, _: &mut Vec<String>) -> String {
    format!(
        r#"    <bsdf type="twosided" {id}>
        <bsdf type="conductor">
            <string name="material" value="none"/>
            {}
        </bsdf>
    </bsdf>
"#,
        color.named("specular_reflectance")
    )
}

/// A floor beside a mirror under a white sky, and two facing mirrors below it.
fn images() -> Result<Vec<KnownImage>, SceneError> {
    const TINT: Vec3 = vec3(0.95, 0.85, 0.7);
    /// Change in height of a path between the two mirrors.
    const STEP: f32 = 0.29;
    let mut mesh = on_floor("mirrors", Vec3::ONE)?;
    let mirror = mesh.material(Material::mirror("mirror", TINT));
    let wall = [vec3(0.0, 0.0, -1.5), 2.0 * Vec3::Y, 3.0 * Vec3::Z];
    mesh.plain(wall, mirror);
    for x in [3.0, 4.0] {
        mesh.plain([vec3(x, -3.0, -1.0), 1.5 * Vec3::Y, 2.0 * Vec3::Z], mirror);
    }
    let tint = TINT.as_dvec3();
    // The wall reflects exactly as much sky as it hides: downward paths to it continue upwards.
    let floor = |point: Vec3| {
        let [c, a, b] = wall.map(Vec3::as_dvec3);
        let corners = [c, c + a, c + a + b, c + b];
        let part = polygon(point.as_dvec3(), DVec3::Y, &corners) / PI;
        FLOOR.as_dvec3() * (DVec3::splat(1.0 - part) + part * tint)
    };
    let [close, away] = [vec3(0.3, 0.0, 0.1), vec3(1.2, 0.0, -0.4)];
    let (seen, from) = (vec3(0.0, 0.25, 0.0), vec3(0.5, 0.15, 0.0));
    let met = seen + vec3(from.x, -from.y, 0.0) * (seen.y / from.y);
    let half = vec3(0.5, -0.5 * STEP, 0.0);
    let views = vec![
        View::new("floor by the mirror", close, NEAR, floor(close)),
        View::new("floor away from it", away, NEAR, floor(away)),
        View::new("floor in the mirror", seen, from, tint * floor(met)),
        // Hits at 0.195 and every 0.29 below the upper edge of 1.5: five times.
        View::new(
            "five mirrors",
            vec3(4.0, -1.695, 0.0),
            -half,
            tint.powf(5.0),
        ),
    ];
    let scene = mesh.done(Vec::new());
    Ok(vec![KnownImage {
        name: "mirrors",
        scene,
        trial: path(8, &[("roulette", "none")]),
        views,
    }])
}

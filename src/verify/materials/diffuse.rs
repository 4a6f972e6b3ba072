//! f = base/π.

use super::*;
use raystone_scene::DIFFUSE;

pub(crate) static CHECKS: MaterialChecks =
    MaterialChecks::new(&DIFFUSE, |surface| Box::new(Diffuse(surface)), mitsuba);

struct Diffuse<'a>(&'a Surface<'a>);

impl Bsdf for Diffuse<'_> {
    fn sample(&self, uv: [f64; 2], rounding: &mut Rounding) -> Option<Bounce> {
        bounce(self, cosine_direction(self.0.normal, uv), rounding)
    }

    fn evaluate(&self, direction: DVec3, _: &mut Rounding) -> Option<Reflected> {
        let density = cosine_density(self.0.normal, direction);
        is_above(self.0, direction).then(|| Reflected {
            value: self.0.base * density,
            density,
        })
    }
}

fn mitsuba(_: &Material, color: &Color, id: &str, _: &mut Vec<String>) -> String {
    format!(
        r#"    <bsdf type="twosided" {id}>
        <bsdf type="diffuse">
            {}
        </bsdf>
    </bsdf>
"#,
        color.named("reflectance")
    )
}

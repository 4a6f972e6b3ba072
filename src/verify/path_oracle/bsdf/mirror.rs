//! The mirror direction, times the base colour.

use super::*;

pub(super) struct Mirror<'a>(pub &'a Surface<'a>);

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

//! World boxes of transformed boxes, grown so that they lose no hit.
//!
//! *Claim.* Let M be the map to object space with f32 entries, B a box there, W the image of B
//! under the exact M⁻¹ grown by [`world_box`], and let a triangle with bounds in B accept the
//! transformed ray at distance t. If t is the final answer, every box around W is entered by
//! `enter_grown`, whenever it is tested: the theorem of [`super::super::triangle`] extends through
//! the transform.
//!
//! *Proof.* ε = 2⁻²⁴ is the unit roundoff, |·| the largest component, ‖·‖ the largest row sum, κ =
//! ‖M‖ · ‖M⁻¹‖, β the largest coordinate of B, o and d the ray's origin and direction, c the
//! translation of M, and x = o + t·d the hit point, formed exactly.
//!
//! 1. The computed o' and d' differ from M·o + c and M·d by at most 4ε (‖M‖|o| + |c|) and 3ε ‖M‖|d|:
//!    sums of four and three products.
//! 2. The test clamps t into the slab interval of the triangle's bounds, padded by 2⁻²¹ = 8ε. The
//!    computed ends carry a difference, a product and a reciprocal (WGSL: 2.5 ulp = 5ε), the pad two
//!    more roundings: o' + t·d' lies in B up to 17ε (β + |o'|). Where components of d' are raised, by at
//!    most 2⁻⁶⁰|d'| or 2⁻⁸⁴, the hit lies on the raised ray, which differs by as much times t.
//! 3. |t·d| = |x − o| ≤ |x| + |o|. Together, M·x + c lies in B up to
//!    ε (17β + 21|c| + 24‖M‖|o| + 3‖M‖|x|), and so x in M⁻¹(B) up to ‖M⁻¹‖ times that.
//! 4. |x| ≤ X + pad, X being the largest coordinate of M⁻¹(B). With κ ≤ 2²⁰ the term 3εκ·pad is
//!    below 0.19 pad, so a factor 1/(1 − 0.19) < 1.24 removes it: the pad
//!    32ε (‖M⁻¹‖(β + |c|) + κX) + 32ε κ|o| covers everything with room for 2εκ(|x| + |o|).
//!    The first part is in W; the second depends on the ray: the *growth* κ·2⁻¹⁹ times |o|.
//! 5. The ray's own slab test of a box that contains x has relative errors of 7ε, a seventh of what
//!    `BOX_PAD` allows; the rounding of the two grown origins (ε|o|) and the raising of
//!    components of d and d' use the room of step 4, if |d| ≥ 2⁻⁵⁶ max(1, 1/‖M‖). The four
//!    inequalities of the plain theorem follow, and monotonicity extends them to boxes around W. ∎
//!
//! If spatial splits list a triangle in several leaves, which only together cover its bounds, the
//! clamped point of step 2 lies in one of them ([`super::super::tree::Coverage`]), and B is the box
//! of that leaf.
//!
//! M⁻¹ and ‖·‖ are computed in f64 from the f32 entries of M, with relative errors of 2⁻²⁹ of ours.

use super::super::bounds::Bounds;
use glam::DVec3;
use raystone_scene::{Instance, row_sum_norm};

/// 32 ε of the proof, 2⁻¹⁹.
const PAD: f64 = 1.0 / 524_288.0;

/// An instance with the norms of the proof.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoxMap {
    instance: Instance,
    inverse: glam::DMat3,
    offset: DVec3,
    norm_of_inverse: f64,
    condition: f64,
    pad: f64,
}

impl BoxMap {
    pub(crate) fn new(instance: &Instance) -> Self {
        Self::with_pad(instance, PAD)
    }

    /// With a pad other than that of the proof, for tests.
    pub(crate) fn with_pad(instance: &Instance, pad: f64) -> Self {
        let (linear, offset) = instance.to_object.parts();
        let inverse = linear.inverse();
        let norm_of_inverse = row_sum_norm(inverse);
        Self {
            instance: *instance,
            inverse,
            offset,
            norm_of_inverse,
            condition: row_sum_norm(linear) * norm_of_inverse,
            pad,
        }
    }

    /// Growth of top-level boxes per unit of the ray origin's largest coordinate.
    pub(crate) fn growth(&self) -> f32 {
        if self.instance.is_identity() {
            0.0
        } else {
            ((self.condition * self.pad) as f32).next_up()
        }
    }

    /// The grown world box of an object-space box; empty if that is empty.
    pub(crate) fn world_box(&self, bounds: &Bounds) -> Bounds {
        if self.instance.is_identity() || bounds.min[0] > bounds.max[0] {
            return *bounds;
        }
        let corner = |k: usize| {
            let pick = |axis: usize| [bounds.min, bounds.max][(k >> axis) & 1][axis];
            let point = DVec3::new(pick(0).into(), pick(1).into(), pick(2).into());
            self.inverse * (point - self.offset)
        };
        let (low, high) = (1..8)
            .map(corner)
            .fold((corner(0), corner(0)), |(l, h), p| (l.min(p), h.max(p)));
        let greatest = |v: [f32; 3]| v.into_iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        let reach = f64::from(greatest(bounds.min).max(greatest(bounds.max)));
        let world_reach = low.abs().max(high.abs()).max_element();
        let pad = self.pad
            * (self.norm_of_inverse * (reach + self.offset.abs().max_element())
                + self.condition * world_reach);
        Bounds {
            min: (low - pad).to_array().map(|x| (x as f32).next_down()),
            max: (high + pad).to_array().map(|x| (x as f32).next_up()),
        }
    }
}

//! A test without what makes hits exact: its time says what exactness costs. CPU version of
//! `kernels/accel/triangle/bare.wesl`.

use super::{Meeting, MoellerTrumbore, TriangleRecord, TriangleTest};
use crate::mask::{Masks, is_cut_out};
use crate::ray::{Hit, Ray};
use crate::watch::{self, Event};

/// T. Möller, B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997, and nothing around it: the distance is not
/// clamped into the triangle's bounds, rays in its plane are not left out, and of equal distances the first one found stays.
pub(crate) struct Bare;

impl TriangleTest for Bare {
    fn name(&self) -> &'static str {
        "bare"
    }

    fn description(&self) -> &'static str {
        "`moeller-trumbore` alone, without clamp, bounds and order of equal distances: hits differ by rounding, and structures \
         are timed on rays, but neither ranked nor rendered with"
    }

    fn kernel(&self) -> &'static str {
        MoellerTrumbore.kernel()
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn meet(&self, triangle: &TriangleRecord, ray: &Ray, inverse: &[f32; 3]) -> Meeting {
        MoellerTrumbore.meet(triangle, ray, inverse)
    }

    fn allowance(
        &self,
        triangle: &TriangleRecord,
        ray: &Ray,
        inverse: &[f32; 3],
        found: &Meeting,
    ) -> [f32; 3] {
        MoellerTrumbore.allowance(triangle, ray, inverse, found)
    }

    fn intersect(
        &self,
        triangle: (&TriangleRecord, Option<&Masks>),
        ray: &Ray,
        inverse: &[f32; 3],
        hit: &mut Hit,
    ) {
        watch::note(Event::Triangle(triangle.0.id));
        accept_bare(triangle, ray, &self.meet(triangle.0, ray, inverse), hit);
    }
}

/// Replaces `hit` by `found` if that is nearer. The distance of a hit begins as `t_max`.
fn accept_bare(
    (triangle, masks): (&TriangleRecord, Option<&Masks>),
    ray: &Ray,
    found: &Meeting,
    hit: &mut Hit,
) {
    if found.area > 0.0 && found.t >= ray.t_min && found.t < hit.t {
        let [u, v] = [found.u, found.v].map(|weight| weight.abs() / found.area);
        if is_cut_out(masks, triangle, ray, [u, v]) {
            return;
        }
        *hit = Hit {
            t: found.t.abs(),
            triangle: triangle.id,
            u,
            v,
        };
        watch::note(Event::Nearest(*hit));
    }
}

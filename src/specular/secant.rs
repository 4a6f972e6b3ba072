//! The search of the thesis: a triangle of samples, and the place at which the gradient through them would be 0.
//! Kernel: `kernels/specular/secant.wesl`.

use crate::newton::{CAPPED, CONVERGED, SINGULAR, Search, Solved};
use crate::path::{Sample, Setup, apart, sample_at, screen_of};
use crate::real::{Real, V3, c};
use crate::reflector::{cross3, dot3, facing, unit};

pub(crate) const BY_AREA: u32 = 0;
pub(crate) const BY_EDGE: u32 = 1;
pub(crate) const BY_EDGE_AND_GRADIENT: u32 = 2;

/// The least gradient of a triangle that ends the search by edge and gradient, squared.
const LEAST_GRADIENT: f32 = 1e-6;
/// Two edges of an equilateral triangle.
const HALF_ROOT_3: f32 = 0.866_025_4;
/// No sample.
const NONE: u32 = 3;
/// A place without a direction, squared; and one too far to square.
const NOWHERE: f32 = 1e-12;
const TOO_FAR: f32 = 1e12;

/// The directions of the first triangle: to the vertex, to the eye, and beside them (§2.8 of the digest).
pub fn first_triangle<T: Real>(setup: Setup<T>, v: V3<T>) -> [V3<T>; 3] {
    let a = facing(setup.reflector, v);
    let b = facing(setup.reflector, setup.eye);
    let across = b - a;
    let length = dot3(across, across).sqrt();
    let beside = unit(cross3(across, a + b)) * (c::<T>(HALF_ROOT_3) * length);
    [a, b, unit((a + b) * T::of(0.5) + beside)]
}

/// The sample with the greatest gradient, but for one.
fn worst<T: Real>(s: &[Sample<T>; 3], but: u32) -> u32 {
    let mut found = NONE;
    let mut size = T::of(-1.0);
    for k in 0..3u32 {
        if k != but && s[k as usize].size > size {
            found = k;
            size = s[k as usize].size;
        }
    }
    found
}

fn best<T: Real>(s: &[Sample<T>; 3]) -> u32 {
    let mut found = 0;
    if s[1].size < s[0].size {
        found = 1;
    }
    if s[2].size < s[found as usize].size {
        found = 2;
    }
    found
}

/// Whether the triangle is small enough in the picture.
fn is_small<T: Real>(setup: Setup<T>, search: Search<T>, s: &[Sample<T>; 3]) -> bool {
    let a = screen_of(setup, s[0].p);
    let b = screen_of(setup, s[1].p);
    let d = screen_of(setup, s[2].p);
    if search.stop == BY_AREA {
        let twice = (b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]);
        return twice.abs() < T::of(2.0);
    }
    let edge = apart(a, b).max(apart(b, d)).max(apart(d, a));
    if search.stop == BY_EDGE {
        return edge < T::of(1.0);
    }
    edge < T::of(1.0) && s[best(s) as usize].size < c(LEAST_GRADIENT)
}

/// Searches from a triangle.
pub fn secant<T: Real>(
    setup: Setup<T>,
    search: Search<T>,
    v: V3<T>,
    first: [V3<T>; 3],
) -> Solved<T> {
    let mut s = first.map(|u| sample_at(setup, v, u));
    let mut out = s[0];
    let mut has_out = false;
    let mut last_in = NONE;
    let mut status = CAPPED;
    let mut iterations = 0;
    while iterations < search.most {
        iterations += 1;
        let a = s[0].g - s[2].g;
        let b = s[1].g - s[2].g;
        let (aa, bb, ab) = (dot3(a, a), dot3(b, b), dot3(a, b));
        let (ac, bc) = (dot3(a, s[2].g), dot3(b, s[2].g));
        let determinant = aa * bb - ab * ab;
        if determinant <= search.singular * (aa * bb) {
            if !has_out {
                status = SINGULAR;
                break;
            }
            // The newest sample stays, or the search would go round for ever.
            last_in = worst(&s, last_in);
            s[last_in as usize] = out;
            has_out = false;
            continue;
        }
        let alpha = (ab * bc - bb * ac) / determinant;
        let beta = (ab * ac - aa * bc) / determinant;
        let place = s[0].p * alpha + s[1].p * beta + s[2].p * (T::of(1.0) - alpha - beta);
        let square = dot3(place, place);
        if square < c(NOWHERE) || square > c(TOO_FAR) {
            status = SINGULAR;
            break;
        }
        last_in = worst(&s, NONE);
        out = s[last_in as usize];
        has_out = true;
        s[last_in as usize] = sample_at(setup, v, unit(place));
        if is_small(setup, search, &s) {
            status = CONVERGED;
            break;
        }
    }
    let found = s[best(&s) as usize];
    Solved {
        p: found.p,
        size: found.size,
        iterations,
        status,
        points: 1,
    }
}

//! The length of the path from the eye over a point of the reflector to a vertex, its gradient, and the picture.
//! Kernel: `kernels/specular/path.wesl`.

use crate::real::{Real, V3, c};
use crate::reflector::{Reflector, clamped, dot3, radius_of, slope_of, unit};
use raystone_core::parameters;

const AS_PRINTED: u32 = 0;
const SIGN_MENDED: u32 = 1;
const TRANSPOSED: u32 = 2;
const INTRINSIC: u32 = 3;

/// The least depth before the eye, so that nothing is divided by 0.
const LEAST_DEPTH: f32 = 1e-6;
/// The least cosine of normal and direction in a division.
const LEAST_COSINE: f32 = 1e-4;

parameters! {
    /// A formula for the gradient of the path's length over the surface.
    pub enum Form {
        /// equation 2.2 as it stands in the thesis: with another sign of the second leg, and u_r as the normal
        AsPrinted = "as-printed",
        /// the same with the sign mended: exact where u_r is the normal
        SignMended = "sign-mended",
        /// its derivative transposed, (u_r·e)∇r + e − (e·u_r)u_r: exact
        Transposed = "transposed",
        /// the gradient along the surface, e − (e·N)N: exact
        Intrinsic = "intrinsic",
    }
}

impl Form {
    pub(crate) const fn word(self) -> u32 {
        match self {
            Self::AsPrinted => AS_PRINTED,
            Self::SignMended => SIGN_MENDED,
            Self::Transposed => TRANSPOSED,
            Self::Intrinsic => INTRINSIC,
        }
    }
}

/// What is searched, and from where.
#[derive(Debug, Clone, Copy)]
pub struct Setup<T> {
    /// The reflector.
    pub reflector: Reflector<T>,
    /// The eye.
    pub eye: V3<T>,
    /// Axes of the picture: to the right, up, and into it.
    pub right: V3<T>,
    /// Up.
    pub up: V3<T>,
    /// Into the picture.
    pub forward: V3<T>,
    /// Pixels for a tangent of 1.
    pub pixels: T,
    /// [`Form`], as a kernel knows it.
    pub form: u32,
}

/// A point of the surface with the gradient there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<T> {
    /// The point.
    pub p: V3<T>,
    /// Its direction from the origin.
    pub u: V3<T>,
    /// The gradient of the path's length.
    pub g: V3<T>,
    /// Its square.
    pub size: T,
}

/// |EP| + |PV|.
pub fn length_of<T: Real>(setup: Setup<T>, v: V3<T>, p: V3<T>) -> T {
    let (a, b) = (p - setup.eye, v - p);
    dot3(a, a).sqrt() + dot3(b, b).sqrt()
}

/// The gradient of the path's length in space: how far from antiparallel the directions to eye and vertex are.
pub fn excess_of<T: Real>(setup: Setup<T>, v: V3<T>, p: V3<T>) -> V3<T> {
    unit(p - setup.eye) - unit(v - p)
}

/// The gradient of the path's length over the surface, by one of the formulas. `m` is normal to the surface.
pub fn gradient_of<T: Real>(setup: Setup<T>, v: V3<T>, p: V3<T>, u: V3<T>, m: V3<T>) -> V3<T> {
    let e = excess_of(setup, v, p);
    if setup.form == INTRINSIC {
        let n = unit(m);
        return e - n * dot3(e, n);
    }
    let slope = u - m / dot3(m, u).max(c(LEAST_COSINE));
    if setup.form == TRANSPOSED {
        let along = dot3(u, e);
        return slope * along + (e - u * along);
    }
    let e = if setup.form == AS_PRINTED {
        unit(p - setup.eye) + unit(v - p)
    } else {
        e
    };
    u * dot3(slope, e) + (e - u * dot3(u, e))
}

/// The sample in a direction.
pub fn sample_at<T: Real>(setup: Setup<T>, v: V3<T>, direction: V3<T>) -> Sample<T> {
    let u = clamped(setup.reflector, direction);
    let p = u * radius_of(setup.reflector, u);
    let m = slope_of(setup.reflector, p);
    let g = gradient_of(setup, v, p, u, m);
    let size = dot3(g, g);
    Sample { p, u, g, size }
}

/// Where a point is in the picture, in pixels from its middle.
pub fn screen_of<T: Real>(setup: Setup<T>, p: V3<T>) -> [T; 2] {
    let d = p - setup.eye;
    let scale = setup.pixels / dot3(d, setup.forward).max(c(LEAST_DEPTH));
    [dot3(d, setup.right) * scale, dot3(d, setup.up) * scale]
}

/// The square of the distance of two points in the picture.
pub fn apart<T: Real>(a: [T; 2], b: [T; 2]) -> T {
    let d = [b[0] - a[0], b[1] - a[1]];
    d[0] * d[0] + d[1] * d[1]
}

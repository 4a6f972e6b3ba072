//! The cone of a pixel, from the eye or from a mirror (Roger 2008, sections 5.1 and 5.2; first order, by Coddington's
//! formulas). Kernel: `kernels/cones/cone.wesl`.

use crate::disk::{Angle, V2, c};
use raystone_core::parameters;
use raystone_specular::real::{Real, V3};
use raystone_specular::reflector::{cross3, dot3, unit};

const SPHERE: u32 = 1;
const PLANE: u32 = 2;

/// Cones of the eye begin here.
const LEAST_NEAR: f32 = 1e-3;
/// The least cosine at the mirror, and the widest reflected cone, as the tangent of its angle.
const LEAST_COSINE: f32 = 1e-3;
const WIDEST: f32 = 0.5;
/// Axes with a greater z are framed by x.
const UPRIGHT: f32 = 0.9;
/// What rounding may add to a triangle's sphere.
const SLACK: f32 = 1e-5;

parameters! {
    /// What stands before the eye.
    pub enum Mirror {
        /// the unit sphere about the origin
        Sphere = "sphere",
        /// the plane x = 0
        Plane = "plane",
    }
}

impl Mirror {
    /// Its number in the kernel.
    pub fn word(self) -> u32 {
        match self {
            Self::Sphere => SPHERE,
            Self::Plane => PLANE,
        }
    }
}

/// An eye with its picture, a mirror, and the lobe of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera<T> {
    /// The eye.
    pub eye: V3<T>,
    /// To the right of the picture, of length 1.
    pub right: V3<T>,
    /// Up in the picture, of length 1.
    pub up: V3<T>,
    /// Where the eye looks, of length 1.
    pub forward: V3<T>,
    /// Distance of the picture from the eye, in pixels.
    pub distance: T,
    /// Distance of neighbouring cones in the picture, in pixels.
    pub stride: T,
    /// Cones along each side of the picture.
    pub side: u32,
    /// 0 for none, or [`Mirror::word`].
    pub mirror: u32,
    /// The tangent of the half-angle of the mirror's lobe.
    pub gloss: T,
    /// Whether a reflected cone is as wide as its two widths' geometric mean, not the greater.
    pub is_mean: bool,
}

/// A cone of circular section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone<T> {
    /// Where it begins.
    pub apex: V3<T>,
    /// Its axis, of length 1.
    pub axis: V3<T>,
    /// Two directions across it, of length 1.
    pub right: V3<T>,
    /// The other one.
    pub up: V3<T>,
    /// The tangent of its half-angle.
    pub tangent: T,
    /// What is nearer along the axis is not in it.
    pub near: T,
    /// What the narrower of the pixel's cone and the mirror's lobe has of its width.
    pub narrow: T,
}

fn framed<T: Real>(apex: V3<T>, axis: V3<T>, tangent: T, near: T, narrow: T) -> Cone<T> {
    let (zero, one) = (c(0.0), c(1.0));
    let mut helper = V3::new(zero, zero, one);
    if axis.z.abs() > c(UPRIGHT) {
        helper = V3::new(one, zero, zero);
    }
    let right = unit(cross3(helper, axis));
    Cone {
        apex,
        axis,
        right,
        up: cross3(axis, right),
        tangent,
        near,
        narrow,
    }
}

/// The tangent of the angle of a circular cone with a pixel's solid angle Ω: its cosine is 1 − Ω / 2π.
fn pixel_tangent<T: Angle>(camera: &Camera<T>, x: T, y: T) -> T {
    let far = (camera.distance * camera.distance + x * x + y * y).sqrt();
    // No product of three factors, whose order compilers of kernels choose.
    let flat = (camera.distance * T::PART / far).sqrt() / far;
    let square = flat * flat;
    let (one, half, quarter) = (c::<T>(1.0), c::<T>(0.5), c::<T>(0.25));
    flat * ((one - quarter * square).sqrt() / (one - half * square))
}

/// The cone off a mirror: wider by the curvature and by the lobe, its apex behind the mirror.
fn reflected<T: Real>(
    camera: &Camera<T>,
    at: V3<T>,
    normal: V3<T>,
    direction: V3<T>,
    t: T,
    tangent: T,
) -> Cone<T> {
    let cosine = (-dot3(direction, normal)).max(c(LEAST_COSINE));
    let axis = unit(direction + normal * (c::<T>(2.0) * cosine));
    let mut wider = c::<T>(1.0);
    if camera.mirror == SPHERE {
        wider = c::<T>(1.0) + c::<T>(2.0) * t / cosine;
        if camera.is_mean {
            wider = (wider * (c::<T>(1.0) + c::<T>(2.0) * t * cosine)).sqrt();
        }
    }
    let own = (tangent * wider).min(c(WIDEST));
    // The tangent of the sum of both angles.
    let sum = (own + camera.gloss) / (c::<T>(1.0) - own * camera.gloss);
    let behind = tangent * t / sum;
    let narrow = own.min(camera.gloss) / (own + camera.gloss);
    framed(at - axis * behind, axis, sum, behind, narrow)
}

/// Offsets of a pixel from the middle of the picture, in pixels.
pub(crate) fn offsets<T: Real>(camera: &Camera<T>, pixel: u32) -> V2<T> {
    let whole = |n: u32| T::of(f64::from(n));
    let middle = c::<T>(0.5) * whole(camera.side);
    V2::new(
        (whole(pixel % camera.side) + c(0.5) - middle) * camera.stride,
        (middle - whole(pixel / camera.side) - c(0.5)) * camera.stride,
    )
}

/// The cone of a pixel, row by row.
pub fn cone_of<T: Angle>(camera: &Camera<T>, pixel: u32) -> Cone<T> {
    let at = offsets(camera, pixel);
    let picture = camera.forward * camera.distance + camera.right * at.x + camera.up * at.y;
    let direction = unit(picture);
    let tangent = pixel_tangent(camera, at.x, at.y);
    let eye = camera.eye;
    if camera.mirror == SPHERE {
        let along = dot3(eye, direction);
        let inner = along * along - (dot3(eye, eye) - c(1.0));
        if inner > c(0.0) && along < c(0.0) {
            let t = -along - inner.sqrt();
            let at = eye + direction * t;
            return reflected(camera, at, unit(at), direction, t, tangent);
        }
    }
    if camera.mirror == PLANE && direction.x < c(-LEAST_COSINE) {
        let t = -eye.x / direction.x;
        let normal = V3::new(c(1.0), c(0.0), c(0.0));
        return reflected(camera, eye + direction * t, normal, direction, t, tangent);
    }
    framed(eye, direction, tangent, c(LEAST_NEAR), c(0.0))
}

/// Whether a sphere may meet the cone: the thesis's test (its equation 3.1) times the cosine, right for all angles.
pub fn meets<T: Real>(cone: &Cone<T>, centre: V3<T>, radius: T) -> bool {
    let w = centre - cone.apex;
    let along = dot3(w, cone.axis);
    let across = cross3(w, cone.axis);
    let beside = dot3(across, across).sqrt();
    let radius = radius + c::<T>(SLACK) * (along.abs() + beside);
    let outside =
        (beside - along * cone.tangent) / (c::<T>(1.0) + cone.tangent * cone.tangent).sqrt();
    outside <= radius && along + radius >= cone.near
}

/// A point in the cone's frame: see [`disk`](crate::disk).
pub fn seen_from<T: Real>(cone: &Cone<T>, p: V3<T>) -> V3<T> {
    let w = p - cone.apex;
    V3::new(
        dot3(w, cone.right) / cone.tangent,
        dot3(w, cone.up) / cone.tangent,
        dot3(w, cone.axis),
    )
}

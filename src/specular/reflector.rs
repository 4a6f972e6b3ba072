//! Reflectors about the origin: the distance of the surface in a direction, the gradient of a function that is 0 on
//! it, and that function's Hessian. Kernel: `kernels/specular/reflector.wesl`.

use crate::real::{Real, V3, c};
use raystone_core::parameters;

const PLANE: u32 = 0;
const SPHERE: u32 = 1;
const ELLIPSOID: u32 = 2;
const TORUS: u32 = 3;
const BUMPY: u32 = 4;
const CONCAVE: u32 = 5;

/// The least cosine with the normal of the plane at which it is looked up.
const PLANE_LEAST: f32 = 0.02;
/// The border of the bowl, along x.
const RIM: f32 = -0.2;
/// 1 / a² of the ellipsoid's axes 0.5, 1 and 0.25.
const AXIS_X: f32 = 4.0;
const AXIS_Y: f32 = 1.0;
const AXIS_Z: f32 = 16.0;
/// Radii of the torus, and the least cosine of the turn about its axis on its part.
const TORUS_CORE: f32 = 1.5;
const TORUS_TUBE: f32 = 0.6;
const TORUS_PART: f32 = 0.7;
const TORUS_STEPS: u32 = 8;
/// Phases of the bumps.
const PHASE_X: f32 = 0.4;
const PHASE_Y: f32 = -0.3;
/// Quarters of a turn in a radian.
const QUARTERS: f32 = std::f32::consts::FRAC_2_PI;
/// Vectors whose square is less have no direction.
const TINY: f32 = 1e-20;

parameters! {
    /// A reflector.
    pub enum Shape {
        /// the plane x = 1
        Plane = "plane",
        /// the unit sphere
        Sphere = "sphere",
        /// an ellipsoid with the half axes 0.5, 1 and 0.25
        Ellipsoid = "ellipsoid",
        /// a part of a torus with the radii 1.5 and 0.6, seen along its axis, about a point of its core
        Torus = "torus",
        /// the unit sphere with bumps: r = 1 + amplitude · cos(f x + 0.4) cos(f y − 0.3) cos(f z)
        Bumpy = "bumpy",
        /// the inside of a part of the unit sphere, a bowl with its rim at x = −0.2
        Concave = "concave",
    }
}

impl Shape {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Plane,
        Self::Sphere,
        Self::Ellipsoid,
        Self::Torus,
        Self::Bumpy,
        Self::Concave,
    ];

    pub(crate) const fn word(self) -> u32 {
        match self {
            Self::Plane => PLANE,
            Self::Sphere => SPHERE,
            Self::Ellipsoid => ELLIPSOID,
            Self::Torus => TORUS,
            Self::Bumpy => BUMPY,
            Self::Concave => CONCAVE,
        }
    }
}

/// A reflector about the origin.
#[derive(Debug, Clone, Copy)]
pub struct Reflector<T> {
    /// [`Shape`], as a kernel knows it.
    pub shape: u32,
    /// Height of bumps.
    pub amplitude: T,
    /// Their frequency, radians per unit.
    pub frequency: T,
}

/// The scalar product, in one order.
pub fn dot3<T: Real>(a: V3<T>, b: V3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// The vector product.
pub fn cross3<T: Real>(a: V3<T>, b: V3<T>) -> V3<T> {
    V3::new(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    )
}

/// The unit vector along `v`; x where `v` has no direction.
pub fn unit<T: Real>(v: V3<T>) -> V3<T> {
    let square = dot3(v, v);
    if square < c(TINY) {
        return V3::new(T::of(1.0), T::of(0.0), T::of(0.0));
    }
    v / square.sqrt()
}

/// Cosine and sine by the quarter of a turn and series, as WGSL promises too little of its own.
pub fn turn(angle: f32) -> [f32; 2] {
    let quarter = (angle * QUARTERS + 0.5).floor();
    let x = angle - quarter * 1.570_796_4;
    let s = x * x;
    let sine = x
        * (1.0
            + s * (-0.166_666_67
                + s * (0.008_333_334 + s * (-0.000_198_412_7 + s * 0.000_002_755_731_9))));
    let cosine = 1.0
        + s * (-0.5
            + s * (0.041_666_668
                + s * (-0.001_388_888_9 + s * (0.000_024_801_588 - s * 0.000_000_275_573_2))));
    let place = quarter - 4.0 * (quarter * 0.25).floor();
    if place == 1.0 {
        return [-sine, cosine];
    }
    if place == 2.0 {
        return [-cosine, -sine];
    }
    if place == 3.0 {
        return [sine, -cosine];
    }
    [cosine, sine]
}

/// The direction in which the reflector is looked up: the plane only where it is.
pub fn clamped<T: Real>(reflector: Reflector<T>, u: V3<T>) -> V3<T> {
    if reflector.shape == PLANE && u.x < c(PLANE_LEAST) {
        return unit(V3::new(c(PLANE_LEAST), u.y, u.z));
    }
    u
}

/// The direction of the radial projection of a point, on the side where the reflector is.
pub fn facing<T: Real>(reflector: Reflector<T>, v: V3<T>) -> V3<T> {
    let u = unit(v);
    if reflector.shape == CONCAVE && u.x > T::of(0.0) {
        return -u;
    }
    clamped(reflector, u)
}

/// The height of the bumps, 1 + amplitude · …, and its gradient in space at a point of the unit sphere.
fn bumps<T: Real>(reflector: Reflector<T>, u: V3<T>) -> (T, V3<T>) {
    let f = reflector.frequency;
    let [cx, sx] = (f * u.x + c(PHASE_X)).turn();
    let [cy, sy] = (f * u.y + c(PHASE_Y)).turn();
    let [cz, sz] = (f * u.z).turn();
    let a = reflector.amplitude;
    let h = T::of(1.0) + a * (cx * cy * cz);
    let slope = V3::new(sx * cy * cz, cx * sy * cz, cx * cy * sz) * (-(a * f));
    (h, slope)
}

/// The Hessian of the bumps times a vector.
fn bump_bend<T: Real>(reflector: Reflector<T>, u: V3<T>, v: V3<T>) -> V3<T> {
    let f = reflector.frequency;
    let [cx, sx] = (f * u.x + c(PHASE_X)).turn();
    let [cy, sy] = (f * u.y + c(PHASE_Y)).turn();
    let [cz, sz] = (f * u.z).turn();
    let all = cx * cy * cz;
    let xy = sx * sy * cz;
    let xz = sx * cy * sz;
    let yz = cx * sy * sz;
    V3::new(
        xy * v.y + xz * v.z - all * v.x,
        xy * v.x + yz * v.z - all * v.y,
        xz * v.x + yz * v.y - all * v.z,
    ) * (reflector.amplitude * f * f)
}

/// The distance of the surface in a direction.
pub fn radius_of<T: Real>(reflector: Reflector<T>, u: V3<T>) -> T {
    if reflector.shape == PLANE {
        return T::of(1.0) / u.x.max(c(PLANE_LEAST));
    }
    if reflector.shape == ELLIPSOID {
        let q = u.x * u.x * c(AXIS_X) + u.y * u.y * c(AXIS_Y) + u.z * u.z * c(AXIS_Z);
        return T::of(1.0) / q.sqrt();
    }
    if reflector.shape == BUMPY {
        return bumps(reflector, u).0;
    }
    if reflector.shape == TORUS {
        return torus_radius(u);
    }
    T::of(1.0)
}

/// Newton's method on the distance from the core, from within the tube.
fn torus_radius<T: Real>(u: V3<T>) -> T {
    let tube: T = c(TORUS_TUBE);
    let mut t = tube;
    for _ in 0..TORUS_STEPS {
        let p = u * t;
        let y = p.y + c(TORUS_CORE);
        let core = (y * y + p.z * p.z).sqrt().max(c(1e-3));
        let off = core - c(TORUS_CORE);
        let distance = (off * off + p.x * p.x).sqrt().max(c(1e-3));
        let slope = (off * ((y * u.y + p.z * u.z) / core) + p.x * u.x) / distance;
        t = t + (tube - distance) / slope.max(c(0.1));
        t = t.max(c(0.1)).min(c(2.0));
    }
    t
}

/// The gradient, at a point of the surface, of a function that is 0 there and grows outwards.
pub fn slope_of<T: Real>(reflector: Reflector<T>, p: V3<T>) -> V3<T> {
    if reflector.shape == PLANE {
        return V3::new(T::of(1.0), T::of(0.0), T::of(0.0));
    }
    if reflector.shape == ELLIPSOID {
        return V3::new(p.x * c(AXIS_X), p.y * c(AXIS_Y), p.z * c(AXIS_Z));
    }
    if reflector.shape == TORUS {
        let y = p.y + c(TORUS_CORE);
        let core = (y * y + p.z * p.z).sqrt().max(c(1e-3));
        let part = (core - c(TORUS_CORE)) / core;
        return V3::new(p.x, part * y, part * p.z);
    }
    if reflector.shape == BUMPY {
        let length = dot3(p, p).sqrt();
        let u = p / length;
        let (_, h) = bumps(reflector, u);
        return u - (h - u * dot3(u, h)) / length;
    }
    p
}

/// The Hessian of the same function times a vector.
pub fn bend_of<T: Real>(reflector: Reflector<T>, p: V3<T>, v: V3<T>) -> V3<T> {
    if reflector.shape == PLANE {
        return v * T::of(0.0);
    }
    if reflector.shape == ELLIPSOID {
        return V3::new(v.x * c(AXIS_X), v.y * c(AXIS_Y), v.z * c(AXIS_Z));
    }
    if reflector.shape == TORUS {
        let y = p.y + c(TORUS_CORE);
        let core = (y * y + p.z * p.z).sqrt().max(c(1e-3));
        let n = V3::new(T::of(0.0), y / core, p.z / core);
        let along = n * dot3(n, v);
        let across = V3::new(T::of(0.0), v.y, v.z) - along;
        let part = (core - c(TORUS_CORE)) / core;
        return V3::new(v.x, T::of(0.0), T::of(0.0)) + along + across * part;
    }
    if reflector.shape == BUMPY {
        return bumpy_bend(reflector, p, v);
    }
    v
}

fn bumpy_bend<T: Real>(reflector: Reflector<T>, p: V3<T>, v: V3<T>) -> V3<T> {
    // Its square is kept, as compilers know that of a root.
    let square = dot3(p, p);
    let length = square.sqrt();
    let u = p / length;
    let (_, h) = bumps(reflector, u);
    let radial = dot3(u, h);
    let tangent = h - u * radial;
    let flat = v - u * dot3(u, v);
    let second = bump_bend(reflector, u, flat);
    let inner =
        second - u * dot3(u, second) - flat * radial - tangent * dot3(u, v) - u * dot3(tangent, v);
    flat / length - inner / square
}

/// 1 where light turns outside the surface, −1 inside.
pub fn side_of<T: Real>(reflector: Reflector<T>) -> T {
    T::of(if reflector.shape == CONCAVE {
        -1.0
    } else {
        1.0
    })
}

/// Whether a point belongs to the part that is the reflector.
pub fn is_on<T: Real>(reflector: Reflector<T>, p: V3<T>) -> bool {
    if reflector.shape == PLANE {
        return p.x < c(1.001);
    }
    if reflector.shape == CONCAVE {
        return p.x <= c(RIM);
    }
    if reflector.shape == TORUS {
        let y = p.y + c(TORUS_CORE);
        let core = (y * y + p.z * p.z).sqrt();
        let off = core - c(TORUS_CORE);
        let distance = (off * off + p.x * p.x).sqrt();
        return y >= core * c(TORUS_PART) && (distance - c(TORUS_TUBE)).abs() < c(1e-3);
    }
    true
}

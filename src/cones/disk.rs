//! The part of a triangle that covers a cone, seen from the apex: area and centroid of a triangle and the unit disk
//! (Roger 2008, section 5.3). Kernel: `kernels/cones/disk.wesl`.
//!
//! A vertex is (x, y, z): z along the axis, x and y over the tangent of the cone's angle, so that the disk is
//! x² + y² ≤ z². Sums over directed edges, by Green's theorem, cover all eight cases of the thesis; homogeneous lines
//! keep edges exact that reach far beyond the disk.

use raystone_specular::real::{Real, V3};
use raystone_specular::reflector::cross3;
use std::ops::{Add, Div, Mul};

const PI: f32 = std::f32::consts::PI;
const HALF_PI: f32 = std::f32::consts::FRAC_PI_2;
const QUARTER_PI: f32 = std::f32::consts::FRAC_PI_4;
/// 1 / π.
const PART: f32 = std::f32::consts::FRAC_1_PI;
/// The tangent of a sixteenth of a turn.
const TAN_EIGHTH: f32 = 0.414_213_56;
/// Lines shorter than this have no direction.
const TINY: f32 = 1e-30;

/// A constant of the kernels.
pub(crate) fn c<T: Real>(constant: f32) -> T {
    T::of(f64::from(constant))
}

/// A vector of two numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V2<T> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
}

impl<T: Real> V2<T> {
    /// A vector of these components.
    pub fn new(x: T, y: T) -> Self {
        Self { x, y }
    }
}

impl<T: Real> Add for V2<T> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y)
    }
}

impl<T: Real> Mul<T> for V2<T> {
    type Output = Self;
    fn mul(self, s: T) -> Self {
        Self::new(self.x * s, self.y * s)
    }
}

impl<T: Real> Div<T> for V2<T> {
    type Output = Self;
    fn div(self, s: T) -> Self {
        Self::new(self.x / s, self.y / s)
    }
}

/// Numbers whose angles are known: of f32 as the kernel computes them, of f64 as the platform does.
pub trait Angle: Real {
    /// The angle of the vector (x, y), in radians from −π to π; 0 for the vector 0.
    fn angle_of(y: Self, x: Self) -> Self;
    /// π.
    const PI: Self;
    /// 1 / π.
    const PART: Self;
}

impl Angle for f32 {
    fn angle_of(y: Self, x: Self) -> Self {
        angle_of(y, x)
    }
    const PI: Self = PI;
    const PART: Self = PART;
}

impl Angle for f64 {
    fn angle_of(y: Self, x: Self) -> Self {
        y.atan2(x)
    }
    const PI: Self = std::f64::consts::PI;
    const PART: Self = std::f64::consts::FRAC_1_PI;
}

/// What covers the disk: signed area, first moments, and edges that cross the disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sum<T> {
    /// Positive for counterclockwise edges.
    pub area: T,
    /// Thrice the first moments, of the same sign: compilers of kernels move constants within products.
    pub moment: V2<T>,
    /// Edges with a part in the disk.
    pub crossing: u32,
}

impl<T: Real> Sum<T> {
    /// No edges.
    pub fn none() -> Self {
        let zero = T::of(0.0);
        Self {
            area: zero,
            moment: V2::new(zero, zero),
            crossing: 0,
        }
    }
}

/// What a triangle covers of the unit disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap<T> {
    /// From 0 to π.
    pub area: T,
    /// 0 where there is no area.
    pub centroid: V2<T>,
}

fn cross2<T: Real>(a: V2<T>, b: V2<T>) -> T {
    a.x * b.y - a.y * b.x
}

fn dot2<T: Real>(a: V2<T>, b: V2<T>) -> T {
    a.x * b.x + a.y * b.y
}

fn xy<T: Real>(v: V3<T>) -> V2<T> {
    V2::new(v.x, v.y)
}

/// The angle of the vector (x, y): WGSL promises 4096 ulp of its own. The series is that of Cephes' `atanf`.
fn angle_of(y: f32, x: f32) -> f32 {
    let a = y.abs();
    let b = x.abs();
    let most = a.max(b);
    if most < TINY {
        return 0.0;
    }
    let mut t = a.min(b) / most;
    let mut angle = 0.0;
    if t > TAN_EIGHTH {
        t = (t - 1.0) / (t + 1.0);
        angle = QUARTER_PI;
    }
    let z = t * t;
    let series = ((0.080_537_446 * z - 0.138_776_86) * z + 0.199_777_11) * z - 0.333_329_5;
    angle += series * z * t + t;
    if a > b {
        angle = HALF_PI - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 {
        angle = -angle;
    }
    angle
}

/// The sector of the disk from one direction to another; directions need not have length 1.
fn sector<T: Angle>(sum: Sum<T>, a: V2<T>, b: V2<T>) -> Sum<T> {
    let from_a = a / dot2(a, a).max(c(TINY)).sqrt();
    let to_b = b / dot2(b, b).max(c(TINY)).sqrt();
    let moment = V2::new(to_b.y - from_a.y, from_a.x - to_b.x);
    Sum {
        area: sum.area + c::<T>(0.5) * T::angle_of(cross2(a, b), dot2(a, b)),
        moment: sum.moment + moment,
        crossing: sum.crossing,
    }
}

/// Adds the edge from `a` to `b`, both before the apex.
pub fn edge<T: Angle>(sum: Sum<T>, a: V3<T>, b: V3<T>) -> Sum<T> {
    let n = cross3(a, b);
    let length = (n.x * n.x + n.y * n.y).sqrt();
    if length < c(TINY) {
        return sum;
    }
    let mut out = sum;
    // The line's distance from the centre, and its direction.
    let h = n.z / length;
    let along = V2::new(n.y, -n.x) / length;
    let foot = V2::new(-n.x, -n.y) * (h / length);
    let half = (c::<T>(1.0) - h * h).max(c(0.0)).sqrt();
    let begin = dot2(xy(a), along) / a.z;
    let end = dot2(xy(b), along) / b.z;
    let low = begin.max(-half);
    let high = end.min(half);
    let is_crossing = h.abs() < c(1.0) && low < high;
    if !is_crossing {
        return sector(out, xy(a), xy(b));
    }
    out.crossing += 1;
    let p = foot + along * low;
    let q = foot + along * high;
    if begin < -half {
        out = sector(out, xy(a), p);
    }
    let part = c::<T>(0.5) * h * (high - low);
    out.area = out.area + part;
    // Not p + q, of which compilers of kernels take the common factor out.
    out.moment = out.moment + (foot * c(2.0) + along * (low + high)) * part;
    if end > half {
        out = sector(out, q, xy(b));
    }
    out
}

/// Area and centroid of what the edges of a polygon enclose of the disk.
pub fn overlap<T: Angle>(sum: Sum<T>) -> Overlap<T> {
    let zero = V2::new(c(0.0), c(0.0));
    let none = Overlap {
        area: c(0.0),
        centroid: zero,
    };
    let area = sum.area.abs();
    if sum.crossing == 0 {
        // All of the disk, or none of it: edges turn about the centre once or not at all.
        if area > c(HALF_PI) {
            return Overlap {
                area: T::PI,
                centroid: zero,
            };
        }
        return none;
    }
    if area < c(TINY) {
        return none;
    }
    let mut centroid = sum.moment / (c::<T>(3.0) * sum.area);
    // What is left of a sliver's cancels: the centroid stays in the disk.
    let size = dot2(centroid, centroid).sqrt();
    if size > c(1.0) {
        centroid = centroid / size;
    }
    Overlap {
        area: area.min(T::PI),
        centroid,
    }
}

/// A triangle with all vertices before the apex.
pub fn disk_triangle<T: Angle>(a: V3<T>, b: V3<T>, c: V3<T>) -> Overlap<T> {
    let mut sum = Sum::none();
    sum = edge(sum, a, b);
    sum = edge(sum, b, c);
    sum = edge(sum, c, a);
    overlap(sum)
}

/// Area and distance of the centroid from the middle of the segment of the unit disk with this central angle, in
/// radians (Roger 2008, equations 5.9 and 5.10; the thesis prints the exponent 3/2 for the sine, which is 3).
pub fn segment(angle: f64) -> (f64, f64) {
    let area = 0.5 * (angle - angle.sin());
    (area, 2.0 / (3.0 * area) * (0.5 * angle).sin().powi(3))
}

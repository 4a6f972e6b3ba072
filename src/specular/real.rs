//! Numbers of 32 or 64 bits and vectors of them, so that one text is the twin of the kernel and its version in f64.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// f32 or f64.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The nearest number.
    fn of(value: f64) -> Self;
    /// The same number in f64.
    fn f64(self) -> f64;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The greatest whole number that is not above.
    fn floor(self) -> Self;
    /// The cosine and the sine: of f32 as the kernel computes them.
    fn turn(self) -> [Self; 2];

    /// The absolute value.
    fn abs(self) -> Self {
        if self < Self::of(0.0) { -self } else { self }
    }

    /// The greater of two numbers.
    fn max(self, other: Self) -> Self {
        if self < other { other } else { self }
    }

    /// The lesser of two numbers.
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
}

/// A constant of the kernels.
pub(crate) fn c<T: Real>(constant: f32) -> T {
    T::of(f64::from(constant))
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }

    fn f64(self) -> f64 {
        f64::from(self)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn floor(self) -> Self {
        self.floor()
    }

    fn turn(self) -> [Self; 2] {
        crate::reflector::turn(self)
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn f64(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn floor(self) -> Self {
        self.floor()
    }

    fn turn(self) -> [Self; 2] {
        let (sine, cosine) = self.sin_cos();
        [cosine, sine]
    }
}

/// A vector of three numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V3<T> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
    /// Third component.
    pub z: T,
}

impl<T: Real> V3<T> {
    /// A vector of these components.
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }

    /// The nearest vector.
    pub fn of(v: glam::DVec3) -> Self {
        Self::new(T::of(v.x), T::of(v.y), T::of(v.z))
    }

    /// The same vector in f64.
    pub fn f64(self) -> glam::DVec3 {
        glam::DVec3::new(self.x.f64(), self.y.f64(), self.z.f64())
    }
}

impl<T: Real> Add for V3<T> {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<T: Real> Sub for V3<T> {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<T: Real> Neg for V3<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<T: Real> Mul<T> for V3<T> {
    type Output = Self;
    fn mul(self, s: T) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<T: Real> Div<T> for V3<T> {
    type Output = Self;
    fn div(self, s: T) -> Self {
        Self::new(self.x / s, self.y / s, self.z / s)
    }
}

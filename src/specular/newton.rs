//! Newton's method with steps that are halved until they gain, its Hessian by differences or exact.
//! Kernel: `kernels/specular/newton.wesl`.

use crate::path::{Sample, Setup, apart, excess_of, length_of, sample_at, screen_of};
use crate::real::{Real, V3, c};
use crate::reflector::{bend_of, cross3, dot3, slope_of, unit};

pub(crate) const BY_LENGTH: u32 = 0;
pub(crate) const BY_GRADIENT: u32 = 1;

/// The longest step, in radians.
const LONGEST: f32 = 0.4;
/// Halvings of a step.
const HALVINGS: u32 = 8;
/// A step that moves less in the picture ends the search, squared pixels.
const STILL: f32 = 0.01;
/// A determinant below this is none.
const LEAST_DETERMINANT: f32 = 1e-10;

/// The stopping rule was met.
pub const CONVERGED: u32 = 0;
/// All iterations were used up.
pub const CAPPED: u32 = 1;
/// No step could be made of the system, twice running.
pub const SINGULAR: u32 = 2;
/// The vertex is behind the reflector.
pub const BEHIND: u32 = 3;
/// The point found is not on the part that is the reflector.
pub const LEFT: u32 = 4;

/// How it is searched.
#[derive(Debug, Clone, Copy)]
pub struct Search<T> {
    /// Newton's method, not secants.
    pub is_newton: bool,
    /// Its Hessian is exact.
    pub is_exact: bool,
    /// [`crate::solve::Stop`] of secants, as a kernel knows it.
    pub stop: u32,
    /// [`crate::solve::Merit`], as a kernel knows it.
    pub merit: u32,
    /// Where to begin is given.
    pub is_given: bool,
    /// How many places to begin at; several are given for all vertices.
    pub starts: u32,
    /// Iterations at most, of each.
    pub most: u32,
    /// A determinant that is a smaller part of its terms is none.
    pub singular: T,
    /// The length of differences, in radians.
    pub difference: T,
}

/// What a search found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solved<T> {
    /// The point.
    pub p: V3<T>,
    /// The square of the gradient there.
    pub size: T,
    /// Iterations.
    pub iterations: u32,
    /// [`CONVERGED`] or why not.
    pub status: u32,
    /// Points of reflection that were told apart.
    pub points: u32,
}

/// A symmetric system of two equations: the matrix, and the gradient.
#[derive(Debug, Clone, Copy)]
pub struct System<T> {
    /// First axis.
    pub x: V3<T>,
    /// Second axis.
    pub y: V3<T>,
    /// The gradient along both.
    pub g: [T; 2],
    /// The Hessian: xx, xy, yy.
    pub h: [T; 3],
}

/// Two unit vectors across `n`.
pub fn basis_of<T: Real>(n: V3<T>) -> [V3<T>; 2] {
    let one = T::of(1.0);
    let none = T::of(0.0);
    let mut axis = V3::new(none, none, one);
    if n.z.abs() > T::of(0.7) {
        axis = V3::new(one, none, none);
    }
    let x = unit(cross3(axis, n));
    [x, cross3(n, x)]
}

/// The Hessian by forward differences of the gradient, in two offsets across the direction.
pub fn by_differences<T: Real>(
    setup: Setup<T>,
    search: Search<T>,
    v: V3<T>,
    here: Sample<T>,
) -> System<T> {
    let [x, y] = basis_of(here.u);
    let d = search.difference;
    let right = sample_at(setup, v, unit(here.u + x * d)).g - here.g;
    let up = sample_at(setup, v, unit(here.u + y * d)).g - here.g;
    let xy = (dot3(right, y) + dot3(up, x)) * T::of(0.5);
    System {
        x,
        y,
        g: [dot3(here.g, x), dot3(here.g, y)],
        h: [dot3(right, x) / d, xy / d, dot3(up, y) / d],
    }
}

/// The Hessian of the length less that of the surface times its multiplier, times a vector.
fn curved<T: Real>(setup: Setup<T>, v: V3<T>, p: V3<T>, multiplier: T, t: V3<T>) -> V3<T> {
    let (a, b) = (p - setup.eye, v - p);
    let (far, near) = (dot3(a, a).sqrt(), dot3(b, b).sqrt());
    let (a, b) = (unit(a), unit(b));
    let legs = (t - a * dot3(a, t)) / far.max(c(1e-12)) + (t - b * dot3(b, t)) / near.max(c(1e-12));
    legs - bend_of(setup.reflector, p, t) * multiplier
}

/// The exact Hessian of the length along the surface, scaled to radians about the origin.
pub fn exact<T: Real>(setup: Setup<T>, v: V3<T>, here: Sample<T>) -> System<T> {
    let m = slope_of(setup.reflector, here.p);
    let [x, y] = basis_of(unit(m));
    let e = excess_of(setup, v, here.p);
    let multiplier = dot3(e, m) / dot3(m, m);
    let scale = dot3(here.p, here.p).sqrt();
    let right = curved(setup, v, here.p, multiplier, x) * scale;
    let up = curved(setup, v, here.p, multiplier, y) * scale;
    System {
        x,
        y,
        g: [dot3(e, x), dot3(e, y)],
        h: [dot3(right, x), dot3(right, y), dot3(up, y)],
    }
}

/// The step of a system: Newton's where it is one, else against the gradient; not too long.
fn step_of<T: Real>(search: Search<T>, system: System<T>) -> [T; 2] {
    let [xx, xy, yy] = system.h;
    let [gx, gy] = system.g;
    let determinant = xx * yy - xy * xy;
    let mut step = [-gx, -gy];
    let is_newton = if search.merit == BY_GRADIENT {
        determinant.abs() > c(LEAST_DETERMINANT)
    } else {
        determinant > c(LEAST_DETERMINANT) && xx > T::of(0.0)
    };
    if is_newton {
        step = [
            (xy * gy - yy * gx) / determinant,
            (xy * gx - xx * gy) / determinant,
        ];
    }
    let length = (step[0] * step[0] + step[1] * step[1]).sqrt();
    if length > c(LONGEST) {
        let shorter = c::<T>(LONGEST) / length;
        step = [step[0] * shorter, step[1] * shorter];
    }
    step
}

/// What a step has to lower.
fn merit_of<T: Real>(setup: Setup<T>, search: Search<T>, v: V3<T>, at: Sample<T>) -> T {
    if search.merit == BY_GRADIENT {
        return at.size;
    }
    length_of(setup, v, at.p)
}

/// Searches from a direction.
pub fn newton<T: Real>(setup: Setup<T>, search: Search<T>, v: V3<T>, first: V3<T>) -> Solved<T> {
    let mut here = sample_at(setup, v, first);
    let mut status = CAPPED;
    let mut iterations = 0;
    while iterations < search.most {
        iterations += 1;
        let mut system = by_differences(setup, search, v, here);
        if search.is_exact {
            system = exact(setup, v, here);
        }
        let step = step_of(search, system);
        let turned = system.x * step[0] + system.y * step[1];
        let merit = merit_of(setup, search, v, here);
        let radius = dot3(here.p, here.p).sqrt();
        let mut part = T::of(1.0);
        let mut next = here;
        for _ in 0..HALVINGS + 1 {
            next = sample_at(setup, v, unit(here.p + turned * (radius * part)));
            if merit_of(setup, search, v, next) <= merit {
                break;
            }
            part = part * T::of(0.5);
        }
        let moved = apart(screen_of(setup, here.p), screen_of(setup, next.p));
        here = next;
        if moved < c(STILL) {
            status = CONVERGED;
            break;
        }
    }
    Solved {
        p: here.p,
        size: here.size,
        iterations,
        status,
        points: 1,
    }
}

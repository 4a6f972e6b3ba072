//! The search for a vertex's point of reflection. Kernel: `kernels/specular/solve.wesl`.

use crate::newton::{BEHIND, BY_GRADIENT, BY_LENGTH, CONVERGED, LEFT, Search, Solved, newton};
use crate::path::{Setup, length_of, sample_at};
use crate::real::{Real, V3, c};
use crate::reflector::{dot3, is_on, side_of, slope_of, unit};
use crate::secant::{BY_AREA, BY_EDGE, BY_EDGE_AND_GRADIENT, first_triangle, secant};
use raystone_core::parameters;

/// Directions to vertex and eye that differ by less are one, and opposite ones have no arc; squared.
const SAME: f32 = 1e-10;
/// Points that are nearer are one, squared.
const ONE_POINT: f32 = 1e-4;
/// A gradient above this, squared, is no point of reflection.
const NO_POINT: f32 = 1e-5;
/// Points that are told apart.
const MOST_POINTS: u32 = 8;

parameters! {
    /// How the next place is found.
    pub enum Step {
        /// by the secants of three samples, as in the thesis
        Secant = "secant",
        /// by Newton's method, its Hessian by differences
        NewtonDifferences = "newton-differences",
        /// by Newton's method with the exact Hessian
        Newton = "newton",
    }

    /// When the search ends.
    pub enum Stop {
        /// the triangle covers less than a pixel, as in the thesis
        Area = "area",
        /// its longest edge is shorter than a pixel
        Edge = "edge",
        /// that, and a gradient below 0.001
        EdgeAndGradient = "edge-and-gradient",
        /// a step moved less than a tenth of a pixel; of Newton's method alone
        Moved = "moved",
    }

    /// What a step of Newton's method has to lower.
    pub enum Merit {
        /// the length of the path: finds least paths alone
        Length = "length",
        /// the gradient: finds saddles and longest paths, too
        Gradient = "gradient",
    }

    /// Where the search begins.
    pub enum Begin {
        /// on the arc between the projections of vertex and eye, as in the thesis
        Arc = "arc",
        /// anywhere on the side of the reflector that faces the eye
        Random = "random",
    }
}

impl Stop {
    pub(crate) const fn word(self) -> u32 {
        match self {
            Self::Area => BY_AREA,
            Self::Edge => BY_EDGE,
            Self::EdgeAndGradient | Self::Moved => BY_EDGE_AND_GRADIENT,
        }
    }
}

impl Merit {
    pub(crate) const fn word(self) -> u32 {
        match self {
            Self::Length => BY_LENGTH,
            Self::Gradient => BY_GRADIENT,
        }
    }
}

/// Whether a point is one at which light turns on the right side.
fn is_seen<T: Real>(setup: Setup<T>, v: V3<T>, found: Solved<T>) -> bool {
    let n = slope_of(setup.reflector, found.p) * side_of::<T>(setup.reflector);
    let none = T::of(0.0);
    found.size < c(NO_POINT)
        && is_on(setup.reflector, found.p)
        && dot3(n, setup.eye - found.p) > none
        && dot3(n, v - found.p) > none
}

/// Searches from many places, and keeps the shortest path of those whose light turns on the right side.
fn from_all<T: Real>(setup: Setup<T>, search: Search<T>, v: V3<T>, starts: &[V3<T>]) -> Solved<T> {
    let mut known = [setup.eye; MOST_POINTS as usize];
    let mut points = 0u32;
    let mut iterations = 0u32;
    let mut chosen = Solved {
        p: setup.eye,
        size: T::of(1.0),
        iterations: 0,
        status: LEFT,
        points: 0,
    };
    let mut length = T::of(1e30);
    for start in starts.iter().take(search.starts as usize) {
        let found = newton(setup, search, v, *start);
        iterations += found.iterations;
        if !is_seen(setup, v, found) {
            continue;
        }
        let mut is_new = points < MOST_POINTS;
        for point in known.iter().take(points as usize) {
            let d = *point - found.p;
            is_new = is_new && dot3(d, d) > c(ONE_POINT);
        }
        if is_new {
            known[points as usize] = found.p;
            points += 1;
        }
        let its_length = length_of(setup, v, found.p);
        if its_length < length {
            length = its_length;
            chosen = found;
        }
    }
    chosen.iterations = iterations;
    chosen.points = points;
    chosen
}

/// The point of reflection of a vertex. `given` has three directions to begin at where `search` says so, or all of
/// several.
pub fn reflect_vertex<T: Real>(
    setup: Setup<T>,
    search: Search<T>,
    v: V3<T>,
    given: &[V3<T>],
) -> Solved<T> {
    let mut first = first_triangle(setup, v);
    let across = first[1] - first[0];
    let sum = first[1] + first[0];
    if search.starts == 1 && dot3(sum, sum) < c(SAME) && !search.is_given {
        let p = setup.eye;
        return Solved {
            p,
            size: T::of(1.0),
            iterations: 0,
            status: BEHIND,
            points: 0,
        };
    }
    if search.is_given && search.starts == 1 {
        first = [given[0], given[1], given[2]];
    }
    let mut found;
    if !search.is_newton {
        if dot3(across, across) < c(SAME) && !search.is_given {
            // Eye, vertex and origin are in line, and so is the point of a sphere.
            let only = sample_at(setup, v, first[0]);
            found = Solved {
                p: only.p,
                size: only.size,
                iterations: 0,
                status: CONVERGED,
                points: 1,
            };
        } else {
            found = secant(setup, search, v, first);
        }
    } else if search.starts > 1 {
        found = from_all(setup, search, v, given);
    } else {
        let mut start = unit(first[0] + first[1]);
        if search.is_given {
            start = first[0];
        }
        found = newton(setup, search, v, start);
    }
    if found.status == CONVERGED && !is_on(setup.reflector, found.p) {
        found.status = LEFT;
    }
    found
}

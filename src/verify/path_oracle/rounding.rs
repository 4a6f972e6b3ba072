//! What single precision may do to a path, played.
//!
//! A bound on the error of a path that is derived by hand would have to follow every decision (an edge, an occluder, a random
//! number against a probability) and every ill-conditioned quotient. Instead the path is repeated in f64, with every
//! quantity that a kernel rounds moved at random by as much as some roundings of f32: Monte Carlo arithmetic (D. Parker,
//! "Monte Carlo arithmetic", 1997). What comes out is what a kernel may answer. A path that changes its decisions
//! under so little is near a boundary, and its margin is the number of roundings that it took.

use crate::holes::PLACED;
use glam::{DVec2, DVec3};
use raystone_core::random::Pcg32;

/// Half an ulp of 1 in f32.
pub(super) const EPSILON: f64 = 1.0 / (1u32 << 24) as f64;

/// The margin below which a decision may come out otherwise, in roundings of f32: as far as they are ever played.
pub(crate) const MOST_ROUNDINGS: f64 = 64.0;

/// Roundings of a direction of unit length that was made of sines, cosines and roots, per component. Libraries of
/// devices may be off by this much in these functions.
const DIRECTION: f64 = 4.0;

/// Stream of the numbers that move points in masks.
const MASKS: u64 = 2;

/// Stream of the numbers that move hits.
const HITS: u64 = 3;

/// Moves quantities by roundings of f32, or leaves them as they are.
pub struct Rounding {
    random: Option<Pcg32>,
    /// What moves points in masks: other numbers stay the same without masks.
    texels: Option<Pcg32>,
    /// What moves hits: distances, and edges.
    hits: Option<Pcg32>,
    /// By how many roundings.
    scale: f64,
}

impl Rounding {
    /// No rounding.
    pub fn none() -> Self {
        Self {
            random: None,
            texels: None,
            hits: None,
            scale: 0.0,
        }
    }

    /// Every quantity is moved by up to `roundings` roundings; `trial` chooses by how much.
    pub(crate) fn played(roundings: f64, trial: u64) -> Self {
        Self {
            random: Some(Pcg32::new(trial)),
            texels: Some(Pcg32::with_stream(trial, MASKS)),
            hits: Some(Pcg32::with_stream(trial, HITS)),
            scale: roundings * EPSILON,
        }
    }

    /// Whether anything is moved.
    pub(crate) fn is_played(&self) -> bool {
        self.random.is_some()
    }

    fn signed(&mut self) -> f64 {
        (self.random.as_mut()).map_or(0.0, |random| self.scale * random.signed())
    }

    /// A number, by a fraction of itself.
    pub fn number(&mut self, x: f64) -> f64 {
        x * (1.0 + self.signed())
    }

    /// A number in [0, 1], by a fraction of 1.
    pub fn share(&mut self, x: f64) -> f64 {
        x + self.signed()
    }

    /// The error of the weight of a corner with one rounding of 1: that of 1, or of `terms` over `area` if that is more, of the
    /// greatest product that it is a sum of and what that is divided by.
    pub(crate) fn of_weights(terms: f64, area: f64) -> f64 {
        (terms / area).clamp(1.0, 1.0 / EPSILON)
    }

    /// The weight of a corner with such an error.
    pub fn weight(&mut self, w: f64, error: f64) -> f64 {
        w + self.signed() * error
    }

    /// Whether a triangle holds a hit whose least weight is this one: of each triangle by itself, so that a ray may slip through
    /// between two of them, as triangle tests that are not watertight let it.
    pub(crate) fn holds(&mut self, margin: f64, error: f64) -> bool {
        let signed = (self.hits.as_mut()).map_or(0.0, Pcg32::signed);
        margin.max(0.0) + signed * self.scale * error >= 0.0
    }

    /// A colour, each component by itself.
    pub fn colour(&mut self, c: DVec3) -> DVec3 {
        c * (1.0 + self.vector())
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A unit vector.
    pub fn direction(&mut self, d: DVec3) -> DVec3 {
        match self.random {
            None => d,
            Some(_) => (d + DIRECTION * self.vector()).normalize(),
        }
    }

    /// A point whose coordinates are sums of terms as large as `terms`.
    pub fn point(&mut self, p: DVec3, terms: DVec3) -> DVec3 {
        p + terms * self.vector()
    }

    /// How far a point may be off its place in a mask, texels, whatever the number of roundings: coordinates there are
    /// multiples of 1/256 texel.
    pub(crate) fn texel(&mut self) -> DVec2 {
        let mut signed = || (self.texels.as_mut()).map_or(0.0, Pcg32::signed);
        PLACED * DVec2::new(signed(), signed())
    }

    /// The distance of a hit that errs by `error` with one rounding, and by `most` at most: of each triangle by itself, so that of
    /// two surfaces that lie closer together either may be nearer.
    pub fn distance(&mut self, distance: f64, error: f64, most: f64) -> f64 {
        let signed = (self.hits.as_mut()).map_or(0.0, Pcg32::signed);
        distance + signed * (self.scale * error).min(most)
    }

    /// How far a ray may start off its surface, where rays start at most `offset` off by one rounding.
    pub fn offset(&mut self, offset: f64) -> f64 {
        self.signed().abs() * offset
    }
}

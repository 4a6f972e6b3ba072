//! Simulated single-precision error of a path.
//!
//! A hand-derived error bound would have to follow every decision (an edge, an occluder, a random
//! number against a probability) and every ill-conditioned quotient. Instead the path is repeated
//! in f64, and every quantity that a kernel rounds is perturbed at random by some f32 roundings:
//! Monte Carlo arithmetic (D. Parker, "Monte Carlo arithmetic", 1997). Any result is a valid kernel
//! answer. A path that changes its decisions under such small changes is near a boundary; its
//! margin is the number of roundings needed.

use crate::holes::PLACED;
use glam::{DVec2, DVec3};
use raystone_core::random::Pcg32;

/// Half an ulp of 1 in f32.
pub(super) const EPSILON: f64 = 1.0 / (1u32 << 24) as f64;

/// Margin below which a decision may change, in f32 roundings: the largest simulated scale.
pub(crate) const MOST_ROUNDINGS: f64 = 64.0;

/// Roundings per component of a unit direction made of sines, cosines and roots. Device libraries
/// may be off by this much in these functions.
const DIRECTION: f64 = 4.0;

/// Stream of the numbers that perturb points in masks.
const MASKS: u64 = 2;

/// Stream of the numbers that perturb hits.
const HITS: u64 = 3;

/// Stream of the choices whether a partly transparent surface is there.
const CHANCE: u64 = 4;

/// Perturbs quantities by f32 roundings, or leaves them unchanged.
pub struct Rounding {
    random: Option<Pcg32>,
    /// Perturbs points in masks; separate, so that other numbers do not depend on masks.
    texels: Option<Pcg32>,
    /// Perturbs hits: distances, and edges.
    hits: Option<Pcg32>,
    /// Decides about surfaces that are there by chance.
    chance: Option<Pcg32>,
    /// Number of surfaces decided about.
    by_chance: usize,
    /// Number of roundings.
    scale: f64,
}

impl Rounding {
    /// No perturbation.
    pub fn none() -> Self {
        Self {
            random: None,
            texels: None,
            hits: None,
            chance: None,
            by_chance: 0,
            scale: 0.0,
        }
    }

    /// Perturbs every quantity by up to `roundings` roundings; `trial` selects the random numbers.
    pub(crate) fn played(roundings: f64, trial: u64) -> Self {
        Self {
            random: Some(Pcg32::new(trial)),
            texels: Some(Pcg32::with_stream(trial, MASKS)),
            hits: Some(Pcg32::with_stream(trial, HITS)),
            chance: Some(Pcg32::with_stream(trial, CHANCE)),
            by_chance: 0,
            scale: roundings * EPSILON,
        }
    }

    pub(crate) fn is_played(&self) -> bool {
        self.random.is_some()
    }

    fn signed(&mut self) -> f64 {
        (self.random.as_mut()).map_or(0.0, |random| self.scale * random.signed())
    }

    /// Perturbs a number, relative to itself.
    pub fn number(&mut self, x: f64) -> f64 {
        x * (1.0 + self.signed())
    }

    /// Perturbs a number in [0, 1], relative to 1.
    pub fn share(&mut self, x: f64) -> f64 {
        x + self.signed()
    }

    /// Error of a corner weight for one rounding of 1: the larger of 1 and `terms` over `area`,
    /// that is the largest product in the sum over the divisor.
    pub(crate) fn of_weights(terms: f64, area: f64) -> f64 {
        (terms / area).clamp(1.0, 1.0 / EPSILON)
    }

    /// Perturbs a corner weight with this error.
    pub fn weight(&mut self, w: f64, error: f64) -> f64 {
        w + self.signed() * error
    }

    /// True if a triangle contains a hit with this smallest weight. Each triangle is perturbed
    /// independently, so a ray may slip through between two, as with tests that are not watertight.
    pub(crate) fn holds(&mut self, margin: f64, error: f64) -> bool {
        let signed = (self.hits.as_mut()).map_or(0.0, Pcg32::signed);
        margin.max(0.0) + signed * self.scale * error >= 0.0
    }

    /// True if a surface is there that chance decides about: always, or, while trials look for the
    /// kernel's answer, every other time, whatever its alpha.
    pub(crate) fn is_there(&mut self) -> bool {
        self.by_chance += 1;
        (self.chance.as_mut()).is_none_or(|chance| chance.next_u32() >> 31 == 0)
    }

    /// Number of surfaces that [`Rounding::is_there`] has decided about.
    pub(crate) fn by_chance(&self) -> usize {
        self.by_chance
    }

    /// Perturbs each component of a colour independently.
    pub fn colour(&mut self, c: DVec3) -> DVec3 {
        c * (1.0 + self.vector())
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// Perturbs a unit vector.
    pub fn direction(&mut self, d: DVec3) -> DVec3 {
        match self.random {
            None => d,
            Some(_) => (d + DIRECTION * self.vector()).normalize(),
        }
    }

    /// Perturbs a point whose coordinates are sums of terms as large as `terms`.
    pub fn point(&mut self, p: DVec3, terms: DVec3) -> DVec3 {
        p + terms * self.vector()
    }

    /// Displacement of a point in a mask, texels, independent of the number of roundings:
    /// coordinates there are multiples of 1/256 texel.
    pub(crate) fn texel(&mut self) -> DVec2 {
        let mut signed = || (self.texels.as_mut()).map_or(0.0, Pcg32::signed);
        PLACED * DVec2::new(signed(), signed())
    }

    /// Perturbs the distance of a hit by `error` per rounding, and by at most `most`. Each triangle
    /// is perturbed independently, so either of two close surfaces may be nearer.
    pub fn distance(&mut self, distance: f64, error: f64, most: f64) -> f64 {
        let signed = (self.hits.as_mut()).map_or(0.0, Pcg32::signed);
        distance + signed * (self.scale * error).min(most)
    }

    /// Offset of a ray from its surface; at most `offset` per rounding.
    pub fn offset(&mut self, offset: f64) -> f64 {
        self.signed().abs() * offset
    }
}

//! What is recorded of a ray caster of others.

use super::{Interval, RayClass};
use serde::{Deserialize, Serialize};

/// Speed of one ray class through a peer, and how its answers differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PeerTiming {
    /// Which rays: those of the structures.
    pub class: RayClass,
    /// How many of them.
    pub rays: usize,
    /// Every kept sample by the wall clock, milliseconds, a round of all structures and peers each, in order.
    pub wall_ms: Vec<f64>,
    /// The same in time of the processors, all threads together; empty where there is no such clock.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cpu_ms: Vec<f64>,
    /// Million rays per second by the wall clock, median with interval.
    pub mrays_s: Interval,
    /// Rays whose triangle (any hits: whether there is one) is not the reference tracer's.
    pub unlike: usize,
    /// Of these, how many were put to the oracle; none of them was beyond rounding.
    pub judged: usize,
    /// Greatest difference of a distance to the reference tracer's where the triangle is the same, over the distance or a hundredth of
    /// the greatest coordinate of the ray's origin.
    pub farthest: f64,
}

/// A ray caster of others on a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PeerRecord {
    /// Version, and on what it ran.
    pub about: String,
    /// Wall time of the build, milliseconds.
    pub build_ms: f64,
    /// Speeds by class.
    pub timings: Vec<PeerTiming>,
    /// Why it did not run here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absent: Option<String>,
    /// What is wrong with its answers; there are no figures then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

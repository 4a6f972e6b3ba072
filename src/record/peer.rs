//! Records of external ray casters.

use super::{Interval, RayClass};
use serde::{Deserialize, Serialize};

/// Speed of one ray class through a peer, and how its answers differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PeerTiming {
    /// Class of the rays: those of the structures.
    pub class: RayClass,
    /// Number of rays.
    pub rays: usize,
    /// Every sample after warm-up, milliseconds, a round of all structures and peers each, in order: by the clock
    /// of the adapter, by the wall clock where the peer runs on the host or there are no timestamps. Empty in
    /// records of before, which have the wall clock alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ms: Vec<f64>,
    /// The same by the wall clock.
    pub wall_ms: Vec<f64>,
    /// The same in time of the processors, all threads together; empty where there is no such clock.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cpu_ms: Vec<f64>,
    /// Million rays per second by the first clock that there is, median with interval.
    pub mrays_s: Interval,
    /// Rays whose triangle (for any hits: whose answer) differs from the reference tracer's.
    pub unlike: usize,
    /// Number of these that were checked by the oracle; none of them was beyond rounding.
    pub judged: usize,
    /// Greatest difference of a distance to the reference tracer's where the triangle is the same, over the distance or a hundredth of
    /// the greatest coordinate of the ray's origin.
    pub farthest: f64,
}

/// An external ray caster on a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PeerRecord {
    /// Version, and the hardware it runs on.
    pub about: String,
    /// Wall time of the build, milliseconds.
    pub build_ms: f64,
    /// Speeds by class.
    pub timings: Vec<PeerTiming>,
    /// The reason for its absence here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub absent: Option<String>,
    /// The fault of its answers; there are no figures then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

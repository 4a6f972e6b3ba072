//! Records of structures whose scene moves.

use super::{CountersPerRay, RayClass};
use raystone_config::Animation;
use serde::{Deserialize, Serialize};

/// A structure over the frames of an animation: the one built over the first frame, updated for each (*refitted*), and
/// one built anew for each (*rebuilt*).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct AnimationRecord {
    /// The motion of the scene.
    pub settings: Animation,
    /// Triangles of the scene.
    pub triangles: u64,
    /// By time; those before the failure, if there is one.
    pub frames: Vec<FrameRecord>,
    /// The fault, and its frame.
    pub failure: Option<String>,
}

/// A frame whose gates both passed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrameRecord {
    /// Number, from 0.
    pub frame: u32,
    /// Rays of each of the two gates, closest and any hit.
    pub judged: usize,
    /// Cost of the update, on the device where it can be done there.
    pub refit: Cost,
    /// The same on the host, equal to the bit; absent where there is only one way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refit_on_host: Option<Cost>,
    /// Cost of a full build.
    pub rebuild: Cost,
    /// SAH cost: refitted, rebuilt; absent where not defined.
    pub sah: [Option<f64>; 2],
    /// Rays through both, by class.
    pub classes: Vec<FrameRays>,
}

/// Rays of a class through the refitted and the rebuilt structure, in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrameRays {
    /// Their class.
    pub class: RayClass,
    /// Their number.
    pub rays: usize,
    /// Counted work.
    pub counters: [Option<CountersPerRay>; 2],
    /// Cost of tracing all of them.
    pub cost: [Cost; 2],
}

/// Milliseconds of the same work in each round, by several clocks.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Cost {
    /// Of all threads of the process; empty where the system does not report it.
    pub processor_ms: Vec<f64>,
    /// By the wall clock.
    pub wall_ms: Vec<f64>,
    /// Between the timestamps around the passes that trace rays; empty for all else, and where there are none.
    pub passes_ms: Vec<f64>,
}

impl Cost {
    /// Returns the times that count: those of the processor on a software adapter, which shares it with other
    /// processes.
    pub fn ms(&self, software: bool) -> &[f64] {
        if software && !self.processor_ms.is_empty() {
            &self.processor_ms
        } else if self.passes_ms.is_empty() {
            &self.wall_ms
        } else {
            &self.passes_ms
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gpu_has_the_time_of_its_passes_and_a_software_adapter_that_of_processors() {
        let cost = Cost {
            processor_ms: vec![8.0],
            wall_ms: vec![4.0],
            passes_ms: vec![2.0],
        };
        assert_eq!([cost.ms(true), cost.ms(false)], [[8.0], [2.0]]);
        let without = |change: fn(&mut Cost)| {
            let mut cost = cost.clone();
            change(&mut cost);
            [cost.ms(true)[0], cost.ms(false)[0]]
        };
        assert_eq!(without(|cost| cost.processor_ms.clear()), [2.0, 2.0]);
        assert_eq!(without(|cost| cost.passes_ms.clear()), [8.0, 4.0]);
    }
}

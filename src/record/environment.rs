//! The machine and the program of a run.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Machine, adapter, driver and program that produced a result.
// Many fields: one for each fact, since records are flat.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Environment {
    /// Adapter name as the driver gives it.
    pub adapter: String,
    /// `vulkan`, `gl`, `metal`, `dx12`, `webgpu`.
    pub backend: String,
    /// Driver name.
    pub driver: String,
    /// Driver version text.
    pub driver_info: String,
    /// `discrete-gpu`, `integrated-gpu`, `virtual-gpu`, `cpu`, `other`.
    pub device_type: String,
    /// True if the adapter is a software rasteriser: its times compare structures on it only.
    pub software: bool,
    /// True if GPU timestamps are available; without them the wall clock is used, and marked.
    pub timestamps: bool,
    /// Maximum loop iterations of an invocation in total, on a driver that ends loops beyond that.
    #[serde(default)]
    pub loop_limit: Option<u32>,
    /// True if denormal numbers are preserved; absent if unknown.
    #[serde(default)]
    pub denormals: Option<bool>,
    /// Operating system and architecture.
    pub os: String,
    /// Processor model.
    pub cpu: String,
    /// Hardware threads of the host.
    pub cpu_threads: usize,
    /// Version of this program.
    pub version: String,
    /// Commit the program was built from, when known.
    pub commit: Option<String>,
    /// True if the working tree had uncommitted changes when it was built.
    pub dirty: Option<bool>,
    /// Address of the adapter on the PCI bus, as `0000:65:00.0`; empty without one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub pci: String,
    /// Least and greatest number of invocations of a subgroup.
    #[serde(default)]
    pub subgroup: Option<[u32; 2]>,
    /// Limits of the device that runs may meet, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub limits: BTreeMap<String, u64>,
    /// Memory of the host, bytes.
    #[serde(default)]
    pub memory_bytes: Option<u64>,
    /// Governor of the processors' clocks.
    #[serde(default)]
    pub governor: Option<String>,
    /// The state of the machine when the run began.
    #[serde(default)]
    pub load: MachineLoad,
    /// The browser, as it names itself; absent in runs of the program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub browser: Option<String>,
    /// The step of its timestamps in nanoseconds, as seen; absent where it was not looked for or is not above 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_step_ns: Option<u64>,
    /// The command line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
}

/// The load of a machine, as far as it can be read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct MachineLoad {
    /// Runnable processes, mean of a minute.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minute: Option<f64>,
    /// Mean clock of the processors, MHz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock_mhz: Option<f64>,
    /// Number of thermal throttling events of the processors since the system started.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub throttled: Option<u64>,
}

//! Where a run happens.

use super::{Gpu, probe_arithmetic};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Machine, adapter, driver and program that produced a result.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Environment {
    /// Adapter name as the driver gives it.
    pub adapter: String,
    /// `vulkan`, `gl`, `metal`, `dx12`.
    pub backend: String,
    /// Driver name.
    pub driver: String,
    /// Driver version text.
    pub driver_info: String,
    /// `discrete-gpu`, `integrated-gpu`, `virtual-gpu`, `cpu`, `other`.
    pub device_type: String,
    /// Whether the adapter is a software rasteriser: its times compare structures on it only.
    pub software: bool,
    /// Whether GPU timestamps are available; wall clock is used, and marked, where not.
    pub timestamps: bool,
    /// Turns that the loops of an invocation may take in all, on a driver that ends them beyond that.
    #[serde(default)]
    pub loop_limit: Option<u32>,
    /// Whether denormal numbers are kept, when known.
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
    /// Whether the working tree had uncommitted changes when it was built.
    pub dirty: Option<bool>,
    /// Where the adapter sits on the PCI bus, as `0000:65:00.0`; empty if it has no such place.
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
    /// How the clocks of the processors are governed.
    #[serde(default)]
    pub governor: Option<String>,
    /// The state of the machine when the run began.
    #[serde(default)]
    pub load: MachineLoad,
    /// The command line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
}

/// How busy a machine is, as far as it can be read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct MachineLoad {
    /// Processes that ran or waited to, mean of a minute.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minute: Option<f64>,
    /// Mean clock of the processors, MHz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock_mhz: Option<f64>,
    /// How often processors were throttled for heat since the system started.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub throttled: Option<u64>,
}

impl MachineLoad {
    /// The machine as it is now; nothing where the system does not tell.
    pub fn now() -> Self {
        let text = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let cpus = text("/proc/cpuinfo");
        let clocks = cpus.lines().filter(|line| line.starts_with("cpu MHz"));
        let clocks = clocks.filter_map(|line| line.split_once(':')?.1.trim().parse::<f64>().ok());
        let clocks: Vec<f64> = clocks.collect();
        let count = |cpu: usize| {
            let path =
                format!("/sys/devices/system/cpu/cpu{cpu}/thermal_throttle/core_throttle_count");
            text(&path).trim().parse::<u64>().ok()
        };
        let minute = text("/proc/loadavg");
        let minute = minute
            .split_whitespace()
            .next()
            .and_then(|m| m.parse().ok());
        Self {
            minute,
            clock_mhz: (!clocks.is_empty())
                .then(|| clocks.iter().sum::<f64>() / clocks.len() as f64),
            throttled: (0..threads()).map(count).fold(None, |sum, count| {
                count.map_or(sum, |c| Some(sum.unwrap_or(0) + c))
            }),
        }
    }
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Memory of the host, where the system tells.
fn memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// How the clock of the first processor is governed, where the system tells.
fn governor() -> Option<String> {
    let path = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
    let text = std::fs::read_to_string(path).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Limits that runs may meet.
fn limits(limits: &wgpu::Limits) -> BTreeMap<String, u64> {
    let found = [
        ("max_buffer_size", limits.max_buffer_size),
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
        ),
        (
            "max_storage_buffers_per_shader_stage",
            limits.max_storage_buffers_per_shader_stage.into(),
        ),
        (
            "max_compute_workgroup_storage_size",
            limits.max_compute_workgroup_storage_size.into(),
        ),
        (
            "max_compute_invocations_per_workgroup",
            limits.max_compute_invocations_per_workgroup.into(),
        ),
        (
            "max_compute_workgroups_per_dimension",
            limits.max_compute_workgroups_per_dimension.into(),
        ),
        (
            "max_texture_dimension_2d",
            limits.max_texture_dimension_2d.into(),
        ),
    ];
    found
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

/// Machine, adapter, driver and program.
pub fn capture(gpu: &Gpu) -> Environment {
    Environment {
        adapter: gpu.info.name.clone(),
        backend: gpu.info.backend.to_str().to_owned(),
        driver: gpu.info.driver.clone(),
        driver_info: gpu.info.driver_info.clone(),
        device_type: device_type(gpu.info.device_type).to_owned(),
        software: gpu.is_software(),
        timestamps: gpu.timestamp_period.is_some(),
        loop_limit: gpu.loop_limit,
        denormals: probe_arithmetic(gpu).ok().map(|probe| probe.denormals),
        os: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        cpu: cpu_model(),
        cpu_threads: threads(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("RAYSTONE_COMMIT").map(str::to_owned),
        dirty: option_env!("RAYSTONE_DIRTY").map(|d| d == "true"),
        pci: gpu.info.device_pci_bus_id.clone(),
        subgroup: (gpu.info.subgroup_max_size > 0)
            .then_some([gpu.info.subgroup_min_size, gpu.info.subgroup_max_size]),
        limits: limits(&gpu.limits),
        memory_bytes: memory_bytes(),
        governor: governor(),
        load: MachineLoad::now(),
        command: std::env::args().collect(),
    }
}

/// The name of a device type in records.
pub fn device_type(kind: wgpu::DeviceType) -> &'static str {
    match kind {
        wgpu::DeviceType::DiscreteGpu => "discrete-gpu",
        wgpu::DeviceType::IntegratedGpu => "integrated-gpu",
        wgpu::DeviceType::VirtualGpu => "virtual-gpu",
        wgpu::DeviceType::Cpu => "cpu",
        wgpu::DeviceType::Other => "other",
    }
}

/// The processor's model name where the system tells, else its architecture.
pub fn cpu_model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|l| {
        l.strip_prefix("model name")?
            .split_once(':')
            .map(|(_, name)| name.trim())
    });
    model.unwrap_or(std::env::consts::ARCH).to_owned()
}

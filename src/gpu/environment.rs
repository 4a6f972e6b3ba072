//! Where a run happens.

use super::{Gpu, probe_arithmetic};
use serde::{Deserialize, Serialize};

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
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("RAYSTONE_COMMIT").map(str::to_owned),
        dirty: option_env!("RAYSTONE_DIRTY").map(|d| d == "true"),
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

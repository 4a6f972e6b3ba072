//! Where a run happens.

use crate::gpu::{Gpu, probe_arithmetic};
use crate::measure::record::Environment;

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

//! The environment of a run.

use raystone_core::program::Program;
use raystone_gpu::{Gpu, device_type, limits_of_runs, probe_arithmetic};
use raystone_record::{Environment, MachineLoad};

/// Current load of the machine, as far as the system reports it.
pub(crate) fn machine_load() -> MachineLoad {
    let text = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let cpus = text("/proc/cpuinfo");
    let clocks = cpus.lines().filter(|line| line.starts_with("cpu MHz"));
    let clocks = clocks.filter_map(|line| line.split_once(':')?.1.trim().parse::<f64>().ok());
    let clocks: Vec<f64> = clocks.collect();
    let count = |cpu: usize| {
        let path = format!("/sys/devices/system/cpu/cpu{cpu}/thermal_throttle/core_throttle_count");
        text(&path).trim().parse::<u64>().ok()
    };
    let minute = text("/proc/loadavg");
    let minute = minute
        .split_whitespace()
        .next()
        .and_then(|m| m.parse().ok());
    MachineLoad {
        minute,
        clock_mhz: (!clocks.is_empty()).then(|| clocks.iter().sum::<f64>() / clocks.len() as f64),
        throttled: (0..threads()).map(count).fold(None, |sum, count| {
            count.map_or(sum, |c| Some(sum.unwrap_or(0) + c))
        }),
    }
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Host memory, if the system reports it.
fn memory_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// Frequency governor of the first processor, if the system reports it.
fn governor() -> Option<String> {
    let path = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
    let text = std::fs::read_to_string(path).ok()?;
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Captures machine, adapter, driver and program.
pub fn capture(gpu: &Gpu, program: &Program) -> Environment {
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
        version: program.version.to_owned(),
        commit: program.commit.map(str::to_owned),
        dirty: program.dirty,
        pci: gpu.info.device_pci_bus_id.clone(),
        subgroup: (gpu.info.subgroup_max_size > 0)
            .then_some([gpu.info.subgroup_min_size, gpu.info.subgroup_max_size]),
        limits: limits_of_runs(&gpu.limits),
        memory_bytes: memory_bytes(),
        governor: governor(),
        load: machine_load(),
        browser: None,
        clock_step_ns: None,
        command: std::env::args().collect(),
    }
}

/// The processor's model name if the system reports it, else its architecture.
pub fn cpu_model() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|l| {
        l.strip_prefix("model name")?
            .split_once(':')
            .map(|(_, name)| name.trim())
    });
    model.unwrap_or(std::env::consts::ARCH).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn memory_is_what_the_c_library_says() {
        let number = |name: &str| -> u64 {
            let output = std::process::Command::new("getconf").arg(name).output();
            let text = String::from_utf8(output.unwrap().stdout).unwrap();
            text.trim().parse().unwrap()
        };
        let pages = (number("_PHYS_PAGES") * number("PAGESIZE")) as f64;
        let found = memory_bytes().unwrap() as f64;
        assert!((found / pages - 1.0).abs() < 0.01, "{found} for {pages}");
    }
}

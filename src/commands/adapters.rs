//! Adapters in words.

use raystone::gpu::AdapterSummary;
use raystone::report::format::bytes;
use serde_json::{Value, json};

/// What kind of device it is.
pub fn kind(adapter: &AdapterSummary) -> &'static str {
    match adapter.info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "unknown kind",
    }
}

/// Driver and version; some drivers give only one of the two.
pub fn driver(adapter: &AdapterSummary) -> String {
    let info = &adapter.info;
    let parts = [info.driver.as_str(), info.driver_info.as_str()];
    let parts: Vec<_> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    match parts.as_slice() {
        [] => "unnamed driver".to_owned(),
        parts => parts.join(" "),
    }
}

/// The most bytes that a kernel can bind as one array.
pub fn largest_binding(limits: &wgpu::Limits) -> u64 {
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}

/// Two lines: number and name; then everything else.
pub fn describe(adapter: &AdapterSummary) -> String {
    let timestamps = if adapter.timestamps { "yes" } else { "no" };
    format!(
        "  {}  {}\n     {}, {}, {}, timestamps: {timestamps}, largest binding: {}\n",
        adapter.index,
        adapter.info.name,
        kind(adapter),
        adapter.info.backend,
        driver(adapter),
        bytes(largest_binding(&adapter.limits)),
    )
}

/// What [`describe`] says, as JSON.
pub fn json(adapter: &AdapterSummary) -> Value {
    json!({
        "index": adapter.index,
        "name": adapter.info.name,
        "kind": kind(adapter),
        "backend": adapter.info.backend.to_str(),
        "driver": driver(adapter),
        "timestamps": adapter.timestamps,
        "largest_binding_bytes": largest_binding(&adapter.limits),
    })
}

/// Major version of the Mesa that a driver is part of, if its version text says so.
pub fn mesa_major(driver_info: &str) -> Option<u32> {
    let (_, version) = driver_info.split_once("Mesa ")?;
    version.split('.').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mesa_is_found_in_the_version_texts_of_both_backends() {
        for (text, major) in [
            ("Mesa 22.3.6 (LLVM 15.0.6)", Some(22)),
            ("4.5 (Core Profile) Mesa 25.0.7-2~bpo12+1", Some(25)),
            ("580.65.06", None),
            ("Mesa", None),
        ] {
            assert_eq!(mesa_major(text), major, "{text}");
        }
    }
}

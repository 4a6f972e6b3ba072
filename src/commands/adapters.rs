//! Adapters in words.

use super::list::Row;
use raystone::gpu::AdapterSummary;
use raystone::report::format::bytes;
use serde_json::json;

/// Returns the kind of device.
fn kind(adapter: &AdapterSummary) -> &'static str {
    match adapter.info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "unknown kind",
    }
}

/// Returns the driver and version; some drivers give only one of the two.
fn driver(adapter: &AdapterSummary) -> String {
    let info = &adapter.info;
    let parts = [info.driver.as_str(), info.driver_info.as_str()];
    let parts: Vec<_> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    match parts.as_slice() {
        [] => "unnamed driver".to_owned(),
        parts => parts.join(" "),
    }
}

/// Returns the most bytes that a kernel can bind as one array.
pub fn largest_binding(limits: &wgpu::Limits) -> u64 {
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}

/// Describes an adapter for lists: its number and name, and below them everything else.
pub fn row(adapter: &AdapterSummary) -> Row {
    let timestamps = if adapter.timestamps { "yes" } else { "no" };
    let (kind, driver, largest) = (
        kind(adapter),
        driver(adapter),
        largest_binding(&adapter.limits),
    );
    let backend = adapter.info.backend;
    let about = format!(
        "{kind}, {backend}, {driver}, timestamps: {timestamps}, largest binding: {}",
        bytes(largest)
    );
    let json = json!({
        "index": adapter.index,
        "name": adapter.info.name,
        "kind": kind,
        "backend": backend.to_str(),
        "driver": driver,
        "timestamps": adapter.timestamps,
        "largest_binding_bytes": largest,
    });
    Row::with(adapter.index, adapter.info.name.clone(), vec![about], json)
}

/// Returns the major version of the Mesa that a driver is part of, if its version text has it.
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

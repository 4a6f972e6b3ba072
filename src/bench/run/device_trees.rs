//! Trees that the device builds against those of the host: one that joins other neighbours, or has larger boxes than it needs,
//! answers right and looks slow.

use super::world::World;
use raystone_accel::{AccelKind, BuildLog, TriangleSoup};
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_gpu::Gpu;

/// Prefixes of builders that make the same tree, on the device and on the host.
const ON: [&str; 2] = ["device-", "host-"];
/// Triangles of the scene over which both build, at most.
const TRIANGLES: usize = 2048;

/// What is wrong with a tree over some of the scene's triangles by a builder on the device. `None` if nothing is, for other builders, and
/// where the device computes otherwise than the host.
pub(super) fn fault(world: &World, kind: &dyn AccelKind, accel: &Variant) -> Option<String> {
    let name = match accel.params.0.get("builder") {
        Some(ParamValue::Name(name)) => name.strip_prefix(ON[0])?,
        _ => return None,
    };
    if !world.probe.is_exact() || world.soup.placed.is_some() {
        return None;
    }
    let step = world.soup.records.len().div_ceil(TRIANGLES).max(1);
    let some = world.soup.records.iter().step_by(step).copied();
    let soup = TriangleSoup::from(some.collect::<Vec<_>>());
    let [device, host] = ON.map(|on| {
        let mut params = accel.params.clone();
        let builder = ParamValue::Name(format!("{on}{name}"));
        params.0.insert("builder".to_owned(), builder);
        words(kind, &params, &soup, world.gpu)
    });
    let pairs = device.ok()?.into_iter().zip(host.ok()?);
    let other = pairs.into_iter().find(|(a, b)| a != b)?;
    Some(format!(
        "over {} triangles of the scene its array `{}` has other words than that of {}{name}",
        soup.records.len(),
        other.0.0,
        ON[1]
    ))
}

/// The arrays of what is built, by name.
fn words(
    kind: &dyn AccelKind,
    params: &Params,
    soup: &TriangleSoup,
    gpu: &Gpu,
) -> Result<Vec<(String, Vec<u32>)>, String> {
    let built = kind.build(soup, params, &mut BuildLog::with_gpu(gpu));
    let built = built.map_err(|e| e.to_string())?;
    let held = built.buffers();
    let arrays = held.arrays.iter();
    let mut all: Vec<_> = arrays
        .map(|a| (a.name.to_string(), a.words.to_vec()))
        .collect();
    for (name, buffer) in built.on_device() {
        let words = gpu.read::<u32>(&buffer).map_err(|e| e.to_string())?;
        all.push((name.to_string(), words));
    }
    all.sort();
    Ok(all)
}

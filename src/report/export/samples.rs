//! Raw times: every recorded round, by the clock of the figure and by others.

use crate::data::RunData;
use raystone_record::figure::{self, Figure};
use raystone_record::{Key, axis};

/// The rounds of one measurement, milliseconds.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// Its subject.
    pub key: Key,
    /// The figure that is made of them.
    pub figure: &'static Figure,
    /// By the clock of the adapter where it has one: the samples of the figure.
    pub ms: Vec<f64>,
    /// In time of the processors; empty on adapters that work elsewhere.
    pub cpu_ms: Vec<f64>,
    /// Rays that a round traces, if rays are timed.
    pub rays: Option<u64>,
}

/// Returns all raw times of a run: builds, classes of rays, and full cells; none where a gate failed.
pub fn samples(data: &RunData) -> Vec<Samples> {
    let mut all = Vec::new();
    for scene in &data.scenes {
        let sound = || scene.structures.iter().filter(|s| s.fault().is_none());
        all.extend(sound().map(|s| Samples {
            key: s.key.clone(),
            figure: &figure::BUILD_MS,
            ms: vec![s.build_ms],
            cpu_ms: Vec::new(),
            rays: None,
        }));
        all.extend(sound().flat_map(|s| {
            s.timings.iter().map(|timing| Samples {
                key: (s.key.clone()).with(axis::RAYS, timing.class.name()),
                figure: &figure::MRAYS_PER_S,
                ms: timing.ms.clone(),
                cpu_ms: timing.cpu_ms.clone(),
                rays: Some(timing.rays as u64),
            })
        }));
        let times = scene.views.iter().flat_map(|view| view.valid_times());
        all.extend(times.map(|time| Samples {
            key: time.key.clone(),
            figure: &figure::MS_PER_SPP,
            ms: time.ms.clone(),
            cpu_ms: time.cpu_ms.clone(),
            rays: Some(time.traced_rays()),
        }));
    }
    all.retain(|samples| !samples.ms.is_empty());
    all
}

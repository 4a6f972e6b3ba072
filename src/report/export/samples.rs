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
    /// Rays that are traced in such a time, if rays are timed.
    pub rays: Option<f64>,
}

/// Returns all raw times of a run: builds, classes of rays, and full cells; none where a gate failed.
pub fn samples(data: &RunData) -> Vec<Samples> {
    let mut all = Vec::new();
    for scene in &data.scenes {
        let sound = || scene.structures.iter().filter(|s| s.fault().is_none());
        all.extend(sound().map(|s| {
            // Known only where it is of every phase.
            let cpu_ms: Option<f64> = s.build.iter().map(|phase| phase.cpu_ms).sum();
            Samples {
                key: s.key.clone(),
                figure: &figure::BUILD_MS,
                ms: vec![s.build_ms],
                cpu_ms: cpu_ms.into_iter().collect(),
                rays: None,
            }
        }));
        all.extend(sound().flat_map(|s| {
            s.timings.iter().map(|timing| Samples {
                key: (s.key.clone()).with(axis::RAYS, timing.class.name()),
                figure: &figure::MRAYS_PER_S,
                ms: timing.ms.clone(),
                cpu_ms: timing.cpu_ms.clone(),
                rays: Some(timing.rays as f64),
            })
        }));
        let times = scene.views.iter().flat_map(|view| view.valid_times());
        all.extend(times.map(|time| {
            let spp = f64::from(time.spp);
            let each = |rounds: &[f64]| rounds.iter().map(|ms| ms / spp).collect();
            Samples {
                key: time.key.clone(),
                figure: &figure::MS_PER_SPP,
                ms: each(&time.ms),
                cpu_ms: each(&time.cpu_ms),
                rays: Some(time.traced_rays() as f64 / spp),
            }
        }));
    }
    all.retain(|samples| !samples.ms.is_empty());
    all
}

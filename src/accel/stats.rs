//! Build times and static statistics of structures.

use super::AccelError;
use raystone_core::structure::Phase;
use raystone_gpu::{Gpu, Played, Player, Recording, Stopwatch};
use raystone_scene::LEAST_BINDING;
use std::sync::Arc;

/// Timed phases of a build, and the device for those that use it.
#[derive(Clone, Default)]
pub struct BuildLog {
    /// The phases timed so far.
    pub phases: Vec<Phase>,
    player: Option<Arc<Player>>,
    /// Bytes of the largest array, if not the device's limit.
    binding: Option<u64>,
    /// See [`BuildLog::noting_quality`].
    pub(crate) notes_quality: bool,
}

impl BuildLog {
    /// A log of a build that may use the device.
    pub fn with_gpu(gpu: &Gpu) -> Self {
        if cfg!(target_family = "wasm") {
            // A build waits for its device, and a browser lets nobody wait.
            return Self::default().binding(most_bytes(gpu));
        }
        Self {
            player: Some(Arc::new(Player::new(gpu))),
            ..Self::default()
        }
    }

    /// The log of a build for an adapter with this binding limit in bytes.
    #[must_use]
    pub fn binding(self, bytes: u64) -> Self {
        Self {
            binding: Some(bytes),
            ..self
        }
    }

    /// Has quality figures computed that only records show, such as the end-point overlap of a tree,
    /// which takes longer than some builds.
    #[must_use]
    pub fn noting_quality(self) -> Self {
        Self {
            notes_quality: true,
            ..self
        }
    }

    /// Maximum words of an array: the adapter's limit, or the guaranteed one.
    pub(crate) fn most_words(&self) -> u64 {
        let bound = self.gpu().map(most_bytes);
        self.binding.or(bound).unwrap_or(LEAST_BINDING) / 4
    }

    /// An empty log on the same device, for parts that are built concurrently.
    #[must_use]
    pub(crate) fn of_a_part(&self) -> Self {
        Self {
            phases: Vec::new(),
            player: self.player.clone(),
            binding: self.binding,
            notes_quality: self.notes_quality,
        }
    }

    /// The device, if the build may use one.
    pub fn gpu(&self) -> Option<&Gpu> {
        self.player.as_deref().map(Player::gpu)
    }

    /// Plays the commands of a device build. Its runs become phases, merged by name, timed by GPU
    /// timestamps if available, otherwise by wall time as one phase.
    ///
    /// # Errors
    /// There is no device, or it reported an error.
    pub fn play(&mut self, recording: &Recording) -> Result<Played, AccelError> {
        let player = self.player.as_ref();
        let player = player.ok_or_else(|| {
            AccelError::Device(
                "this structure is built on the device, and there is none for it; no build has one in a browser"
                    .to_owned(),
            )
        })?;
        let watch = Stopwatch::start();
        let played = player.play(recording);
        let spent = watch.elapsed();
        let played = played.map_err(|e| AccelError::Device(e.to_string()))?;
        let is_timed = played.runs.iter().all(|(_, ms)| ms.is_some());
        let noted = self.phases.len();
        for (name, ms) in played.runs.iter().filter(|_| is_timed) {
            self.note(name, ms.unwrap_or(0.0));
        }
        if !is_timed {
            let names = played.runs.iter().map(|(name, _)| name.as_str());
            let mut phase = names.collect::<Vec<_>>().join(" + ");
            if played.elapsed().backwards {
                phase += " (wall clock: that of the device ran backwards)";
            }
            self.note(&phase, played.wall_ms());
        }
        // Which of the passes kept the processors busy is not known.
        if let Some(phase) = self.phases.get_mut(noted) {
            phase.cpu_ms = spent.cpu_ms;
        }
        Ok(played)
    }

    /// Adds milliseconds to the phase of this name, creating it if needed.
    pub fn note(&mut self, name: &str, ms: f64) {
        match self.phases.iter_mut().find(|phase| phase.name == name) {
            Some(phase) => phase.ms += ms,
            None => self.phases.push(Phase {
                name: name.to_owned(),
                ms,
                cpu_ms: None,
            }),
        }
    }

    /// Runs `work` and records its time.
    pub fn phase<T>(&mut self, name: &str, work: impl FnOnce() -> T) -> T {
        let watch = Stopwatch::start();
        let result = work();
        let spent = watch.elapsed();
        self.phases.push(Phase {
            name: name.to_owned(),
            ms: spent.wall_ms,
            cpu_ms: spent.cpu_ms,
        });
        result
    }

    /// Sum of all phases, milliseconds.
    pub fn total_ms(&self) -> f64 {
        // Not sum(): the sum of nothing is −0.
        self.phases.iter().fold(0.0, |sum, p| sum + p.ms)
    }
}

/// Bytes of the largest array that a device binds.
fn most_bytes(gpu: &Gpu) -> u64 {
    let limits = &gpu.limits;
    limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pass_that_runs_several_times_has_the_sum_of_its_times() {
        let mut log = BuildLog::default();
        for (name, ms) in [("sort", 1.0), ("merge", 8.0), ("sort", 2.0), ("sort", 4.0)] {
            log.note(name, ms);
        }
        let phases: Vec<(&str, f64)> = log.phases.iter().map(|p| (&*p.name, p.ms)).collect();
        assert_eq!(phases, [("sort", 7.0), ("merge", 8.0)]);
        assert_eq!(log.total_ms(), 15.0);
    }
}

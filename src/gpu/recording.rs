//! Recordings: lists of device commands; a [`Player`] plays them.

use super::adapter::Gpu;
use super::bindings::{Bindings, Storage};
use super::clock::Elapsed;
use super::pipeline::{Pipeline, WORKGROUP_SIZE};
use super::wait::wait_for;
use super::{Composition, GpuError, Player, UniformValues};
use bytemuck::Pod;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Workgroups in a row of a one-dimensional dispatch. WebGPU allows 65,535 of them; in shorter rows ordinary loads fill several, so
/// that a kernel whose index is wrong beyond the first row is seen.
const ROW: u32 = 256;

/// The number of workgroups of a kernel.
#[derive(Debug, Clone, PartialEq)]
pub enum Groups {
    /// A fixed number in x, y, z.
    Direct([u32; 3]),
    /// Read from three words of this buffer, from this byte offset, when the step runs.
    Indirect(Storage, u64),
}

impl From<[u32; 3]> for Groups {
    fn from(groups: [u32; 3]) -> Self {
        Self::Direct(groups)
    }
}

/// Workgroups of [`WORKGROUP_SIZE`] for `items` invocations of a one-dimensional kernel; kernels
/// compute their index as `x + y * WORKGROUP_SIZE * num_workgroups.x`.
pub fn groups_for(items: u32) -> [u32; 3] {
    grid_of(items.div_ceil(WORKGROUP_SIZE))
}

/// At least one workgroup and at least `workgroups`; beyond 256 in several rows, the last
/// of which may have too many. A kernel's workgroup index is `x + y * num_workgroups.x`.
pub fn grid_of(workgroups: u32) -> [u32; 3] {
    let groups = workgroups.max(1);
    [groups.min(ROW), groups.div_ceil(ROW), 1]
}

#[derive(Clone)]
pub(super) struct Run {
    pub name: String,
    pub pipeline: Arc<Pipeline>,
    pub bindings: Bindings,
    pub groups: Groups,
}

#[derive(Clone)]
pub(super) enum Step {
    Clear(Storage),
    Copy { from: Storage, to: Storage },
    Run(Box<Run>),
    Download { name: String, from: Storage },
}

/// A list of steps for the device. Nothing runs before it is played: [`Player::play`].
#[derive(Clone, Default)]
pub struct Recording {
    pub(super) steps: Vec<Step>,
}

impl Recording {
    /// Creates an empty recording.
    pub fn new() -> Self {
        Self::default()
    }

    /// True if there are no steps.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Number of steps, for [`Recording::name_since`].
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Reports the times of all runs from this step on under one name.
    pub fn name_since(&mut self, place: usize, name: &str) -> &mut Self {
        for step in self.steps.iter_mut().skip(place) {
            if let Step::Run(run) = step {
                name.clone_into(&mut run.name);
            }
        }
        self
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: impl Into<Storage>) -> &mut Self {
        self.steps.push(Step::Clear(buffer.into()));
        self
    }

    /// Copies one buffer entirely over the start of another.
    pub fn copy(&mut self, from: impl Into<Storage>, to: impl Into<Storage>) -> &mut Self {
        let (from, to) = (from.into(), to.into());
        self.steps.push(Step::Copy { from, to });
        self
    }

    /// Runs a kernel, with its time reported under `name`.
    pub fn run(
        &mut self,
        name: &str,
        pipeline: &Arc<Pipeline>,
        bindings: &Bindings,
        groups: impl Into<Groups>,
    ) -> &mut Self {
        self.steps.push(Step::Run(Box::new(Run {
            name: name.to_owned(),
            pipeline: Arc::clone(pipeline),
            bindings: bindings.clone(),
            groups: groups.into(),
        })));
        self
    }

    /// Downloads the content of a buffer at this step, under `name`.
    pub fn download(&mut self, name: &str, from: impl Into<Storage>) -> &mut Self {
        let (name, from) = (name.to_owned(), from.into());
        self.steps.push(Step::Download { name, from });
        self
    }

    /// Number of kernels that it runs.
    pub fn run_count(&self) -> usize {
        self.runs().count()
    }

    /// Bytes of all scratch buffers whose names are wanted, each once, as long as the longest use of it.
    pub fn scratch_bytes(&self, is_wanted: impl Fn(&str) -> bool) -> u64 {
        let mut longest: BTreeMap<&str, u64> = BTreeMap::new();
        for storage in self.storages() {
            if let Storage::Scratch { name, bytes } = storage
                && is_wanted(name)
            {
                let known = longest.entry(name).or_default();
                *known = (*known).max(*bytes);
            }
        }
        longest.values().sum()
    }

    pub(super) fn runs(&self) -> impl Iterator<Item = &Run> {
        self.steps.iter().filter_map(|step| match step {
            Step::Run(run) => Some(&**run),
            _ => None,
        })
    }

    /// The same steps with the selected compilations of their kernels.
    pub(super) fn in_turn(&self, gpu: &Gpu) -> Result<Self, GpuError> {
        let mut recording = self.clone();
        for step in &mut recording.steps {
            if let Step::Run(run) = step {
                run.pipeline = gpu.in_turn(&run.pipeline)?;
            }
        }
        Ok(recording)
    }

    /// The same steps in recordings of at most `most` runs.
    pub(super) fn parts(&self, most: usize) -> Vec<Self> {
        let (mut parts, mut part, mut runs) = (Vec::new(), Self::new(), 0);
        for step in &self.steps {
            if matches!(step, Step::Run(_)) {
                if runs == most {
                    parts.push(std::mem::take(&mut part));
                    runs = 0;
                }
                runs += 1;
            }
            part.steps.push(step.clone());
        }
        parts.push(part);
        parts
    }

    pub(super) fn storages(&self) -> impl Iterator<Item = &Storage> {
        self.steps.iter().flat_map(|step| {
            let mut all: Vec<&Storage> = Vec::new();
            match step {
                Step::Clear(buffer) | Step::Download { from: buffer, .. } => all.push(buffer),
                Step::Copy { from, to } => all.extend([from, to]),
                Step::Run(run) => {
                    all.extend(run.bindings.storages());
                    if let Groups::Indirect(buffer, _) = &run.groups {
                        all.push(buffer);
                    }
                }
            }
            all
        })
    }

    /// The kernels it runs, each once, in order, with the milliseconds of their first use
    /// (composition and driver) once played. See [`Pipeline::cold_ms`].
    pub fn cold_ms(&self) -> Vec<(String, Option<f64>)> {
        let mut seen: Vec<&Arc<Pipeline>> = Vec::new();
        for run in self.runs() {
            if !seen.iter().any(|known| Arc::ptr_eq(known, &run.pipeline)) {
                seen.push(&run.pipeline);
            }
        }
        let entry = |p: &Arc<Pipeline>| p.kernel.composition.entry.clone();
        seen.iter().map(|p| (entry(p), p.cold_ms())).collect()
    }
}

/// Times and downloads of a played recording.
#[derive(Debug, Clone, Default)]
pub struct Played {
    /// From submission to completion by the host's clocks.
    pub(super) host: Elapsed,
    /// Names of the runs, each with its GPU milliseconds; `None` without timestamps.
    pub runs: Vec<(String, Option<f64>)>,
    /// GPU milliseconds from the beginning of the first run to the end of the last; `None` without timestamps, if the
    /// clock ran backwards, or in several submissions.
    pub gpu_span_ms: Option<f64>,
    /// The timestamps of the first run, and so on; empty without timestamps.
    pub(super) ticks: Vec<[u64; 2]>,
    pub(super) downloads: BTreeMap<String, Vec<u8>>,
}

impl Played {
    /// Wall-clock milliseconds from submission to completion.
    pub fn wall_ms(&self) -> f64 {
        self.host.wall_ms
    }

    /// The sum over all runs, and the host's clocks.
    pub fn elapsed(&self) -> Elapsed {
        let add = |sum: Option<f64>, (_, ms): &(String, Option<f64>)| Some(sum? + (*ms)?);
        Elapsed {
            gpu_ms: self.runs.iter().fold(Some(0.0), add),
            ..self.host
        }
    }

    /// The download named `name`.
    ///
    /// # Errors
    /// There is none.
    pub fn download<T: Pod>(&self, name: &str) -> Result<Vec<T>, GpuError> {
        let bytes = self.downloads.get(name);
        let bytes = bytes.ok_or_else(|| {
            GpuError::Driver(format!("the recording downloads nothing called `{name}`"))
        })?;
        Ok(bytemuck::pod_collect_to_vec(bytes))
    }
}

impl Gpu {
    /// Plays a recording once, with its own player: see [`Player::play`].
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn play(&self, recording: &Recording) -> Result<Played, GpuError> {
        Player::new(self).play(recording)
    }

    /// The same as a future: see [`Player::play_async`].
    ///
    /// # Errors
    /// As [`Player::play`].
    pub async fn play_async(&self, recording: &Recording) -> Result<Played, GpuError> {
        Player::new(self).play_async(recording).await
    }

    /// Runs a kernel once with one uniform, and downloads its outputs, given their sizes in bytes.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn evaluate(
        &self,
        kernel: &Composition,
        (uniform, values): (&str, UniformValues),
        inputs: &[(&str, &[u8])],
        outputs: &[(&str, u64)],
        groups: [u32; 3],
    ) -> Result<Played, GpuError> {
        let mut bindings = Bindings::new();
        bindings.uniform(uniform, values);
        for (name, content) in inputs {
            bindings.buffer(name, &self.storage(name, content)?);
        }
        for (name, bytes) in outputs {
            bindings.buffer(name, Storage::scratch(name, *bytes));
        }
        let mut recording = Recording::new();
        recording.run(uniform, &self.pipeline(kernel, true)?, &bindings, groups);
        for (name, bytes) in outputs {
            recording.download(name, Storage::scratch(name, *bytes));
        }
        self.play(&recording)
    }

    /// Copies a buffer to the host.
    ///
    /// # Errors
    /// The device is lost or does not finish in time.
    pub fn read<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        wait_for(self.read_async(buffer))
    }

    /// The same as a future: see [`Player::play_async`].
    ///
    /// # Errors
    /// As [`Gpu::read`].
    pub async fn read_async<T: Pod>(&self, buffer: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
        let mut recording = Recording::new();
        self.play_async(recording.download("", buffer))
            .await?
            .download("")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scratch_of_one_name_is_as_long_as_the_longest_that_asks_for_it() {
        let keys = |bytes| Storage::scratch("keys", bytes);
        let mut recording = Recording::new();
        recording.clear(keys(4)).clear(keys(8)).clear(keys(6));
        recording.clear(Storage::scratch("counts", 2));
        assert_eq!(recording.scratch_bytes(|_| true), 10);
        assert_eq!(recording.scratch_bytes(|name| name == "keys"), 8);
    }
}

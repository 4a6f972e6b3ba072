//! Plays recordings: binds, compiles new kernels, submits once, and reads clocks and downloads.

use super::GpuError;
use super::adapter::Gpu;
use super::bindings::{Resource, Storage};
use super::clock::{Elapsed, Stopwatch};
use super::pipeline::{BindingKind, Pipeline};
use super::recording::{Groups, Played, Recording, Run, Step};
use super::wait::wait_for;
use raystone_core::clock::Instant;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum runs per submission: as many as a set of timestamps has pairs.
const MAX_RUNS: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;
/// Maximum cached bind groups; they keep their buffers alive.
const KEPT_GROUPS: usize = 256;

/// Plays recordings on a device, and caches their resources: scratch and staging buffers, uniforms,
/// bind groups, timestamps. Replaying with the same buffers allocates nothing on the device.
pub struct Player {
    gpu: Gpu,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    scratch: BTreeMap<String, wgpu::Buffer>,
    staging: BTreeMap<String, wgpu::Buffer>,
    /// By index of the run in the recording, group and binding: the buffer with its content.
    uniforms: HashMap<(usize, u32, u32), (wgpu::Buffer, Vec<u8>)>,
    groups: HashMap<GroupKey, KeptGroups>,
    clock: Option<Clock>,
    made: usize,
}

/// The address of a pipeline and its resources.
type GroupKey = (usize, Vec<Resource>);
/// Bind groups with their pipeline, which keeps its address from being reused.
type KeptGroups = (Arc<Pipeline>, Vec<wgpu::BindGroup>);

/// A query set with two timestamps per run.
struct Clock {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mapped: wgpu::Buffer,
    runs: usize,
}

impl Player {
    /// A player with empty caches.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            kept: Mutex::default(),
        }
    }

    /// The device that it plays on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Number of buffers, query sets and bind groups created so far.
    pub fn made(&self) -> usize {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.made
    }

    /// Plays a recording to its end, in one submission (or several in sequence, for thousands of
    /// runs), and measures it. Kernels new to this device are compiled first, outside the
    /// measurement: [`Pipeline::cold_ms`].
    ///
    /// # Errors
    /// A binding is missing, a buffer or the number of workgroups exceeds a limit of the adapter,
    /// the driver complains, the device is lost or does not finish.
    pub fn play(&self, recording: &Recording) -> Result<Played, GpuError> {
        wait_for(self.play_async(recording))
    }

    /// The same as a future: between submission and answer, the caller may do other things. One recording of a player
    /// is played at a time.
    ///
    /// # Errors
    /// As [`Player::play`].
    #[expect(
        clippy::await_holding_lock,
        reason = "native futures do not suspend, and a browser has one thread"
    )]
    pub async fn play_async(&self, recording: &Recording) -> Result<Played, GpuError> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let scope = self
            .gpu
            .device
            .push_error_scope(wgpu::ErrorFilter::Validation);
        let played = match self.gpu.turn() {
            0 => kept.play(&self.gpu, recording).await,
            _ => match recording.in_turn(&self.gpu) {
                Ok(recording) => kept.play(&self.gpu, &recording).await,
                Err(error) => Err(error),
            },
        };
        let complaint = scope.pop().await;
        let played = match (played, complaint) {
            (Err(lost @ GpuError::Lost(_)), _) => Err(lost),
            (_, Some(error)) => Err(GpuError::Driver(error.to_string())),
            (played, None) => played,
        };
        if played.is_err() {
            // Buffers may still be mapped.
            *kept = Kept::default();
        }
        played
    }
}

impl Kept {
    async fn play(&mut self, gpu: &Gpu, recording: &Recording) -> Result<Played, GpuError> {
        if recording.runs().count() <= MAX_RUNS {
            return self.play_part(gpu, recording).await;
        }
        // Size for the largest part: growing later would lose the content.
        self.lend_scratch(gpu, recording)?;
        let mut whole = Played {
            host: Elapsed::nothing(false),
            ..Played::default()
        };
        for part in recording.parts(MAX_RUNS) {
            let played = self.play_part(gpu, &part).await?;
            whole.host += played.host;
            whole.runs.extend(played.runs);
            whole.downloads.extend(played.downloads);
        }
        Ok(whole)
    }

    async fn play_part(&mut self, gpu: &Gpu, recording: &Recording) -> Result<Played, GpuError> {
        let runs: Vec<&Run> = recording.runs().collect();
        for run in &runs {
            if let Groups::Direct(groups) = run.groups {
                check_groups(gpu, &run.name, groups)?;
            }
        }
        self.lend_scratch(gpu, recording)?;
        let bound = runs.iter().enumerate();
        let bound: Vec<_> = bound
            .map(|(place, run)| self.bind(gpu, place, run))
            .collect::<Result<_, _>>()?;
        for (run, groups) in runs.iter().zip(&bound) {
            if run.pipeline.first_ms.get().is_none() {
                let ms = first_dispatch(gpu, run, groups).await?;
                let _ = run.pipeline.first_ms.set(ms);
            }
        }
        let clock = gpu.timestamp_period.filter(|_| !runs.is_empty());
        if clock.is_some() {
            self.wind_clock(gpu, runs.len());
        }
        let (commands, staged) = self.encode(gpu, recording, &bound);
        let watch = Stopwatch::start();
        gpu.queue.submit([commands]);
        let clock_buffer = clock.and(self.clock.as_ref().map(|clock| clock.mapped.clone()));
        let to_map = staged.iter().map(|(_, buffer)| buffer);
        let to_map: Vec<_> = to_map.chain(&clock_buffer).collect();
        gpu.finished(&to_map).await?;
        let mut host = watch.elapsed();
        let mut downloads = BTreeMap::new();
        for (name, buffer) in staged {
            downloads.insert(name, take(&buffer)?);
        }
        let ticks = clock_buffer.map(|buffer| take(&buffer)).transpose()?;
        let ticks: Option<Vec<u64>> = ticks.map(|bytes| bytemuck::pod_collect_to_vec(&bytes));
        // Two timestamps per run.
        let (stamps, _) = ticks.as_deref().unwrap_or_default().as_chunks();
        let stamps = &stamps[..runs.len().min(stamps.len())];
        let whole = stamps.first().zip(stamps.last());
        let gpu_span_ms = whole.and_then(|(first, last)| span_ms([first[0], last[1]], clock));
        let spans: Vec<Option<f64>> = stamps.iter().map(|span| span_ms(*span, clock)).collect();
        host.backwards |= ticks.is_some() && spans.contains(&None);
        let ms = |place: usize| spans.get(place).copied().flatten();
        for (place, run) in runs.iter().enumerate() {
            if let Some(words) = downloads.remove(&staged_groups(place)) {
                let [x, y, z, ..] = bytemuck::pod_collect_to_vec::<_, u32>(&words)[..] else {
                    continue;
                };
                check_groups(gpu, &run.name, [x, y, z])?;
            }
        }
        let runs = runs.iter().enumerate();
        let runs = runs.map(|(place, run)| (run.name.clone(), ms(place)));
        Ok(Played {
            host,
            gpu_span_ms,
            ticks: stamps.to_vec(),
            runs: runs.collect(),
            downloads,
        })
    }

    /// Creates the scratch buffers of a recording that are missing or too small.
    fn lend_scratch(&mut self, gpu: &Gpu, recording: &Recording) -> Result<(), GpuError> {
        for storage in recording.storages() {
            let Storage::Scratch { name, bytes } = storage else {
                continue;
            };
            let known = self.scratch.get(name);
            if known.is_none_or(|buffer| buffer.size() < *bytes) {
                self.scratch.insert(name.clone(), gpu.zeroed(name, *bytes)?);
                self.made += 1;
                // Bind groups of the smaller buffer are obsolete.
                self.groups.clear();
            }
        }
        Ok(())
    }

    /// The buffer of a storage; scratch was created before.
    fn buffer<'a>(&'a self, storage: &'a Storage) -> Option<&'a wgpu::Buffer> {
        match storage {
            Storage::Own(buffer) => Some(buffer),
            Storage::Scratch { name, .. } => self.scratch.get(name),
        }
    }

    /// Bind groups of a run, with its uniforms filled.
    fn bind(
        &mut self,
        gpu: &Gpu,
        place: usize,
        run: &Run,
    ) -> Result<Vec<wgpu::BindGroup>, GpuError> {
        let mut resources = Vec::with_capacity(run.pipeline.bindings.len());
        for binding in &run.pipeline.bindings {
            let resource = match &binding.kind {
                BindingKind::Uniform { size, members } => {
                    let bytes = uniform_bytes(run, &binding.name, *size, members)?;
                    let key = (place, binding.group, binding.binding);
                    Resource::Buffer(self.uniform(gpu, key, bytes)?)
                }
                BindingKind::Storage | BindingKind::Texels => {
                    let lend = |name: &str| self.scratch.get(name);
                    run.bindings.resource(gpu, &run.pipeline, binding, lend)?
                }
            };
            resources.push(resource);
        }
        let key = (Arc::as_ptr(&run.pipeline) as usize, resources);
        if let Some((_, groups)) = self.groups.get(&key) {
            return Ok(groups.clone());
        }
        let layouts = run.pipeline.layouts.iter().enumerate();
        let groups: Vec<_> = layouts
            .map(|(group, layout)| {
                let bindings = run.pipeline.bindings.iter().zip(&key.1);
                let entries: Vec<_> = bindings
                    .filter(|(binding, _)| binding.group as usize == group)
                    .map(|(binding, resource)| wgpu::BindGroupEntry {
                        binding: binding.binding,
                        resource: resource.binding(),
                    })
                    .collect();
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout,
                    entries: &entries,
                })
            })
            .collect();
        if self.groups.len() >= KEPT_GROUPS {
            self.groups.clear();
        }
        self.made += groups.len();
        let kept = (Arc::clone(&run.pipeline), groups.clone());
        self.groups.insert(key, kept);
        Ok(groups)
    }

    /// The buffer of a uniform; written only if its content changes.
    fn uniform(
        &mut self,
        gpu: &Gpu,
        key: (usize, u32, u32),
        bytes: Vec<u8>,
    ) -> Result<wgpu::Buffer, GpuError> {
        if let Some((buffer, held)) = self.uniforms.get_mut(&key) {
            if *held == bytes {
                return Ok(buffer.clone());
            }
            if held.len() == bytes.len() {
                gpu.queue.write_buffer(buffer, 0, &bytes);
                *held = bytes;
                return Ok(buffer.clone());
            }
        }
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = gpu.filled("uniform", &bytes, usage)?;
        self.made += 1;
        self.uniforms.insert(key, (buffer.clone(), bytes));
        Ok(buffer)
    }

    fn wind_clock(&mut self, gpu: &Gpu, runs: usize) {
        if self.clock.as_ref().is_some_and(|clock| clock.runs >= runs) {
            return;
        }
        let runs = runs.next_power_of_two().min(MAX_RUNS);
        let queries = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("timestamps"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * runs as u32,
        });
        let buffer = |usage| buffer_of(gpu, "timestamps", 16 * runs as u64, usage);
        self.made += 3;
        self.clock = Some(Clock {
            queries,
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            mapped: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
            runs,
        });
    }

    /// The commands, and the buffers to read after completion, by name.
    fn encode(
        &mut self,
        gpu: &Gpu,
        recording: &Recording,
        bound: &[Vec<wgpu::BindGroup>],
    ) -> (wgpu::CommandBuffer, Vec<(String, wgpu::Buffer)>) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut staged = Vec::new();
        let mut place = 0;
        for step in &recording.steps {
            match step {
                Step::Clear(buffer) => {
                    if let Some(buffer) = self.buffer(buffer) {
                        encoder.clear_buffer(buffer, 0, None);
                    }
                }
                Step::Copy { from, to } => {
                    if let (Some(from), Some(to)) = (self.buffer(from), self.buffer(to)) {
                        encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
                    }
                }
                Step::Run(run) => {
                    if let Groups::Indirect(buffer, offset) = &run.groups {
                        let name = staged_groups(place);
                        staged.extend(self.stage(
                            gpu,
                            &mut encoder,
                            name,
                            buffer,
                            *offset,
                            Some(12),
                        ));
                    }
                    self.encode_run(&mut encoder, run, &bound[place], place);
                    place += 1;
                }
                Step::Download { name, from } => {
                    staged.extend(self.stage(gpu, &mut encoder, name.clone(), from, 0, None));
                }
            }
        }
        if let Some(clock) = self.clock.as_ref().filter(|_| place > 0) {
            let queries = 2 * place as u32;
            encoder.resolve_query_set(&clock.queries, 0..queries, &clock.resolved, 0);
            let bytes = 8 * u64::from(queries);
            encoder.copy_buffer_to_buffer(&clock.resolved, 0, &clock.mapped, 0, bytes);
        }
        (encoder.finish(), staged)
    }

    fn encode_run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        run: &Run,
        groups: &[wgpu::BindGroup],
        place: usize,
    ) {
        let writes = self
            .clock
            .as_ref()
            .map(|clock| wgpu::ComputePassTimestampWrites {
                query_set: &clock.queries,
                beginning_of_pass_write_index: Some(2 * place as u32),
                end_of_pass_write_index: Some(2 * place as u32 + 1),
            });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(&run.name),
            timestamp_writes: writes,
        });
        set(&mut pass, run, groups);
        match &run.groups {
            Groups::Direct([x, y, z]) => pass.dispatch_workgroups(*x, *y, *z),
            Groups::Indirect(buffer, offset) => {
                if let Some(buffer) = self.buffer(buffer) {
                    pass.dispatch_workgroups_indirect(buffer, *offset);
                }
            }
        }
    }

    /// Copies a buffer, or `bytes` of it, to one that the host can read.
    fn stage(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        name: String,
        from: &Storage,
        offset: u64,
        bytes: Option<u64>,
    ) -> Option<(String, wgpu::Buffer)> {
        let whole = match from {
            Storage::Own(buffer) => buffer.size(),
            Storage::Scratch { bytes, .. } => bytes.next_multiple_of(4).max(4),
        };
        let bytes = bytes.unwrap_or(whole);
        let from = self.buffer(from)?.clone();
        let known = self.staging.get(&name);
        let staging = match known.filter(|staging| staging.size() == bytes) {
            Some(staging) => staging.clone(),
            None => {
                self.made += 1;
                let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
                let staging = buffer_of(gpu, "staging", bytes, usage);
                self.staging.insert(name.clone(), staging.clone());
                staging
            }
        };
        encoder.copy_buffer_to_buffer(&from, offset, &staging, 0, bytes);
        Some((name, staging))
    }
}

/// Name for staging the workgroup count of an indirect run.
fn staged_groups(place: usize) -> String {
    format!("workgroups of run {place}")
}

fn check_groups(gpu: &Gpu, step: &str, groups: [u32; 3]) -> Result<(), GpuError> {
    let limit = gpu.limits.max_compute_workgroups_per_dimension;
    if groups.iter().any(|n| *n > limit) {
        Err(GpuError::TooManyGroups {
            step: step.to_owned(),
            groups,
            limit,
        })
    } else {
        Ok(())
    }
}

fn uniform_bytes(
    run: &Run,
    name: &str,
    size: u32,
    members: &[(String, u32)],
) -> Result<Vec<u8>, GpuError> {
    let uniforms = &run.bindings.uniforms;
    let unbound = |what: &str| run.pipeline.unbound(what, uniforms.keys());
    let values = uniforms.get(name).ok_or_else(|| unbound(name))?;
    values
        .pack(size, members)
        .map_err(|member| unbound(&format!("{name}.{member}")))
}

fn buffer_of(gpu: &Gpu, name: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: bytes,
        usage,
        mapped_at_creation: false,
    })
}

fn set(pass: &mut wgpu::ComputePass, run: &Run, groups: &[wgpu::BindGroup]) {
    pass.set_pipeline(&run.pipeline.compute);
    for (index, group) in groups.iter().enumerate() {
        pass.set_bind_group(index as u32, group, &[]);
    }
}

/// Milliseconds of a dispatch of no workgroups. Browsers warn of such dispatches: there it is that of a pass without one.
async fn first_dispatch(gpu: &Gpu, run: &Run, groups: &[wgpu::BindGroup]) -> Result<f64, GpuError> {
    run.pipeline.complaint().await?;
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        set(&mut pass, run, groups);
        if !cfg!(target_arch = "wasm32") {
            pass.dispatch_workgroups(0, 1, 1);
        }
    }
    let start = Instant::now();
    gpu.queue.submit([encoder.finish()]);
    gpu.finished(&[]).await?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// Milliseconds between two timestamps; `None` without a clock, or if it ran backwards.
fn span_ms([from, to]: [u64; 2], period_ns: Option<f32>) -> Option<f64> {
    Some(to.checked_sub(from)? as f64 * f64::from(period_ns?) * 1e-6)
}

/// The content of a mapped buffer, which is unmapped.
fn take(buffer: &wgpu::Buffer) -> Result<Vec<u8>, GpuError> {
    let view = buffer.get_mapped_range(..);
    let view = view.map_err(|e| GpuError::Driver(e.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    buffer.unmap();
    Ok(bytes)
}

/// Computes a known span: 2000 ticks of 2.5 ns.
///
/// # Errors
/// It is not 0.005 ms.
pub fn check_span() -> Result<(), String> {
    let found = span_ms([7000, 9000], Some(2.5));
    let agrees = found.is_some_and(|ms| (ms - 0.005).abs() < 1e-12);
    agrees.then_some(()).ok_or_else(|| {
        format!(
            "2000 ticks of 2.5 ns are {found:?} ms, and should be 0.005: this program shows wrong times; build it anew, and \
             report what stays wrong"
        )
    })
}

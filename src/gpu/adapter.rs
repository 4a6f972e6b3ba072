//! Adapter choice and device creation.

use super::GpuError;
use super::compose::KernelLibrary;
use super::pipeline::PipelineCache;
use super::wait::wait_for;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

/// The adapter to use.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// The best: discrete before integrated before virtual before software; Vulkan before GL.
    #[default]
    Best,
    /// Index in the list of `raystone list`.
    Index(usize),
    /// Part of the adapter's name, case-insensitive, or its PCI bus address, as `0000:65:00.0` or a
    /// part of it with a colon.
    Name(String),
}

impl std::str::FromStr for AdapterChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(text
            .parse()
            .map_or_else(|_| Self::Name(text.to_owned()), Self::Index))
    }
}

/// One adapter, for lists.
#[derive(Debug, Clone)]
pub struct AdapterSummary {
    /// Index in the list.
    pub index: usize,
    /// Adapter information from wgpu.
    pub info: wgpu::AdapterInfo,
    /// Maximum limits.
    pub limits: wgpu::Limits,
    /// True if it has GPU timestamps.
    pub timestamps: bool,
}

/// An open device and its properties; a clone refers to the same device.
#[derive(Clone)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter it belongs to.
    pub info: wgpu::AdapterInfo,
    /// Limits that the device was opened with.
    pub limits: wgpu::Limits,
    /// Nanoseconds per timestamp tick; `None` where there are no timestamps.
    pub timestamp_period: Option<f32>,
    /// Total loop iterations per invocation after which the driver silently ends loops, if it does.
    /// Kernels then check that it did not happen.
    pub loop_limit: Option<u32>,
    /// Kernels read arrays as sampled textures, see [`Gpu::sampling_texels`].
    pub(super) samples_texels: bool,
    /// Kernel sources.
    pub kernels: KernelLibrary,
    pub(super) pipelines: Arc<Mutex<PipelineCache>>,
    /// See [`Gpu::take_modules`].
    pub(super) used: Arc<Mutex<BTreeMap<String, String>>>,
    /// See [`Gpu::compiled_apart`].
    compilations: usize,
    turn: Arc<AtomicUsize>,
    lost: Arc<Mutex<Option<String>>>,
    /// See [`Gpu::reads_texels_faster`].
    pub(super) texels_faster: Arc<OnceLock<bool>>,
}

/// Arrays that a kernel may read as textures: nodes, triangles of leaves and of the scene, shading tables, words of a sampler.
const TEXEL_ARRAYS: u32 = 5;

fn instance(backends: wgpu::Backends) -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle_from_env()
    })
}

fn rank(info: &wgpu::AdapterInfo) -> (u8, u8) {
    let device = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (device, u8::from(info.backend == wgpu::Backend::Gl))
}

/// Every adapter with compute shaders, best first. OpenGL is tried only if nothing else answers, or
/// `WGPU_BACKEND` asks for it: merely loading it makes some drivers print.
fn enumerate() -> Vec<wgpu::Adapter> {
    match wgpu::Backends::from_env() {
        Some(asked) => enumerate_among(asked),
        None => {
            let found = enumerate_among(wgpu::Backends::all() - wgpu::Backends::GL);
            if found.is_empty() {
                enumerate_among(wgpu::Backends::GL)
            } else {
                found
            }
        }
    }
}

fn enumerate_among(backends: wgpu::Backends) -> Vec<wgpu::Adapter> {
    let mut found = wait_for(instance(backends).enumerate_adapters(backends));
    found.retain(|a| {
        a.get_downlevel_capabilities()
            .flags
            .contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
    });
    found.sort_by_key(|a| rank(&a.get_info()));
    found
}

/// Every adapter with compute shaders, best first; OpenGL only if there are no others.
/// `WGPU_BACKEND` narrows the search.
pub fn adapters() -> Vec<AdapterSummary> {
    enumerate()
        .iter()
        .enumerate()
        .map(|(index, adapter)| AdapterSummary {
            index,
            info: adapter.get_info(),
            limits: adapter.limits(),
            timestamps: adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        })
        .collect()
}

fn choose(found: Vec<wgpu::Adapter>, choice: &AdapterChoice) -> Result<wgpu::Adapter, GpuError> {
    if found.is_empty() {
        return Err(GpuError::NoAdapter);
    }
    let names: Vec<String> = found.iter().map(|a| a.get_info().name).collect();
    let position = match choice {
        AdapterChoice::Best => Some(0),
        AdapterChoice::Index(i) => (*i < names.len()).then_some(*i),
        AdapterChoice::Name(part) => {
            let part = part.to_lowercase();
            let is_at = |a: &wgpu::Adapter| {
                let place = a.get_info().device_pci_bus_id.to_lowercase();
                part.contains(':') && place.contains(&part)
            };
            let is_called = |name: &String| name.to_lowercase().contains(&part);
            let by_place = found.iter().position(is_at);
            by_place.or_else(|| names.iter().position(is_called))
        }
    };
    match position.and_then(|p| found.into_iter().nth(p)) {
        Some(adapter) => Ok(adapter),
        None => Err(GpuError::UnknownAdapter {
            asked: match choice {
                AdapterChoice::Index(i) => i.to_string(),
                AdapterChoice::Name(n) => n.clone(),
                AdapterChoice::Best => String::new(),
            },
            known: names
                .iter()
                .enumerate()
                .map(|(i, n)| format!("{i}: {n}"))
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}

/// WebGPU's defaults, with the adapter's offer only for larger buffers, more of them (for arrays in
/// several parts) and more storage textures (for arrays read as such): kernels stay portable.
fn limits_to_ask(offer: &wgpu::Limits) -> wgpu::Limits {
    wgpu::Limits {
        max_buffer_size: offer.max_buffer_size,
        max_storage_buffer_binding_size: offer.max_storage_buffer_binding_size,
        max_storage_buffers_per_shader_stage: offer.max_storage_buffers_per_shader_stage,
        max_storage_textures_per_shader_stage: offer.max_storage_textures_per_shader_stage,
        ..wgpu::Limits::default().using_resolution(offer.clone())
    }
}

/// A separate device for uses outside this crate, without players, pipelines and checks.
pub struct RawDevice {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name of the adapter.
    pub adapter: String,
    /// Nanoseconds per timestamp tick; `None` where there are no timestamps.
    pub timestamp_period: Option<f32>,
    fault: Arc<Mutex<Option<String>>>,
}

impl RawDevice {
    /// Waits for all submitted work.
    ///
    /// # Errors
    /// The driver has complained, or does not finish.
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::Wait {
            submission_index: None,
            timeout: Some(super::buffers::PATIENCE),
        });
        if let Some(cause) = self.fault.lock().ok().and_then(|slot| slot.clone()) {
            return Err(GpuError::Driver(cause));
        }
        waited.map(|_| ()).map_err(|_| GpuError::Timeout {
            seconds: super::buffers::PATIENCE.as_secs(),
        })
    }
}

/// True if the chosen adapter is a software rasteriser; it is not opened.
///
/// # Errors
/// No adapter, or no such adapter.
pub fn is_software(choice: &AdapterChoice) -> Result<bool, GpuError> {
    let adapter = choose(enumerate(), choice)?;
    Ok(adapter.get_info().device_type == wgpu::DeviceType::Cpu)
}

/// Opens the chosen adapter.
///
/// # Errors
/// No adapter, no such adapter, the driver refuses a device, or its loops cannot be trusted.
pub fn open(choice: &AdapterChoice, kernels: KernelLibrary) -> Result<Gpu, GpuError> {
    let adapter = choose(enumerate(), choice)?;
    let info = adapter.get_info();
    let limits = limits_to_ask(&adapter.limits());
    // naga translates reads of storage textures for every backend.
    wait_for(device_of(&adapter, info, limits, true, kernels))
}

/// Opens the adapter that a browser offers. `name` is what the browser says of it, which wgpu keeps to itself: adapters
/// known by it to be software are taken for such.
///
/// # Errors
/// As for [`open`].
#[cfg(target_family = "wasm")]
pub async fn open_in_browser(name: &str, kernels: KernelLibrary) -> Result<Gpu, GpuError> {
    let instance = instance(wgpu::Backends::BROWSER_WEBGPU);
    let wanted = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..Default::default()
    };
    let adapter = instance.request_adapter(&wanted).await;
    let adapter = adapter.map_err(|_| GpuError::NoAdapter)?;
    let mut info = adapter.get_info();
    info.name = name.to_owned();
    if names_software(name) {
        info.device_type = wgpu::DeviceType::Cpu;
    }
    // What every page may ask for, so that all measure the same.
    let limits = wgpu::Limits::default();
    let language = instance.wgsl_language_features();
    let reads = language.contains(wgpu::WgslLanguageFeatures::ReadOnlyAndReadWriteStorageTextures);
    let gpu = device_of(&adapter, info, limits, reads, kernels).await?;
    let texels = super::load_probe::measure(&gpu).await?;
    let _ = gpu.texels_faster.set(texels);
    Ok(gpu)
}

/// True if this is what a software rasteriser is called.
#[cfg(any(test, target_family = "wasm"))]
fn names_software(name: &str) -> bool {
    let name = name.to_lowercase();
    let software = ["swiftshader", "llvmpipe", "lavapipe", "basic render driver"];
    software.iter().any(|part| name.contains(part))
}

async fn device_of(
    adapter: &wgpu::Adapter,
    info: wgpu::AdapterInfo,
    limits: wgpu::Limits,
    reads_storage_textures: bool,
    kernels: KernelLibrary,
) -> Result<Gpu, GpuError> {
    let features =
        adapter.features() & (wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SUBGROUP);
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("raystone"),
        required_features: features,
        required_limits: limits.clone(),
        ..Default::default()
    };
    let opened = adapter.request_device(&descriptor).await;
    let (device, queue) = opened.map_err(|e| GpuError::NoDevice {
        adapter: info.name.clone(),
        cause: e.to_string(),
    })?;
    let lost = Arc::new(Mutex::new(None));
    let flag = Arc::clone(&lost);
    device.set_device_lost_callback(move |reason, text| {
        if let Ok(mut slot) = flag.lock() {
            *slot = Some(format!("{reason:?}: {text}"));
        }
    });
    // Validation errors outside a scope are reported at the next wait, instead of panicking.
    let flag = Arc::clone(&lost);
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        if let Ok(mut slot) = flag.lock() {
            slot.get_or_insert_with(|| error.to_string());
        }
    }));
    let timestamp_period = features
        .contains(wgpu::Features::TIMESTAMP_QUERY)
        .then(|| queue.get_timestamp_period());
    let mut gpu = Gpu {
        device,
        queue,
        info,
        timestamp_period,
        loop_limit: None,
        samples_texels: !reads_storage_textures
            || limits.max_storage_textures_per_shader_stage < TEXEL_ARRAYS,
        limits,
        kernels,
        pipelines: Arc::default(),
        used: Arc::default(),
        compilations: 1,
        turn: Arc::default(),
        lost,
        texels_faster: Arc::default(),
    };
    gpu.loop_limit = super::probe::probe_loops(&gpu).await?;
    Ok(gpu)
}

impl Gpu {
    /// The same device with other kernels: both can bind the same buffers, and kernels that compose
    /// to the same text are compiled once.
    #[must_use]
    pub fn with_kernels(&self, kernels: KernelLibrary) -> Self {
        Self {
            kernels,
            ..self.clone()
        }
    }

    /// The same device, whose kernels read arrays as sampled textures and not as storage textures: what a device does that
    /// cannot read five of the latter. Every device has sampled ones; Mesa's software driver takes more than twice as long to read them.
    #[must_use]
    pub fn sampling_texels(&self) -> Self {
        Self {
            samples_texels: true,
            ..self.clone()
        }
    }

    /// Another device of the same adapter, with the same kernels: modules count for both, see [`Gpu::take_modules`].
    ///
    /// # Errors
    /// As for [`open`].
    pub fn twin(&self, choice: &AdapterChoice) -> Result<Self, GpuError> {
        Ok(Self {
            used: Arc::clone(&self.used),
            ..open(choice, self.kernels.clone())?
        })
    }

    /// The same device, but it compiles every kernel this many times, and each kernel library
    /// separately even for equal texts: measurements then include the random differences between
    /// compilations of the same text.
    #[must_use]
    pub fn compiled_apart(&self, compilations: usize) -> Self {
        Self {
            compilations: compilations.max(1),
            ..self.clone()
        }
    }

    /// Number of compilations of every kernel.
    pub fn compilations(&self) -> usize {
        self.compilations
    }

    /// Selects the compilation for this round, for everything played on this device from now on.
    pub fn take_turn(&self, round: usize) {
        self.turn.store(round, Ordering::Relaxed);
    }

    /// Index of the selected compilation, from 0.
    pub(super) fn turn(&self) -> usize {
        self.turn.load(Ordering::Relaxed) % self.compilations
    }

    /// Another device on the same adapter with these wgpu features, which may be experimental.
    ///
    /// # Errors
    /// The adapter lacks them, or gives no second device.
    pub fn open_beside(&self, features: wgpu::Features) -> Result<RawDevice, GpuError> {
        let refused = |cause: String| GpuError::NoDevice {
            adapter: self.info.name.clone(),
            cause,
        };
        let mut found = enumerate_among(self.info.backend.into()).into_iter();
        let adapter = found
            .find(|adapter| adapter.get_info() == self.info)
            .ok_or_else(|| refused("it does not answer a second time".into()))?;
        if !adapter.features().contains(features) {
            return Err(refused(format!("it lacks {features:?}")));
        }
        let timestamps = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let limits = adapter.limits();
        // SAFETY: experimental features are requested by name, and used as wgpu documents.
        let experimental_features = unsafe { wgpu::ExperimentalFeatures::enabled() };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("raystone, beside"),
            required_features: features | timestamps,
            required_limits: limits,
            experimental_features,
            ..Default::default()
        };
        let (device, queue) =
            wait_for(adapter.request_device(&descriptor)).map_err(|e| refused(e.to_string()))?;
        let fault = Arc::new(Mutex::new(None));
        let slot = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            if let Ok(mut slot) = slot.lock() {
                slot.get_or_insert_with(|| error.to_string());
            }
        }));
        let adapter = self.info.name.clone();
        let timestamp_period = (!timestamps.is_empty()).then(|| queue.get_timestamp_period());
        Ok(RawDevice {
            device,
            queue,
            adapter,
            timestamp_period,
            fault,
        })
    }

    /// True if there are GPU timestamps.
    pub fn has_clock(&self) -> bool {
        self.timestamp_period.is_some()
    }

    /// What is wrong with the period of timestamps; `None` if it is that of the queue, or if there are none.
    pub fn period_fault(&self) -> Option<String> {
        let own = self.queue.get_timestamp_period();
        let other = self.timestamp_period.filter(|period| *period != own)?;
        Some(format!(
            "timestamps are taken for {other} ns, and those of the queue are {own} ns"
        ))
    }

    /// True if the adapter is a software rasteriser.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// True if kernels may vote and shuffle within subgroups, whose size they must not assume.
    pub(crate) fn has_subgroups(&self) -> bool {
        self.device.features().contains(wgpu::Features::SUBGROUP)
    }

    /// The error that made the device unusable, if any.
    pub fn lost(&self) -> Option<String> {
        // The driver reports a loss only when polled; its other messages are reported elsewhere.
        let _ = self.device.poll(wgpu::PollType::Poll);
        self.lost.lock().ok().and_then(|slot| slot.clone())
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

/// Adapter limits that runs may reach.
pub fn limits_of_runs(limits: &wgpu::Limits) -> BTreeMap<String, u64> {
    let found = [
        ("max_buffer_size", limits.max_buffer_size),
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
        ),
        (
            "max_storage_buffers_per_shader_stage",
            limits.max_storage_buffers_per_shader_stage.into(),
        ),
        (
            "max_compute_workgroup_storage_size",
            limits.max_compute_workgroup_storage_size.into(),
        ),
        (
            "max_compute_invocations_per_workgroup",
            limits.max_compute_invocations_per_workgroup.into(),
        ),
        (
            "max_compute_workgroups_per_dimension",
            limits.max_compute_workgroups_per_dimension.into(),
        ),
        (
            "max_texture_dimension_2d",
            limits.max_texture_dimension_2d.into(),
        ),
    ];
    found
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::names_software;

    #[test]
    fn software_is_known_by_what_browsers_call_it() {
        for name in [
            "google swiftshader",
            "SwiftShader Device (Subzero)",
            "llvmpipe (LLVM 15.0.6, 256 bits)",
            "Microsoft Basic Render Driver",
        ] {
            assert!(names_software(name), "{name}");
        }
        for name in ["nvidia ampere", "apple metal-3", ""] {
            assert!(!names_software(name), "{name}");
        }
    }
}

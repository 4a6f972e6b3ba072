//! The kernels of a run: a library for each folder on the axis, and a device that composes from each.

use super::{Registries, RunError, RunOptions};
use raystone_core::params::Variant;
use raystone_gpu::{self as gpu, AdapterChoice, Gpu, KernelLibrary};
use raystone_record::{KernelFile, KernelFolder, KernelSetRecord};
use std::path::Path;
use std::sync::OnceLock;

/// The embedded kernels with those of `folder` on top, checked as far as can be without composing.
///
/// # Errors
/// The folder cannot be read, a file in it is no WESL, or no kernel could be made with it.
pub fn kernel_library(folder: &Path, registries: &Registries) -> Result<KernelLibrary, RunError> {
    let library = registries.library().with_folder(folder);
    let checked = library.and_then(|library| {
        library.check(&registries.kernels())?;
        Ok(library)
    });
    checked.map_err(|e| RunError::Input(format!("kernels {}: {e}", folder.display())))
}

/// The libraries of an axis of kernels, and that of the program with what was registered.
pub struct Kernels {
    embedded: KernelLibrary,
    folders: Vec<(Variant, KernelLibrary)>,
}

impl Kernels {
    /// Reads and checks the folders; the variant of the empty name stands for the embedded kernels.
    ///
    /// # Errors
    /// As [`kernel_library`].
    pub fn load(axis: &[Variant], registries: &Registries) -> Result<Self, RunError> {
        let folders = axis.iter().filter(|kernels| !kernels.name.is_empty());
        let library = |kernels: &Variant| {
            let library = kernel_library(Path::new(&kernels.name), registries)?;
            Ok((kernels.clone(), library))
        };
        Ok(Self {
            embedded: registries.library(),
            folders: folders.map(library).collect::<Result<_, RunError>>()?,
        })
    }

    /// Why kernels that were made of these modules are others now; `None` if they are not.
    pub(super) fn changed(&self, set: &KernelSetRecord) -> Option<String> {
        let folder = (self.folders.iter()).find(|(kernels, _)| kernels.label == set.kernels);
        let folder = folder.map(|(_, library)| library);
        if !set.kernels.is_empty() && folder.is_none() {
            return Some(format!("there is no folder of kernels {} now", set.kernels));
        }
        let is_other = |(name, hash): &(&String, &String)| match name.strip_prefix('@') {
            Some(name) => folder.is_none_or(|f| !f.overrides(name) || f.text_hash(name) != **hash),
            None => {
                folder.is_some_and(|folder| folder.overrides(name))
                    || self.embedded.text_hash(name) != **hash
            }
        };
        let other = set.modules.iter().filter(is_other);
        let names: Vec<&str> = other.map(|(name, _)| name.as_str()).collect();
        (!names.is_empty()).then(|| format!("kernels changed: {}", names.join(", ")))
    }

    /// What is recorded of them.
    pub(super) fn folders(&self) -> Vec<KernelFolder> {
        let folder = |(kernels, library): &(Variant, KernelLibrary)| KernelFolder {
            label: kernels.label.clone(),
            folder: kernels.name.clone(),
            hash: library.hash().to_owned(),
            files: library
                .overridden()
                .into_iter()
                .map(|name| file(library, name))
                .collect(),
        };
        self.folders.iter().map(folder).collect()
    }
}

fn file(library: &KernelLibrary, name: &str) -> KernelFile {
    let text = library.text(name).unwrap_or_default();
    KernelFile {
        file: format!("{name}.wesl"),
        hash: blake3::hash(text.as_bytes()).to_hex().to_string(),
        replaces: KernelLibrary::is_embedded(name),
    }
}

/// An open device, which composes kernels from every library of a run.
pub(super) struct Device {
    /// With the embedded kernels.
    pub gpu: Gpu,
    views: Vec<(Variant, Gpu)>,
    adapter: AdapterChoice,
    /// See [`Self::hands`].
    twin: OnceLock<Option<Gpu>>,
}

impl Device {
    /// Opens the adapter of the options.
    pub(super) fn open(options: &RunOptions, kernels: &Kernels) -> Result<Self, RunError> {
        let gpu = gpu::open(&options.adapter, kernels.embedded.clone())?;
        let gpu = gpu.compiled_apart(options.compilations);
        let views = kernels.folders.iter();
        let views =
            views.map(|(kernels, library)| (kernels.clone(), gpu.with_kernels(library.clone())));
        let views = views.collect();
        Ok(Self {
            gpu,
            views,
            adapter: options.adapter.clone(),
            twin: OnceLock::new(),
        })
    }

    /// Devices with these kernels that may work at once: two of a software adapter, for which the host does most of its work one
    /// thread at a time.
    pub(super) fn hands(&self, kernels: &Variant) -> Result<Vec<Gpu>, RunError> {
        let first = self.of(kernels)?.clone();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        if !first.is_software() || cores < 2 {
            return Ok(vec![first]);
        }
        let twin = (self.twin).get_or_init(|| self.gpu.twin(&self.adapter).ok());
        let twin = twin
            .as_ref()
            .map(|twin| twin.with_kernels(first.kernels.clone()));
        Ok([first].into_iter().chain(twin).collect())
    }

    /// The device with these kernels; an error if the plan was made for others.
    pub(super) fn of(&self, kernels: &Variant) -> Result<&Gpu, RunError> {
        if kernels.name.is_empty() {
            return Ok(&self.gpu);
        }
        let view = self.views.iter().find(|(known, _)| known == kernels);
        let view = view.map(|(_, gpu)| gpu);
        view.ok_or_else(|| {
            RunError::Input(format!("the kernels {kernels} are not those of the plan"))
        })
    }
}

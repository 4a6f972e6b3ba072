//! Kernels of a run: a library per folder on the axis, and a device that composes from each.

use super::device::Device;
use super::error::RunError;
use super::options::RunOptions;
use super::registries::Registries;
use raystone_core::params::Variant;
use raystone_gpu::{self as gpu, KernelLibrary};
use raystone_record::{KernelFile, KernelFolder, KernelSetRecord};
use std::path::Path;

/// The embedded kernels overlaid with those of `folder`, checked without composing.
///
/// # Errors
/// The folder cannot be read, a file is not WESL, or no kernel could be composed with it.
pub fn kernel_library(folder: &Path, registries: &Registries) -> Result<KernelLibrary, RunError> {
    let library = registries.library().with_folder(folder);
    let checked = library.and_then(|library| {
        library.check(&registries.kernels())?;
        Ok(library)
    });
    checked.map_err(|e| RunError::Input(format!("kernels {}: {e}", folder.display())))
}

/// The libraries of a kernel axis, and the program's with all registered modules.
pub struct Kernels {
    embedded: KernelLibrary,
    folders: Vec<(Variant, KernelLibrary)>,
}

impl Kernels {
    /// Reads and checks the folders; the variant with an empty name is the embedded kernels.
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

    /// Opens the chosen adapter, with a device for each library.
    pub(super) fn open(&self, options: &RunOptions) -> Result<Device, RunError> {
        let gpu = gpu::open(&options.adapter, self.embedded.clone())?;
        let gpu = gpu.compiled_apart(options.compilations);
        let view = |(kernels, library): &(Variant, KernelLibrary)| {
            (kernels.clone(), gpu.with_kernels(library.clone()))
        };
        let views = self.folders.iter().map(view).collect();
        Ok(Device::new(gpu, views, options.adapter.clone()))
    }

    /// Why kernels made of these modules are out of date; `None` if they are current.
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

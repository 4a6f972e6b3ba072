//! Kernel composition: WESL modules from `kernels/` joined into one WGSL text.
//!
//! A structure or sampler is swapped by mapping a *virtual module* (`package::active::accel`) to the
//! chosen file; features switch `@if(...)` parts on; numbers that the structure decides become
//! constants of the virtual module `package::active::constants`.

use super::GpuError;
use super::diagnose;
use crate::accel::Intersection;
use crate::integrator::RayOffset;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use wesl::{BasicSourceMap, ModulePath, SourceMap, VirtualResolver, Wesl};

include!(concat!(env!("OUT_DIR"), "/embedded_kernels.rs"));

/// Kernel sources: those embedded in the program, with files of override folders on top.
#[derive(Debug, Clone)]
pub struct KernelLibrary {
    /// Module path with slashes (`accel/bvh`) → where it came from and its text.
    files: BTreeMap<String, (PathBuf, String)>,
    overridden: Vec<String>,
}

impl Default for KernelLibrary {
    fn default() -> Self {
        let files = EMBEDDED
            .iter()
            .map(|(name, text)| {
                (
                    (*name).to_owned(),
                    (
                        PathBuf::from(format!("kernels/{name}.wesl")),
                        (*text).to_owned(),
                    ),
                )
            })
            .collect();
        Self {
            files,
            overridden: Vec::new(),
        }
    }
}

impl KernelLibrary {
    /// Adds every `*.wesl` file below `folder`, replacing embedded files of the same relative path.
    ///
    /// # Errors
    /// The folder or a file in it cannot be read, or it holds no kernel.
    pub fn with_folder(mut self, folder: &Path) -> Result<Self, GpuError> {
        let before = self.overridden.len();
        self.add_folder(folder, folder)?;
        if self.overridden.len() == before {
            return Err(GpuError::Kernel(format!(
                "{}: no *.wesl file in this kernel folder",
                folder.display()
            )));
        }
        Ok(self)
    }

    fn add_folder(&mut self, root: &Path, folder: &Path) -> Result<(), GpuError> {
        let unreadable = |e: std::io::Error| GpuError::Kernel(format!("{}: {e}", folder.display()));
        for entry in std::fs::read_dir(folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if path.is_dir() {
                self.add_folder(root, &path)?;
            } else if path.extension().is_some_and(|e| e == "wesl") {
                let text = std::fs::read_to_string(&path)
                    .map_err(|e| GpuError::Kernel(format!("{}: {e}", path.display())))?;
                let relative = path.strip_prefix(root).unwrap_or(&path).with_extension("");
                let name: Vec<_> = relative
                    .components()
                    .map(|c| c.as_os_str().to_string_lossy())
                    .collect();
                let name = name.join("/");
                self.overridden.push(name.clone());
                self.files.insert(name, (path, text));
            }
        }
        Ok(())
    }

    /// Modules that came from override folders.
    pub fn overridden(&self) -> &[String] {
        &self.overridden
    }

    /// Names of all modules, with slashes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Text of a module.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.files.get(name).map(|(_, text)| text.as_str())
    }

    /// Composes one kernel.
    ///
    /// # Errors
    /// A module is missing, does not parse, or the result is not valid WGSL; the message names the
    /// source file and line.
    pub fn compose(&self, composition: &Composition) -> Result<ComposedKernel, GpuError> {
        // Where nobody chose how rays meet triangles and boxes, and leave surfaces, the defaults do.
        let composition = Intersection::default().activate(composition.clone());
        let composition = &RayOffset::default().activate(composition);
        let mut resolver = VirtualResolver::new();
        let mut paths = BTreeMap::new();
        for (name, (path, text)) in &self.files {
            resolver.add_module(module_path(name)?, text.as_str().into());
            paths.insert(module_path(name)?.to_string(), path.clone());
        }
        for (active, name) in &composition.active {
            let (path, text) = self.files.get(name).ok_or_else(|| {
                GpuError::Kernel(format!("there is no kernel `{name}.wesl` (wanted as the active {active}); add it under kernels/ or to the folder given by --kernels"))
            })?;
            resolver.add_module(
                module_path(&format!("active/{active}"))?,
                text.as_str().into(),
            );
            paths.insert(
                module_path(&format!("active/{active}"))?.to_string(),
                path.clone(),
            );
        }
        let constants: String = composition
            .constants
            .iter()
            .map(|(name, value)| format!("const {name}: u32 = {value}u;\n"))
            .collect();
        resolver.add_module(module_path("active/constants")?, constants.into());

        let mut compiler = Wesl::new("kernels").set_custom_resolver(resolver);
        compiler
            .use_sourcemap(true)
            .set_missing_feature_behavior(false);
        for feature in &composition.features {
            compiler.set_feature(feature, true);
        }
        let result = compiler
            .compile(&module_path(&composition.entry)?)
            .map_err(|e| {
                let sources = self
                    .files
                    .values()
                    .map(|(path, text)| (path.as_path(), text.as_str()));
                GpuError::Kernel(diagnose::wesl_error(&e.to_string(), &paths, sources))
            })?;
        let wgsl = result.to_string();
        let map = result.sourcemap.unwrap_or_default();
        let (module, info) = diagnose::parse_and_validate(&wgsl, &map, &paths)?;
        Ok(ComposedKernel {
            composition: composition.clone(),
            wgsl,
            module,
            info,
            map,
        })
    }
}

fn module_path(name: &str) -> Result<ModulePath, GpuError> {
    format!("package::{}", name.replace('/', "::"))
        .parse()
        .map_err(|e| {
            GpuError::Kernel(format!(
                "`{name}` is no module name ({e}); use letters, digits and _"
            ))
        })
}

/// What goes into one kernel.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Composition {
    /// Module that holds the entry point, for instance `integrator/trace_rays`.
    pub entry: String,
    /// Virtual module name (`accel`, `sequence`, `decorrelation`) → module that takes its place.
    pub active: BTreeMap<String, String>,
    /// Features that are on.
    pub features: BTreeSet<String>,
    /// Constants of `package::active::constants`.
    pub constants: BTreeMap<String, u32>,
}

impl Composition {
    /// A kernel with this entry module and nothing else chosen.
    pub fn new(entry: &str) -> Self {
        Self {
            entry: entry.to_owned(),
            ..Self::default()
        }
    }

    /// Puts `module` in the place of `package::active::<role>`.
    #[must_use]
    pub fn with(mut self, role: &str, module: &str) -> Self {
        self.active.insert(role.to_owned(), module.to_owned());
        self
    }

    /// Switches a feature on.
    #[must_use]
    pub fn feature(mut self, name: &str, on: bool) -> Self {
        if on {
            self.features.insert(name.to_owned());
        }
        self
    }

    /// Adds a constant.
    #[must_use]
    pub fn constant(mut self, name: &str, value: u32) -> Self {
        self.constants.insert(name.to_owned(), value);
        self
    }
}

/// A composed, validated kernel.
pub struct ComposedKernel {
    /// What it was made of.
    pub composition: Composition,
    /// Plain WGSL.
    pub wgsl: String,
    pub(super) module: naga::Module,
    pub(super) info: naga::valid::ModuleInfo,
    map: BasicSourceMap,
}

impl ComposedKernel {
    /// The name that the author gave to a global, without the composition's mangling.
    pub(super) fn author_name<'a>(&'a self, mangled: &'a str) -> &'a str {
        self.map.get_decl(mangled).map_or(mangled, |(_, item)| item)
    }
}

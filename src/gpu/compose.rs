//! Kernel composition: WESL modules from `kernels/` joined into one WGSL text.
//!
//! A structure or sampler is selected by mapping a *virtual module* (`package::active::accel`) to
//! the chosen file; features enable `@if(...)` parts; numbers chosen by the structure become
//! constants of the virtual module `package::active::constants`.

use super::GpuError;
use super::diagnose;
use super::pipeline::WORKGROUP_EDGE;
use raystone_core::files::{self, files};
use raystone_core::text::{cell_hash, nearest, plain_text};
use raystone_kernels::EMBEDDED;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use wesl::{BasicSourceMap, ModulePath, SourceMap, VirtualResolver, Wesl};

/// Kernel sources: the embedded ones, with the files of override folders on top.
#[derive(Debug, Clone)]
pub struct KernelLibrary {
    /// Module path with slashes (`accel/bvh`) → source file and text.
    files: BTreeMap<String, (PathBuf, String)>,
    /// Modules of override folders.
    overridden: BTreeSet<String>,
    /// Modules registered by other crates.
    registered: BTreeSet<String>,
    hash: String,
}

impl Default for KernelLibrary {
    fn default() -> Self {
        let file = |name| PathBuf::from(format!("kernels/{name}.wesl"));
        let files = EMBEDDED
            .iter()
            .map(|(name, text)| ((*name).to_owned(), (file(name), (*text).to_owned())))
            .collect();
        Self {
            files,
            overridden: BTreeSet::new(),
            registered: BTreeSet::new(),
            hash: String::new(),
        }
    }
}

/// Maximum depth below an override folder, which ends link cycles.
const DEEPEST_FOLDER: usize = 8;

impl KernelLibrary {
    /// Adds every `*.wesl` file below `folder`, replacing embedded files of the same relative path.
    /// Files and folders with names that begin with a dot are skipped.
    ///
    /// # Errors
    /// The folder or a file in it cannot be read, or it holds no kernel.
    pub fn with_folder(mut self, folder: &Path) -> Result<Self, GpuError> {
        let mut found = BTreeMap::new();
        collect(folder, DEEPEST_FOLDER, &mut found)?;
        if found.is_empty() {
            return Err(GpuError::Kernel(format!(
                "{}: no *.wesl file in this kernel folder",
                folder.display()
            )));
        }
        for (path, text) in found {
            let relative = path
                .strip_prefix(folder)
                .unwrap_or(&path)
                .with_extension("");
            let parts = relative.components();
            let name: Vec<_> = parts.map(|c| c.as_os_str().to_string_lossy()).collect();
            self.overridden.insert(name.join("/"));
            self.files.insert(name.join("/"), (path, text));
        }
        Ok(self.hashed())
    }

    /// Adds the modules of an external item: their paths (`integrator/mine`) and texts.
    #[must_use]
    pub fn with_sources(mut self, sources: &[(&str, &str)]) -> Self {
        for (name, text) in sources {
            let file = PathBuf::from(format!("{name}.wesl"));
            self.registered.insert((*name).to_owned());
            self.files
                .insert((*name).to_owned(), (file, (*text).to_owned()));
        }
        self.hashed()
    }

    fn hashed(mut self) -> Self {
        let own = self.overridden.union(&self.registered);
        let texts: Vec<_> = own.map(|name| (&**name, &*self.files[name].1)).collect();
        if !texts.is_empty() {
            self.hash = cell_hash(&texts);
        }
        self
    }

    /// Modules from override folders, in alphabetical order.
    pub fn overridden(&self) -> Vec<&str> {
        self.overridden.iter().map(String::as_str).collect()
    }

    /// True if a module of this name comes from an override folder.
    pub fn overrides(&self, name: &str) -> bool {
        self.overridden.contains(name)
    }

    /// True if a module of this name is embedded in the program.
    pub fn is_embedded(name: &str) -> bool {
        EMBEDDED.iter().any(|(known, _)| *known == name)
    }

    /// BLAKE3 of the names and texts of all modules that are not embedded; empty without any.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Checks override folders as far as possible before a kernel is composed.
    ///
    /// # Errors
    /// A file that is not valid WESL, with its line, or a file that no kernel can use: it neither
    /// replaces an embedded one, nor is it among `wanted`, nor does another file of the folders
    /// import it.
    pub fn check(&self, wanted: &[String]) -> Result<(), GpuError> {
        let mut imports = BTreeMap::new();
        for name in &self.overridden {
            let (path, text) = &self.files[name];
            let parsed = diagnose::imports(path, text, name).map_err(GpuError::Kernel)?;
            imports.insert(name.as_str(), parsed);
        }
        let is_root = |name: &&str| {
            Self::is_embedded(name)
                || self.registered.contains(*name)
                || wanted.iter().any(|w| w == name)
        };
        let (mut reached, mut rest): (Vec<&str>, Vec<&str>) =
            self.overridden().into_iter().partition(is_root);
        while let Some(name) = reached.pop() {
            let text = self.text(name).unwrap_or_default();
            let is_imported = |other: &&str| {
                let written_out = format!("package::{}::", other.replace('/', "::"));
                let mut paths = imports.get(name).into_iter().flatten();
                paths.any(|path| imports_it(path, other)) || text.contains(&written_out)
            };
            let (imported, others): (Vec<&str>, Vec<&str>) =
                rest.into_iter().partition(is_imported);
            reached.extend(imported);
            rest = others;
        }
        let Some(lost) = rest.first() else {
            return Ok(());
        };
        let known = EMBEDDED.iter().map(|(name, _)| *name);
        let known = known.chain(wanted.iter().map(String::as_str));
        let near = nearest(lost, known);
        let near = near.map_or(String::new(), |near| {
            format!("; did you mean `{near}.wesl`?")
        });
        Err(GpuError::Kernel(format!(
            "{}: this file replaces no kernel, and none imports it{near} \
             (paths are relative to the folder given, upper and lower case count)",
            self.files[*lost].0.display()
        )))
    }

    /// Names of all modules, with slashes.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Text of a module.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.files.get(name).map(|(_, text)| text.as_str())
    }

    /// The first 16 hexadecimal digits of BLAKE3 of a module's text, empty if it is missing.
    pub fn text_hash(&self, name: &str) -> String {
        let text = self.text(name).unwrap_or_default();
        blake3::hash(text.as_bytes()).to_hex()[..16].to_owned()
    }

    /// The name of a module, prefixed with `@` if it comes from an override folder.
    pub fn marked(&self, name: &str) -> String {
        if self.overrides(name) {
            format!("@{name}")
        } else {
            name.to_owned()
        }
    }

    /// Composes one kernel.
    ///
    /// # Errors
    /// A module is missing, does not parse, or gives invalid WGSL, with source file and line.
    pub fn compose(&self, composition: &Composition) -> Result<ComposedKernel, GpuError> {
        let composition = &composition.clone().completed();
        let mut resolver = VirtualResolver::new();
        let mut paths = BTreeMap::new();
        let own = self
            .files
            .iter()
            .map(|(name, file)| Ok((name.clone(), file)));
        let chosen = composition.active.iter().map(|(active, name)| {
            let missing = || {
                GpuError::Kernel(format!("there is no kernel `{name}.wesl` (wanted as the active {active}); add it under kernels/ or to the folder given by --kernels"))
            };
            let file = self.files.get(name).ok_or_else(missing)?;
            Ok((format!("active/{active}"), file))
        });
        for module in own.chain(chosen) {
            let (name, (path, text)) = module?;
            let module = module_path(&name)?;
            paths.insert(module.to_string(), path.clone());
            resolver.add_module(module, text.as_str().into());
        }
        for (name, text) in &composition.brought {
            if !self.files.contains_key(name) {
                let module = module_path(name)?;
                paths.insert(module.to_string(), PathBuf::from(format!("{name}.wesl")));
                resolver.add_module(module, text.as_str().into());
            }
        }
        let constants = composition.constants.iter();
        let constants: String = constants
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
        let entry = &module_path(&composition.entry)?;
        let result = compiler.compile(entry).map_err(|e| {
            let sources = self
                .files
                .values()
                .map(|(path, text)| (path.as_path(), text.as_str()));
            GpuError::Kernel(diagnose::wesl_error(&e.to_string(), &paths, sources))
        })?;
        let wgsl = result.to_string();
        let (module, info) = diagnose::parse_and_validate(&diagnose::Composed {
            wgsl: &wgsl,
            result: &result,
            entry,
            paths: &paths,
        })?;
        Ok(ComposedKernel {
            composition: composition.clone(),
            wgsl,
            module,
            info,
            modules: (result.modules.iter())
                .filter_map(|path| composition.module_of(&path.to_string()))
                .collect(),
            map: result.sourcemap.unwrap_or_default(),
        })
    }
}

/// Collects the kernels below a folder, with their texts.
fn collect(
    folder: &Path,
    levels: usize,
    found: &mut BTreeMap<PathBuf, String>,
) -> Result<(), GpuError> {
    let fault =
        |path: &Path, what: &dyn Display| GpuError::Kernel(format!("{}: {what}", path.display()));
    let paths = files().list(folder).map_err(|e| fault(folder, &e))?;
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        if name.starts_with('.') {
            continue;
        } else if files().is_folder(&path) {
            let levels = levels.checked_sub(1);
            let levels = levels.ok_or_else(|| fault(&path, &"too deep a kernel folder"))?;
            collect(&path, levels, found)?;
        } else if extension == "wesl" {
            let bytes = files::read(&path).map_err(|e| fault(&path, &e))?;
            let text = plain_text(bytes).map_err(|e| {
                let problem = format!("line {} is not UTF-8 text", e.line);
                fault(&path, &problem)
            })?;
            found.insert(path, text);
        } else if ["wesl", "wgsl"].contains(&extension.to_lowercase().as_str()) {
            return Err(fault(&path, &"kernels end in `.wesl`; rename or remove it"));
        }
    }
    Ok(())
}

/// True if an import path refers to this module or to an item in it.
fn imports_it(path: &[String], module: &str) -> bool {
    let mut parts = path.iter();
    module
        .split('/')
        .all(|part| parts.next().is_some_and(|p| p == part))
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

/// Defaults for virtual modules and constants that were not chosen: those of the registries of
/// dependent crates, whose tests compare them.
const DEFAULT_MODULES: [(&str, &str); 2] = [
    ("triangle", "accel/triangle/watertight"),
    ("offset", "integrator/offset/error_bound"),
];
const DEFAULT_CONSTANTS: [(&str, u32); 3] = [
    ("BOX_PAD_ULPS", 16),
    ("GROUP_WIDTH", WORKGROUP_EDGE),
    ("GROUP_HEIGHT", WORKGROUP_EDGE),
];

/// The contents of one kernel.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Composition {
    /// Module with the entry point, for instance `integrator/trace_rays`.
    pub entry: String,
    /// Virtual module name (`accel`, `sequence`, `decorrelation`) → module that replaces it.
    pub active: BTreeMap<String, String>,
    /// Enabled features.
    pub features: BTreeSet<String>,
    /// Constants of `package::active::constants`.
    pub constants: BTreeMap<String, u32>,
    /// Texts of modules that belong to the rendered scene, by path (`shading/bsdf/mine`). Modules
    /// of the library take precedence.
    pub brought: BTreeMap<String, String>,
}

impl Composition {
    /// A kernel with this entry module and no other choices.
    pub fn new(entry: &str) -> Self {
        Self {
            entry: entry.to_owned(),
            ..Self::default()
        }
    }

    /// Selects `module` for `package::active::<role>`.
    #[must_use]
    pub fn with(mut self, role: &str, module: &str) -> Self {
        self.active.insert(role.to_owned(), module.to_owned());
        self
    }

    /// Adds defaults for ray–triangle tests, ray–box tests and ray offsets that were not chosen.
    #[must_use]
    pub fn completed(mut self) -> Self {
        for (role, module) in DEFAULT_MODULES {
            let chosen = self.active.entry(role.to_owned());
            chosen.or_insert_with(|| module.to_owned());
        }
        for (name, value) in DEFAULT_CONSTANTS {
            self.constants.entry(name.to_owned()).or_insert(value);
        }
        self
    }

    /// The module of a path (`package::accel::bvh`); `None` for the module of constants.
    fn module_of(&self, path: &str) -> Option<String> {
        let name = path.strip_prefix("package::")?.replace("::", "/");
        match name.strip_prefix("active/") {
            Some("constants") => None,
            Some(role) => self.active.get(role).cloned(),
            None => Some(name),
        }
    }

    /// Enables or disables a feature.
    #[must_use]
    pub fn feature(mut self, name: &str, on: bool) -> Self {
        if on {
            self.features.insert(name.to_owned());
        }
        self
    }

    /// Adds a module.
    #[must_use]
    pub fn bringing(mut self, module: &str, text: impl Into<String>) -> Self {
        self.brought.insert(module.to_owned(), text.into());
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
    /// Its composition.
    pub composition: Composition,
    /// Plain WGSL.
    pub wgsl: String,
    pub(super) module: naga::Module,
    pub(super) info: naga::valid::ModuleInfo,
    map: BasicSourceMap,
    /// Names of its modules, with slashes.
    pub modules: Vec<String>,
}

impl ComposedKernel {
    /// BLAKE3 of the composed text.
    pub fn hash(&self) -> String {
        blake3::hash(self.wgsl.as_bytes()).to_hex().to_string()
    }

    /// The source name of a global, without the composition's mangling.
    pub(super) fn author_name<'a>(&'a self, mangled: &'a str) -> &'a str {
        self.map.get_decl(mangled).map_or(mangled, |(_, item)| item)
    }
}

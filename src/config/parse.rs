//! The walk from the merged tree to a checked [`Experiment`].

use super::cells::COMPACTIONS;
use super::check::{
    as_table, cell_tables, check_on_axis, check_sections, parameter_tables, pattern_list,
};
use super::error::{ConfigError, Place};
use super::experiment::{
    Animation, Axes, CellSet, Coherence, Condition, Discrepancy, Experiment, Gate, Motion,
    Reference, Rule, Timing,
};
use super::keys::{Axis, KEYS, OPTIONAL_SECTIONS};
use super::section::{Section, texts};
use super::tree::{self, Item, Table, Value};
use super::variants::WHEN;
use super::{Catalogue, expect, variants};
use raystone_core::geometry::Camera;
use raystone_core::params::{Entry, Variant};
use std::path::{Path, PathBuf};

/// Parses and checks an experiment; see [`Experiment::parse`].
pub(super) fn parse(
    text: &str,
    file: &str,
    overrides: &[String],
    catalogue: &Catalogue,
) -> Result<Experiment, ConfigError> {
    let tree = layers(text, file, overrides)?;
    check_sections(&tree, catalogue)?;
    let reader = Reader {
        tree: &tree,
        file,
        catalogue,
    };
    let run = reader.section("run")?;
    let name = match run.has("name") {
        true => run.text("name")?.to_owned(),
        false => file_stem(file),
    };
    if name.contains(char::is_control) {
        return Err(ConfigError::OutOfRange {
            at: run.place("name"),
            key: "run.name".to_owned(),
            value: format!("{name:?}"),
            expected: "a text without control characters".to_owned(),
        });
    }
    let axes = Axes::try_new(|axis| reader.axis(axis))?;
    let experiment = Experiment {
        name,
        source: file.to_owned(),
        text: with_overrides(text, overrides),
        overrides: overrides.to_vec(),
        replicates: run.unsigned("replicates")?,
        seed: run.unsigned("seed")?,
        resolution: run.unsigned_pair("resolution")?,
        spp: run.counts("spp")?,
        stop: (run.has("stop"))
            .then(|| run.stop_rule("stop"))
            .transpose()?,
        runtime_checks: run.flag("runtime_checks")?,
        camera: reader.camera()?,
        excludes: reader.cell_sets("exclude", &axes)?,
        includes: reader.cell_sets("include", &axes)?,
        conditions: reader.conditions(&axes)?,
        axes,
        reference: reader.reference()?,
        timing: reader.timing()?,
        gate: reader.gate()?,
        discrepancy: reader.discrepancy()?,
        coherence: reader.coherence(&run)?,
        animation: reader.animation()?,
    };
    check_reference_seed(&experiment, &reader)?;
    check_reference_file(&experiment, &reader)?;
    Ok(experiment)
}

/// Defaults, file and overrides in one tree.
fn layers(text: &str, file: &str, overrides: &[String]) -> Result<Table, ConfigError> {
    let mut user = tree::parse_file(text, file)?;
    // What a thesis says changes nothing that is measured; a fault in it is told all the same.
    if expect::take(&mut user) {
        expect::Thesis::parse(text, file)?;
    }
    for text in overrides {
        tree::merge(&mut user, tree::parse_override(text)?);
    }
    let mut tree = Table::new();
    for key in KEYS {
        if OPTIONAL_SECTIONS.contains(&key.section) && !user.contains_key(key.section) {
            continue;
        }
        let Some(default) = key.default else { continue };
        let leaf = Item {
            at: Place::Default,
            value: tree::default_value(default),
        };
        let section = Item {
            at: Place::Default,
            value: Value::Table([(key.name.to_owned(), leaf)].into()),
        };
        tree::merge(&mut tree, [(key.section.to_owned(), section)].into());
    }
    tree::merge(&mut tree, user);
    add_least_scene(&mut tree);
    Ok(tree)
}

/// Integrands trace nothing: an experiment of nothing else needs neither a scene nor a structure, and
/// gets the least there is where it names none. Compactions draw nothing, too.
fn add_least_scene(tree: &mut Table) {
    let Some(Item {
        value: Value::Table(axes),
        ..
    }) = tree.get_mut("axes")
    else {
        return;
    };
    let begins = |item: &Item, with: &str| matches!(&item.value, Value::Text(name) if name.starts_with(with));
    let all_begin = |with: &[&str]| match axes.get("integrator").map(|item| &item.value) {
        Some(Value::List(items)) => {
            let fits = |item: &Item| with.iter().any(|with| begins(item, with));
            !items.is_empty() && items.iter().all(fits)
        }
        _ => false,
    };
    let mut least = Vec::new();
    if all_begin(&["integrand:", COMPACTIONS]) {
        least = vec![
            (Axis::Scene, "single-triangle"),
            (Axis::Accel, "brute-force"),
        ];
    }
    if all_begin(&[COMPACTIONS]) {
        least.push((Axis::Sequence, "pixel-hash"));
    }
    for (axis, name) in least {
        let least = Item {
            at: Place::Default,
            value: tree::default_value(&format!("[\"{name}\"]")),
        };
        axes.entry(axis.name().to_owned()).or_insert(least);
    }
}

fn with_overrides(text: &str, overrides: &[String]) -> String {
    let mut text = text.to_owned();
    if !overrides.is_empty() && !text.ends_with('\n') {
        text.push('\n');
    }
    for line in overrides {
        text += &format!("# --set {line}\n");
    }
    text
}

fn file_stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into())
}

/// No replicate may share its seed with a part of the reference: their errors would be correlated,
/// and a hash sampler would compare an image with itself.
fn check_reference_seed(experiment: &Experiment, reader: &Reader) -> Result<(), ConfigError> {
    let seeds = experiment.seeds();
    let Some(shared) = seeds.shared() else {
        return Ok(());
    };
    Err(ConfigError::OutOfRange {
        at: reader.section("reference")?.place("seed"),
        key: "reference.seed".to_owned(),
        value: experiment.reference.seed.to_string(),
        expected: format!(
            "another number: hashed, it gives the {} parts of the reference the seeds from {} on, and \
             {shared} is one of the {} replicates' seeds from {} on",
            seeds.reference_parts.len(),
            seeds.reference_parts[0],
            experiment.replicates,
            experiment.seed
        ),
    })
}

/// One image cannot be what several scenes should look like.
fn check_reference_file(experiment: &Experiment, reader: &Reader) -> Result<(), ConfigError> {
    let scenes = experiment.axes[Axis::Scene].len();
    if experiment.reference.file.is_none() || scenes == 1 {
        return Ok(());
    }
    let expected =
        format!("left out where `axes.scene` has {scenes} scenes: it is an image of one");
    Err(reader.section("reference")?.not_allowed("file", &expected))
}

/// Reads sections of the merged tree.
struct Reader<'t> {
    tree: &'t Table,
    file: &'t str,
    catalogue: &'t Catalogue,
}

impl<'t> Reader<'t> {
    fn section(&self, name: &'static str) -> Result<Section<'t>, ConfigError> {
        match self.tree.get(name) {
            Some(item) => Ok(Section {
                name,
                at: item.at.clone(),
                table: as_table(item, name, "a section")?,
                file: self.file,
            }),
            None => Err(ConfigError::Missing {
                at: Place::File {
                    file: self.file.into(),
                    line: 1,
                },
                key: name.to_owned(),
                expected: "a section".to_owned(),
            }),
        }
    }

    /// The variants of one axis, in the order of the file.
    fn axis(&self, axis: Axis) -> Result<Vec<Variant>, ConfigError> {
        let axes = self.section("axes")?;
        let key = format!("axes.{axis}");
        let list = axes.item(axis.name())?;
        let names = texts(&key, list)?;
        variants::check_count(axis, list, names.len())?;
        let empty = Table::new();
        let parameters = match self.tree.get(axis.name()) {
            Some(item) => as_table(item, axis.name(), "sections")?,
            None => &empty,
        };
        let mut variants = Vec::new();
        let mut used: Vec<String> = Vec::new();
        for (item, name) in names {
            if used.iter().any(|other| other == name) {
                return Err(ConfigError::Duplicate {
                    at: item.at.clone(),
                    key,
                    value: format!("\"{name}\""),
                });
            }
            used.push(name.to_owned());
            let entry = variants::resolve(axis, item, name, self.catalogue)?;
            let tables = match parameters.get(name) {
                Some(item) => parameter_tables(axis, name, item)?,
                None => vec![&empty],
            };
            for table in tables {
                for variant in variants::expand(axis, &entry, table)? {
                    // Tables may meet, most often in the defaults.
                    if !variants.contains(&variant) {
                        variants.push(variant);
                    }
                }
                variants::check_count(axis, item, variants.len())?;
            }
        }
        let replaced = matches!(axes.place(axis.name()), Place::Override(_));
        check_on_axis(axis, parameters, &used, replaced)?;
        if matches!(axis, Axis::Scene | Axis::Kernels) {
            variants::shorten_labels(&mut variants);
        }
        Ok(variants)
    }

    fn camera(&self) -> Result<Option<Camera>, ConfigError> {
        if !self.tree.contains_key("camera") {
            return Ok(None);
        }
        let section = self.section("camera")?;
        let camera = Camera {
            eye: section.vector("eye")?,
            target: section.vector("target")?,
            up: section.vector("up")?,
            vertical_fov_degrees: section.number("fov")? as f32,
        };
        // `try_normalize` also refuses lengths that overflow.
        let Some(view) = (camera.target - camera.eye).try_normalize() else {
            let expected = "another point than `camera.eye`, at a finite distance";
            return Err(section.not_allowed("target", expected));
        };
        let up = camera.up.try_normalize();
        if up.is_none_or(|up| view.cross(up).length() < 1e-4) {
            let expected = "a direction that is neither zero nor parallel to the view";
            return Err(section.not_allowed("up", expected));
        }
        Ok(Some(camera))
    }

    /// Cells that are left out, or kept.
    fn cell_sets(&self, section: &str, axes: &Axes) -> Result<Vec<CellSet>, ConfigError> {
        let Some(item) = self.tree.get(section) else {
            return Ok(Vec::new());
        };
        let tables = cell_tables(section, item)?.into_iter();
        tables
            .map(|(at, table)| self.cell_set(section, (at, table), axes))
            .collect()
    }

    /// The patterns of a table, by axis.
    fn cell_set(
        &self,
        section: &str,
        (at, table): (&Place, &Table),
        axes: &Axes,
    ) -> Result<CellSet, ConfigError> {
        let mut patterns = Vec::new();
        let mut lenient = false;
        for axis in Axis::ALL {
            let Some(item) = table.get(axis.name()) else {
                continue;
            };
            let texts = texts(&format!("{section}.{axis}"), item)?;
            let changed = self.is_overridden(axis)?;
            lenient |= changed;
            patterns.push((axis, pattern_list(axis, &texts, axes, changed)?));
        }
        if patterns.is_empty() {
            return Err(ConfigError::Empty {
                at: at.clone(),
                key: section.to_owned(),
            });
        }
        Ok(CellSet {
            at: at.clone(),
            patterns,
            lenient,
        })
    }

    /// What `when` says in tables of parameters.
    fn conditions(&self, axes: &Axes) -> Result<Vec<Condition>, ConfigError> {
        let mut conditions = Vec::new();
        for axis in Axis::ALL {
            for variant in &axes[axis] {
                let mut cells = Vec::new();
                for table in self.tables_of(axis, &variant.name)? {
                    let entry = self.entry(axis, &variant.name)?;
                    if !variants::expand(axis, &entry, table)?
                        .iter()
                        .any(|other| other.params == variant.params)
                    {
                        continue;
                    }
                    cells.push(match table.get(WHEN) {
                        Some(item) => Some(self.condition(axis, &variant.name, item, axes)?),
                        None => None,
                    });
                }
                // A table without a condition makes the variant whatever others say.
                let cells: Option<Vec<CellSet>> = cells.into_iter().collect();
                if let Some(cells) = cells.filter(|cells| !cells.is_empty()) {
                    conditions.push(Condition {
                        axis,
                        label: variant.label.clone(),
                        cells,
                    });
                }
            }
        }
        Ok(conditions)
    }

    fn condition(
        &self,
        axis: Axis,
        name: &str,
        item: &Item,
        axes: &Axes,
    ) -> Result<CellSet, ConfigError> {
        let key = format!("{axis}.{name}.{WHEN}");
        let table = as_table(
            item,
            &key,
            "axes with patterns, as in { scene = \"sponza\" }",
        )?;
        let unknown = |(name, _): &(&String, &Item)| Axis::from_name(name).is_none();
        if let Some((name, item)) = table.iter().find(unknown) {
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("axis in `{key}`"),
                name: name.clone(),
                known: Axis::ALL.map(|axis| axis.name().to_owned()).to_vec(),
            });
        }
        self.cell_set(&key, (&item.at, table), axes)
    }

    /// The tables of parameters of an entry on an axis.
    fn tables_of(&self, axis: Axis, name: &str) -> Result<Vec<&'t Table>, ConfigError> {
        match self.tree.get(axis.name()) {
            Some(item) => match as_table(item, axis.name(), "sections")?.get(name) {
                Some(item) => parameter_tables(axis, name, item),
                None => Ok(Vec::new()),
            },
            None => Ok(Vec::new()),
        }
    }

    fn entry(&self, axis: Axis, name: &str) -> Result<Entry, ConfigError> {
        let at = Item {
            at: Place::Default,
            value: Value::Text(name.to_owned()),
        };
        variants::resolve(axis, &at, name, self.catalogue)
    }

    /// Whether the command line changed the names or the parameters of an axis.
    fn is_overridden(&self, axis: Axis) -> Result<bool, ConfigError> {
        let names = self.section("axes")?.place(axis.name());
        let parameters = self.tree.get(axis.name());
        Ok(matches!(names, Place::Override(_)) || parameters.is_some_and(Item::has_override))
    }

    fn reference(&self) -> Result<Reference, ConfigError> {
        let section = self.section("reference")?;
        let entry = |axis: Axis| {
            let item = section.item(axis.name())?;
            let name = section.text(axis.name())?;
            variants::resolve(axis, item, name, self.catalogue)
        };
        let file = match section.has("file") {
            true => Some(PathBuf::from(section.text("file")?)),
            false => None,
        };
        Ok(Reference {
            file,
            spp: section.unsigned("spp")?,
            sequence: entry(Axis::Sequence)?.default_variant(),
            decorrelation: entry(Axis::Decorrelation)?.default_variant(),
            seed: section.unsigned("seed")?,
        })
    }

    fn timing(&self) -> Result<Timing, ConfigError> {
        let section = self.section("timing")?;
        let timing = Timing {
            rounds: section.unsigned("rounds")?,
            spp: section.unsigned("spp")?,
            min_warmup_ms: section.unsigned("min_warmup_ms")?,
            max_warmup_ms: section.unsigned("max_warmup_ms")?,
            rays: section.unsigned("rays")?,
            orders: section.flag("orders")?,
        };
        if timing.max_warmup_ms < timing.min_warmup_ms {
            let expected = "at least `timing.min_warmup_ms`";
            return Err(section.not_allowed("max_warmup_ms", expected));
        }
        Ok(timing)
    }

    fn gate(&self) -> Result<Gate, ConfigError> {
        let section = self.section("gate")?;
        Ok(Gate {
            rays: section.unsigned("rays")?,
            brute_force_tests: section.integer("brute_force_tests")?.unsigned_abs(),
            oracle_rays: section.unsigned("oracle_rays")?,
            ao_length: section.number("ao_length")? as f32,
            offset: section.number("offset")? as f32,
            shadow_orders: section.flag("shadow_orders")?,
        })
    }

    fn coherence(&self, run: &Section) -> Result<Option<Coherence>, ConfigError> {
        if !self.tree.contains_key("coherence") {
            return Ok(None);
        }
        let section = self.section("coherence")?;
        let warp = section.unsigned_pair("warp")?;
        if warp.iter().any(|edge| 8 % edge != 0) {
            return Err(section.not_allowed("warp", "divisors of 8, the edge of a workgroup"));
        }
        let spp = match section.has("spp") {
            true => section.counts("spp")?,
            false => run.counts("spp")?,
        };
        let resolution = match section.has("resolution") {
            true => section.unsigned_pair("resolution")?,
            false => run.unsigned_pair("resolution")?,
        };
        Ok(Some(Coherence {
            resolution,
            spp: spp.counts().collect(),
            groups: section.unsigned("groups")?,
            warps: section.unsigned("warps")?,
            warp,
            samples: section.unsigned("samples")?,
            rule: match section.word("rule")? {
                0 => Rule::Loop,
                _ => Rule::IfIf,
            },
            line_bytes: section.unsigned("line_bytes")?,
            l1_kib: section.unsigned("l1_kib")?,
            l1_ways: section.unsigned("l1_ways")?,
            l2_kib: section.unsigned("l2_kib")?,
            l2_ways: section.unsigned("l2_ways")?,
        }))
    }

    fn animation(&self) -> Result<Option<Animation>, ConfigError> {
        if !self.tree.contains_key("animation") {
            return Ok(None);
        }
        let section = self.section("animation")?;
        Ok(Some(Animation {
            motion: match section.word("motion")? {
                0 => Motion::Deform,
                _ => Motion::Instances,
            },
            frames: section.unsigned("frames")?,
            amplitude: section.number("amplitude")?,
            wavelength: section.number("wavelength")?,
        }))
    }

    fn discrepancy(&self) -> Result<Discrepancy, ConfigError> {
        let section = self.section("discrepancy")?;
        Ok(Discrepancy {
            points: section.unsigned("points")?,
            pairs: section.dimension_pairs("pairs")?,
            seeds: section.unsigned("seeds")?,
        })
    }
}

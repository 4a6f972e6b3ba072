//! Converts the merged tree to a checked [`Experiment`].

use super::axis::Axis;
use super::cells::BENCHES;
use super::check::{
    AXES, cell_tables, check_keys, check_on_axis, check_sections, parameter_tables, pattern_list,
    texts,
};
use super::error::{ConfigError, Place};
use super::experiment::{Axes, CellSet, Condition, Experiment};
use super::faults::{Faults, both};
use super::plot::PlotRequest;
use super::sections::{Coherence, Reference, Run, View};
use super::settings::{find, not_allowed, read_all, take};
use super::tree::{self, Item, Table};
use super::variants::WHEN;
use super::{Catalogue, expect, variants};
use raystone_core::geometry::Camera;
use raystone_core::params::{Entry, Variant};
use std::path::Path;

/// Parses and checks an experiment; see [`Experiment::parse`].
pub(super) fn parse(
    text: &str,
    file: &str,
    overrides: &[String],
    catalogue: &Catalogue,
) -> Result<Experiment, ConfigError> {
    let tree = layers(text, file, overrides)?;
    let settings = both(
        check_sections(&tree, catalogue),
        read_all(catalogue.sections(), &tree),
    );
    let reader = Reader::new(&tree, file, catalogue);
    let axes = reader.and_then(|reader| Ok((reader.axes()?, reader)));
    let (((), mut read), (axes, reader)) = both(settings, axes)?;
    let run: Run = take(&mut read).unwrap_or_default();
    let mut coherence: Option<Coherence> = take(&mut read);
    if let Some(coherence) = &mut coherence {
        coherence.complete(&run);
    }
    let sets = both(
        reader.cell_sets("exclude", &axes),
        reader.cell_sets("include", &axes),
    );
    let reference = reader.reference(take(&mut read).unwrap_or_default(), &axes);
    let others = both(reader.conditions(&axes), reference);
    let ((excludes, includes), (conditions, reference)) = both(sets, others)?;
    let experiment = Experiment {
        name: run.name.clone().unwrap_or_else(|| file_stem(file)),
        source: file.to_owned(),
        text: with_overrides(text, overrides),
        overrides: overrides.to_vec(),
        run,
        stop: take(&mut read),
        camera: take(&mut read).map(|view: View| Camera::from(view)),
        excludes,
        includes,
        conditions,
        reference,
        axes,
        timing: take(&mut read).unwrap_or_default(),
        gate: take(&mut read).unwrap_or_default(),
        discrepancy: take(&mut read).unwrap_or_default(),
        coherence,
        animation: take(&mut read),
        window: take(&mut read).unwrap_or_default(),
        further: read,
    };
    reader.check_reference_seed(&experiment)?;
    Ok(experiment)
}

/// Merges file and overrides into one tree.
fn layers(text: &str, file: &str, overrides: &[String]) -> Result<Table, ConfigError> {
    let mut tree = tree::parse_file(text, file)?;
    // Neither expectations nor plots affect measurements, but an error in them is still an error.
    if expect::take(&mut tree) {
        expect::Thesis::parse(text, file)?;
        PlotRequest::all(text, file)?;
    }
    for text in overrides {
        tree::merge(&mut tree, tree::parse_override(text)?);
    }
    Ok(tree)
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

struct Reader<'t> {
    tree: &'t Table,
    /// The `[axes]` section, and defaults of the other axes.
    axes: Table,
    file: &'t str,
    catalogue: &'t Catalogue,
}

/// Integrands trace nothing: an experiment of nothing else needs neither a scene nor a structure, and
/// gets the least there is where it names none. What needs no scene at all draws nothing, too.
fn least_name(axis: Axis, integrators: &Item) -> Option<&'static str> {
    let names = texts(AXES, integrators).ok()?;
    let is_bench = |name: &str| BENCHES.iter().any(|of| name.starts_with(of));
    let all = |is: &dyn Fn(&str) -> bool| names.iter().all(|(_, name)| is(name));
    let traces_nothing = |name: &str| name.starts_with("integrand:") || is_bench(name);
    match axis {
        Axis::Scene if all(&traces_nothing) => Some("single-triangle"),
        Axis::Accel if all(&traces_nothing) => Some("brute-force"),
        Axis::Sequence if all(&is_bench) => Some("pixel-hash"),
        _ => None,
    }
}

impl<'t> Reader<'t> {
    fn new(tree: &'t Table, file: &'t str, catalogue: &'t Catalogue) -> Result<Self, ConfigError> {
        let mut axes = match tree.get(AXES) {
            Some(item) => item.table(AXES, "a section")?.clone(),
            None => Table::new(),
        };
        let integrators = axes.get(Axis::Integrator.name()).cloned();
        for axis in Axis::ALL {
            let least = (integrators.as_ref()).and_then(|names| least_name(axis, names));
            if let Some(name) = axis.default_name().or(least) {
                let written = axes.entry(axis.name().to_owned());
                written.or_insert_with(|| Item::default_text(name));
            }
        }
        Ok(Self {
            tree,
            axes,
            file,
            catalogue,
        })
    }

    fn parameters(&self, axis: Axis) -> Result<Option<&'t Table>, ConfigError> {
        let item = self.tree.get(axis.name());
        item.map(|item| item.table(axis.name(), "sections"))
            .transpose()
    }

    fn names(&self, axis: Axis) -> Result<&Item, ConfigError> {
        let missing = || ConfigError::Missing {
            at: match self.tree.get(AXES) {
                Some(item) => item.at.clone(),
                None => Place::start_of(self.file),
            },
            key: format!("{AXES}.{axis}"),
            expected: axis.expected(),
        };
        self.axes.get(axis.name()).ok_or_else(missing)
    }

    /// The variants of all axes.
    fn axes(&self) -> Result<Axes, ConfigError> {
        let mut faults = Faults::default();
        let mut variants = |axis| Ok(faults.keep(self.axis(axis)).unwrap_or_default());
        let axes = Axes::try_new(&mut variants)?;
        faults.or(axes)
    }

    /// The variants of one axis, in file order.
    fn axis(&self, axis: Axis) -> Result<Vec<Variant>, ConfigError> {
        let key = format!("{AXES}.{axis}");
        let list = self.names(axis)?;
        let names = texts(&key, list)?;
        variants::check_count(axis, list, names.len())?;
        let empty = Table::new();
        let parameters = self.parameters(axis)?.unwrap_or(&empty);
        let (mut variants, mut faults) = (Vec::new(), Faults::default());
        let mut used: Vec<String> = Vec::new();
        for (item, name) in names {
            if used.iter().any(|other| other == name) {
                faults.keep::<()>(Err(item.duplicate(&key)));
                continue;
            }
            used.push(name.to_owned());
            let label = variants::of_label(axis, item, name, self.catalogue);
            let plain = label.as_ref().map_or(name, |(plain, _)| plain);
            let entry = variants::resolve(axis, &item.at, plain, self.catalogue);
            let tables = match (&label, parameters.get(name)) {
                (Some((_, own)), _) => Ok(vec![own]),
                (None, Some(item)) => parameter_tables(axis, name, item),
                (None, None) => Ok(vec![&empty]),
            };
            let Some((entry, tables)) = faults.keep(both(entry, tables)) else {
                continue;
            };
            for table in tables {
                let expanded = faults.keep(variants::expand(axis, &entry, table));
                for variant in expanded.into_iter().flatten() {
                    // Tables may overlap, most often in the defaults.
                    if !variants.contains(&variant) {
                        variants.push(variant);
                    }
                }
                variants::check_count(axis, item, variants.len())?;
            }
        }
        faults.end()?;
        let replaced = matches!(list.at, Place::Override(_));
        check_on_axis(axis, parameters, &used, replaced)?;
        if matches!(axis, Axis::Scene | Axis::Kernels) {
            variants::shorten_labels(&mut variants);
        }
        Ok(variants)
    }

    fn cell_sets(&self, section: &str, axes: &Axes) -> Result<Vec<CellSet>, ConfigError> {
        let Some(item) = self.tree.get(section) else {
            return Ok(Vec::new());
        };
        let tables = cell_tables(section, item)?.into_iter();
        tables
            .map(|(at, table)| self.cell_set(section, (at, table), axes))
            .collect()
    }

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
                // A table without a condition allows the variant everywhere.
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
        let table = item.table(&key, "axes with patterns, as in { scene = \"sponza\" }")?;
        let axis = format!("axis in `{key}`");
        check_keys(&axis, table, &Axis::ALL.map(Axis::name))?;
        self.cell_set(&key, (&item.at, table), axes)
    }

    fn tables_of(&self, axis: Axis, name: &str) -> Result<Vec<&'t Table>, ConfigError> {
        match self.parameters(axis)?.and_then(|entries| entries.get(name)) {
            Some(item) => parameter_tables(axis, name, item),
            None => Ok(Vec::new()),
        }
    }

    fn entry(&self, axis: Axis, name: &str) -> Result<Entry, ConfigError> {
        variants::resolve(axis, &Place::Default, name, self.catalogue)
    }

    /// True if the command line changed the names or parameters of an axis.
    fn is_overridden(&self, axis: Axis) -> Result<bool, ConfigError> {
        let parameters = self.tree.get(axis.name());
        let changed = parameters.is_some_and(Item::has_override);
        Ok(changed || matches!(self.names(axis)?.at, Place::Override(_)))
    }

    /// The reference, with its sampler resolved in the catalogue.
    fn reference(&self, mut reference: Reference, axes: &Axes) -> Result<Reference, ConfigError> {
        let places = [
            (Axis::Sequence, &mut reference.sequence),
            (Axis::Decorrelation, &mut reference.decorrelation),
        ];
        for (axis, variant) in places {
            let item = find(self.tree, &format!("reference.{axis}"));
            let at = item.map_or(&Place::Default, |item| &item.at);
            let entry = variants::resolve(axis, at, &variant.name, self.catalogue)?;
            *variant = entry.default_variant();
        }
        // A single image cannot be the reference of several scenes.
        let scenes = axes[Axis::Scene].len();
        if reference.file.is_some() && scenes > 1 {
            let expected =
                format!("left out where `axes.scene` has {scenes} scenes: it is an image of one");
            return Err(not_allowed(self.tree, "reference.file", "", expected));
        }
        Ok(reference)
    }

    /// Checks that no replicate shares its seed with a reference part: errors would be correlated,
    /// and a hash sampler would compare an image with itself.
    fn check_reference_seed(&self, experiment: &Experiment) -> Result<(), ConfigError> {
        let seeds = experiment.seeds();
        let Some(shared) = seeds.shared() else {
            return Ok(());
        };
        let expected = format!(
            "another number: hashed, it gives the {} parts of the reference the seeds from {} on, and \
             {shared} is one of the {} replicates' seeds from {} on",
            seeds.reference_parts.len(),
            seeds.reference_parts[0],
            experiment.run.replicates,
            experiment.run.seed
        );
        let seed = experiment.reference.seed;
        Err(not_allowed(self.tree, "reference.seed", seed, expected))
    }
}

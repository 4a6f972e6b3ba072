//! Everything an experiment may contain: the entries of each axis, and sections of settings.

use super::axis::{Axis, AxisMap};
use super::error::Place;
use super::sections::{
    Animation, Coherence, Discrepancy, Gate, Reference, Run, StopRule, Timing, View, Window,
};
use super::settings::{Section, Settings};
use super::variants;
use raystone_core::params::{Entry, ParamValue, Parameter, Variant};
use std::fmt::Write as _;
use std::ops::{Index, IndexMut};

/// Every name an experiment may use, by axis, and every section of settings. Built from the
/// registries, so a new entry reaches the parser, `raystone list` and the docs without another
/// edit. Scenes may also be paths; kernels always are.
#[derive(Debug, Clone)]
pub struct Catalogue {
    entries: AxisMap<Vec<Entry>>,
    sections: Vec<Section>,
}

impl Default for Catalogue {
    fn default() -> Self {
        Self {
            entries: AxisMap::default(),
            sections: vec![
                Section::of::<Run>(),
                Section::of::<StopRule>(),
                Section::of::<View>(),
                Section::of::<Reference>(),
                Section::of::<Timing>(),
                Section::of::<Gate>(),
                Section::of::<Discrepancy>(),
                Section::of::<Coherence>(),
                Section::of::<Animation>(),
                Section::of::<Window>(),
            ],
        }
    }
}

impl Index<Axis> for Catalogue {
    type Output = Vec<Entry>;

    fn index(&self, axis: Axis) -> &Vec<Entry> {
        &self.entries[axis]
    }
}

impl IndexMut<Axis> for Catalogue {
    fn index_mut(&mut self, axis: Axis) -> &mut Vec<Entry> {
        &mut self.entries[axis]
    }
}

impl Catalogue {
    /// All sections of settings.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The entry of a name on an axis: a built-in one, or that of the path of a model or of a folder of kernels, which has the
    /// parameters that all of the axis share. `None` if there is neither.
    pub fn entry(&self, axis: Axis, name: &str) -> Option<Entry> {
        variants::resolve(axis, &Place::Default, name, self).ok()
    }

    /// A variant with another value of one parameter, as an experiment with this variant alone has it; `None` if there is no such
    /// entry or parameter, or the value is not allowed.
    pub fn with_parameter(
        &self,
        axis: Axis,
        now: &Variant,
        name: &str,
        value: &ParamValue,
    ) -> Option<Variant> {
        let entry = self.entry(axis, &now.name)?;
        let changed = entry.schema.iter().find(|known| known.name == name)?;
        if !changed.range.allows(value) {
            return None;
        }
        let value_of = |known: &Parameter| {
            if known.name == name {
                Some(value.clone())
            } else {
                now.params.0.get(known.name).cloned()
            }
        };
        let set: Vec<(&'static str, ParamValue)> = (entry.schema.iter())
            .filter_map(|known| Some((known.name, value_of(known)?)))
            .collect();
        let mut variant = entry.variant(&set);
        if matches!(axis, Axis::Scene | Axis::Kernels) {
            variants::shorten_labels(std::slice::from_mut(&mut variant));
        }
        Some(variant)
    }

    /// Adds a section of settings, for [`Experiment::settings`](super::Experiment::settings).
    pub fn add_section<S: Settings>(&mut self) {
        self.sections.retain(|section| section.name() != S::SECTION);
        self.sections.push(Section::of::<S>());
    }

    /// Allowed keys of a section of settings, and the tables within it.
    pub(super) fn keys_of(&self, section: &str) -> Vec<&str> {
        let mut keys = Vec::new();
        for known in &self.sections {
            match known.name().split_once('.') {
                Some((outer, inner)) if outer == section => keys.push(inner),
                _ if known.name() == section => {
                    keys.extend(known.entry.schema.iter().map(|key| key.name));
                }
                _ => {}
            }
        }
        keys
    }

    /// Markdown table of all keys, as in `docs/experiments.md`.
    pub fn table(&self) -> String {
        let mut text = String::from("| Key | Value | Default | Meaning |\n|---|---|---|---|\n");
        axes(&mut text);
        // Writing to a string cannot fail.
        for section in &self.sections {
            let Entry {
                name,
                description,
                schema,
            } = &section.entry;
            let _ = writeln!(text, "| **`[{name}]`** | | | {description} |");
            for key in schema {
                let _ = writeln!(
                    text,
                    "| `{name}.{}` | {} | {} | {} |",
                    key.name,
                    key.range,
                    default(section, key),
                    key.description
                );
            }
        }
        text
    }
}

/// Default of a key, as written in a file.
fn default(section: &Section, key: &Parameter) -> String {
    match key.default_written() {
        None if section.required.contains(&key.name) => NEEDED.to_owned(),
        None => "–".to_owned(),
        Some(ParamValue::Name(text)) => format!("`\"{text}\"`"),
        Some(value) => format!("`{value}`"),
    }
}

/// Table entry in place of a default for a required key.
const NEEDED: &str = "needed";

fn axes(text: &mut String) {
    let _ = writeln!(text, "| **`[axes]`** | | | What is varied. |");
    for axis in Axis::ALL {
        let default = axis
            .default_name()
            .map_or(NEEDED.to_owned(), |name| format!("`[\"{name}\"]`"));
        let _ = writeln!(
            text,
            "| `axes.{axis}` | {} | {default} | {} |",
            axis.expected(),
            axis.meaning()
        );
    }
    for (section, meaning) in [
        (
            "exclude",
            "Cells that fit a pattern on every axis named are left out …",
        ),
        ("include", "… but those are kept that one of these fits."),
    ] {
        let _ = writeln!(
            text,
            "| `{section}.AXIS` | one pattern or a list of them, for any axis | – | {meaning} |"
        );
    }
}

//! The choice of figures to export.

use super::ExportError;
use crate::values::Value;
use raystone_config::{Pattern, Selector};
use raystone_core::params::{Params, Variant};
use raystone_record::{Key, axis};
use std::collections::BTreeSet;

/// Patterns of figures, and of labels by axis; without patterns everything is chosen.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    figures: Vec<Pattern>,
    only: Selector,
}

impl Selection {
    /// Parses a choice: `figures` are ids, with or without version, or patterns of them; `only` are texts for [`Selector`].
    ///
    /// # Errors
    /// If a text is not `axis=pattern`, or names an unknown axis.
    pub fn new(figures: &[String], only: &[String]) -> Result<Self, ExportError> {
        Ok(Self {
            figures: figures.iter().map(Pattern::new).collect(),
            only: Selector::parse(only, &axis::ALL)?,
        })
    }

    /// Returns `true` if all figures are chosen.
    pub(crate) fn is_of_all_figures(&self) -> bool {
        self.figures.is_empty()
    }

    /// Returns `true` if a figure of this key is chosen: it has all requested axes.
    pub fn keeps(&self, key: &Key, figure: &str) -> bool {
        let is_chosen = |pattern: &Pattern| pattern.matches(&id_variant(figure));
        (self.figures.is_empty() || self.figures.iter().any(is_chosen))
            && self.only.fits(|axis, fits| key.get(axis).is_some_and(fits))
    }

    /// Returns the chosen values.
    ///
    /// # Errors
    /// If no figure or label matches a pattern, or no value is left.
    pub fn of<'a>(&self, values: Vec<Value<'a>>) -> Result<Vec<Value<'a>>, ExportError> {
        for pattern in &self.figures {
            let fits = |value: &Value| pattern.matches(&id_variant(&value.figure.id));
            if !values.iter().any(fits) {
                let ids: BTreeSet<&str> = values.iter().map(|v| v.figure.id.as_ref()).collect();
                let ids: Vec<&str> = ids.into_iter().collect();
                return Err(ExportError::Choice(format!(
                    "--figure {pattern}: the run has no such figure (it has: {})",
                    ids.join(", ")
                )));
            }
        }
        self.only.check(|axis| {
            let mut known: Vec<_> = values.iter().filter_map(|v| v.key.get(axis)).collect();
            known.sort_unstable_by_key(|variant| &variant.label);
            known.dedup_by_key(|variant| &variant.label);
            known
        })?;
        let had_any = !values.is_empty();
        let mut values = values;
        values.retain(|value| self.keeps(&value.key, &value.figure.id));
        if values.is_empty() && had_any {
            Err(ExportError::Choice(
                "no figure of the run fits --figure and --only together".into(),
            ))
        } else {
            Ok(values)
        }
    }
}

/// Returns a figure's id as patterns see it: its name is the id without the version.
fn id_variant(id: &str) -> Variant {
    Variant {
        name: id.rsplit_once("/v").map_or(id, |(name, _)| name).to_owned(),
        params: Params::default(),
        label: id.to_owned(),
    }
}

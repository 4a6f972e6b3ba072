//! Which figures, and of what.

use super::ExportError;
use crate::values::Value;
use raystone_config::{Pattern, Selector};
use raystone_core::params::{Params, Variant};
use raystone_record::{Key, axis};
use std::collections::BTreeSet;

/// Patterns of figures, and of labels by axis; none of a sort chooses everything.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    figures: Vec<Pattern>,
    only: Selector,
}

impl Selection {
    /// `figures` are ids, with or without their version, or patterns of them; `only` are texts as [`Selector`] reads them.
    ///
    /// # Errors
    /// A text that is no `axis=pattern`, or of an axis that there is not.
    pub fn new(figures: &[String], only: &[String]) -> Result<Self, ExportError> {
        Ok(Self {
            figures: figures.iter().map(Pattern::new).collect(),
            only: Selector::parse(only, &axis::ALL)?,
        })
    }

    /// Whether all figures are chosen.
    pub(crate) fn is_of_all_figures(&self) -> bool {
        self.figures.is_empty()
    }

    /// Whether a figure of this key is chosen: it has all axes that are asked for.
    pub fn keeps(&self, key: &Key, figure: &str) -> bool {
        let is_chosen = |pattern: &Pattern| pattern.matches(&id_variant(figure));
        (self.figures.is_empty() || self.figures.iter().any(is_chosen))
            && self.only.fits(|axis, fits| key.get(axis).is_some_and(fits))
    }

    /// The chosen values.
    ///
    /// # Errors
    /// A pattern that no figure or no label fits, or no value is left.
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
        match values.is_empty() && had_any {
            true => Err(ExportError::Choice(
                "no figure of the run fits --figure and --only together".into(),
            )),
            false => Ok(values),
        }
    }
}

/// A figure's id as patterns see it: its name is that without the version.
fn id_variant(id: &str) -> Variant {
    Variant {
        name: id.rsplit_once("/v").map_or(id, |(name, _)| name).to_owned(),
        params: Params::default(),
        label: id.to_owned(),
    }
}

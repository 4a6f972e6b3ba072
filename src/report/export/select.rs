//! Which figures, and of what.

use super::ExportError;
use crate::values::Value;
use raystone_config::Pattern;
use raystone_core::params::{Params, Variant};
use raystone_record::{Key, axis};
use std::collections::BTreeSet;

/// Patterns of figures, and of labels by axis; none of a sort chooses everything.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    figures: Vec<Pattern>,
    only: Vec<(String, Pattern)>,
}

impl Selection {
    /// `figures` are ids, with or without their version, or patterns of them; `only` are texts
    /// `axis=pattern`, several behind commas: patterns of one axis are alternatives.
    ///
    /// # Errors
    /// A text that is no `axis=pattern`, or of an axis that there is not.
    pub fn new(figures: &[String], only: &[String]) -> Result<Self, ExportError> {
        let parse = |text: &str| {
            let fault = |why: String| ExportError::Choice(format!("--only {text}: {why}"));
            let (axis, pattern) = text
                .split_once('=')
                .ok_or_else(|| fault("give AXIS=PATTERN".into()))?;
            match axis::ALL.contains(&axis) {
                true => Ok((axis.to_owned(), Pattern::new(pattern))),
                false => Err(fault(format!(
                    "there is no axis {axis} (known: {})",
                    axis::ALL.join(", ")
                ))),
            }
        };
        let only = only.iter().flat_map(|text| text.split(','));
        Ok(Self {
            figures: figures.iter().map(Pattern::new).collect(),
            only: only.map(parse).collect::<Result<_, _>>()?,
        })
    }

    /// Whether all figures are chosen.
    pub(crate) fn is_of_all_figures(&self) -> bool {
        self.figures.is_empty()
    }

    /// Whether a figure of this key is chosen.
    pub fn keeps(&self, key: &Key, figure: &str) -> bool {
        let fits_axis = |axis: &String| {
            let mut patterns = self.only.iter().filter(|(of, _)| of == axis);
            let variant = key.get(axis);
            patterns.any(|(_, pattern)| variant.is_some_and(|variant| pattern.matches(variant)))
        };
        let is_chosen = |pattern: &Pattern| pattern.matches(&id_variant(figure));
        (self.figures.is_empty() || self.figures.iter().any(is_chosen))
            && self.only.iter().all(|(axis, _)| fits_axis(axis))
    }

    /// The chosen values.
    ///
    /// # Errors
    /// A pattern of figures that none of them fits, or no value is left.
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

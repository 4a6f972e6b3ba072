//! The table of weights, and its file.

use crate::features::FEATURES;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use thiserror::Error;

/// Classes of rays whose times are predicted: the names in [`Costs::ns`].
pub const CLASSES: [&str; 5] = ["primary", "shadow", "ambient occlusion", "bounce", "chord"];

/// The tables that come with the program, most trusted first.
const BUILT_IN: [&str; 1] = [include_str!("tables/llvmpipe.toml")];

/// Why a table cannot be read, fitted or used.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum AdviceError {
    /// The file is not a table.
    #[error("not a table of advice: {0}")]
    Syntax(String),
    /// A choice has weights of other features.
    #[error("{choice}: {found} weights for {cost}, where {expected} features are known: {names}; fit the table anew",
        expected = FEATURES.len(), names = FEATURES.join(", "))]
    Weights {
        /// The choice.
        choice: String,
        /// What they predict.
        cost: &'static str,
        /// Their number.
        found: usize,
    },
    /// There is nothing to choose from.
    #[error("{0}")]
    Empty(String),
}

/// A structure with parameters that the advisor can choose.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Choice {
    /// Name of the structure.
    pub structure: String,
    /// Its builder, if it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub builder: Option<String>,
}

impl Choice {
    /// The choice of a label such as `cwbvh(builder=ploc)`; `None` if it sets anything but a builder.
    pub fn of_label(label: &str) -> Option<Self> {
        let (structure, inside) = match label.split_once('(') {
            None => (label, None),
            Some((structure, inside)) => (structure, Some(inside.strip_suffix(')')?)),
        };
        let builder = match inside {
            None => None,
            Some(inside) => Some(inside.strip_prefix("builder=")?.to_owned()),
        };
        if builder.as_ref().is_some_and(|b| b.contains(',')) {
            return None;
        }
        Some(Self {
            structure: structure.to_owned(),
            builder,
        })
    }

    /// Its label in records and on the command line.
    pub fn label(&self) -> String {
        match &self.builder {
            None => self.structure.clone(),
            Some(builder) => format!("{}(builder={builder})", self.structure),
        }
    }
}

/// Weights of the terms of a scene's features ([`FEATURES`]), for the binary logarithm of each cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Costs {
    /// What is built.
    #[serde(flatten)]
    pub choice: Choice,
    /// Fewest instances that a scene needs for it: 2 of structures over copies.
    #[serde(default = "one")]
    pub least_copies: u64,
    /// Of the milliseconds of a build.
    pub build_ms: Vec<f64>,
    /// Of the nanoseconds of a ray, by class.
    pub ns: BTreeMap<String, Vec<f64>>,
}

fn one() -> u64 {
    1
}

/// Weights for all choices, fitted on one adapter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdviceTable {
    /// Name of the adapter.
    pub adapter: String,
    /// The scenes that it was fitted on.
    pub scenes: Vec<String>,
    /// Least value of each term in these.
    pub least: Vec<f64>,
    /// Greatest value of each.
    pub most: Vec<f64>,
    /// The choices.
    #[serde(rename = "choice")]
    pub choices: Vec<Costs>,
}

impl AdviceTable {
    /// Reads the text of a table.
    ///
    /// # Errors
    /// It is not TOML of this form, has no choices, or was fitted on other features.
    pub fn parse(text: &str) -> Result<Self, AdviceError> {
        let table: Self = toml::from_str(text).map_err(|e| {
            let before = e.span().and_then(|span| text.get(..span.start));
            let line = before.map_or(0, |before| before.matches('\n').count()) + 1;
            AdviceError::Syntax(format!("line {line}: {}", e.message()))
        })?;
        if table.choices.is_empty() {
            return Err(AdviceError::Empty("the table has no choices".to_owned()));
        }
        if table.least.len() != FEATURES.len() || table.most.len() != FEATURES.len() {
            let reason = format!(
                "`least` and `most` have a number for each of {}",
                FEATURES.join(", ")
            );
            return Err(AdviceError::Syntax(reason));
        }
        for costs in &table.choices {
            let all = (costs.ns.values().map(|w| ("a class of rays", w)))
                .chain([("builds", &costs.build_ms)]);
            for (cost, weights) in all {
                if weights.len() != FEATURES.len() {
                    let (choice, found) = (costs.choice.label(), weights.len());
                    return Err(AdviceError::Weights {
                        choice,
                        cost,
                        found,
                    });
                }
            }
        }
        Ok(table)
    }

    /// Writes it, so that [`AdviceTable::parse`] reads the same.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "# Weights of what a scene shows for the binary logarithm of what a structure costs on it: build_ms, milliseconds of a\n\
             # build, ns, nanoseconds of a ray. The terms are, in order: {}.\n\
             # Made by `raystone advise --fit`; see docs/advice.md.\n\n\
             adapter = {:?}\nscenes = {:?}\nleast = {}\nmost = {}\n",
            FEATURES.join(", "),
            self.adapter,
            self.scenes,
            row(&self.least),
            row(&self.most),
        );
        for costs in &self.choices {
            text += &format!("\n[[choice]]\nstructure = {:?}\n", costs.choice.structure);
            if let Some(builder) = &costs.choice.builder {
                text += &format!("builder = {builder:?}\n");
            }
            if costs.least_copies > 1 {
                text += &format!("least_copies = {}\n", costs.least_copies);
            }
            text += &format!("build_ms = {}\n", row(&costs.build_ms));
            for (class, weights) in &costs.ns {
                text += &format!("ns.{class:?} = {}\n", row(weights));
            }
        }
        text
    }

    /// The table that comes with the program for this adapter, or the nearest to it; a sentence where it is another's.
    pub fn built_in(adapter: &str) -> Result<(Self, Option<String>), AdviceError> {
        let tables = BUILT_IN.map(Self::parse);
        let mut tables = tables.into_iter().collect::<Result<Vec<_>, _>>()?;
        let own = tables.iter().position(|t| is_of(&t.adapter, adapter));
        let table = tables.swap_remove(own.unwrap_or(0));
        let other = own.is_none().then(|| {
            format!(
                "no table was fitted on {adapter}: this is the one of {}; `raystone advise --fit` makes one from a run of experiments/advice.toml",
                table.adapter
            )
        });
        Ok((table, other))
    }
}

/// True if both name the same adapter, or both the software rasteriser, whose name ends with its version and width.
fn is_of(table: &str, adapter: &str) -> bool {
    let first = |name: &str| name.split_whitespace().next().map(str::to_lowercase);
    table == adapter
        || first(table).as_deref() == Some("llvmpipe") && first(adapter) == first(table)
}

fn row(weights: &[f64]) -> String {
    let written: Vec<String> = weights.iter().map(|w| format!("{w:.4}")).collect();
    format!("[{}]", written.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_say_structure_and_builder_and_nothing_else() {
        let choice = Choice::of_label("cwbvh(builder=ploc-reinsertion)").unwrap();
        assert_eq!(choice.builder.as_deref(), Some("ploc-reinsertion"));
        assert_eq!(choice.label(), "cwbvh(builder=ploc-reinsertion)");
        assert_eq!(Choice::of_label("bvh").unwrap().label(), "bvh");
        assert_eq!(Choice::of_label("bvh(traversal=roped)"), None);
        assert_eq!(Choice::of_label("bvh(builder=ploc,leaf_size=2)"), None);
    }

    #[test]
    fn a_table_is_read_as_it_was_written_and_others_are_refused() {
        let (table, other) = AdviceTable::built_in("llvmpipe (LLVM 17.0.6, 128 bits)").unwrap();
        assert_eq!(other, None);
        assert_eq!(AdviceTable::parse(&table.to_text()).unwrap(), table);
        let (_, other) = AdviceTable::built_in("Some GPU").unwrap();
        assert!(other.unwrap().contains("Some GPU"));
        let short = table
            .to_text()
            .replacen("build_ms = [", "build_ms = [1.0, ", 1);
        assert!(matches!(
            AdviceTable::parse(&short),
            Err(AdviceError::Weights { .. })
        ));
        assert!(matches!(
            AdviceTable::parse("adapter = 1"),
            Err(AdviceError::Syntax(_))
        ));
    }
}

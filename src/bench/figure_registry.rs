//! Registry of additional figures of built structures.

use raystone_accel::{BuiltAccel, TriangleSoup};
use raystone_record::Interval;
use raystone_record::figure::{FIGURES, Figure};
use std::collections::BTreeMap;

/// Measures a built structure; `None` if the figure does not apply.
pub(crate) type OfStructure = fn(&dyn BuiltAccel, &TriangleSoup) -> Option<f64>;

/// Figures from outside the crate, with the code that measures them.
#[derive(Debug, Clone, Default)]
pub struct FigureRegistry(Vec<(Figure, OfStructure)>);

impl FigureRegistry {
    /// Adds a figure of built structures.
    ///
    /// # Errors
    /// The id is taken, or has no version.
    pub fn add(&mut self, figure: Figure, measure: OfStructure) -> Result<(), String> {
        let id = &figure.id;
        if !id.contains("/v") {
            return Err(format!(
                "the id of the figure {id:?} needs a version, as in \"{id}/v1\""
            ));
        }
        if self
            .rows()
            .chain(FIGURES.iter().copied())
            .any(|known| known.id == *id)
        {
            return Err(format!(
                "there is a figure {id:?} already: choose another id or version"
            ));
        }
        self.0.push((figure, measure));
        Ok(())
    }

    /// The added table rows.
    pub fn rows(&self) -> impl Iterator<Item = &Figure> {
        self.0.iter().map(|(figure, _)| figure)
    }

    /// All applicable figures of a structure, by id.
    pub fn of_structure(
        &self,
        built: &dyn BuiltAccel,
        soup: &TriangleSoup,
    ) -> BTreeMap<String, Interval> {
        let measured = |(figure, measure): &(Figure, OfStructure)| {
            let value = measure(built, soup).filter(|value| value.is_finite())?;
            Some((figure.id.to_string(), Interval::exact(value)))
        };
        self.0.iter().filter_map(measured).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::figure::{Better::Lower, Shown::Digits, Spread::Exact};

    #[test]
    fn a_figure_from_outside_needs_a_version_and_an_id_of_its_own() {
        let mut registry = FigureRegistry::default();
        let row = |id| Figure::new(id, "mine", "", Lower, Digits(3), Exact);
        assert!(registry.add(row("mine"), |_, _| None).is_err());
        assert!(registry.add(row("sah-cost/v1"), |_, _| None).is_err());
        assert!(registry.add(row("mine/v1"), |_, _| None).is_ok());
        assert!(registry.add(row("mine/v1"), |_, _| None).is_err());
        assert_eq!(registry.rows().count(), 1);
    }
}

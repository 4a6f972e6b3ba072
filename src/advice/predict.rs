//! Predicted costs, and the choice of least cost.

use crate::features::SceneFeatures;
use crate::table::{AdviceTable, Choice, Costs};
use std::collections::BTreeMap;

/// The rays that a structure is built for.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// Their number.
    pub rays: f64,
    /// The classes they are of in equal parts; all that the table knows if empty.
    pub classes: Vec<String>,
}

/// Predicted costs of a choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// What would be built.
    pub choice: Choice,
    /// Milliseconds of the build.
    pub build_ms: f64,
    /// Nanoseconds of a ray, by class.
    pub ns: BTreeMap<String, f64>,
}

impl Prediction {
    /// Milliseconds of building and of all rays; `None` if a class is not known.
    pub fn total_ms(&self, demand: &Demand) -> Option<f64> {
        Some(self.build_ms + demand.rays * mean_ns(&self.ns, &demand.classes)? * 1e-6)
    }
}

/// Mean over these classes of nanoseconds per ray, over all of them if none is named.
pub(crate) fn mean_ns(ns: &BTreeMap<String, f64>, classes: &[String]) -> Option<f64> {
    let all: Option<Vec<f64>> = match classes {
        [] => Some(ns.values().copied().collect()),
        classes => classes.iter().map(|class| ns.get(class).copied()).collect(),
    };
    let all = all.filter(|all| !all.is_empty())?;
    Some(all.iter().sum::<f64>() / all.len() as f64)
}

impl AdviceTable {
    /// Costs of every choice that suits the scene, in the order of the table. Features beyond those of the scenes that it was
    /// fitted on count as the nearest of them, but for the number of triangles.
    pub fn predict(&self, features: &SceneFeatures) -> Vec<Prediction> {
        let mut terms = features.terms();
        let bounds = self.least.iter().zip(&self.most).enumerate();
        for (i, (least, most)) in bounds.filter(|(i, _)| *i != TRIANGLES) {
            terms[i] = terms[i].max(*least).min(*most);
        }
        let cost = |weights: &[f64]| {
            let log: f64 = weights.iter().zip(terms).map(|(w, t)| w * t).sum();
            log.exp2()
        };
        let one = |costs: &Costs| Prediction {
            choice: costs.choice.clone(),
            build_ms: cost(&costs.build_ms),
            ns: (costs.ns.iter())
                .map(|(class, weights)| (class.clone(), cost(weights)))
                .collect(),
        };
        let suits = |costs: &&Costs| features.copies >= costs.least_copies;
        self.choices.iter().filter(suits).map(one).collect()
    }

    /// The same with the total for `demand`, least first.
    pub fn advise(&self, features: &SceneFeatures, demand: &Demand) -> Vec<(Prediction, f64)> {
        let mut all: Vec<_> = (self.predict(features).into_iter())
            .filter_map(|p| p.total_ms(demand).map(|ms| (p, ms)))
            .collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        all
    }
}

/// Index of the term of the number of triangles.
const TRIANGLES: usize = 1;

/// Costs of a table, by hand: `quick` 1 ms and 1024 ns a ray, `good` 16 ms and 512 ns, and `two-level` 1 ms and 512 ns, of copies alone. Of
/// 1024 triangles both of the former take as long for 29,297 rays.
const KNOWN: &str = "adapter = 'known'\nscenes = []\nleast = [1, 3, 0, 0, 0, 0, 0]\nmost = [1, 20, 4, 4, 4, 4, 9]\n\
    [[choice]]\nstructure = 'quick'\nbuild_ms = [0, 0, 0, 0, 0, 0, 0]\nns.bounce = [10, 0, 0, 0, 0, 0, 0]\n\
    [[choice]]\nstructure = 'good'\nbuild_ms = [4, 0, 0, 0, 0, 0, 0]\nns.bounce = [9, 0, 0, 0, 0, 0, 0]\n\
    [[choice]]\nstructure = 'two-level'\nleast_copies = 2\nbuild_ms = [0, 0, 0, 0, 0, 0, 0]\nns.bounce = [0, 0.9, 0, 0, 0, 0, 0]\n";

/// Gives advice on known scenes.
///
/// # Errors
/// Their features or the order of structures are others than they should be.
pub fn check_known() -> Result<(), String> {
    crate::features::check()?;
    let table = AdviceTable::parse(KNOWN).map_err(|e| e.to_string())?;
    for (copies, rays, expected) in [
        (1, 29_000.0, "quick good"),
        (1, 29_600.0, "good quick"),
        (2, 1e5, "two-level good quick"),
    ] {
        let features = SceneFeatures {
            triangles: 1 << 10,
            copies,
            ..SceneFeatures::default()
        };
        let demand = Demand {
            rays,
            classes: vec!["bounce".to_owned()],
        };
        let advised = table.advise(&features, &demand);
        let names: Vec<String> = advised.iter().map(|(p, _)| p.choice.label()).collect();
        let found = names.join(" ");
        if found != expected {
            return Err(format!(
                "advice for {rays} rays of a known scene is `{found}`, and should be `{expected}`: build this program anew, and report \
                 what stays wrong"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_budget_decides_between_a_quick_build_and_quick_rays() {
        assert_eq!(check_known(), Ok(()));
    }

    #[test]
    fn a_class_that_is_not_known_has_no_total() {
        let demand = Demand {
            rays: 1.0,
            classes: vec!["x-rays".to_owned()],
        };
        assert!(
            AdviceTable::parse(KNOWN)
                .unwrap()
                .advise(&SceneFeatures::default(), &demand)
                .is_empty()
        );
    }

    #[test]
    fn a_scene_beyond_those_of_the_fit_costs_what_the_farthest_of_them_does() {
        // Weights of one for the spread of sizes, of which the fit saw 1 to 4, and for triangles, of which it saw up to 2²⁰.
        let table = "adapter = 'known'\nscenes = []\nleast = [1, 3, 1, 0, 0, 0, 0]\nmost = [1, 20, 4, 4, 4, 4, 9]\n\
            [[choice]]\nstructure = 'one'\nbuild_ms = [0, 1, 0, 0, 0, 0, 0]\nns.bounce = [0, 0, 1, 0, 0, 0, 0]\n";
        let table = AdviceTable::parse(table).unwrap();
        for (size_spread, ns) in [(0.0, 2.0), (1.0, 2.0), (3.0, 8.0), (4.0, 16.0), (9.0, 16.0)] {
            let features = SceneFeatures {
                triangles: 1 << 24,
                copies: 1,
                size_spread,
                ..SceneFeatures::default()
            };
            let found = &table.predict(&features)[0];
            assert_eq!(found.ns["bounce"], ns, "{size_spread}");
            // Of triangles alone there may be any number.
            assert_eq!(found.build_ms, f64::from(1 << 24));
        }
    }
}

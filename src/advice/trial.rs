//! How good the advice is on scenes that it was not fitted on.

use crate::fit::{Sample, fit};
use crate::predict::{Demand, mean_ns};
use crate::table::{AdviceError, AdviceTable, Choice};
use std::collections::BTreeMap;

/// What was advised for a scene, by a table that was fitted on all others.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// The scene.
    pub scene: String,
    /// Number of rays.
    pub rays: f64,
    /// The choice.
    pub advised: Choice,
    /// The choice that was cheapest as measured.
    pub best: Choice,
    /// Measured cost of the advised choice over that of the best, less one.
    pub regret: f64,
}

/// Regret over trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regret {
    /// Mean.
    pub mean: f64,
    /// Greatest.
    pub worst: f64,
}

impl Regret {
    /// Of these trials; 0 if there are none.
    pub fn of<'a>(trials: impl Iterator<Item = &'a Trial> + Clone) -> Self {
        let count = trials.clone().count().max(1) as f64;
        let regrets = trials.map(|t| t.regret);
        Self {
            mean: regrets.clone().sum::<f64>() / count,
            worst: regrets.fold(0.0, f64::max),
        }
    }
}

/// Advice for each scene by a table that was fitted without its family: scenes of one name that differ in parameters alone are
/// left out together.
///
/// # Errors
/// There are too few scenes to leave one out.
pub fn leave_one_out(samples: &[Sample], demands: &[Demand]) -> Result<Vec<Trial>, AdviceError> {
    let family = |scene: &str| scene.split('(').next().unwrap_or(scene).to_owned();
    let mut families: BTreeMap<String, Vec<&Sample>> = BTreeMap::new();
    for sample in samples {
        families
            .entry(family(&sample.scene))
            .or_default()
            .push(sample);
    }
    let mut trials = Vec::new();
    for (name, own) in &families {
        let others = samples.iter().filter(|s| family(&s.scene) != *name);
        let table = fit("", &others.cloned().collect::<Vec<_>>())?;
        let mut scenes: BTreeMap<&str, Vec<&Sample>> = BTreeMap::new();
        own.iter()
            .for_each(|s| scenes.entry(&s.scene).or_default().push(s));
        for (scene, measured) in scenes {
            let of_demand = |demand| trial(&table, scene, &measured, demand);
            trials.extend(demands.iter().filter_map(of_demand));
        }
    }
    Ok(trials)
}

/// The advice of `table` against what was measured in a scene; `None` if no choice was.
pub fn trial(
    table: &AdviceTable,
    scene: &str,
    measured: &[&Sample],
    demand: &Demand,
) -> Option<Trial> {
    let cost = |choice: &Choice| {
        let sample = measured.iter().find(|s| s.choice == *choice)?;
        Some(sample.build_ms + demand.rays * mean_ns(&sample.ns, &demand.classes)? * 1e-6)
    };
    let features = &measured.first()?.features;
    let advised = table.advise(features, demand).into_iter();
    let (advised, paid) = advised
        .filter_map(|(p, _)| cost(&p.choice).map(|ms| (p.choice, ms)))
        .next()?;
    let costs = measured
        .iter()
        .filter_map(|s| cost(&s.choice).map(|ms| (&s.choice, ms)));
    let (best, least) = costs.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Trial {
        scene: scene.to_owned(),
        rays: demand.rays,
        advised,
        best: best.clone(),
        regret: paid / least - 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::SceneFeatures;

    /// In scenes of few triangles `a` is twice as fast as `b`, in those of many half as fast.
    fn samples(odd_one: bool) -> Vec<Sample> {
        let mut samples = Vec::new();
        for size in 4..24_u64 {
            let turned = odd_one && size == 15;
            for (name, slope) in [("a", 1.0), ("b", -1.0)] {
                let log = slope * (size as f64 - 13.5) / 9.0 * if turned { -1.0 } else { 1.0 };
                samples.push(Sample {
                    scene: format!("s{size}"),
                    features: SceneFeatures {
                        triangles: 1 << size,
                        copies: 1,
                        ..Default::default()
                    },
                    choice: Choice::of_label(name).unwrap(),
                    build_ms: 1e-6,
                    ns: [("bounce".to_owned(), 100.0 * log.exp2())].into(),
                });
            }
        }
        samples
    }

    #[test]
    fn no_regret_where_other_scenes_agree_and_the_whole_where_they_mislead() {
        let demand = Demand {
            rays: 1e6,
            classes: Vec::new(),
        };
        let sound = leave_one_out(&samples(false), std::slice::from_ref(&demand)).unwrap();
        assert_eq!(sound.len(), 20);
        assert_eq!(
            Regret::of(sound.iter()),
            Regret {
                mean: 0.0,
                worst: 0.0
            }
        );
        let misled = leave_one_out(&samples(true), &[demand]).unwrap();
        let regret = Regret::of(misled.iter());
        // That scene costs 2^(2 · 1.5 / 9) times the least.
        let expected = (3.0_f64 / 9.0).exp2() - 1.0;
        assert!((regret.worst - expected).abs() < 1e-6, "{regret:?}");
        assert_eq!(misled.iter().filter(|t| t.regret > 0.0).count(), 1);
        assert!((regret.mean - expected / 20.0).abs() < 1e-6, "{regret:?}");
    }

    #[test]
    fn scenes_that_differ_in_parameters_alone_do_not_teach_each_other() {
        let mut all = samples(false);
        let own: Vec<Sample> = all.iter().filter(|s| s.scene == "s15").cloned().collect();
        // Two towns show what no other scene shows, and both mislead: seen one of them, the other would be known.
        for seed in 1..3 {
            for mut sample in own.clone() {
                sample.scene = format!("town(seed={seed})");
                sample.features.size_spread = 1.0;
                let ns = sample.ns.get_mut("bounce").unwrap();
                *ns = 1e4 / *ns;
                all.push(sample);
            }
        }
        let demand = Demand {
            rays: 1e6,
            classes: Vec::new(),
        };
        let trials = leave_one_out(&all, &[demand]).unwrap();
        let of_towns = trials.iter().filter(|t| t.scene.starts_with("town"));
        let regrets: Vec<f64> = of_towns.map(|t| t.regret).collect();
        let whole = (3.0_f64 / 9.0).exp2() - 1.0;
        assert_eq!(regrets.len(), 2);
        assert!(
            regrets.iter().all(|regret| (regret - whole).abs() < 1e-6),
            "{regrets:?}"
        );
    }
}

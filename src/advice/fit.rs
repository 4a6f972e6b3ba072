//! Fitting the table: least squares with a small penalty on weights (ridge regression, Hoerl & Kennard 1970).

use crate::features::{FEATURES, SceneFeatures};
use crate::table::{AdviceError, AdviceTable, CLASSES, Choice, Costs};
use std::collections::{BTreeMap, BTreeSet};

const TERMS: usize = FEATURES.len();
/// Penalties on squared weights of standardised terms, in scenes: of builds, and of rays, there of what all structures have in
/// common and of what distinguishes them. Chosen, with the terms of builds, by the regret on scenes left out (docs/advice.md).
const PENALTY_OF_BUILDS: f64 = 0.3;
const PENALTY_OF_RAYS: f64 = 3.0;
/// Terms of builds, which look at triangles and their boxes alone.
const TERMS_OF_BUILDS: [usize; 2] = [1, 3];
/// A cost needs so many scenes, or it is left out.
const LEAST_SCENES: usize = 2;

/// What one structure cost on one scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The scene's label.
    pub scene: String,
    /// Its features.
    pub features: SceneFeatures,
    /// What was built.
    pub choice: Choice,
    /// Milliseconds of the build.
    pub build_ms: f64,
    /// Nanoseconds of a ray, by class.
    pub ns: BTreeMap<String, f64>,
}

/// Fits a table on samples of one adapter.
///
/// # Errors
/// No structure was measured in two scenes.
pub fn fit(adapter: &str, samples: &[Sample]) -> Result<AdviceTable, AdviceError> {
    let choices: BTreeSet<&Choice> = samples.iter().map(|s| &s.choice).collect();
    let scenes: BTreeSet<&str> = samples.iter().map(|s| s.scene.as_str()).collect();
    let builds = by_choice(samples, |s| Some(s.build_ms));
    let builds: BTreeMap<Choice, Weights> = (builds.into_iter())
        .filter(|(_, points)| points.len() >= LEAST_SCENES)
        .map(|(choice, points)| {
            let points: Vec<_> = points
                .into_iter()
                .map(|(_, terms, log)| (terms, log))
                .collect();
            let weights = ridge(&points, &TERMS_OF_BUILDS, PENALTY_OF_BUILDS);
            (choice.clone(), weights)
        })
        .collect();
    let rays = CLASSES.map(|class| {
        let points = by_choice(samples, |s| s.ns.get(class).copied());
        (class, of_rays(points, scenes.len()))
    });
    let of_choice = |choice: &Choice| {
        let ns: BTreeMap<String, Vec<f64>> = (rays.iter())
            .filter_map(|(class, all)| Some(((*class).to_owned(), all.get(choice)?.to_vec())))
            .collect();
        let own = samples.iter().filter(|s| s.choice == *choice);
        Some(Costs {
            choice: choice.clone(),
            least_copies: own.map(|s| s.features.copies).min()?.min(2),
            build_ms: builds.get(choice).filter(|_| !ns.is_empty())?.to_vec(),
            ns,
        })
    };
    let costs: Vec<Costs> = choices.into_iter().filter_map(of_choice).collect();
    if costs.is_empty() {
        return Err(AdviceError::Empty(format!(
            "nothing to fit: a structure needs {LEAST_SCENES} scenes, and the records hold {} with times of structures; run experiments/advice.toml",
            scenes.len()
        )));
    }
    let all = samples.iter().map(|s| s.features.terms());
    let bound = |of: fn(f64, f64) -> f64| {
        let terms = all.clone();
        terms.reduce(|a, b| std::array::from_fn(|i| of(a[i], b[i])))
    };
    Ok(AdviceTable {
        adapter: adapter.to_owned(),
        scenes: scenes.into_iter().map(str::to_owned).collect(),
        least: bound(f64::min).unwrap_or_default().to_vec(),
        most: bound(f64::max).unwrap_or_default().to_vec(),
        choices: costs,
    })
}

type Weights = [f64; TERMS];

/// Scene, terms and binary logarithm of a cost, by choice.
fn by_choice(
    samples: &[Sample],
    cost: impl Fn(&Sample) -> Option<f64>,
) -> BTreeMap<&Choice, Vec<(&str, Weights, f64)>> {
    let mut all: BTreeMap<&Choice, Vec<(&str, Weights, f64)>> = BTreeMap::new();
    for sample in samples {
        if let Some(cost) = cost(sample).filter(|c| c.is_finite() && *c > 0.0) {
            let point = (sample.scene.as_str(), sample.features.terms(), cost.log2());
            all.entry(&sample.choice).or_default().push(point);
        }
    }
    all
}

/// Weights of rays, by choice: those of the mean over the choices that were measured in all scenes, and of the difference from
/// this mean. What a scene costs every structure then moves no choice.
fn of_rays(
    points: BTreeMap<&Choice, Vec<(&str, Weights, f64)>>,
    scenes: usize,
) -> BTreeMap<Choice, Weights> {
    let everywhere = points.values().filter(|points| points.len() == scenes);
    let mut means: BTreeMap<&str, (Weights, f64, f64)> = BTreeMap::new();
    for (scene, terms, log) in everywhere.flatten() {
        let mean = means.entry(scene).or_insert((*terms, 0.0, 0.0));
        (mean.1, mean.2) = (mean.1 + log, mean.2 + 1.0);
    }
    let mean_of = |scene: &str| means.get(scene).map_or(0.0, |(_, sum, count)| sum / count);
    let common: Vec<_> = (means.iter())
        .map(|(scene, (terms, ..))| (*terms, mean_of(scene)))
        .collect();
    let every_term: [usize; TERMS] = std::array::from_fn(|i| i);
    let common = match &common[..] {
        [] => [0.0; TERMS],
        points => ridge(points, &every_term, PENALTY_OF_RAYS),
    };
    let fitted = points
        .into_iter()
        .filter(|(_, points)| points.len() >= LEAST_SCENES);
    let of_choice = |(choice, points): (&Choice, Vec<(&str, Weights, f64)>)| {
        let differences: Vec<_> = (points.into_iter())
            .map(|(scene, terms, log)| (terms, log - mean_of(scene)))
            .collect();
        let own = ridge(&differences, &every_term, PENALTY_OF_RAYS);
        (choice.clone(), std::array::from_fn(|i| common[i] + own[i]))
    };
    fitted.map(of_choice).collect()
}

/// Weights w of these terms with the least Σ (y − w · x)² + `penalty` Σ (wᵢ σᵢ)², the constant term free.
fn ridge(points: &[(Weights, f64)], terms: &[usize], penalty: f64) -> Weights {
    let count = points.len() as f64;
    type Point = (Weights, f64);
    let mean_of = |of: &dyn Fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / count;
    let means: [f64; TERMS] = std::array::from_fn(|i| mean_of(&|(x, _)| x[i]));
    let level = mean_of(&|(_, y)| *y);
    let scales: [f64; TERMS] = std::array::from_fn(|i| {
        if terms.contains(&i) {
            mean_of(&|(x, _)| (x[i] - means[i]).powi(2)).sqrt()
        } else {
            0.0
        }
    });
    let normal = |x: &[f64; TERMS], i: usize| match scales[i] {
        scale if scale > 1e-9 => (x[i] - means[i]) / scale,
        _ => 0.0,
    };
    let mut system = [[0.0; TERMS + 1]; TERMS];
    for (x, y) in points {
        let x: Weights = std::array::from_fn(|i| normal(x, i));
        for (row, own) in system.iter_mut().zip(x) {
            for (value, other) in row.iter_mut().zip(x) {
                *value += own * other;
            }
            row[TERMS] += own * (y - level);
        }
    }
    for (row, values) in system.iter_mut().enumerate() {
        values[row] += penalty;
    }
    let standard = solve(system);
    let mut weights: [f64; TERMS] = std::array::from_fn(|i| match scales[i] {
        scale if scale > 1e-9 => standard[i] / scale,
        _ => 0.0,
    });
    // The first term is one, which no penalty draws to 0.
    weights[0] = level - (1..TERMS).map(|i| weights[i] * means[i]).sum::<f64>();
    weights
}

/// Solves a positive definite system by Gauss's elimination; the last column is the right side.
fn solve(mut system: [[f64; TERMS + 1]; TERMS]) -> [f64; TERMS] {
    for pivot in 0..TERMS {
        let upper = system[pivot];
        for row in &mut system[pivot + 1..] {
            let factor = row[pivot] / upper[pivot];
            for (value, above) in row.iter_mut().zip(upper) {
                *value -= factor * above;
            }
        }
    }
    let mut solution = [0.0; TERMS];
    for row in (0..TERMS).rev() {
        let known: f64 = (row + 1..TERMS).map(|i| system[row][i] * solution[i]).sum();
        solution[row] = (system[row][TERMS] - known) / system[row][row];
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scenes whose features differ in every term, with the cost that `cost` says.
    fn samples(cost: impl Fn(&SceneFeatures) -> f64) -> Vec<Sample> {
        let scene = |index: u64| {
            let turn = |by: f64| 0.5 + (index as f64 * by).fract();
            let features = SceneFeatures {
                triangles: 100 << (index % 14),
                copies: 1 + index % 5,
                size_spread: 2.0 * turn(0.618),
                boxes_crossed: 9.0 * turn(0.755),
                surfaces_crossed: 4.0 * turn(0.57),
                occupied: 0.1 * turn(0.413),
            };
            Sample {
                scene: format!("scene {index}"),
                choice: Choice::of_label("bvh").unwrap(),
                build_ms: features.triangles as f64 * 1e-3,
                ns: [("chord".to_owned(), cost(&features))].into(),
                features,
            }
        };
        (0..400).map(scene).collect()
    }

    #[test]
    fn a_product_of_powers_is_found() {
        let cost = |f: &SceneFeatures| {
            30.0 * (f.triangles as f64).powf(0.25) * f.surfaces_crossed.powf(0.5) / f.occupied
        };
        let samples = samples(cost);
        let table = fit("test", &samples).unwrap();
        for sample in &samples {
            let predicted = &table.predict(&sample.features)[0];
            let ratio = predicted.ns["chord"] / sample.ns["chord"];
            assert!((0.97..1.03).contains(&ratio), "{ratio} for {sample:?}");
            let build = predicted.build_ms / sample.build_ms;
            assert!((0.97..1.03).contains(&build), "{build} for {sample:?}");
        }
        // The exponents themselves, drawn to 0 a little.
        let weights = &table.choices[0].ns["chord"];
        assert!((weights[1] - 0.25).abs() < 0.01, "{weights:?}");
        assert!((weights[4] - 0.5).abs() < 0.02, "{weights:?}");
        assert!((weights[5] + 1.0).abs() < 0.02, "{weights:?}");
    }

    #[test]
    fn one_scene_is_too_few() {
        let samples = &samples(|_| 1.0)[..1];
        let error = fit("test", samples).unwrap_err().to_string();
        assert!(error.contains("needs 2 scenes"), "{error}");
    }
}

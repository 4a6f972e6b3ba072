//! `auto`, and the builder of that name: what the table of advice expects to cost least on the scene.

use super::registry::AccelRegistry;
use super::structure::prelude::*;
use super::tree::{Builder, LARGEST_OF_PLOC, TreeParameters};
use raystone_advice::{AdviceTable, CLASSES, Demand, SceneFeatures};
use raystone_core::clock::Instant;
use raystone_core::params::{Choice, ParamValue};
use std::borrow::Cow;

/// The structure whose trees the builder `auto` is chosen by.
const TREES_OF: &str = "cwbvh";
/// Rays that the builder `auto` expects: some ten samples per pixel of a large picture.
const RAYS: f64 = 1e7;

parameters! {
    /// What a structure is chosen for.
    pub(crate) struct AutoParameters {
        /// rays that it will answer: the more, the longer a build may take
        rays: f64 = RAYS, in 1.0..=1e15;
        /// their class; mixed: all in equal parts
        class: Class = Class::Mixed;
    }

    /// Classes of rays.
    pub(crate) enum Class {
        Mixed = "mixed",
        Primary = "primary",
        Shadow = "shadow",
        AmbientOcclusion = "ambient-occlusion",
        Bounce = "bounce",
        Chord = "chord",
    }
}

impl AutoParameters {
    fn demand(&self) -> Demand {
        let name = self.class.name().replace('-', " ");
        let class = CLASSES.iter().find(|class| **class == name);
        Demand {
            rays: self.rays,
            classes: class.map(|class| (*class).to_owned()).into_iter().collect(),
        }
    }
}

/// The registry entry `auto`.
pub(crate) struct Auto;

impl Structure for Auto {
    const NAME: &'static str = "auto";
    const DESCRIPTION: &'static str = "the structure that the table of advice expects to cost least on the scene, build and rays together";
    type Parameters = AutoParameters;

    /// None of its own: it is another structure once it is built.
    fn kernels() -> Vec<String> {
        Vec::new()
    }

    fn build(soup: &TriangleSoup, options: &AutoParameters, log: &mut BuildLog) -> BuildResult {
        let start = Instant::now();
        let advised = table(log)?.advise(&features(soup), &options.demand());
        let spent = start.elapsed().as_secs_f64() * 1e3;
        let registry = AccelRegistry::default();
        let mut refused = AccelError::Invalid("the table of advice has no choice".to_owned());
        for (prediction, _) in advised {
            let choice = &prediction.choice;
            let kind = registry.named("structure", &choice.structure);
            let kind = kind.map_err(AccelError::Invalid)?;
            let mut params = Params::default();
            if let Some(builder) = &choice.builder {
                let builder = ParamValue::Name(builder.clone());
                params.0.insert("builder".to_owned(), builder);
            }
            match kind.build(soup, &params, log) {
                Ok(built) => {
                    log.note(&format!("chosen: {}", choice.label()), spent);
                    return Ok(built);
                }
                // What this scene or adapter is too large for is passed over for the next best.
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }
}

/// The parameters with the builder that [`Builder::Auto`] stands for here.
///
/// # Errors
/// The table of advice cannot be read.
pub(super) fn with_builder<'a>(
    settings: &'a TreeParameters,
    soup: &TriangleSoup,
    log: &mut BuildLog,
) -> Result<Cow<'a, TreeParameters>, AccelError> {
    if settings.builder != Builder::Auto {
        return Ok(Cow::Borrowed(settings));
    }
    let start = Instant::now();
    let demand = Demand {
        rays: RAYS,
        classes: Vec::new(),
    };
    let advised = table(log)?.advise(&features(soup), &demand);
    let best = (advised.into_iter()).find(|(p, _)| p.choice.structure == TREES_OF);
    let named = best.and_then(|(p, _)| p.choice.builder);
    let builder = match named {
        // Clustering takes no coordinates beyond a limit.
        Some(_) if !coordinates_are_within(soup, LARGEST_OF_PLOC) => {
            TreeParameters::default().builder
        }
        None => TreeParameters::default().builder,
        Some(name) => Builder::from_name(&name).ok_or_else(|| {
            let what = format!("the table of advice names a builder `{name}` that does not exist");
            AccelError::Invalid(what)
        })?,
    };
    log.note(
        &format!("chosen: {}", builder.name()),
        start.elapsed().as_secs_f64() * 1e3,
    );
    Ok(Cow::Owned(TreeParameters {
        builder,
        ..settings.clone()
    }))
}

fn coordinates_are_within(soup: &TriangleSoup, limit: f32) -> bool {
    let mut coordinates = soup.records.iter().flat_map(|r| r.vertices()).flatten();
    coordinates.all(|x| x.abs() <= limit)
}

fn table(log: &BuildLog) -> Result<AdviceTable, AccelError> {
    let adapter = log.gpu().map_or("", |gpu| gpu.info.name.as_str());
    let table = AdviceTable::built_in(adapter).map_err(|e| AccelError::Invalid(e.to_string()))?;
    Ok(table.0)
}

fn features(soup: &TriangleSoup) -> SceneFeatures {
    let corners = |record: &crate::triangle::TriangleRecord| {
        [record.v0, record.v1, record.v2].map(glam::Vec3::from)
    };
    let copies = soup
        .placed
        .as_ref()
        .map_or(1, |placed| placed.instances.len());
    SceneFeatures::of(soup.records.iter().map(corners), copies)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::lattice;

    fn chosen(log: &BuildLog) -> Vec<String> {
        let names = log.phases.iter().map(|phase| phase.name.clone());
        let chosen = |name: String| Some(name.strip_prefix("chosen: ")?.to_owned());
        names.filter_map(chosen).collect()
    }

    #[test]
    fn what_is_built_is_what_the_log_names() {
        let soup = lattice(2);
        for (rays, class) in [(1.0, "mixed"), (1e4, "chord"), (1e9, "bounce")] {
            let mut params = Params::default();
            params.0.insert("rays".to_owned(), ParamValue::Number(rays));
            params
                .0
                .insert("class".to_owned(), ParamValue::Name(class.to_owned()));
            let mut log = BuildLog::default();
            let built = crate::AccelKind::build(&Auto, &soup, &params, &mut log).unwrap();
            let [label] = &chosen(&log)[..] else {
                panic!("{:?}", log.phases)
            };
            let choice = raystone_advice::Choice::of_label(label).unwrap();
            let kind = AccelRegistry::default()
                .named("structure", &choice.structure)
                .unwrap();
            let mut params = Params::default();
            if let Some(builder) = choice.builder {
                params
                    .0
                    .insert("builder".to_owned(), ParamValue::Name(builder));
            }
            let named = kind
                .build(&soup, &params, &mut BuildLog::default())
                .unwrap();
            let arrays = |built: &dyn BuiltAccel| -> Vec<Vec<u32>> {
                built
                    .buffers()
                    .arrays
                    .iter()
                    .map(|a| a.words.to_vec())
                    .collect()
            };
            assert_eq!(arrays(&*built), arrays(&*named), "{label}");
            assert_eq!(built.buffers().kernel, named.buffers().kernel);
        }
    }

    #[test]
    fn what_is_built_costs_least_by_the_table() {
        let soup = lattice(2);
        let (table, _) = AdviceTable::built_in("").unwrap();
        for rays in [1.0, 1e5, 1e9] {
            let mut params = Params::default();
            params.0.insert("rays".to_owned(), ParamValue::Number(rays));
            let mut log = BuildLog::default();
            crate::AccelKind::build(&Auto, &soup, &params, &mut log).unwrap();
            let label = &chosen(&log)[0];
            let totals = table.predict(&features(&soup)).into_iter().map(|p| {
                let ns_per_ray = p.ns.values().sum::<f64>() / p.ns.len() as f64;
                (p.choice.label(), p.build_ms + rays * ns_per_ray * 1e-6)
            });
            let least = totals.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            assert_eq!(*label, least.0, "{rays}: {least:?}");
        }
    }

    #[test]
    fn many_rays_do_not_build_faster_than_few() {
        let features = features(&lattice(2));
        let (table, _) = AdviceTable::built_in("").unwrap();
        let build = |rays| {
            let demand = Demand {
                rays,
                classes: Vec::new(),
            };
            table.advise(&features, &demand)[0].0.build_ms
        };
        assert!(build(1.0) <= build(1e5) && build(1e5) <= build(1e12));
    }

    #[test]
    fn a_tree_by_advice_is_that_of_the_builder_it_names() {
        let soup = lattice(2);
        let settings = TreeParameters {
            builder: Builder::Auto,
            ..TreeParameters::default()
        };
        let mut log = BuildLog::default();
        let resolved = with_builder(&settings, &soup, &mut log)
            .unwrap()
            .into_owned();
        assert_eq!(chosen(&log), [resolved.builder.name()]);
        let tree = crate::tree::Tree::build(&soup, &settings, &mut log).unwrap();
        let named = crate::tree::Tree::build(&soup, &resolved, &mut BuildLog::default()).unwrap();
        assert_eq!(tree.order, named.order);
    }

    #[test]
    fn every_choice_of_the_table_can_be_built() {
        let (table, _) = AdviceTable::built_in("").unwrap();
        for costs in &table.choices {
            let kind = AccelRegistry::default()
                .named("structure", &costs.choice.structure)
                .unwrap();
            if let Some(builder) = &costs.choice.builder {
                assert!(Builder::from_name(builder).is_some_and(|b| b != Builder::Auto));
                assert!(kind.parameters().iter().any(|p| p.name == "builder"));
            }
        }
    }

    #[test]
    fn coordinates_that_clustering_refuses_get_the_plain_builder_on_either_side_of_0() {
        let settings = TreeParameters {
            builder: Builder::Auto,
            ..TreeParameters::default()
        };
        for far in [2.0 * LARGEST_OF_PLOC, -2.0 * LARGEST_OF_PLOC] {
            let mut soup = lattice(2);
            soup.records[3].v0[1] = far;
            let mut log = BuildLog::default();
            let resolved = with_builder(&settings, &soup, &mut log).unwrap();
            assert_eq!(resolved.builder, TreeParameters::default().builder, "{far}");
        }
    }
}

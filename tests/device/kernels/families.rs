//! Choices of a kernel, and kernels that cover every pair of choices.

use super::covering::{Choice, pairwise};
use crate::support::{Pcg, build, inline_structures, param_variants, scenes};
use raystone::accel::{BoxTest, Intersection, RefillParameters, TriangleRegistry, Workgroup};
use raystone::gpu::Composition;
use raystone::integrator::{IntegratorRegistry, OffsetRegistry, SceneFeatures, with_sampler};
use raystone::params::{Entry, Variant};
use raystone::sampling::{Demand, SamplerRegistry};
use std::collections::{BTreeMap, BTreeSet};

/// The part of a kernel chosen for one purpose.
pub type Part = Composition;

fn part() -> Part {
    Composition::default()
}

/// Source text that depends on a part; constants only change numbers.
fn text_of(part: &Part) -> Part {
    Part {
        constants: BTreeMap::new(),
        ..part.clone()
    }
}

/// Choices for one purpose, by levels of equal text. Parts of a level alternate.
pub struct Factor {
    pub name: &'static str,
    pub levels: Vec<Vec<Part>>,
}

impl Factor {
    fn new(name: &'static str, parts: impl IntoIterator<Item = Part>) -> Self {
        let mut levels: BTreeMap<Part, Vec<Part>> = BTreeMap::new();
        for part in parts {
            let level = levels.entry(text_of(&part)).or_default();
            if !level.contains(&part) {
                level.push(part);
            }
        }
        let levels: Vec<Vec<Part>> = levels.into_values().collect();
        let choices: usize = levels.iter().map(Vec::len).sum();
        assert!(choices > 1, "{name}: nothing to choose");
        Self { name, levels }
    }

    /// A feature that is on or off.
    fn feature(name: &'static str) -> Self {
        Self::new(name, [part(), part().feature(name, true)])
    }

    fn entry(entries: &[&str]) -> Self {
        let parts = entries.iter().map(|entry| Part::new(entry));
        Self::new("entry", parts)
    }
}

/// A level of a factor, by its first part.
#[derive(Clone, Copy)]
struct Level<'a> {
    factor: &'a str,
    part: &'a Part,
}

impl Level<'_> {
    fn is_on(self, feature: &str) -> bool {
        self.factor == feature && self.part.features.contains(feature)
    }

    fn is_off(self, feature: &str) -> bool {
        self.factor == feature && !self.part.features.contains(feature)
    }
}

/// Kernels that cover every possible pair of choices.
pub struct Family {
    factors: Vec<Factor>,
    pub kernels: Vec<Composition>,
}

impl Family {
    /// `clash` is true for two levels, in both orders, that no experiment combines.
    fn new(base: &Part, factors: Vec<Factor>, clash: impl Fn(Level, Level) -> bool) -> Self {
        let levels: Vec<usize> = factors.iter().map(|f| f.levels.len()).collect();
        let level = |(factor, level): Choice| Level {
            factor: factors[factor].name,
            part: &factors[factor].levels[level][0],
        };
        let rows = pairwise(&levels, |a, b| {
            clash(level(a), level(b)) || clash(level(b), level(a))
        });
        let mut turns: Vec<Vec<usize>> = levels.iter().map(|count| vec![0; *count]).collect();
        let mut kernels = Vec::new();
        for row in &rows {
            let mut kernel = base.clone();
            for (factor, level) in row.iter().enumerate() {
                let parts = &factors[factor].levels[*level];
                let turn = &mut turns[factor][*level];
                lay(&parts[*turn % parts.len()], &mut kernel);
                *turn += 1;
            }
            kernels.push(kernel);
        }
        for (factor, turns) in factors.iter().zip(turns) {
            for (parts, turns) in factor.levels.iter().zip(turns) {
                let name = factor.name;
                assert!(turns >= parts.len(), "{name}: {turns} turns of {parts:?}");
            }
        }
        Self { factors, kernels }
    }

    /// The kernels that have both choices, and the others.
    pub fn divided(&self, a: Chosen, b: Chosen) -> [Vec<&Composition>; 2] {
        let has = |kernel: &Composition, chosen: Chosen| match chosen.choice {
            "on" => kernel.features.contains(chosen.factor),
            "off" => !kernel.features.contains(chosen.factor),
            module => (kernel.active.get(chosen.factor)).is_some_and(|m| m == module),
        };
        let kernels = self.kernels.iter();
        let (with, without): (Vec<_>, Vec<_>) =
            kernels.partition(|kernel| has(kernel, a) && has(kernel, b));
        [with, without]
    }

    /// The modules available for this role.
    pub fn modules(&self, role: &str) -> BTreeSet<&str> {
        let factor = self.factors.iter().find(|f| f.name == role);
        let levels = factor.map_or(&[][..], |f| &f.levels);
        let modules = levels.iter().filter_map(|parts| parts[0].active.get(role));
        modules.map(String::as_str).collect()
    }

    pub fn levels(&self) -> Vec<(&'static str, usize)> {
        let factors = self.factors.iter();
        factors.map(|f| (f.name, f.levels.len())).collect()
    }
}

/// A level of a factor: the module in its role, or `on` or `off` for a feature.
#[derive(Debug, Clone, Copy)]
pub struct Chosen {
    pub factor: &'static str,
    pub choice: &'static str,
}

fn lay(part: &Part, kernel: &mut Composition) {
    if !part.entry.is_empty() {
        kernel.entry.clone_from(&part.entry);
    }
    kernel.active.extend(part.active.clone());
    kernel.features.extend(part.features.clone());
    kernel.constants.extend(part.constants.clone());
}

/// Every registered structure with its parameters, and those whose rays can be refilled.
fn structures() -> (Factor, BTreeSet<Part>) {
    let soup = scenes::lattice_soup(&mut Pcg::new(1), 50, 5);
    let (mut parts, mut refilled) = (Vec::new(), BTreeSet::new());
    for kind in inline_structures() {
        for params in param_variants(&kind.parameters()) {
            let built = build(kind, &soup, &params);
            let part = built.buffers().activate(part());
            if built.refill() != RefillParameters::NONE {
                refilled.insert(text_of(&part));
            }
            parts.push(part);
        }
    }
    assert!(refilled.len() >= 3, "refilled: {refilled:?}");
    (Factor::new("accel", parts), refilled)
}

/// Triangle and box tests.
fn intersections() -> [Factor; 2] {
    let default = Intersection::default();
    let triangles = TriangleRegistry::default();
    let triangles = triangles.iter().map(|triangle| {
        let chosen = Intersection {
            triangle,
            ..default
        };
        part()
            .with("triangle", &chosen.activate(part()).active["triangle"])
            .feature("bare_triangles", !triangle.is_exact())
    });
    let boxes = BoxTest::ALL.map(|box_test| {
        let chosen = Intersection {
            box_test,
            ..default
        };
        Part {
            active: BTreeMap::new(),
            ..chosen.activate(part())
        }
    });
    [
        Factor::new("triangle", triangles),
        Factor::new("box_test", boxes),
    ]
}

fn workgroups() -> Factor {
    let named = Workgroup::ALL.iter().filter(|group| group.name != "auto");
    let parts = named.map(|group| {
        let (width, height) = group.name.split_once('x').unwrap_or((group.name, "1"));
        let edge = |text: &str| text.parse().expect("a number of invocations");
        part()
            .constant("GROUP_WIDTH", edge(width))
            .constant("GROUP_HEIGHT", edge(height))
    });
    Factor::new("workgroup", parts)
}

fn variants(entries: &[Entry]) -> Vec<Variant> {
    let mut out = Vec::new();
    for entry in entries {
        let params = param_variants(&entry.schema).into_iter();
        out.extend(params.map(|params| Variant {
            name: entry.name.clone(),
            label: entry.name.clone(),
            params,
        }));
    }
    out
}

/// Sequences and decorrelations, and the valid pairs.
fn samplers() -> ([Factor; 2], BTreeSet<[String; 2]>) {
    let registry = SamplerRegistry::default();
    let demand = Demand {
        samples: Some(16),
        dimensions: 1,
        width: Some(16),
    };
    let (mut sequences, mut decorrelations) = (Vec::new(), Vec::new());
    let mut pairs = BTreeSet::new();
    let seconds = variants(&registry.decorrelation_entries());
    for first in variants(&registry.sequence_entries()) {
        for second in &seconds {
            let Ok(sampler) = registry.sampler(&first, second, &demand) else {
                continue;
            };
            let whole = with_sampler(part(), &sampler);
            let half = |role: &str, seeding: &str, constants: Vec<(&'static str, u32)>| {
                let half = part().with(role, &whole.active[role]);
                let half = half.constant(seeding, whole.constants[seeding]);
                let constants = constants.into_iter();
                constants.fold(half, |half, (name, value)| half.constant(name, value))
            };
            let constants = sampler.sequence.constants();
            sequences.push(half("sequence", "SEQUENCE_SEEDING", constants));
            let constants = sampler.decorrelation.constants();
            decorrelations.push(half("decorrelation", "DECORRELATION_SEEDING", constants));
            pairs.insert(sampler.kernels());
        }
    }
    let factors = [
        Factor::new("sequence", sequences),
        Factor::new("decorrelation", decorrelations),
    ];
    (factors, pairs)
}

fn offsets() -> Factor {
    let offsets = OffsetRegistry::default();
    Factor::new("offset", offsets.iter().map(|o| o.activate(part())))
}

/// Integrators with their parameters, and those that can be split.
fn integrators() -> (Factor, BTreeSet<Part>) {
    let (mut parts, mut staged) = (Vec::new(), BTreeSet::new());
    for kind in IntegratorRegistry::default().iter() {
        for params in param_variants(&kind.parameters()) {
            let mut part = part().with("integrator", kind.kernel());
            for (name, value) in kind.constants(&params) {
                part = part.constant(name, value);
            }
            for (name, on) in kind.features(&params) {
                part = part.feature(name, on);
            }
            let facts = kind.facts(&params);
            if facts.has_stages && !facts.is_rasterised {
                staged.insert(text_of(&part));
            }
            parts.push(part);
        }
    }
    (Factor::new("integrator", parts), staged)
}

/// Flags of scenes and their carriers, and the flag of the counting run.
fn flags(more: &[&'static str]) -> Vec<Factor> {
    let of_scenes = SceneFeatures::default().flags();
    let of_scenes = of_scenes.into_iter().map(|(name, _)| name);
    let names = of_scenes.chain(["carried", "ray_counts", "loops_cut"]);
    let names = names.chain(more.iter().copied());
    names.map(Factor::feature).collect()
}

/// Kernels that answer ray buffers.
pub fn batches() -> Family {
    let (accel, refilled) = structures();
    let mut factors = vec![accel, workgroups()];
    factors.extend(intersections());
    let features = [
        "any",
        "counters",
        "refill",
        "counted",
        "alpha_masks",
        "blended",
        "texels",
        "sampled_texels",
        "loops_cut",
    ];
    factors.extend(features.map(Factor::feature));
    let clash = |a: Level, b: Level| {
        a.is_on("refill") && b.factor == "accel" && !refilled.contains(&text_of(b.part))
    };
    Family::new(&Part::new("integrator/trace_rays"), factors, clash)
}

/// True if two levels do not form a valid sampler.
fn are_no_sampler(a: Level, b: Level, pairs: &BTreeSet<[String; 2]>) -> bool {
    let halves = (
        a.part.active.get("sequence"),
        b.part.active.get("decorrelation"),
    );
    match halves {
        (Some(first), Some(second)) => !pairs.contains(&[first.clone(), second.clone()]),
        _ => false,
    }
}

/// True if one has spherical lights, and the other no lights.
fn are_no_lights(a: Level, b: Level) -> bool {
    a.is_on("sphere_lights") && b.is_off("lights")
}

/// Kernels that render in one pass.
pub fn renderers() -> Family {
    const REGENERATION: &str = "organisation/regeneration";
    let (accel, _) = structures();
    let (integrator, staged) = integrators();
    let (samplers, pairs) = samplers();
    let entries = ["integrator/render", "integrator/render_part", REGENERATION];
    let mut factors = vec![accel, integrator];
    factors.extend(samplers);
    factors.extend([offsets(), workgroups(), Factor::entry(&entries)]);
    factors.extend(intersections());
    factors.extend(flags(&[
        "alpha_masks",
        "blended",
        "block_list",
        "texels",
        "sampled_texels",
    ]));
    let clash = |a: Level, b: Level| {
        let is_whole = b.factor == "integrator" && !staged.contains(&text_of(b.part));
        (a.part.entry == REGENERATION && is_whole)
            || are_no_sampler(a, b, &pairs)
            || are_no_lights(a, b)
    };
    Family::new(&part(), factors, clash)
}

/// Kernels that render in several passes with queues.
pub fn queued() -> Family {
    /// Run with and without queue compaction; then those run only with it.
    const ALWAYS: [&str; 5] = ["accumulate", "extend", "finish", "generate", "shade"];
    const COMPACTED: [&str; 6] = [
        "kinds",
        "material_keys",
        "plan",
        "plan_kind",
        "ray_keys",
        "take_order",
    ];
    const OF_QUEUES: [&str; 4] = ["regenerated", "by_kind", "sorted_hits", "nothing_met"];
    let (mut integrator, staged) = integrators();
    // Connections send several shadow rays from one point, and are refused.
    integrator.levels.retain(|parts| {
        let connects = parts[0].features.contains("mirror_connections");
        !connects && staged.contains(&text_of(&parts[0]))
    });
    let (samplers, pairs) = samplers();
    let module = |name: &&str| format!("organisation/{name}");
    let compacted: BTreeSet<String> = COMPACTED.iter().map(module).collect();
    let entries: Vec<String> = ALWAYS.iter().map(module).chain(compacted.clone()).collect();
    let entries: Vec<&str> = entries.iter().map(String::as_str).collect();
    let mut factors = vec![integrator, Factor::entry(&entries)];
    factors.extend(samplers);
    factors.extend([offsets(), workgroups()]);
    factors.extend(flags(&["texels", "sampled_texels", "compacted"]));
    factors.extend(OF_QUEUES.map(Factor::feature));
    let clash = |a: Level, b: Level| {
        let needs_queue = compacted.contains(&b.part.entry) || OF_QUEUES.iter().any(|f| b.is_on(f));
        (a.is_off("compacted") && needs_queue)
            || (a.is_off("by_kind") && b.is_on("nothing_met"))
            || are_no_sampler(a, b, &pairs)
            || are_no_lights(a, b)
    };
    let base = part().feature("queued", true).constant("QUEUE", 1);
    Family::new(&base, factors, clash)
}

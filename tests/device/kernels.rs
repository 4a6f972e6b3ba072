//! Every kernel that an experiment can ask for composes and validates, stays within WebGPU's
//! default limits, carries no counters unless asked, and has structs laid out like Rust's. No
//! adapter is needed.

use crate::support::{Pcg, build, default_params, param_variants, scenes};
use rayon::prelude::*;
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{AccelRegistry, Counters, Hit, Ray};
use raystone::gpu::{Composition, KernelLibrary};
use raystone::integrator::{IntegratorRegistry, SceneFeatures, with_sampler};
use raystone::params::{Entry, Variant};
use raystone::sampling::{Demand, Sampler, SamplerRegistry};
use std::mem::{offset_of, size_of};

/// Names of the scene's feature flags, and the flag of the counting run.
fn render_features() -> Vec<&'static str> {
    let mut names: Vec<_> = SceneFeatures::default()
        .flags()
        .into_iter()
        .map(|(n, _)| n)
        .collect();
    names.extend(["carried", "ray_counts"]);
    names
}

/// Every registered structure with its parameters, as the active one of `kernel`.
fn with_structures(kernel: &Composition) -> Vec<Composition> {
    let soup = scenes::lattice_soup(&mut Pcg::new(1), 50, 5);
    let mut out = Vec::new();
    for kind in AccelRegistry::default().iter() {
        for params in param_variants(&kind.parameters()) {
            let built = build(kind, &soup, &params);
            out.push(built.buffers().activate(kernel.clone()));
        }
    }
    out
}

/// Every sequence and every decorrelation with every parameter, each with one partner.
fn samplers() -> Vec<Sampler> {
    let registry = SamplerRegistry::default();
    let demand = Demand {
        samples: Some(16),
        dimensions: 1,
        width: Some(16),
    };
    let variants = |entry: &Entry| -> Vec<Variant> {
        let variant = |params| Variant {
            name: entry.name.clone(),
            label: entry.name.clone(),
            params,
        };
        let params = param_variants(&entry.schema).into_iter();
        params.map(variant).collect()
    };
    let sequences: Vec<_> = registry
        .sequence_entries()
        .iter()
        .flat_map(variants)
        .collect();
    let decorrelations = registry.decorrelation_entries();
    let decorrelations: Vec<_> = decorrelations.iter().flat_map(variants).collect();
    let none = decorrelations
        .iter()
        .find(|d| d.name == "none")
        .expect("none");
    let sobol = sequences.iter().find(|s| s.name == "sobol").expect("sobol");
    let pairs = sequences.iter().map(|s| (s, none));
    let pairs = pairs.chain(decorrelations.iter().map(|d| (sobol, d)));
    let sampler = |(s, d)| {
        registry
            .sampler(s, d, &demand)
            .unwrap_or_else(|e| panic!("{e}"))
    };
    pairs.map(sampler).collect()
}

/// Every sampler as that of `kernel`.
fn with_samplers(kernel: &Composition) -> Vec<Composition> {
    let samplers = samplers();
    let with = |sampler| with_sampler(kernel.clone(), sampler);
    samplers.iter().map(with).collect()
}

/// Every integrator with every structure, and with every sampler. The two are independent imports:
/// their full product would only repeat itself.
fn renderers() -> Vec<Composition> {
    let mut out = Vec::new();
    for integrator in IntegratorRegistry::default().iter() {
        let kernel = Composition::new("integrator/render").with("integrator", integrator.kernel());
        let constants = integrator.constants(&default_params(&integrator.parameters()));
        let kernel = constants.iter().fold(kernel, |k, (n, v)| k.constant(n, *v));
        let one_structure = &with_structures(&kernel)[0];
        let one_sampler = &with_samplers(&kernel)[0];
        out.extend(with_samplers(one_structure));
        out.extend(with_structures(one_sampler));
    }
    let mut seen = std::collections::BTreeSet::new();
    out.retain(|kernel| seen.insert(format!("{kernel:?}")));
    assert!(out.len() >= 3 * (3 + 4 * 2), "only {} renderers", out.len());
    out
}

/// `kernel` refilled, if its structure exports what that takes.
fn refilled(kernel: &Composition) -> Option<Composition> {
    let takes_it = ["accel/bvh4", "accel/cwbvh"].contains(&&*kernel.active["accel"]);
    takes_it.then(|| kernel.clone().feature("refill", true))
}

/// The batch kernels of every structure: closest and any hit, counting or not, refilled or not.
fn batches() -> Vec<Composition> {
    let feature_sets: [&[&str]; 4] = [&[], &["any"], &["counters"], &["any", "counters"]];
    let batch = |features: &[&str]| {
        let kernel = Composition::new("integrator/trace_rays");
        features
            .iter()
            .fold(kernel, |k, name| k.feature(name, true))
    };
    let mut out: Vec<_> = feature_sets
        .iter()
        .flat_map(|features| with_structures(&batch(features)))
        .collect();
    let more: Vec<_> = out.iter().filter_map(refilled).collect();
    assert!(more.len() >= 8, "only {} refilled kernels", more.len());
    out.extend(more);
    let mut seen = std::collections::BTreeSet::new();
    out.retain(|kernel| seen.insert(format!("{kernel:?}")));
    out
}

fn with_features(mut kernel: Composition, names: &[&str], mask: usize) -> Composition {
    for (bit, name) in names.iter().enumerate() {
        kernel = kernel.feature(name, mask >> bit & 1 == 1);
    }
    kernel
}

/// Why the kernel breaks WebGPU's default limits, if it does.
fn broken_limit(wgsl: &str) -> Option<String> {
    let count = |what: &str| wgsl.matches(what).count();
    let storage = count("var<storage");
    if storage > 8 {
        return Some(format!("{storage} storage buffers"));
    }
    let group = |rest: &str| -> u32 {
        let digits = rest.split(')').next().unwrap_or("");
        digits.parse().expect("a group number")
    };
    if let Some(high) = wgsl
        .split("@group(")
        .skip(1)
        .map(group)
        .find(|group| *group >= 4)
    {
        return Some(format!("bind group {high}"));
    }
    let module = naga::front::wgsl::parse_str(wgsl).expect("a kernel");
    let invocations: u32 = module.entry_points[0].workgroup_size.iter().product();
    (invocations > 256).then(|| format!("{invocations} invocations"))
}

fn compose_within_limits(library: &KernelLibrary, kernel: &Composition) -> String {
    let composed = library.compose(kernel);
    let wgsl = composed.unwrap_or_else(|e| panic!("{kernel:?}: {e}")).wgsl;
    assert_eq!(broken_limit(&wgsl), None, "{kernel:?}");
    wgsl
}

/// Which of so many features are on: none, all, each alone, all but each, and some at random, others for each kernel.
fn masks(features: usize, kernel: usize) -> Vec<usize> {
    let all = (1 << features) - 1;
    let mut random = Pcg::new(kernel as u64 + 1);
    let mut random = || random.next_u32() as usize & all;
    let mut masks = vec![0, all];
    masks.extend((0..features).flat_map(|bit| [1 << bit, all & !(1 << bit)]));
    masks.extend((0..8).map(|_| random()));
    masks
}

#[test]
fn every_combination_composes_validates_and_stays_within_the_limits() {
    let library = KernelLibrary::default();
    let names = render_features();
    let all = (1 << names.len()) - 1;
    // Features against integrators and structures; samplers with no feature and with all.
    let kernels: Vec<Composition> = renderers()
        .into_iter()
        .enumerate()
        .flat_map(|(index, kernel)| {
            let is_plain = kernel.active["sequence"] == "sampling/sobol"
                && kernel.active["decorrelation"] == "sampling/cranley_patterson";
            let masks: Vec<usize> = if is_plain {
                masks(names.len(), index)
            } else {
                vec![0, all, index % (all + 1)]
            };
            let names = names.clone();
            masks
                .into_iter()
                .map(move |mask| with_features(kernel.clone(), &names, mask))
        })
        .chain(batches())
        .collect();
    assert!(kernels.len() > 150, "only {} kernels", kernels.len());
    kernels.par_iter().for_each(|kernel| {
        compose_within_limits(&library, kernel);
    });
}

#[test]
fn a_kernel_over_a_limit_is_seen() {
    let buffer = |n| format!("@group(0) @binding({n}) var<storage, read> a{n}: array<u32>;\n");
    let buffers = |n: usize| (0..n).map(buffer).collect::<String>();
    let entry = |size: &str| format!("@compute @workgroup_size({size}) fn main() {{}}");
    assert_eq!(broken_limit(&(buffers(8) + &entry("16, 16"))), None);
    assert!(broken_limit(&(buffers(9) + &entry("64"))).is_some());
    assert!(broken_limit(&entry("16, 17")).is_some());
    let far = "@group(4) @binding(0) var<uniform> a: vec4<u32>;\n";
    assert!(broken_limit(&(far.to_owned() + &entry("64"))).is_some());
}

#[test]
fn timed_kernels_carry_no_counters() {
    let library = KernelLibrary::default();
    let counts = |wgsl: &str| {
        wgsl.contains("count_") || wgsl.contains("counters") || wgsl.contains("ray_counts")
    };
    let mut counting = 0;
    for kernel in batches() {
        let wgsl = compose_within_limits(&library, &kernel);
        let asked = kernel.features.contains("counters");
        assert_eq!(counts(&wgsl), asked, "{kernel:?}");
        counting += usize::from(asked);
    }
    assert!(counting > 0);
    let names = render_features();
    let all = (1 << names.len()) - 1;
    let without_counts = all
        & !(1
            << names
                .iter()
                .position(|n| *n == "ray_counts")
                .expect("a flag"));
    for kernel in renderers().into_iter().step_by(7) {
        let timed = with_features(kernel.clone(), &names, without_counts);
        assert!(
            !counts(&compose_within_limits(&library, &timed)),
            "{timed:?}"
        );
        let counted = with_features(kernel, &names, all);
        assert!(
            counts(&compose_within_limits(&library, &counted)),
            "{counted:?}"
        );
    }
}

/// Span and member offsets of a struct of the composed kernel, by the author's name.
fn layout(module: &naga::Module, name: &str) -> (u32, Vec<(String, u32)>) {
    let found = module.types.iter().find_map(|(_, ty)| {
        let full = ty.name.as_deref()?;
        let is_it = full == name || full.ends_with(&format!("_{name}"));
        match &ty.inner {
            naga::TypeInner::Struct { members, span } if is_it => Some((members, *span)),
            _ => None,
        }
    });
    let (members, span) = found.unwrap_or_else(|| panic!("no struct {name} in the kernel"));
    let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset);
    (span, members.iter().map(member).collect())
}

fn offsets(members: &[(&str, usize)]) -> Vec<(String, u32)> {
    let member = |(name, offset): &(&str, usize)| ((*name).to_owned(), *offset as u32);
    members.iter().map(member).collect()
}

#[test]
fn structs_of_kernels_are_laid_out_like_those_of_rust() {
    let library = KernelLibrary::default();
    let kernel = Composition::new("integrator/trace_rays")
        .with("accel", "accel/brute_force")
        .feature("counters", true);
    let wgsl = compose_within_limits(&library, &kernel);
    let module = naga::front::wgsl::parse_str(&wgsl).expect("validated before");

    let ray = offsets(&[
        ("origin", offset_of!(Ray, origin)),
        ("t_min", offset_of!(Ray, t_min)),
        ("direction", offset_of!(Ray, direction)),
        ("t_max", offset_of!(Ray, t_max)),
    ]);
    assert_eq!(layout(&module, "Ray"), (size_of::<Ray>() as u32, ray));
    let hit = offsets(&[
        ("t", offset_of!(Hit, t)),
        ("triangle", offset_of!(Hit, triangle)),
        ("u", offset_of!(Hit, u)),
        ("v", offset_of!(Hit, v)),
    ]);
    assert_eq!(layout(&module, "Hit"), (size_of::<Hit>() as u32, hit));
    let record = offsets(&[
        ("v0", offset_of!(TriangleRecord, v0)),
        ("v1", offset_of!(TriangleRecord, v1)),
        ("v2", offset_of!(TriangleRecord, v2)),
    ]);
    let record_size = size_of::<TriangleRecord>() as u32;
    assert_eq!(layout(&module, "TriangleRecord"), (record_size, record));
    // Rust may order the fields of Counters as it likes: names and number are what counts.
    let (span, members) = layout(&module, "Counters");
    assert_eq!(span as usize, size_of::<Counters>());
    let Counters {
        nodes: _,
        box_tests: _,
        triangle_tests: _,
        stack_high_water: _,
    } = Counters::default();
    let names: Vec<_> = members.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        ["nodes", "box_tests", "triangle_tests", "stack_high_water"]
    );
}

#[test]
fn arrays_read_as_textures_have_rows_of_one_length_on_both_sides() {
    let library = KernelLibrary::default();
    let text = library.text("common/texels").expect("an embedded kernel");
    let module = naga::front::wgsl::parse_str(text).expect("a kernel without imports");
    let value = |name: &str| {
        let found = module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref() == Some(name));
        let (_, constant) = found.unwrap_or_else(|| panic!("no constant {name}"));
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(x)) => x,
            ref other => panic!("{name} is {other:?}"),
        }
    };
    assert_eq!(1 << value("ROW_SHIFT"), raystone::gpu::TEXELS_PER_ROW);
    assert_eq!(value("ROW_MASK"), raystone::gpu::TEXELS_PER_ROW - 1);
}

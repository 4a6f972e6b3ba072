//! Every kernel that an experiment can request composes and validates, stays within WebGPU's
//! default limits, contains counters only on request, and has Rust's struct layout. No adapter.

mod covering;
mod families;
mod translators;

use crate::support::in_turn;
use covering::{Choice, pairs, pairwise};
use families::{Chosen, Family, batches, queued, renderers};
use rayon::prelude::*;
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{Counters, Hit, Ray};
use raystone::gpu::{Composition, KernelLibrary};
use std::collections::BTreeSet;
use std::mem::{offset_of, size_of};
use std::sync::LazyLock;

/// Kernels that answer rays, render in one kernel, and render with queues.
static FAMILIES: LazyLock<[Family; 3]> = LazyLock::new(|| [batches(), renderers(), queued()]);

/// Storage buffers that WebGPU promises.
const BUFFERS: usize = 8;

/// The WebGPU default limit exceeded by the kernel, if any.
fn broken_limit(wgsl: &str) -> Option<String> {
    let count = |what: &str| wgsl.matches(what).count();
    let storage = count("var<storage");
    if storage > BUFFERS {
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

fn counts(wgsl: &str) -> bool {
    ["count_", "counters", "ray_counts"]
        .iter()
        .any(|word| wgsl.contains(word))
}

/// The fault of a kernel: it does not compose, exceeds a limit, or counts without request.
/// `must_count` says if it has to count on request.
fn fault(library: &KernelLibrary, kernel: &Composition, must_count: bool) -> Option<String> {
    let wgsl = match library.compose(kernel) {
        Ok(composed) => composed.wgsl,
        Err(error) => return Some(error.to_string()),
    };
    let asked = ["counters", "ray_counts"]
        .iter()
        .any(|f| kernel.features.contains(*f));
    match (broken_limit(&wgsl), counts(&wgsl)) {
        (Some(limit), _) => Some(limit),
        (None, true) if !asked => Some("counters that nobody asked for".to_owned()),
        (None, false) if asked && must_count => Some("no counters".to_owned()),
        _ => None,
    }
}

/// Composes all kernels of a family, of which there are at least `least`.
fn see_that_all_are_sound(family: &Family, least: usize, must_count: impl Fn(&str) -> bool + Sync) {
    let (library, kernels) = (KernelLibrary::default(), &family.kernels);
    println!("{} kernels: {:?}", kernels.len(), family.levels());
    assert!(kernels.len() >= least, "only {} kernels", kernels.len());
    let judged = kernels.par_iter().filter_map(|kernel| {
        let fault = fault(&library, kernel, must_count(&kernel.entry))?;
        Some(format!("{kernel:?}: {fault}"))
    });
    let faults: Vec<String> = judged.collect();
    let first = &faults[..faults.len().min(3)];
    assert!(
        faults.is_empty(),
        "{} of {} kernels: {first:#?}",
        faults.len(),
        kernels.len()
    );
}

#[test]
fn kernels_that_answer_rays_compose_stay_within_the_limits_and_count_only_when_asked() {
    see_that_all_are_sound(&FAMILIES[0], 100, |_| true);
}

#[test]
fn kernels_that_make_images_compose_stay_within_the_limits_and_count_only_when_asked() {
    see_that_all_are_sound(&FAMILIES[1], 150, |_| true);
}

#[test]
fn kernels_with_queues_between_them_compose_stay_within_the_limits_and_count_only_when_asked() {
    see_that_all_are_sound(&FAMILIES[2], 50, |_| false);
}

#[test]
fn other_translators_take_every_kernel() {
    let (library, tint) = (KernelLibrary::default(), translators::tint());
    let kernels = FAMILIES.iter().flat_map(|family| &family.kernels);
    let kernels = in_turn("kernels through other translators", kernels);
    let faults = kernels.par_iter().filter_map(|kernel| {
        let composed = library.compose(kernel);
        let wgsl = composed.unwrap_or_else(|e| panic!("{kernel:?}: {e}")).wgsl;
        let by_tint = tint.and_then(|tint| translators::tint_fault(tint, &wgsl));
        let fault = by_tint.or_else(|| translators::naga_fault(&wgsl))?;
        Some(format!("{kernel:?}: {fault}"))
    });
    let faults: Vec<String> = faults.collect();
    let first = &faults[..faults.len().min(3)];
    assert!(
        faults.is_empty(),
        "{} of {}: {first:#?}",
        faults.len(),
        kernels.len()
    );
    // Faults that each of them must refuse.
    let broken = "@compute @workgroup_size(1) fn main() { let x: u32 = 1.0; }";
    assert!(tint.is_none_or(|tint| translators::tint_fault(tint, broken).is_some()));
}

#[test]
fn any_two_choices_meet_in_a_row_unless_they_clash() {
    let clash = |a: Choice, b: Choice| a == (0, 6) && b.0 == 3 && b.1 > 0;
    let levels = [7, 2, 5, 4, 2, 2, 2, 3, 1];
    let rows = pairwise(&levels, |a, b| clash(a, b) || clash(b, a));
    let mut met = BTreeSet::new();
    for row in &rows {
        assert!(row.iter().zip(levels).all(|(level, count)| *level < count));
        let choices: Vec<Choice> = row.iter().copied().enumerate().collect();
        for (index, a) in choices.iter().enumerate() {
            met.extend(choices[index + 1..].iter().map(|b| (*a, *b)));
        }
    }
    assert_eq!(met, pairs(&levels, clash));
    assert!(!met.contains(&((0, 6), (3, 1))) && met.contains(&((0, 6), (3, 0))));
    // Fewer are impossible, and few more are needed.
    assert!((35..50).contains(&rows.len()), "{} rows", rows.len());
}

/// A fault that shows only in kernels with both choices.
struct Planted<'a> {
    family: &'a Family,
    /// A module, and the text in one of its functions after which the fault is inserted.
    at: (&'static str, &'static str),
    fault: &'static str,
    both: [Chosen; 2],
}

impl Planted<'_> {
    /// The kernels with the fault. A fault that uses `PLANTED` of the module in a role only shows
    /// with the second choice: all other modules define it.
    fn library(&self) -> KernelLibrary {
        let library = KernelLibrary::default();
        let (module, line) = self.at;
        let text = library.text(module).expect("a known module");
        assert_eq!(text.matches(line).count(), 1, "`{line}` in {module}");
        let faulty = text.replace(line, &format!("{line} {}", self.fault));
        let mut sources = vec![(module.to_owned(), faulty)];
        let second = self.both[1];
        if self.fault.contains("PLANTED") {
            let others = self.family.modules(second.factor).into_iter();
            sources.extend(others.filter(|m| *m != second.choice).map(|module| {
                let text = library.text(module).expect("a known module");
                (
                    module.to_owned(),
                    format!("{text}\nconst PLANTED: u32 = 0u;\n"),
                )
            }));
        }
        let sources: Vec<_> = sources
            .iter()
            .map(|(m, t)| (m.as_str(), t.as_str()))
            .collect();
        library.with_sources(&sources)
    }

    /// True if some kernel with both choices fails, and none of some others does.
    fn is_seen(&self) -> bool {
        let library = self.library();
        let [a, b] = self.both;
        let [with, without] = self.family.divided(a, b);
        let fault = |kernel: &&Composition| library.compose(kernel).err();
        let mut others = without.iter().step_by(1 + without.len() / 20);
        let other = others.find_map(|kernel| Some((kernel, fault(kernel)?.to_string())));
        assert_eq!(other, None, "{a:?} × {b:?}: another one fails, too");
        with.par_iter().any(|kernel| fault(kernel).is_some())
    }
}

#[test]
fn a_fault_that_shows_where_two_choices_meet_is_seen() {
    const DRAW: (&str, &str) = ("sampling/sampler", "fn to_unit(x: u32) -> f32 {");
    const HALTON: (&str, &str) = ("sampling/halton", "fn sequence(s: SamplerState) -> u32 {");
    const KD_TREE: (&str, &str) = ("accel/kd_tree", "fn trace(ray: Ray, any: bool) -> Hit {");
    let [batches, renderers, queued] = &*FAMILIES;
    let chosen = |factor, choice| Chosen { factor, choice };
    let cases = [
        (
            renderers,
            DRAW,
            "@if(phong && many_lights) let planted: u32 = 1.0;",
            [("phong", "on"), ("many_lights", "on")],
        ),
        (
            renderers,
            DRAW,
            "@if(!textures && normal_maps) let planted: u32 = 1.0;",
            [("textures", "off"), ("normal_maps", "on")],
        ),
        (
            renderers,
            KD_TREE,
            "@if(vertex_colors) let planted: u32 = 1.0;",
            [("accel", "accel/kd_tree"), ("vertex_colors", "on")],
        ),
        (
            renderers,
            KD_TREE,
            "let planted = package::active::integrator::PLANTED;",
            [("accel", "accel/kd_tree"), ("integrator", "integrator/ao")],
        ),
        (
            renderers,
            KD_TREE,
            "let planted = package::active::sequence::PLANTED;",
            [("accel", "accel/kd_tree"), ("sequence", "sampling/halton")],
        ),
        (
            renderers,
            HALTON,
            "let planted = package::active::offset::PLANTED;",
            [
                ("sequence", "sampling/halton"),
                ("offset", "integrator/offset/fixed"),
            ],
        ),
        (
            batches,
            KD_TREE,
            "let planted = package::active::triangle::PLANTED;",
            [
                ("accel", "accel/kd_tree"),
                ("triangle", "accel/triangle/pluecker"),
            ],
        ),
        (
            batches,
            KD_TREE,
            "@if(alpha_masks) let planted: u32 = 1.0;",
            [("accel", "accel/kd_tree"), ("alpha_masks", "on")],
        ),
        (
            queued,
            HALTON,
            "@if(!sorted_hits) let planted: u32 = 1.0;",
            [("sequence", "sampling/halton"), ("sorted_hits", "off")],
        ),
    ];
    for (family, at, fault, both) in cases {
        let both = both.map(|(factor, choice)| chosen(factor, choice));
        let planted = Planted {
            family,
            at,
            fault,
            both,
        };
        assert!(planted.is_seen(), "{both:?} is not seen");
    }
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
    // Rust may reorder the fields of Counters: only names and number matter.
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
    let reading = Composition::new("common/load_probe").feature("texels", true);
    let wgsl = compose_within_limits(&library, &reading);
    let module = naga::front::wgsl::parse_str(&wgsl).expect("validated before");
    let value = |name: &str| {
        let found = module
            .constants
            .iter()
            .find(|(_, c)| c.name.as_deref().is_some_and(|full| full.ends_with(name)));
        let (_, constant) = found.unwrap_or_else(|| panic!("no constant {name}"));
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(x)) => x,
            ref other => panic!("{name} is {other:?}"),
        }
    };
    assert_eq!(1 << value("ROW_SHIFT"), raystone::gpu::TEXELS_PER_ROW);
    assert_eq!(value("ROW_MASK"), raystone::gpu::TEXELS_PER_ROW - 1);
}

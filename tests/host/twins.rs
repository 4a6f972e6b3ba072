//! Kernels and their Rust twins: same file stem in mirrored folders, same function names, same
//! constants. Exceptions are listed here with the reason.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Kernel file → Rust file, if the stem differs.
const OTHER_FILE: &[(&str, &str)] = &[
    ("accel/grid", "src/accel/grid/mod.rs"),
    ("accel/query", "src/accel/twin.rs"),
    ("accel/triangle", "src/accel/triangle/mod.rs"),
    ("integrator/position_error", "src/render/offset/mod.rs"),
    ("accel/instance", "src/accel/instancing/instance.rs"),
    ("accel/irregular_grid", "src/accel/irregular_grid/mod.rs"),
    ("accel/meta_bvh", "src/accel/instancing/meta_bvh.rs"),
    (
        "accel/meta_bvh_nested",
        "src/accel/instancing/meta_bvh_nested.rs",
    ),
    ("accel/object_list", "src/accel/instancing/object_list.rs"),
    ("accel/bvh4", "src/accel/wide/bvh4.rs"),
    ("accel/cwbvh", "src/accel/wide/cwbvh.rs"),
    ("accel/wide", "src/accel/wide/quantise.rs"),
    ("accel/kd_tree", "src/accel/kd_tree/mod.rs"),
    ("shading/light/units", "src/render/units.rs"),
    ("accel/octree", "src/accel/octree/mod.rs"),
    ("sampling/sampler", "src/sampling/lib.rs"),
];

/// Kernel files and folders without a twin, with the reason.
const NO_TWIN: &[(&str, &str)] = &[
    (
        "integrator/connection",
        "checked path by path by the oracle in f64 (src/verify/path_oracle/connection.rs), and in src/verify/connection_tests.rs by closed forms",
    ),
    (
        "integrator/coloured_medium",
        "judged path by path by the oracle in f64 (src/verify/path_oracle/coloured.rs), and in src/verify/media_colour_tests.rs by closed forms and quadratures",
    ),
    (
        "integrator/several_media",
        "judged path by path by the oracle in f64 (src/verify/path_oracle/media.rs), and in src/verify/several_media_tests.rs by closed forms, quadratures and one medium",
    ),
    (
        "integrator/medium",
        "judged path by path by the oracle in f64 (src/verify/path_oracle/medium.rs), and in src/verify/media_tests.rs by closed forms and quadratures",
    ),
    (
        "cones/overlaps",
        "a loop over disk_triangle, whose twin its answers are compared with",
    ),
    (
        "organisation/",
        "stages that hand paths on; tests/device/organisations.rs holds their images to that of one kernel",
    ),
    (
        "accel/divide_and_conquer/",
        "passes, and rows of their buffers; tests/hits/divide_and_conquer compares hits, and problems and pairs level by level",
    ),
    (
        "accel/found",
        "a word a ray that many invocations offer to; twins offer to the hit of a walk",
    ),
    (
        "accel/ray_hierarchy/passes/",
        "passes; tests/hits/ray_hierarchy compares hits, and pairs level by level",
    ),
    (
        "accel/ray_hierarchy/tree",
        "bindings, and a walk through them; src/accel/ray_hierarchy/anatomy.rs counts the same pairs",
    ),
    (
        "common/counters",
        "fields of Counters; the tests of structures compare counted work per ray",
    ),
    (
        "accel/nodes",
        "a binding; the twin's layouts own their nodes",
    ),
    ("accel/stack", "the twins have vectors"),
    (
        "accel/wide/device/",
        "passes; tests/device/device_builders compares wide trees",
    ),
    (
        "accel/tree/parallel/device/blocks",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/boxes",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/codes",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/inner",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/keys",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/leaves",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/links",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/nodes",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/advance",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/joins",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/merge",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/nearest",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/pairs",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/state",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/sorted",
        "a pass; tests/device/device_builders compares trees",
    ),
    (
        "accel/tree/parallel/device/size",
        "a pass; tests/device/device_builders compares trees",
    ),
    ("common/lane", "an invocation's place in its workgroup"),
    (
        "common/numbers",
        "tests/device/portability.rs compares it with the host",
    ),
    (
        "common/texels",
        "arrays as textures; tests/device/kernels.rs compares the length of a row",
    ),
    ("common/errors", "writes the error word on the device"),
    ("common/limits", "a uniform, filled by name"),
    (
        "common/load_probe",
        "takes time on the device, which src/gpu/load_probe.rs measures",
    ),
    ("common/sort/digits", "what the passes of the sort share"),
    (
        "common/sort/count",
        "a pass of the sort; tests/device/sorting.rs has the host's",
    ),
    (
        "common/sort/offsets",
        "a pass of the sort; tests/device/sorting.rs has the host's",
    ),
    (
        "common/sort/scatter",
        "a pass of the sort; tests/device/sorting.rs has the host's",
    ),
    (
        "common/loops",
        "run by src/gpu/probe.rs, which knows the answer",
    ),
    ("common/probe", "compared with the host in src/gpu/probe.rs"),
    (
        "integrator/known_offsets",
        "a call of two functions that have twins, compared with them in src/render/offset/known.rs",
    ),
    (
        "common/ray_counts",
        "counts on the device, read by the renderer",
    ),
    (
        "common/scan",
        "sums over a workgroup; tests/device/compaction compares them with the host's",
    ),
    ("common/scene", "a binding"),
    (
        "compaction/add_totals",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/atomic",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/blelloch",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/digest",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/keys",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/follow",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/dispatch",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/gather",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/groups",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/hillis_steele",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/holes",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/none",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/reduce",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/roger_blocks",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/roger_move",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/scan_blocks",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/scatter",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/stream",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/subgroup",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/tile",
        "judged by tests/device/compaction, against what flags say",
    ),
    (
        "compaction/workgroup",
        "judged by tests/device/compaction, against what flags say",
    ),
    ("integrator/ao", "judged by images, not by a twin"),
    (
        "integrator/bounces",
        "counts; tests/device/viewer.rs compares them with the path oracle",
    ),
    ("integrator/frame", "judged by images, not by a twin"),
    ("integrator/path", "judged by images, not by a twin"),
    ("integrator/primary", "judged by images, not by a twin"),
    ("integrator/render", "the loop over samples"),
    ("integrator/render_part", "the loop over samples"),
    ("integrator/trace_rays", "the loop over rays"),
    (
        "integrator/visibility",
        "drawn by the rasteriser; tests/images/primary_visibility.rs compares it with rays",
    ),
    (
        "integrator/visible",
        "reads what was drawn; tests/images/primary_visibility.rs compares it with rays",
    ),
    (
        "media/adaptive/",
        "judged in f64 by every run of media:pipeline (src/media/measure/pipeline/checks.rs), whose faults src/media/tests/pipeline_faults.rs plants",
    ),
    (
        "media/curved/",
        "judged in f64 by every run of media:pipeline (src/media/pipeline/ways.rs), whose faults src/media/tests/pipeline_faults.rs plants",
    ),
    (
        "media/voxels/",
        "judged by winding numbers in f64 in src/media/tests/voxels.rs",
    ),
    (
        "media/scatter/",
        "judged by sums in f64 in src/media/tests/scatter.rs",
    ),
    (
        "media/photons",
        "judged by planes in f64 in src/media/tests/pipeline.rs",
    ),
    (
        "media/gather",
        "judged by quadratures in f64 in src/media/tests/pipeline.rs",
    ),
    (
        "media/tracking",
        "judged by closed forms and quadratures in src/media/tests/tracking.rs",
    ),
    ("sampling/dump_stream", "the loop over coordinates"),
    (
        "sampling/sampler_cost",
        "the loop over samples, for their cost",
    ),
    (
        "stress/conversion",
        "judged in src/stress/numerics/conversion.rs",
    ),
    ("stress/energy", "judged in src/stress/numerics/energy.rs"),
    (
        "stress/mappings",
        "judged in src/stress/numerics/mappings.rs",
    ),
    ("stress/sums", "judged in src/stress/numerics/sums.rs"),
    ("shading/basis", "judged in src/stress/numerics/mappings.rs"),
    ("shading/bsdf", "the table of materials; judged by images"),
    (
        "shading/bsdf/cook_torrance",
        "judged in f64 by tests/images/materials",
    ),
    (
        "shading/bsdf/dielectric",
        "judged in f64 by tests/images/dielectric",
    ),
    ("shading/bsdf/diffuse", "judged by images, not by a twin"),
    (
        "shading/bsdf/fresnel",
        "judged in f64 by tests/images/dielectric and tests/images/materials",
    ),
    (
        "shading/bsdf/lobes",
        "judged in f64 by tests/images/materials",
    ),
    ("shading/bsdf/mirror", "judged by images, not by a twin"),
    (
        "shading/bsdf/phong",
        "judged in f64 by tests/images/materials",
    ),
    (
        "shading/bsdf/principled",
        "judged in f64 by tests/images/materials",
    ),
    (
        "shading/hemisphere",
        "judged in src/stress/numerics/mappings.rs",
    ),
    ("shading/lights", "the table of lights; judged by images"),
    ("shading/colors", "judged in f64 by single paths"),
    ("shading/light/sky", "judged by images, not by a twin"),
    ("shading/light/choice", "judged by tests/images/lights"),
    ("shading/light/delta", "judged by tests/images/lights"),
    ("shading/light/environment", "judged by tests/images/lights"),
    ("shading/light/flat", "judged by images, not by a twin"),
    ("shading/light/ies", "judged by tests/images/lights"),
    ("shading/light/sample", "what a sample of a light is"),
    ("shading/light/sphere", "judged by tests/images/lights"),
    ("shading/light/tree", "judged by tests/images/lights"),
    ("shading/light/table", "the layout of lights"),
    ("shading/material", "judged by images, not by a twin"),
    ("shading/normals", "judged in f64 by tests/images/materials"),
    ("shading/sides", "judged by images, not by a twin"),
    ("shading/surface", "judged by images, not by a twin"),
    ("shading/texture", "judged by images, not by a twin"),
];

/// Kernel functions and constants that the twin expresses differently, with the reason.
const KERNEL_ONLY: &[(&str, &str, &str)] = &[
    (
        "accel/triangle/compensated",
        "kept",
        "rustc keeps products as they are written",
    ),
    (
        "accel/wide/costs",
        "kept",
        "rustc keeps products as they are written",
    ),
    (
        "accel/wide/octants",
        "NOTHING",
        "the twin has empty leaves there",
    ),
    (
        "shading/light/units",
        "unit_number",
        "the host chooses nothing",
    ),
    (
        "accel/instance",
        "load_entry",
        "reads words; the twin has structs",
    ),
    ("accel/bounds", "MISSED", "the twin returns an Option"),
    ("accel/leaf", "leaf_words", "parts of an array"),
    ("accel/bvh/stack", "follow", "the body of the twin's loop"),
    ("accel/bvh/stack", "begin", "of lanes that are refilled"),
    ("media/march", "main", "the loop over paths"),
    ("media/segments", "main", "the loop over rays"),
    ("specular/solve", "main", "the loop over vertices"),
    ("cones/trace", "main", "the loop over pixels"),
    ("cones/trace", "triangle_at", "reads a buffer"),
    ("accel/bvh/stack", "advance", "of lanes that are refilled"),
    (
        "accel/bvh/short_stack",
        "level_bit",
        "the twin's words have 64 bits",
    ),
    (
        "accel/bvh/short_stack",
        "has",
        "the twin's words have 64 bits",
    ),
    (
        "accel/bvh/short_stack",
        "deepest",
        "the twin's words have 64 bits",
    ),
    (
        "integrator/integrand",
        "radiance",
        "draws; the twin is given the point",
    ),
    (
        "accel/two_level_grid",
        "load_top",
        "a method of the twin's arrays",
    ),
    ("sampling/pixel_hash", "hash", "the twin picks a function"),
    (
        "sampling/sampler",
        "sample_1d",
        "draws; the twin asks for coordinates",
    ),
    (
        "sampling/sampler",
        "sample_2d",
        "draws; the twin asks for coordinates",
    ),
];

/// Free functions of a twin that no kernel needs, with the reason.
const RUST_ONLY: &[(&str, &str, &str)] = &[
    ("cones/disk", "c", "a constant in f32 or f64"),
    ("cones/disk", "xy", "a swizzle"),
    ("cones/disk", "segment", "the thesis's formula, for tests"),
    ("cones/cone", "offsets", "three lines of the kernel"),
    ("cones/trace", "clamp", "a function of WGSL"),
    ("cones/lobe", "before", "two lines of the kernel"),
    ("cones/lobe", "lobe_table", "makes the table"),
    ("cones/lobe", "lens", "makes the table"),
    ("cones/lobe", "density", "makes the table"),
    ("cones/lobe", "mean_density", "makes the table"),
    ("accel/bvh/pairs", "validate", "looks at what was built"),
    (
        "accel/triangle/watertight",
        "edge_on_share",
        "how near a ray is to the limit, for the choice of hard rays",
    ),
    (
        "sampling/seeding",
        "paired",
        "which pixels a workgroup should have, for the model of coherence",
    ),
    (
        "accel/brute_force",
        "brute_force_hits",
        "the reference tracer, in batches",
    ),
    (
        "accel/brute_force",
        "test_all",
        "the loop of the kernel, also that of a structure that answers rays together",
    ),
    ("accel/bvh4", "child", "one expression of the kernel"),
    (
        "accel/brute_force",
        "mask",
        "the reference tracer, in batches",
    ),
    (
        "accel/triangle/watertight",
        "products",
        "two expressions of the kernel",
    ),
    ("accel/leaf", "leaf_reference", "build"),
    (
        "accel/ray_hierarchy/node",
        "minus",
        "an operator of the kernel",
    ),
    (
        "accel/ray_hierarchy/node",
        "greatest",
        "an expression of the kernel",
    ),
    ("volume/medium", "pack_halves", "build"),
    ("volume/structure/cube_bvh", "append", "build"),
    ("media/segments", "step_fuse", "a uniform of the kernel"),
    (
        "media/segments",
        "first_difference",
        "compares with the kernel",
    ),
    ("media/segments", "wrong_segment", "judges in f64"),
    ("media/segments", "exact_depth", "judges in f64"),
    ("media/march", "parallel_rays", "where paths begin"),
    ("media/march", "focus_miss", "judges in f64"),
    ("media/march", "ball_deviation", "judges in f64"),
    ("media/march", "angle_of", "judges in f64"),
    ("accel/tree/parallel/lbvh", "build", "the passes, in turn"),
    (
        "accel/tree/parallel/clusters",
        "build",
        "the passes, in turn",
    ),
    (
        "accel/tree/parallel/clusters",
        "nearest",
        "a pass, device/nearest.wesl",
    ),
    ("accel/leaf", "leaf_range", "unpacks in one place"),
    ("accel/bvh/boxes", "split_axis", "build"),
    ("accel/bvh/roped", "rope", "build"),
    ("accel/bvh/roped", "rope_of", "build and validation"),
    ("accel/bvh/octant_roped", "ropes_of", "build and validation"),
    ("accel/wide/octants", "check", "a known cube"),
    (
        "accel/bvh/octant_roped",
        "near_side",
        "one expression of the kernel",
    ),
    (
        "integrator/integrand",
        "half_plane_area",
        "the integral, f64",
    ),
    ("integrator/integrand", "functions", "for streams"),
    ("sampling/blue_noise", "read_tables", "files"),
    ("sampling/blue_noise", "read_words", "files"),
    ("accel/two_level_grid", "parts", "build"),
    ("accel/two_level_grid", "cut", "build"),
    ("sampling/dimensions", "needed", "planning"),
    ("sampling/r2", "generalised_golden_ratio", "makes the table"),
    ("sampling/sobol", "direction_numbers", "makes the table"),
    ("sampling/jittered", "strata", "makes the table"),
    ("sampling/dimensions", "purpose", "words for the report"),
    (
        "sampling/dimensions",
        "pair_purpose",
        "words for the report",
    ),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Names of all kernels in `kernels/` and its folders, without the extension.
fn kernels() -> Vec<String> {
    fn walk(folder: &Path, name: &str, out: &mut Vec<String>) {
        let entries =
            std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        for entry in entries {
            let file = entry.expect("a readable entry").path();
            let stem = file.file_stem().expect("a file name").to_string_lossy();
            let name = format!("{name}{stem}");
            if file.is_dir() {
                walk(&file, &format!("{name}/"), out);
            } else if file.extension().is_some_and(|ending| ending == "wesl") {
                out.push(name);
            }
        }
    }
    let mut out = Vec::new();
    walk(&root().join("kernels"), "", &mut out);
    out.sort();
    out
}

fn kernel_text(kernel: &str) -> String {
    read(&root().join(format!("kernels/{kernel}.wesl")))
}

fn twin_path(kernel: &str) -> PathBuf {
    let other = OTHER_FILE.iter().find(|(name, _)| *name == kernel);
    let beside = match kernel.split_once('/') {
        Some(("integrator", rest)) => format!("src/render/{rest}.rs"),
        Some((folder @ "compaction", rest)) => format!("src/gpu/{folder}/{rest}.rs"),
        _ => format!("src/{kernel}.rs"),
    };
    root().join(other.map_or(beside, |(_, path)| (*path).to_owned()))
}

/// Text of a Rust file without its unit tests.
fn without_tests(path: &Path) -> String {
    let text = read(path);
    let end = text.find("#[cfg(test)]").unwrap_or(text.len());
    text[..end].to_owned()
}

fn twin_text(kernel: &str) -> String {
    let text = without_tests(&twin_path(kernel));
    // The ray type is shared by all crates.
    match kernel {
        "accel/ray" => text + &without_tests(&root().join("src/core/geometry.rs")),
        _ => text,
    }
}

/// Text of a twin, with the shared part of its folder if a structure is a folder.
fn twin_and_shared_text(kernel: &str) -> String {
    let shared = twin_path(kernel).with_file_name("mod.rs");
    // A separate crate begins with its root.
    let shared = if shared.exists() {
        shared
    } else {
        shared.with_file_name("lib.rs")
    };
    let in_folder = kernel.matches('/').count() > 1;
    let shared = if in_folder {
        without_tests(&shared)
    } else {
        String::new()
    };
    twin_text(kernel) + &shared
}

fn is_named(kernel: &str, name: &str) -> bool {
    kernel == name || (name.ends_with('/') && kernel.starts_with(name))
}

fn twinned() -> Vec<String> {
    let listed = |kernel: &String| NO_TWIN.iter().any(|(name, _)| is_named(kernel, name));
    let out: Vec<_> = kernels().into_iter().filter(|k| !listed(k)).collect();
    assert!(out.len() >= 12, "only {} kernels have twins", out.len());
    out
}

/// Names after `fn `; in Rust, only free functions if `free`.
fn functions(text: &str, free: bool) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    for line in text.lines() {
        if free && line.starts_with(' ') {
            continue;
        }
        let line = line.trim_start();
        let line = line.strip_prefix("pub ").unwrap_or(line);
        let line = line.strip_prefix("pub(super) ").unwrap_or(line);
        let line = line.strip_prefix("pub(crate) ").unwrap_or(line);
        if let Some(rest) = line.strip_prefix("fn ") {
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_');
            out.extend(name.take(1).map(str::to_owned));
        }
    }
    out
}

/// `const NAME: type = value;` lines of either language with 32-bit types: name → declaration.
fn constants(text: &str) -> BTreeMap<String, String> {
    let mut out = BTreeMap::new();
    for line in text.lines() {
        let line = line.trim_start();
        let line = line.strip_prefix("pub ").unwrap_or(line);
        let line = line.strip_prefix("pub(super) ").unwrap_or(line);
        let line = line.strip_prefix("pub(crate) ").unwrap_or(line);
        let Some(declaration) = line.strip_prefix("const ") else {
            continue;
        };
        let Some((name, rest)) = declaration.split_once(':') else {
            continue;
        };
        if rest.trim_start().starts_with("u32") || rest.trim_start().starts_with("f32") {
            out.insert(name.to_owned(), declaration.to_owned());
        }
    }
    out
}

/// Values of constants as bits, evaluated by naga; Rust spelling is converted to WGSL.
fn values(constants: &BTreeMap<String, String>) -> BTreeMap<String, u32> {
    let wgsl = |declaration: &String| {
        let (left, value) = declaration.split_once('=').expect("a value");
        let mut previous = ' ';
        let digits_apart = |c: char| {
            let separator = c == '_' && previous.is_ascii_digit();
            previous = if separator { previous } else { c };
            (!separator).then_some(c)
        };
        let value = value.replace("u32::MAX", "0xffffffffu");
        let mut value = value;
        for (name, number) in [
            ("FRAC_2_PI", std::f32::consts::FRAC_2_PI),
            ("FRAC_1_PI", std::f32::consts::FRAC_1_PI),
            ("FRAC_PI_2", std::f32::consts::FRAC_PI_2),
            ("FRAC_PI_4", std::f32::consts::FRAC_PI_4),
            ("PI", std::f32::consts::PI),
        ] {
            value = value.replace(
                &format!("std::f32::consts::{name};"),
                &format!("{number:?}f;"),
            );
        }
        let is_hex = value.contains("0x");
        let value: String = if is_hex {
            value.replace('_', "")
        } else {
            value.chars().filter_map(digits_apart).collect()
        };
        format!("const {left}={value}\n")
    };
    let text: String = constants.values().map(wgsl).collect();
    let module = naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(&text)));
    let bits = |(_, constant): (_, &naga::Constant)| {
        let value = match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(x)) => x,
            naga::Expression::Literal(naga::Literal::F32(x)) => x.to_bits(),
            ref other => panic!("{:?} is {other:?}", constant.name),
        };
        (constant.name.clone().expect("constants have names"), value)
    };
    module.constants.iter().map(bits).collect()
}

#[test]
fn lists_name_only_what_exists() {
    let known = kernels();
    for (kernel, reason) in NO_TWIN {
        assert!(
            known.iter().any(|k| is_named(k, kernel)),
            "{kernel} does not exist"
        );
        assert!(!reason.is_empty());
    }
    for (kernel, name, _) in KERNEL_ONLY {
        let text = kernel_text(kernel);
        let exists =
            functions(&text, false).contains(*name) || constants(&text).contains_key(*name);
        assert!(exists, "{kernel} has no {name}");
    }
    for (kernel, name, _) in RUST_ONLY {
        let exists = functions(&twin_text(kernel), true).contains(*name);
        assert!(exists, "the twin of {kernel} has no {name}");
    }
}

/// docs/adding-a-structure.md says so.
#[test]
fn structures_of_the_package_need_no_import_but_the_prelude() {
    let braced = |text: &str, from: &str| {
        let inside = text.split(from).nth(1).unwrap_or_else(|| panic!("{from}"));
        let names = inside.split('}').next().unwrap_or_default();
        let names = names.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        BTreeSet::from_iter(names.filter(|name| !name.is_empty()).map(str::to_owned))
    };
    let shared = read(&root().join("src/accel/structure.rs"));
    let prelude = shared.split("mod prelude {").nth(1).expect("the prelude");
    let prelude = prelude.split("\n}").next().expect("its end");
    let example = read(&root().join("tests/device/adding_a_structure/sorted_slabs.rs"));
    let mut needed = braced(&example, "use raystone::accel::{");
    needed.extend(braced(&example, "use raystone::accel::twin::{"));
    needed.extend(["Bounds", "parameters"].map(str::to_owned));
    assert!(needed.len() > 10, "{needed:?}");
    let has = |name: &String| {
        prelude
            .split(|c: char| !(c.is_alphanumeric() || c == '_'))
            .any(|word| word == name)
    };
    let missing: Vec<&String> = needed.iter().filter(|name| !has(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_function_of_a_kernel_has_a_twin_of_the_same_name_and_the_other_way_round() {
    let mut compared = 0;
    for kernel in twinned() {
        let here = functions(&kernel_text(&kernel), false);
        let there = twin_text(&kernel);
        let shared = twin_and_shared_text(&kernel);
        for name in here.difference(&functions(&shared, false)) {
            let listed = KERNEL_ONLY
                .iter()
                .any(|(k, n, _)| *k == kernel && n == name);
            assert!(
                listed,
                "{kernel}: fn {name} is not in {}",
                twin_path(&kernel).display()
            );
        }
        if OTHER_FILE.iter().all(|(name, _)| *name != kernel) {
            for name in functions(&there, true).difference(&here) {
                let listed = RUST_ONLY.iter().any(|(k, n, _)| *k == kernel && n == name);
                assert!(
                    listed,
                    "{}: fn {name} is not in {kernel}",
                    twin_path(&kernel).display()
                );
            }
        }
        compared += here.len();
    }
    assert!(compared >= 25, "only {compared} functions were compared");
}

#[test]
fn constants_of_the_same_name_have_the_same_value() {
    let mut compared = BTreeSet::new();
    for kernel in twinned() {
        let here = values(&constants(&kernel_text(&kernel)));
        let there = values(&constants(&twin_and_shared_text(&kernel)));
        for (name, value) in here {
            match there.get(&name) {
                Some(other) => {
                    assert_eq!(value, *other, "{kernel}: {name}");
                    compared.insert(name);
                }
                None => assert!(
                    KERNEL_ONLY
                        .iter()
                        .any(|(k, n, _)| *k == kernel && *n == name),
                    "{kernel}: {name} is not in {}",
                    twin_path(&kernel).display()
                ),
            }
        }
    }
    for needed in [
        "TRIANGLE_PAD",
        "DISTANCE_PAD",
        "SMALLEST_DIRECTION",
        "SMALLEST_COMPONENT",
        "SMALLEST_SLOPE",
        "NO_HIT",
        "COUNT_SHIFT",
        "FIRST_MASK",
        "LEAF",
        "PER_BOUNCE",
        "ROULETTE",
    ] {
        assert!(compared.contains(needed), "{needed} was not compared");
    }
}

#[test]
fn a_function_or_constant_that_is_missing_or_different_is_seen() {
    let rust =
        "pub fn a() {\n    fn b() {}\n}\nconst X: u32 = (1 << 3) - 1;\nconst Y: f32 = 1.000_001_9;";
    let kernel = "fn a() {}\nconst X: u32 = 7u;\nconst Y: f32 = 1.0000018;";
    let names: Vec<_> = functions(rust, false).into_iter().collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(functions(rust, true).len(), 1);
    let [here, there] = [kernel, rust].map(|text| values(&constants(text)));
    assert_eq!(here["X"], there["X"]);
    assert_eq!(there["Y"], 1.000_001_9_f32.to_bits());
    assert_ne!(here["Y"], there["Y"]);
}

#[test]
fn the_error_word_and_the_ray_classes_mean_the_same_on_both_sides() {
    let errors = values(&constants(&kernel_text("common/errors")));
    let known = raystone::gpu::KERNEL_ERRORS.map(|(bit, _)| bit);
    assert_eq!(errors.len(), known.len());
    assert!(errors.values().all(|bit| known.contains(bit)));

    let mut classes = values(&constants(&kernel_text("common/ray_counts")));
    classes.retain(|name, _| name.starts_with("RAY_"));
    let names = raystone::integrator::RAY_COUNT_CLASSES;
    assert_eq!(classes.len(), names.len());
    for (index, name) in names.iter().enumerate() {
        let constant = format!("RAY_{}", name.to_uppercase());
        assert_eq!(classes.get(&constant), Some(&(index as u32)), "{constant}");
    }
}

#[test]
fn kinds_of_materials_have_the_numbers_of_their_rows() {
    let names: Vec<String> = raystone::scene::MATERIAL_KINDS
        .map(|kind| kind.feature.to_uppercase())
        .to_vec();
    let numbered = |text: &str| {
        let found = values(&constants(text));
        let mut found: Vec<_> = found.into_iter().map(|(name, n)| (n, name)).collect();
        found.sort();
        let names: Vec<String> = found.into_iter().map(|(_, name)| name).collect();
        names
    };
    let table = kernel_text("shading/bsdf");
    assert_eq!(numbered(&table), names);
    let swapped = table.replace("MIRROR: u32 = 4u", "MIRROR: u32 = 7u");
    assert_ne!(numbered(&swapped), names);
}

#[test]
fn kinds_of_lights_have_the_numbers_of_their_rows() {
    let constants = values(&constants(&kernel_text("shading/light/table")));
    for (number, kind) in (0..).zip(raystone::scene::LIGHT_KINDS) {
        let name = kind.name.to_uppercase();
        assert_eq!(constants.get(&name), Some(&number), "{name}");
    }
    // Plus NO_LIGHT.
    assert_eq!(constants.len(), raystone::scene::LIGHT_KINDS.len() + 1);
}

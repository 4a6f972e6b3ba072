//! Faults of the kernels of photons that a run has to see.

use super::tier::{faults_in_turn, in_turn};
use crate::register;
use raystone_bench::run::{Existing, Registries, RunOptions, run};
use raystone_config::{Experiment, Plan};

/// File, text, its replacement, strategy: faults of the kernels that a run has to see.
const FAULTS: [(&str, &str, &str, &str); 22] = [
    // Transmittance that is lost, and energy as if the way began at its end.
    ("photons", "through *= exp(-depth);", "", "fixed-64"),
    ("photons", "way * mean_transmittance(depth)", "way", "swap"),
    // The last group left out, of photons and of rays.
    (
        "photons",
        "i < photons.count",
        "i + 64u < photons.count",
        "tiles",
    ),
    (
        "gather",
        "i < gather.count",
        "i + 64u < gather.count",
        "fixed-64",
    ),
    // Twice the power.
    (
        "photons",
        "photon[3].xyz * (through",
        "photon[3].xyz * (2.0 * through",
        "sort",
    ),
    // Two colours exchanged; one in the place of all.
    (
        "photons",
        "energy, photon[2].xyz",
        "energy.xzy, photon[2].xyz",
        "fixed-64",
    ),
    (
        "scatter/tallies",
        "return energy[channel];",
        "return energy[2u - channel];",
        "swap",
    ),
    (
        "gather",
        "energy += weight * one[0].xyz",
        "energy += weight * one[0].xxx",
        "fixed-64",
    ),
    // A voxel too far; half a voxel beside; the place where a piece begins instead of its middle.
    (
        "photons",
        "deposit(place_of(voxel)",
        "deposit(place_of(vec3<u32>(next.voxel))",
        "fixed-64",
    ),
    ("gather", "position - 0.5", "position", "fixed-64"),
    ("gather", "(0.5 * (walk.t + stop))", "walk.t", "fixed-64"),
    // Photons that go back where they came from.
    (
        "photons",
        "energy, photon[2].xyz",
        "energy, -photon[2].xyz",
        "fixed-32",
    ),
    // A region that is kept beyond its border, and one whose least σ stands for all.
    (
        "gather",
        "if (!is_in(walk, region)) {",
        "if (false) {",
        "fixed-64\"\ncontent = \"shadow",
    ),
    (
        "photons",
        "return region.sigma.x == region.sigma.y;",
        "return true;",
        "fixed-64\"\ncontent = \"cloud",
    ),
    // The phase function's sign, and its other half.
    (
        "gather",
        "-dot(sums.direction",
        "dot(sums.direction",
        "fixed-64",
    ),
    (
        "phase",
        "1.0 + a * a - 2.0 * a * cosine",
        "1.0 + a * a + 2.0 * a * cosine",
        "fixed-64",
    ),
    // No transmittance up to the eye; no albedo; a voxel instead of a sum.
    ("gather", "through *= after;", "", "fixed-64"),
    ("gather", "* gather.albedo", "", "fixed-64"),
    (
        "gather",
        "light += scattered(",
        "light = scattered(",
        "fixed-64",
    ),
    // Sums without their sign, of another scale, and with a lost carry.
    (
        "scatter/resolve",
        "select(value, -value, negative)",
        "value",
        "fixed-64",
    ),
    (
        "scatter/resolve",
        "f32(low)) / scatter.units",
        "f32(low)) / (2.0 * scatter.units)",
        "tiles",
    ),
    (
        "scatter/wide",
        "select(carry, carry + 0xffffffffu, units < 0)",
        "carry",
        "fixed-64",
    ),
];

/// The same of adaptive photons, with the filter that shows it.
const ADAPTIVE_FAULTS: [(&str, &str, &str, &str); 15] = [
    // Pilots in the wrong cells, counted for every voxel, from the wrong column, and without squares.
    (
        "photons",
        "voxel * photons.cells / medium.resolution",
        "voxel / photons.cells",
        "none",
    ),
    ("photons", "place != counted_place", "true", "none"),
    (
        "adaptive/origins",
        "counts[5u * place + 1u], at.x",
        "counts[5u * place + 1u], at.y",
        "none",
    ),
    ("adaptive/origins", "at.y * at.y", "at.y", "none"),
    // Weights that are not added up, or cut off.
    (
        "adaptive/weights",
        "marks.x * counting.units + 0.5",
        "counting.units",
        "both",
    ),
    (
        "adaptive/weights",
        "atomicAdd(&counts[2u * place], 1u)",
        "atomicAdd(&counts[2u * place], 2u)",
        "weight",
    ),
    // A pyramid from other taps, another place, with a mean over empty cells or without the last level.
    (
        "adaptive/mip",
        "vec3<f32>(FAR), vec3<f32>(NEAR), inner",
        "vec3<f32>(NEAR), vec3<f32>(FAR), inner",
        "constant",
    ),
    (
        "adaptive/mip",
        "k & 3u, (k >> 2u) & 3u, k >> 4u)) - 1",
        "k & 3u, (k >> 2u) & 3u, k >> 4u))",
        "constant",
    ),
    ("adaptive/mip", "max(weights, 1.0)", "8.0", "weight"),
    (
        "adaptive/levels",
        "+ ((1u << level) - 1u)) >>",
        ") >>",
        "surround",
    ),
    // Half a cell beside; levels by other rules; a blur of other taps.
    (
        "adaptive/smooth",
        "/ f32(1u << level) - 0.5",
        "/ f32(1u << level)",
        "constant",
    ),
    (
        "adaptive/smooth",
        "counted(level, voxel).x < least",
        "counted(level, voxel).x <= least",
        "count",
    ),
    (
        "adaptive/smooth",
        "counted(level_with(1.0, voxel), voxel).y",
        "counted(0u, voxel).y",
        "weight",
    ),
    (
        "adaptive/smooth",
        "after <= before",
        "after > before",
        "surround",
    ),
    (
        "adaptive/smooth",
        "vec3<f32>(0.25), vec3<f32>(0.5)",
        "vec3<f32>(0.5), vec3<f32>(0.25)",
        "blur",
    ),
];

/// Of refracted photons: with the content that shows it.
const CURVED_FAULTS: [(&str, &str, &str, &str); 18] = [
    // Ways that are not bent, or by the gradient elsewhere, twice, or against it.
    (
        "curved/way",
        "if (!has_one_n(region)) {",
        "if (false) {",
        "ball",
    ),
    (
        "bend",
        "optics_at(middle).gradient",
        "optics_at(x).gradient",
        "lens",
    ),
    (
        "bend",
        "optics_at(middle).gradient * h",
        "optics_at(middle).gradient * (2.0 * h)",
        "cube",
    ),
    (
        "bend",
        "v + optics_at(middle)",
        "v - optics_at(middle)",
        "ball",
    ),
    // A way that begins beside its photon, and regions that count as even where they are not.
    (
        "curved/way",
        "let x = clamp(origin,",
        "let x = clamp(origin + 0.5,",
        "lens",
    ),
    (
        "curved/way",
        "return region.n.x == region.n.y;",
        "return region.n.y < 1.3;",
        "ball",
    ),
    // Steps that end before the border of a region, or at its other side.
    (
        "bend",
        "* speed + march.nudge",
        "* (0.5 * speed) + march.nudge",
        "cube",
    ),
    (
        "bend",
        "select(vec3<f32>(region.low), vec3<f32>(region.high)",
        "select(vec3<f32>(region.high), vec3<f32>(region.low)",
        "ball",
    ),
    // Half a voxel beside.
    ("optics", "position - 0.5", "position", "ball"),
    // A way's length in voxels, a chord that goes on beyond the grid, and the light's first direction all along.
    (
        "curved/way",
        "min(length * optical.voxel,",
        "min(length,",
        "ball",
    ),
    (
        "curved/way",
        "select(vec3<f32>(0.0), vec3<f32>(medium.resolution), along",
        "select(vec3<f32>(0.0), 2.0 * vec3<f32>(medium.resolution), along",
        "lens",
    ),
    (
        "curved/photons",
        "energy, chord.direction",
        "energy, photon[2].xyz",
        "ball",
    ),
    // Transmittance that begins anew at each chord, and one whose least σ stands for all.
    (
        "curved/photons",
        "var through = begun;",
        "var through = 1.0;",
        "lens",
    ),
    (
        "curved/photons",
        "if (!is_even(region)) {",
        "if (false) {",
        "ball",
    ),
    (
        "curved/photons",
        "i < photons.count",
        "i + 64u < photons.count",
        "cube",
    ),
    // Of the view: its direction before it was bent, no n², and no transmittance.
    (
        "curved/gather",
        "radiance_at(middle), chord.direction",
        "radiance_at(middle), one[2].xyz",
        "ball",
    ),
    ("curved/gather", "(share * share)", "share", "ball"),
    ("curved/gather", "through *= after;", "", "torus"),
];

/// The same where something is left out that the medium does not ask for; the last word is what is loaded.
const SWITCH_FAULTS: [(&str, &str, &str, &str); 13] = [
    // Voxels that scatter are crossed, and more than a region.
    (
        "gather",
        "region.sigma.y <= 0.0",
        "region.sigma.x <= 0.0",
        CLOUD,
    ),
    (
        "gather",
        "leave(ray, walk, region.low, region.high)",
        "leave(ray, walk, max(region.low, vec3<u32>(2u)) - 2u, min(region.high + 2u, medium.resolution))",
        CLOUD,
    ),
    // Voxels that views read are crossed by photons: those beside what scatters, and some that do.
    (
        "photons",
        "select(region.high - 1u, region.high,",
        "select(region.high, region.high,",
        CLOUD,
    ),
    (
        "photons",
        "leave(ray, walk, core[0], core[1])",
        "leave(ray, walk, region.low, region.high)",
        CLOUD,
    ),
    // Two sums, the third from another place, and directions that nothing has added.
    (
        "scatter/tallies",
        "CHANNELS: u32 = 3u;",
        "CHANNELS: u32 = 2u;",
        EVEN,
    ),
    (
        "scatter/resolve",
        "value_of(at + 2u, false)",
        "value_of(at + 1u, false)",
        EVEN,
    ),
    (
        "scatter/resolve",
        "var direction = vec4<f32>(0.0);",
        "var direction = vec4<f32>(1.0);",
        EVEN,
    ),
    // Straight ways as curved ones: half a step, and n² where there is none.
    (
        "curved/way",
        "(h / norm(path.v))",
        "(0.5 * h / norm(path.v))",
        WAYS,
    ),
    (
        "curved/gather",
        "let share = outside / n;",
        "let share = outside / (n + 0.1);",
        WAYS,
    ),
    // A mirror that turns light by less, that is seen where it is not entered, and behind which no light is lost.
    (
        "curved/mirror",
        "- normal * dot(v, normal)",
        "- normal * (0.8 * dot(v, normal))",
        MIRROR,
    ),
    (
        "curved/mirror",
        "optics_at(first).n < mirror.index",
        "optics_at(first).n >= mirror.index",
        MIRROR,
    ),
    ("curved/gather", "through *= 1.0 - mirror.part;", "", MIRROR),
    (
        "curved/gather",
        "path.v, outside) * through;",
        "path.v, outside);",
        MIRROR,
    ),
];
const MIRROR: &str = "content = \"ball\"\nreflectivity = 0.5";
const CLOUD: &str = "content = \"cloud\"";
const EVEN: &str = "scatters = \"isotropic\"";
const WAYS: &str = "content = \"shadow\"\ngeneral_ways = true";

/// A run of one pipeline with these kernels: how many cells failed, and why.
pub(super) fn pipeline_run(folder: &std::path::Path, kernels: &str, load: &str) -> (usize, String) {
    pipeline_run_of(folder, kernels, 12, load)
}

/// The same with so many voxels along each axis.
pub(super) fn pipeline_run_of(
    folder: &std::path::Path,
    kernels: &str,
    side: u32,
    load: &str,
) -> (usize, String) {
    let text = format!(
        "[run]\nname = \"faults\"\n[axes]\nintegrator = [\"media:pipeline\"]\nkernels = [\"{kernels}\"]\n\
         [[integrator.\"media:pipeline\"]]\nside = {side}\n{load}\n\
         [timing]\nrounds = 3\nmin_warmup_ms = 0\nmax_warmup_ms = 1\n"
    );
    let mut registries = Registries::default();
    register(&mut registries).unwrap();
    let experiment = Experiment::parse(&text, "test", &[], &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
    let options = RunOptions {
        out: folder.join("run"),
        existing: Existing::Replace,
        ..RunOptions::default()
    };
    let summary = run(&experiment, &plan, &registries, &options).unwrap();
    let records = std::fs::read_to_string(options.out.join("records.jsonl")).unwrap();
    let reasons = records
        .lines()
        .filter_map(|line| line.split_once("reason\":\"").map(|(_, rest)| rest))
        .map(|rest| &rest[..rest.find("\",\"").unwrap_or(rest.len())]);
    (summary.failed, reasons.collect::<Vec<_>>().join("; "))
}

#[test]
fn a_run_of_photons_without_a_fault_passes() {
    if super::segments::adapter().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let all = [
        "photons = 48\nstrategy = [\"fixed-32\", \"fixed-64\", \"swap\", \"sort\", \"tiles\"]",
        "photons = 48\ngeneral = true\ncontent = [\"fog\", \"shadow\", \"cloud\"]",
        "photons = 48\nscatters = \"isotropic\"\nstrategy = [\"fixed-32\", \"fixed-64\", \"swap\", \"sort\", \"tiles\"]",
        "photons = 48\nscatters = \"isotropic\"\ngeneral_directions = true",
        "photons = 48\ngeneral_list = true\nmode = [\"reference\", \"adaptive\"]",
        "photons = 48\ngeneral_steps = true\ncontent = [\"fog\", \"cloud\"]",
        "photons = 48\ngeneral_deposits = true\ncontent = [\"fog\", \"cloud\"]\nstrategy = [\"fixed-64\", \"tiles\"]",
        "photons = 48\ngeneral_ways = true\ncontent = [\"fog\", \"shadow\", \"cloud\"]",
        "photons = 48\ncontent = [\"ball\", \"torus\"]\nreflectivity = 0.5",
        "photons = 48\ncontent = \"ball\"\ngeneral_mirror = true",
        "photons = 48\nmode = [\"reference\", \"adaptive\"]\ncontent = [\"shadow\", \"cloud\"]",
        "content = \"shadow\"\nmode = \"adaptive\"\nwarp = [\"alias\", \"hierarchical\"]",
        "photons = 48\ncontent = [\"ball\", \"cube\", \"lens\", \"torus\"]",
        "photons = 32\nmode = \"adaptive\"\ncontent = \"ball\"\nfilter = \"both\"",
        // So few that voxels have none.
        "photons = 16\nmode = \"adaptive\"\npilot_cells = 5\nfilter = [\"weight\", \"both\"]",
        // Cells at the borders of odd levels hold fewer than so many.
        "photons = 16\nstrategy = \"fixed-64\"\nfilter = \"count\"\nleast = 200",
        "photons = 48\nmode = [\"reference\", \"adaptive\"]\nfilter = [\"blur\", \"constant\", \"count\", \"surround\", \"weight\", \"both\"]",
    ];
    for load in in_turn("loads of photons", all) {
        let (failed, reason) = pipeline_run(folder.path(), "", load);
        assert_eq!(failed, 0, "{load} without a fault: {reason}");
    }
    // Of so small a grid some voxels take the widest level; through so fine a torus rays enter its glass twice.
    let others = [
        (5, "filter = \"surround\""),
        (32, "content = \"torus\"\nreflectivity = 0.5"),
    ];
    for (side, load) in others {
        let load = format!("photons = 48\nstrategy = \"fixed-64\"\n{load}");
        let (failed, reason) = pipeline_run_of(folder.path(), "", side, &load);
        assert_eq!(failed, 0, "{side} voxels a side, {load}: {reason}");
    }
}

/// Each in the load that [`a_run_of_photons_without_a_fault_passes`] has without it.
#[test]
fn a_fault_in_a_kernel_of_photons_fails_the_run() {
    if super::segments::adapter().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let library = raystone_gpu::KernelLibrary::default();
    let fixed = FAULTS.map(|(file, text, fault, strategy)| {
        (
            file,
            text,
            fault,
            format!("photons = 48\nstrategy = \"{strategy}\""),
        )
    });
    let adaptive = ADAPTIVE_FAULTS.map(|(file, text, fault, filter)| {
        (
            file,
            text,
            fault,
            format!("photons = 16\nmode = \"adaptive\"\npilot_cells = 5\nfilter = \"{filter}\""),
        )
    });
    let curved = CURVED_FAULTS.map(|(file, text, fault, content)| {
        let load = format!("photons = 48\nstrategy = \"fixed-64\"\ncontent = \"{content}\"");
        (file, text, fault, load)
    });
    let switched = SWITCH_FAULTS.map(|(file, text, fault, content)| {
        let load = format!("photons = 48\nstrategy = \"fixed-64\"\n{content}");
        (file, text, fault, load)
    });
    let faults = faults_in_turn(
        "faults of photons in a run",
        (fixed.into_iter().chain(adaptive)).chain(curved.into_iter().chain(switched)),
    );
    let mut unseen = Vec::new();
    for (k, (file, text, fault, load)) in faults.into_iter().enumerate() {
        let name = match file {
            "phase" => "volume/phase".to_owned(),
            _ => format!("media/{file}"),
        };
        let sound = library.text(&name).unwrap();
        assert_eq!(sound.matches(text).count(), 1, "{file}: `{text}`");
        let kernels = folder.path().join(format!("kernels-{k}"));
        let path = kernels.join(format!("{name}.wesl"));
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, sound.replace(text, fault)).unwrap();
        // The blurred border of coarse glass does not reach the index of its mirror.
        let side = if load.contains(MIRROR) { 32 } else { 12 };
        let kernels = kernels.to_str().unwrap();
        let (failed, reason) = pipeline_run_of(folder.path(), kernels, side, &load);
        println!("{file}: `{text}` as `{fault}`: {reason}");
        if failed != 1 {
            unseen.push(format!("{file}: `{text}` as `{fault}`"));
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
}

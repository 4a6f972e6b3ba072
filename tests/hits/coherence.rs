//! The coherence model matches twins' reads, integrators' rays and device counters, in runs, too.

use crate::support;
use crate::support::{Pcg, build, param_variants, scenes, trace, variant};
use raystone::accel::{Query, Ray, TriangleSoup};
use raystone::coherence::{
    Kind, Machine, Memory, Organisation, RayClass, Rays, Trace, View, groups_of, of_rays,
    run as run_model, together, trace_of,
};
use raystone::config::{Coherence, Rule};
use raystone::integrator::{ConfiguredIntegrator, IntegratorRegistry};
use raystone::measure::path_oracle::{self, PathOracle};
use raystone::measure::record::{Body, CoherenceRecord, StructureRecord, Tally, all_of, axis};
use raystone::params::ParamValue;
use raystone::run::Registries;
use raystone::sampling::{Sampler, SamplerRegistry};
use raystone::scene::SceneData;
use std::collections::BTreeMap;

/// All kinds of rays through all kinds of triangles.
fn soup_and_rays(seed: u64) -> (TriangleSoup, Vec<Ray>) {
    let mut rng = Pcg::new(seed);
    let soup = scenes::lattice_soup(&mut rng, 150, 8);
    let mut rays = scenes::aimed_rays(&mut rng, &soup, 40);
    rays.extend(scenes::lattice_rays(&mut rng, 40, 8));
    (soup, rays)
}

/// Every structure, with one parameter set per layout or kernel that it can choose.
fn each_structure(
    soup: &TriangleSoup,
    mut check: impl FnMut(&str, &dyn raystone::accel::BuiltAccel),
) {
    let mut kernels = Vec::new();
    for kind in support::inline_structures() {
        for params in param_variants(&kind.parameters()) {
            let Ok(built) = kind.build(soup, &params, &mut Default::default()) else {
                continue;
            };
            let buffers = built.buffers();
            let kernel = (buffers.kernel, buffers.features);
            if !kernels.contains(&kernel) {
                kernels.push(kernel);
                check(&format!("{} {params:?}", kind.name()), &*built);
            }
        }
    }
    assert!(kernels.len() > 12, "{} kernels", kernels.len());
}

#[test]
fn what_a_twin_reads_is_what_the_device_has_and_as_often_as_its_counters_say() {
    let gpu = support::gpu();
    if !support::is_exact(gpu) {
        return;
    }
    let (soup, rays) = soup_and_rays(3);
    each_structure(&soup, |what, built| {
        let memory = Memory::new(built, &soup).unwrap_or_else(|e| panic!("{what}: {e}"));
        let twin = built.cpu_twin(&soup).expect("a twin");
        for (query, features) in [
            (Query::Closest, ["counters", ""]),
            (Query::Any, ["counters", "any"]),
        ] {
            let counted = trace(gpu, built, &soup, &rays, &features);
            for (ray, work) in rays.iter().zip(&counted.work) {
                let found = trace_of(&*twin, &memory, ray, query);
                let found = found.unwrap_or_else(|e| panic!("{what}: {e}"));
                let told = [Kind::Node, Kind::Triangle].map(|kind| found.count(kind));
                assert_eq!(told, [work.nodes, work.triangle_tests], "{what}: {ray:?}");
                check_fetches(what, &found, &memory);
            }
        }
    });
}

/// Checks that a triangle test reads its 48 bytes, aligned, and that no trace has only tests.
fn check_fetches(what: &str, found: &Trace, memory: &Memory) {
    for step in 0..found.steps.len() {
        if found.steps[step].kind == Kind::Triangle {
            let records = found.fetches_of(step).iter().filter(|f| f.bytes == 48);
            let places: Vec<_> = records.map(|fetch| memory.place(*fetch)).collect();
            let right = |(name, at): &&(&str, u64)| {
                ["triangles", "leaf_triangles"].contains(name) && at % 48 == 0
            };
            assert_eq!(places.iter().filter(right).count(), 1, "{what}: {places:?}");
        }
    }
    let visits = found.count(Kind::Node) as usize;
    let other = found.fetches.iter().filter(|f| f.bytes != 48).count();
    let is_told =
        visits == 0 || other > 0 || what.starts_with("two-level-grid") || what.starts_with("bvh4");
    assert!(is_told, "{what}: {visits} visits read nothing");
}

#[test]
fn twins_read_the_words_that_are_uploaded() {
    let (soup, _) = soup_and_rays(4);
    each_structure(&soup, |what, built| {
        let read = built.twin_arrays();
        for array in built.buffers().arrays {
            let found = read.iter().find(|(name, _)| *name == array.name);
            let (_, parts) = found.unwrap_or_else(|| panic!("{what}: {} is not read", array.name));
            assert_eq!(parts.concat(), *array.words, "{what}: {}", array.name);
        }
    });
}

#[test]
fn a_triangle_test_that_reads_more_than_twins_keep_is_refused() {
    use raystone::accel::{Intersection, TriangleRegistry};
    let (soup, _) = soup_and_rays(5);
    let tests = TriangleRegistry::default();
    let triangle = tests
        .named("triangle test", "baldwin-weber")
        .expect("a test");
    let soup = soup.intersecting(Intersection {
        triangle,
        ..Intersection::default()
    });
    let built = build(
        support::structure("bvh"),
        &soup,
        &support::default_params(&support::structure("bvh").parameters()),
    );
    let error = Memory::new(&*built, &soup).expect_err("refused");
    assert!(
        error.contains("baldwin-weber") && error.contains("48"),
        "{error}"
    );
}

const SIZE: [u32; 2] = [24, 16];
/// Size of the image whose rays are compared: neighbours are close together.
const LARGE: [u32; 2] = [240, 160];

struct Setting {
    scene: SceneData,
    integrator: ConfiguredIntegrator,
    sampler: Sampler,
    variant: raystone::params::Variant,
    size: [u32; 2],
    groups: [u32; 2],
}

impl Setting {
    fn new(
        scene: &str,
        integrator: &str,
        changes: &[(&str, ParamValue)],
        decorrelation: (&str, f64),
        spp: u32,
    ) -> Self {
        let integrators = IntegratorRegistry::default();
        let what = variant(&integrators.entries(), integrator, changes);
        let integrator = integrators.configured(&what).expect("an integrator");
        let samplers = SamplerRegistry::default();
        let k = [("k", ParamValue::Number(decorrelation.1))];
        let changes = if decorrelation.1 > 0.0 { &k[..] } else { &[] };
        let decorrelation = variant(&samplers.decorrelation_entries(), decorrelation.0, changes);
        let sequence = variant(&samplers.sequence_entries(), "halton", &[]);
        let demand = integrator.demand(spp, SIZE[0]);
        Self {
            scene: support::builtin(scene, &[]),
            sampler: samplers
                .sampler(&sequence, &decorrelation, &demand)
                .expect("a sampler"),
            integrator,
            variant: what,
            size: SIZE,
            groups: [2, 6],
        }
    }

    fn rays(&self, samples: &[u32]) -> Rays {
        let stride = self.sampler.stride();
        let groups = groups_of(self.size, [8, 4], self.groups, stride);
        let oracle = PathOracle::new(&self.scene).expect("an oracle");
        let image = path_oracle::View {
            estimator: path_oracle::Estimator::of(&self.integrator).expect("an estimator"),
            camera: self.scene.view(1.5),
            size: self.size,
            sampler: &self.sampler,
        };
        let view = View {
            oracle: &oracle,
            image: &image,
            diagonal: 2.0 * f64::from(self.scene.bounds().radius()),
            samples,
            seed: 5,
        };
        Rays::new(&view, &groups)
    }

    fn tallies(
        &self,
        samples: &[u32],
        structure: &str,
        organisation: Organisation,
    ) -> BTreeMap<String, Tally> {
        let soup = TriangleSoup::new(&self.scene);
        let kind = support::structure(structure);
        let built = build(kind, &soup, &support::default_params(&kind.parameters()));
        let memory = Memory::new(&*built, &soup).expect("its memory");
        let twin = built.cpu_twin(&soup).expect("a twin");
        let groups = self.rays(samples).through(&*twin, &memory).expect("traces");
        let groups: Vec<_> = groups
            .into_iter()
            .map(|warps| organisation.of(warps))
            .collect();
        let tallies = run_model(&Machine::new(&MACHINE), &groups).into_iter();
        tallies
            .map(|(class, tally)| (RayClass::of_word(class).to_string(), tally))
            .collect()
    }
}

const MACHINE: Coherence = Coherence {
    resolution: SIZE,
    spp: Vec::new(),
    groups: 2,
    warps: 6,
    warp: [8, 4],
    samples: 1,
    rule: Rule::Loop,
    line_bytes: 128,
    l1_kib: 16,
    l1_ways: 4,
    l2_kib: 64,
    l2_ways: 16,
};

#[test]
fn each_cache_of_the_machine_has_its_own_size_and_ways() {
    let machine = Machine::new(&MACHINE);
    // 16 KiB and 64 KiB, of lines of 128 bytes.
    assert_eq!([machine.l1.lines, machine.l1.ways], [128, 4]);
    assert_eq!([machine.l2.lines, machine.l2.ways], [512, 16]);
    assert_eq!((machine.line_bytes, machine.rule), (128, Rule::Loop));
}

fn depth(max: i64) -> [(&'static str, ParamValue); 1] {
    [("max_depth", ParamValue::Integer(max))]
}

#[test]
fn rays_are_those_that_the_integrators_count_on_the_device() {
    let gpu = support::gpu();
    for (scene, integrator, changes) in [
        ("cornell-box", "path", &depth(3)[..]),
        ("cornell-box", "ao", &[]),
        (
            "many-lights",
            "path",
            &[
                ("lights", ParamValue::Name("all".into())),
                ("max_depth", ParamValue::Integer(1)),
            ],
        ),
    ] {
        let setting = Setting::new(scene, integrator, changes, ("cranley-patterson", 0.0), 4);
        let mut own: BTreeMap<&str, u64> = BTreeMap::new();
        let rays = setting.rays(&[0, 1, 2, 3]);
        for pass in rays.groups.iter().flatten().flatten() {
            let class = pass.class.to_string();
            let name = ["primary", "shadow", "ao", "bounce"]
                .into_iter()
                .find(|name| class.starts_with(name));
            *own.entry(name.expect("a class")).or_default() +=
                pass.lanes.iter().flatten().count() as u64;
        }
        let stage = support::Stage::new(gpu, setting.scene.clone());
        let traced = stage.traced(gpu, support::structure("bvh"));
        let mut stage = stage;
        stage.camera = setting.scene.view(1.5);
        let renderer = stage.renderer(gpu, &traced, &setting.sampler, &setting.variant, SIZE, true);
        renderer.reset().expect("a renderer");
        renderer.add_samples(0, 4, 5).expect("samples");
        let counted = renderer.ray_counts().expect("counts");
        let names = raystone::integrator::RAY_COUNT_CLASSES;
        for (name, counted) in names.into_iter().zip(counted).take(4) {
            let own = own.get(name).copied().unwrap_or(0);
            // Decisions affected by rounding: a few among thousands of rays.
            let apart = own.abs_diff(counted);
            assert!(
                apart <= counted / 400,
                "{scene}, {integrator}: {name} {own}, counted {counted}"
            );
        }
        assert!(counted[0] == u64::from(4 * SIZE[0] * SIZE[1]));
    }
}

#[test]
fn a_path_lengthens_and_lanes_fall_asleep_unless_they_are_compacted() {
    let setting = Setting::new(
        "cornell-box",
        "path",
        &depth(5),
        ("cranley-patterson", 0.0),
        4,
    );
    let single = setting.tallies(&[0, 2], "bvh", Organisation::SingleKernel);
    let [compacted, by_warps, by_rays] = [
        Organisation::Compacted,
        Organisation::CompactedByWarps,
        Organisation::CompactedByRays,
    ]
    .map(|organisation| setting.tallies(&[0, 2], "bvh", organisation));
    let efficiency =
        |t: &BTreeMap<String, Tally>, class: &str| t[class].efficiency().expect("issues");
    assert!(efficiency(&single, "bounce 1") < efficiency(&single, "primary"));
    assert!(efficiency(&single, "bounce 5") < efficiency(&single, "bounce 1"));
    for class in single.keys() {
        let s = single[class];
        for c in [&compacted, &by_warps, &by_rays].map(|t| t[class]) {
            assert_eq!(
                [s.rays, s.nodes, s.triangles, s.active, s.bytes],
                [c.rays, c.nodes, c.triangles, c.active, c.bytes]
            );
        }
    }
    // Losing the order of rays costs coherence; losing that of warps almost none.
    let bounces = [&compacted, &by_warps, &by_rays].map(|t| efficiency(t, "bounce 1"));
    assert!(bounces[2] < 0.98 * bounces[0], "{bounces:?}");
    assert!((bounces[1] / bounces[0] - 1.0).abs() < 0.02, "{bounces:?}");
    assert!(efficiency(&compacted, "bounce 5") > 1.3 * efficiency(&single, "bounce 5"));
}

#[test]
fn a_smaller_jitter_makes_rays_more_coherent() {
    let efficiency = |decorrelation| {
        let mut setting = Setting::new("cornell-box", "ao", &[], decorrelation, 256);
        (setting.size, setting.groups) = (LARGE, [6, 4]);
        let tallies = setting.tallies(&[3, 100], "bvh", Organisation::SingleKernel);
        tallies["ao"].efficiency().expect("issues")
    };
    let all = [
        ("none", 0.0),
        ("micro-jitter", 0.5),
        ("micro-jitter", 2.5),
        ("cranley-patterson", 0.0),
    ]
    .map(efficiency);
    assert!(all.is_sorted_by(|a, b| a > b), "{all:?}");
    assert!(all[1] > 1.05 * all[3], "{all:?}");
}

#[test]
fn figures_do_not_depend_on_threads() {
    let setting = Setting::new("cornell-box", "path", &depth(2), ("micro-jitter", 0.0), 16);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| setting.tallies(&[0, 9], "cwbvh", Organisation::Compacted))
    };
    assert_eq!(on(1), on(7));
}

#[test]
fn rays_of_a_buffer_go_in_warps_as_they_follow_each_other() {
    let (soup, rays) = soup_and_rays(6);
    let kind = support::structures()
        .into_iter()
        .find(|k| k.name() == "bvh");
    let kind = kind.expect("bvh");
    let built = build(kind, &soup, &support::default_params(&kind.parameters()));
    let memory = Memory::new(&*built, &soup).expect("memory");
    let twin = built.cpu_twin(&soup).expect("a twin");
    let settings = |groups, warps| Coherence {
        groups,
        warps,
        l1_kib: 128,
        l1_ways: 0,
        ..MACHINE
    };
    let tally = |rays: &[Ray], groups, warps| {
        let found = of_rays(
            rays,
            Query::Closest,
            (&*twin, &memory),
            &settings(groups, warps),
        );
        let of_all = together(&found.expect("tallies of groups"));
        of_all.into_values().next().unwrap_or_default()
    };
    // Every ray once for any groups; the last of three warps is not full.
    let all = tally(&rays[..80], 9, 1);
    assert_eq!((all.rays, all.lanes % 32), (80, 0));
    assert_eq!(tally(&rays[..80], 1, 3).active, all.active);
    // Two groups of one warp: the first, and the last but one.
    let some = tally(&rays[..80], 2, 1);
    assert_eq!(some.rays, 64);
    let alone = |from: usize| tally(&rays[from..from + 32], 1, 1);
    let sum = |of: fn(&Tally) -> u64| of(&alone(0)) + of(&alone(32));
    assert_eq!(some.issues, sum(|t| t.issues));
    assert_eq!(some.active, sum(|t| t.active));
    assert_eq!(some.lines, sum(|t| t.lines));
    // Each group has its own L1, so equal groups need every line twice.
    let twice = [&rays[..32], &rays[..32]].concat();
    let (apart, together) = (tally(&twice, 2, 1), tally(&twice, 1, 2));
    assert_eq!(apart.lines, 2 * alone(0).lines);
    assert_eq!(apart.l2_accesses(), 2 * alone(0).l2_accesses());
    assert_eq!(together.l2_accesses(), alone(0).l2_accesses());
}

const WITH_MODEL: [&str; 4] = [
    "axes.decorrelation = [\"none\", \"cranley-patterson\"]\naxes.sequence = [\"halton\"]\naxes.accel = [\"bvh\", \"cwbvh\", \"uniform-grid\"]",
    "integrator.path.max_depth = 2",
    "gate.shadow_orders = true",
    "[coherence]\ngroups = 2\nwarps = 2\nsamples = 1",
];

#[test]
fn a_run_records_coherence_twice_the_same_and_the_report_shows_it() {
    let experiment = support::small_with(&WITH_MODEL);
    let once = || {
        let folder = tempfile::tempdir().expect("a folder");
        let (summary, lines) =
            support::run(&experiment, &Registries::default(), folder.path(), None);
        assert_eq!((summary.failed, summary.skipped), (0, 0));
        let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
        let figures = std::fs::read_to_string(folder.path().join("figures.csv")).expect("figures");
        let plots = std::fs::read_dir(folder.path().join("plots")).expect("plots");
        let plots: Vec<String> = plots
            .map(|f| f.expect("a file").file_name().to_string_lossy().into())
            .collect();
        (lines, page, figures, plots)
    };
    let (lines, page, figures, plots) = once();
    let records: Vec<_> = all_of::<CoherenceRecord>(&lines).collect();
    assert_eq!(records.len(), 6);
    for record in &records {
        // Two sample counts, four organisations.
        assert_eq!(record.at.len(), 8);
        for at in &record.at {
            let classes: Vec<&str> = at.classes.iter().map(|(class, _)| class.as_str()).collect();
            assert_eq!(
                classes,
                ["primary", "shadow 0", "bounce 1", "shadow 1", "bounce 2"]
            );
            assert_eq!((at.paths, at.classes[0].1.rays), (128, 128));
            // The groups add up to the class, and no group has all of it.
            for ((_, tally), groups) in at.classes.iter().zip(&at.groups) {
                let sum = |i: usize| groups.iter().map(|g| g[i]).sum::<u64>();
                assert_eq!([sum(0), sum(1)], [tally.rays, tally.cost()]);
            }
            assert_eq!(at.groups.len(), at.classes.len());
            assert_eq!(
                at.groups[0].iter().map(|g| g[0]).collect::<Vec<_>>(),
                [64, 64]
            );
        }
        // The same rays through all structures.
        let rays = |r: &CoherenceRecord| r.at.iter().map(|at| at.all().rays).collect::<Vec<_>>();
        let same = records
            .iter()
            .filter(|r| r.key.label(axis::DECORRELATION) == record.key.label(axis::DECORRELATION));
        assert!(same.clone().all(|r| rays(r.body) == rays(record.body)));
    }
    assert!(
        page.contains("SIMT efficiency by bounce") && page.contains("Kendall"),
        "the page"
    );
    assert!(figures.contains("simt-efficiency/v1") && figures.contains("cycles-per-path/v1"));
    for plot in [
        "efficiency-bounces.svg",
        "cycles-spp.png",
        "predicted-times.svg",
    ] {
        assert!(
            plots.iter().any(|name| name.ends_with(plot)),
            "{plot} of {plots:?}"
        );
    }
    check_recorded_rays(&lines);
    let (again, ..) = once();
    let bodies = |lines: &[raystone::measure::record::Line]| -> Vec<String> {
        let found = lines
            .iter()
            .filter(|line| matches!(line.body, Body::Coherence(_)));
        found
            .map(|line| serde_json::to_string(line).expect("text"))
            .collect()
    };
    assert_eq!(bodies(&lines), bodies(&again));
}

/// Checks that two groups of two warps of each class of recorded rays went through the model.
fn check_recorded_rays(lines: &[raystone::measure::record::Line]) {
    let structures: Vec<_> = all_of::<StructureRecord>(lines).collect();
    assert_eq!(structures.len(), 3);
    for structure in structures {
        let coherence = structure.coherence.as_ref().expect("a model");
        let classes = &coherence.classes;
        assert_eq!(coherence.groups.len(), classes.len());
        for ((_, tally), groups) in classes.iter().zip(&coherence.groups) {
            let sum = |i: usize| groups.iter().map(|g| g[i]).sum::<u64>();
            assert_eq!([sum(0), sum(1)], [tally.rays, tally.cost()]);
            assert_eq!(groups.len(), 2);
        }
        assert_eq!(classes.len(), structure.timings.len());
        assert_eq!(classes.len(), 8);
        for ((class, tally), timing) in classes.iter().zip(&structure.timings) {
            assert_eq!((*class, tally.rays), (timing.class, 128));
            let is_shadow = format!("{class:?}").starts_with("Shadow");
            let is_made = is_shadow && format!("{class:?}") != "Shadow";
            assert_eq!(timing.unlike_shadow.is_some(), is_made, "{class:?}");
        }
    }
}

#[test]
fn without_the_section_nothing_is_modelled_and_integrands_are_left_out_with_a_reason() {
    let run = |text: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        support::run(text, &Registries::default(), folder.path(), None)
    };
    let (_, lines) = run(support::SMALL);
    assert_eq!(all_of::<CoherenceRecord>(&lines).count(), 0);
    let (summary, lines) = run(&support::small_with(&[
        "axes.integrator = [\"integrand:disk\"]",
        "coherence = {}",
    ]));
    assert_eq!((summary.failed, summary.skipped), (0, 1));
    let reason = lines.iter().find_map(|line| match &line.body {
        Body::Skipped(skipped) => Some(format!("{}: {}", skipped.cell, skipped.reason)),
        _ => None,
    });
    let reason = reason.expect("a reason");
    assert!(
        reason.contains("coherence of") && reason.contains("integrand:disk"),
        "{reason}"
    );
}

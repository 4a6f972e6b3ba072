//! Materials from outside the program need only a row for rendering and a row of checks. Kernels
//! compose with them, files load as them, single paths and a known image match their formulas, they
//! are exported to Mitsuba, and faults are detected.

mod rows;

use crate::support::*;
use glam::{Vec3, vec3};
use raystone::gpu::{Gpu, KernelLibrary};
use raystone::integrator::{
    IntegratorRegistry, OrganisationRegistry, RayOffset, RenderJob, Renderer,
};
use raystone::measure::image_gate::{Choice, Pixels, answers, judge};
use raystone::measure::kinds::KindChecks;
use raystone::measure::known_images::{SIZE, known_images_of, look, most_samples};
use raystone::measure::mitsuba::{
    MITSUBA_FILE, MitsubaSettings, export_mitsuba, export_mitsuba_of,
};
use raystone::measure::path_oracle::{Estimator, PathOracle, View};
use raystone::measure::record::PathsRecord;
use raystone::measure::trial_scenes::{trial_scenes, trial_scenes_of};
use raystone::params::{ParamValue, Params, Variant};
use raystone::sampling::Sampler;
use raystone::scene::{
    DIFFUSE, LoadOptions, Lobes, MATERIAL_KINDS, MaterialKind, SceneData, encode_normal, load,
};
use rows::{GAUZE, MINNAERT, kinds, minnaert};

const IMAGE: [u32; 2] = [26, 19];

/// The row of balls, including the new kinds.
fn balls(kinds: &KindChecks) -> SceneData {
    let scenes = trial_scenes_of(kinds).expect("scenes").into_iter();
    let mut scenes = scenes.map(|trial| trial.scene);
    let found = scenes.find(|scene| scene.name == "glossy");
    found.expect("the trial scene of gloss")
}

/// The box with a single material and the normals of a bumpy surface.
fn bumpy() -> SceneData {
    let mut scene = builtin("cornell-box", &[]);
    for material in &mut scene.materials {
        let emission = material.emission;
        *material = minnaert(0.5).emitting(emission);
    }
    let bent = |k: usize| {
        let part = |step: usize| ((k * step) % 7) as f32 / 7.0 - 0.5;
        vec3(part(3), part(5), part(2))
    };
    let corners = scene.triangles.iter().enumerate();
    let normals = corners.map(|(id, triangle)| {
        let [a, b, c] = triangle.vertices;
        let flat = (b - a).cross(c - a).normalize();
        [0, 1, 2].map(|k| encode_normal((flat + 0.6 * bent(3 * id + k)).normalize()))
    });
    scene.normals = normals.collect();
    scene
}

fn with<'a>(
    gpu: &'a Gpu,
    stage: &'a Stage,
    sampler: &Sampler,
    (size, what): ([u32; 2], &Variant),
    by: &Variant,
) -> Renderer<'a> {
    let integrator = IntegratorRegistry::default().configured(what);
    let by = OrganisationRegistry::default().configured(by);
    let by = by.unwrap_or_else(|e| panic!("{e}"));
    let integrator = integrator.expect("an integrator").organised(by);
    let job = RenderJob {
        size,
        camera: stage.camera,
        sampler,
        integrator: &integrator.unwrap_or_else(|e| panic!("{e}")),
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let traced = stage.traced(gpu, structure("bvh"));
    Renderer::new(gpu, &stage.buffers, &traced, &job, false).unwrap_or_else(|e| panic!("{e}"))
}

fn organisation(name: &str, changes: &[(&str, &str)]) -> Variant {
    let word =
        |(key, value): &(&str, &str)| ((*key).to_owned(), ParamValue::Name((*value).to_owned()));
    Variant {
        name: name.to_owned(),
        label: name.to_owned(),
        params: Params(changes.iter().map(word).collect()),
    }
}

pub fn verdict(
    gpu: &Gpu,
    scene: &SceneData,
    kinds: &KindChecks,
    more: &[(&str, ParamValue)],
) -> PathsRecord {
    let stage = Stage::new(gpu, scene.clone());
    let sampler = sampler_of("pixel-hash", "none", 100_000);
    let single = organisation("single-kernel", &[]);
    let depth = ("max_depth", ParamValue::Integer(5));
    let what = integrator_variant("path", &[&[depth], more].concat());
    let renderer = with(gpu, &stage, &sampler, (IMAGE, &what), &single);
    let pixels = Pixels {
        size: IMAGE,
        choice: Choice::Every(1),
        samples: vec![0, 3],
        seed: 70_003,
    };
    let answers = answers(&renderer, &pixels).expect("images");
    let oracle = PathOracle::knowing(scene, kinds).expect("known materials");
    let integrator = IntegratorRegistry::default().configured(&what);
    let view = View {
        estimator: Estimator::of(&integrator.expect("an integrator")).expect("a known one"),
        camera: stage.camera,
        size: IMAGE,
        sampler: &sampler,
    };
    judge(&oracle, &view, &answers)
}

/// The device with a fault in a kernel of a kind.
pub fn faulty_gpu((name, text): (&str, &str), from: &str, to: &str) -> Gpu {
    assert_eq!(text.matches(from).count(), 1, "{from}");
    let text = text.replace(from, to);
    open(KernelLibrary::default().with_sources(&[(name, &text)]))
}

#[test]
fn single_paths_are_those_of_the_formulas_and_faults_are_seen() {
    if !is_exact(gpu()) {
        return;
    }
    let (balls, bumpy) = (balls(&kinds()), bumpy());
    assert!([&MINNAERT, &GAUZE].iter().all(|kind| shows(&balls, kind)));
    for scene in [&balls, &bumpy] {
        let record = verdict(gpu(), scene, &kinds(), &[]);
        assert_eq!(record.fault, None, "{}", scene.name);
    }
    let unknown = PathOracle::new(&balls).err();
    assert_eq!(unknown, Some("material `minnaert`".to_owned()));
    for (kind, scene, from, to) in [
        (&MINNAERT, &balls, "pow(cosine * seen", "pow(cosine"),
        (&MINNAERT, &bumpy, "cosine <= 0.0", "cosine <= 0.2"),
        (&GAUZE, &balls, "u.x < passes", "u.x > passes"),
    ] {
        let record = verdict(&faulty_gpu(kind.sources[0], from, to), scene, &kinds(), &[]);
        assert!(record.wrong > 0, "{to}: {record:?}");
    }
}

fn shows(scene: &SceneData, kind: &MaterialKind) -> bool {
    scene.materials.iter().any(|material| material.kind == kind)
}

#[test]
fn a_kernel_for_each_kind_makes_the_image_of_the_single_kernel() {
    let stage = Stage::new(gpu(), balls(&kinds()));
    let sampler = sampler("owen-sobol", "none");
    let image = |by: &Variant| {
        let renderer = with(gpu(), &stage, &sampler, (IMAGE, &path(4)), by);
        let shots = renderer.render(&[2], 9).expect("an image");
        let bits = |pixel: &[f32; 3]| pixel.map(f32::to_bits);
        let pixels: Vec<_> = shots[0].image.pixels.iter().map(bits).collect();
        (pixels, renderer.kernel_text())
    };
    let (expected, text) = image(&organisation("single-kernel", &[]));
    assert!(text.contains("minnaert_scattering") && text.contains("gauze_sample"));
    for shading in ["one", "per-material"] {
        let by = organisation("wavefront", &[("shading", shading)]);
        let (found, _) = image(&by);
        assert!(found == expected, "{shading}");
    }
}

/// The error of a view of a known image.
pub fn fault_in(gpu: &Gpu, kinds: &KindChecks, image: &str, view: &str) -> Option<String> {
    let images = known_images_of(kinds).expect("images");
    let image = images.iter().find(|known| known.name == image);
    let image = image.expect("a known image");
    let view = image.views.iter().find(|known| known.name == view);
    let view = view.expect("one of its views");
    let stage = Stage::new(gpu, image.scene.clone());
    let sampler = sampler_of("owen-sobol", "none", most_samples());
    let single = organisation("single-kernel", &[]);
    let mut renderer = with(gpu, &stage, &sampler, (SIZE, &path(1)), &single);
    look(&mut renderer, image, view).expect("a view").fault
}

#[test]
fn a_plane_is_as_bright_as_the_quadrature_of_its_formula_and_faults_are_seen() {
    let plane = |gpu: &Gpu| fault_in(gpu, &kinds(), "materials", "minnaert");
    assert_eq!(plane(gpu()), None);
    let from = "cosine * INVERSE_PI)";
    let gpu = faulty_gpu(MINNAERT.sources[0], from, &format!("1.01 * {from}"));
    assert!(plane(&gpu).is_some());
}

#[test]
fn mitsuba_is_told_of_it() {
    let scene = balls(&kinds());
    let folder = tempfile::tempdir().expect("a folder");
    let settings = MitsubaSettings {
        camera: scene.view(1.0),
        size: [8, 8],
        spp: 1,
        bounces: 1,
        fronts_only: true,
    };
    let said = export_mitsuba_of(&kinds(), &scene, &settings, folder.path());
    let said = said.expect("a scene").join("\n");
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
    let xml = read(MITSUBA_FILE);
    roxmltree::Document::parse(&xml).expect("XML");
    let balls = xml.matches("<bsdf type=\"raystone-minnaert\"").count();
    assert_eq!(balls, 2, "{xml}");
    assert!(xml.contains("<bsdf type=\"conductor\" id="), "{xml}");
    assert!(read("materials.py").contains("class Minnaert(Opaque)"));
    assert!(
        said.contains("gauze: Mitsuba draws its mirror alone"),
        "{said}"
    );
    let said = export_mitsuba(&scene, &settings, folder.path()).expect("a scene");
    let said = said.join("\n");
    assert!(
        said.contains("minnaert has no counterpart in Mitsuba"),
        "{said}"
    );
}

#[test]
fn files_are_read_into_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write(
        "moon.mtl",
        "newmtl moon\nillum 10\nKd 0.5 0.4 0.3\nNs 0.7\n",
    );
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    write(
        "moon.obj",
        &format!("mtllib moon.mtl\n{corners}usemtl moon\nf 1 2 3\n"),
    );
    let file = Variant {
        name: folder.path().join("moon.obj").display().to_string(),
        label: "file".to_owned(),
        params: Params::default(),
    };
    static KINDS: [&MaterialKind; 2] = [&DIFFUSE, &MINNAERT];
    let options = LoadOptions {
        kinds: &KINDS,
        ..LoadOptions::default()
    };
    let found = load(&file, &options).expect("a model").materials.remove(0);
    assert_eq!((found.kind, found.parameters), (&MINNAERT, vec![0.7]));
    assert_eq!(found.base_color, Vec3::new(0.5, 0.4, 0.3));
    let plain = load(&file, &LoadOptions::default()).expect("a model");
    assert_eq!(plain.materials[0].kind, &DIFFUSE);
}

/// Kinds without a row of checks, and those that nothing shows.
fn unchecked(all: &[&MaterialKind], kinds: &KindChecks) -> Vec<String> {
    let trials = trial_scenes_of(kinds).expect("scenes");
    let images = known_images_of(kinds).expect("images");
    let missing = |kind: &&MaterialKind| {
        let row = kinds
            .materials
            .get(kind.name)
            .is_some_and(|row| row.kind == *kind);
        let tried = trials.iter().any(|trial| shows(&trial.scene, kind));
        let known = images.iter().any(|image| shows(&image.scene, kind));
        let all = [(row, "row"), (tried, "trial scene"), (known, "known image")];
        let missing = all.into_iter().filter(|(there, _)| !there);
        let name = kind.name;
        missing
            .map(move |(_, what)| format!("{name}: no {what}"))
            .collect::<Vec<_>>()
    };
    all.iter().flat_map(missing).collect()
}

#[test]
fn every_kind_has_its_row_and_is_shown() {
    let default = KindChecks::default();
    assert_eq!(unchecked(&MATERIAL_KINDS, &default), [""; 0]);
    assert_eq!(default.materials.iter().count(), MATERIAL_KINDS.len());
    let all = |what: &str| format!("minnaert: no {what}");
    assert_eq!(
        unchecked(&[&MINNAERT], &default),
        ["row", "trial scene", "known image"].map(all)
    );
    assert_eq!(unchecked(&[&MINNAERT], &kinds()), [""; 0]);
    // The program's kinds stay in place.
    let before = trial_scenes().expect("scenes");
    let after = trial_scenes_of(&kinds()).expect("scenes");
    let names = |trials: &[raystone::measure::trial_scenes::TrialScene]| -> Vec<String> {
        trials
            .iter()
            .map(|trial| trial.scene.name.clone())
            .collect()
    };
    assert_eq!(names(&before), names(&after));
}

/// Lines that an entry requires in the table of kernels.
fn lines(number: usize, kind: &MaterialKind) -> Vec<String> {
    let (feature, name) = (kind.feature, kind.feature.to_uppercase());
    let answer =
        |answer: &str| format!("@if({feature}) if (is_of(surface, {name})) {{ return {answer}");
    let mut lines = vec![
        format!("const {name}: u32 = {number}u;"),
        format!("import package::shading::bsdf::{feature}::"),
    ];
    match kind.lobes {
        Lobes::Diffuse => {}
        Lobes::Glossy => lines.extend([
            answer("true; }"),
            answer(&format!("{feature}_scattering(surface, direction); }}")),
            answer(&format!("{feature}_sample(surface, u); }}")),
        ]),
        Lobes::Delta => lines.extend([
            answer("true; }"),
            answer(&format!("{feature}_sample(surface")),
        ]),
    }
    lines
}

#[test]
fn the_table_of_kernels_has_the_lines_that_the_rows_ask_for() {
    let library = KernelLibrary::default();
    let table = library.text("shading/bsdf").expect("the table");
    let missing = |table: &str| -> Vec<String> {
        let all = MATERIAL_KINDS.iter().enumerate();
        let all = all.flat_map(|(number, kind)| lines(number, kind));
        all.filter(|line| table.matches(line.as_str()).count() != 1)
            .collect()
    };
    assert_eq!(missing(table), [""; 0]);
    for line in table
        .lines()
        .filter(|line| line.contains("@if(mirror)") || line.contains("@if(phong)"))
    {
        assert_eq!(missing(&table.replacen(line, "", 1)).len(), 1, "{line}");
    }
}

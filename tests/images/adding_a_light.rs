//! A light from outside the program needs only a row for rendering and a row of checks. Single
//! paths and a known image match its formula, it is exported to Mitsuba, and faults are detected.

use crate::adding_a_material::{fault_in, faulty_gpu, verdict};
use crate::support::*;
use glam::{DVec3, Vec3, vec3};
use raystone::geometry::Camera;
use raystone::measure::kinds::KindChecks;
use raystone::measure::known_images::{KnownImage, View, known_images_of};
use raystone::measure::lights::{LightChecks, LightTwin};
use raystone::measure::mitsuba::{
    Export, ExportError, MITSUBA_FILE, MitsubaSettings, export_mitsuba_of, vector,
};
use raystone::measure::path_oracle::{LightSample, PathOracle, Rounding};
use raystone::measure::trial_scenes::{TrialScene, trial_scenes_of};
use raystone::params::ParamValue;
use raystone::scene::{LIGHT_KINDS, Light, LightKind, LightList, Material, SceneData, SceneError};
use std::f64::consts::PI;

static BULB: LightKind = LightKind {
    name: "bulb",
    description: "a point that shines most along its axis",
    color: "intensity",
    feature: "bulb",
    group: "lights",
    sources: &[(
        "shading/light/bulb",
        include_str!("adding_a_light/kernels/shading/light/bulb.wesl"),
    )],
};

static CHECKS: LightChecks = LightChecks {
    points: || vec![bulb(vec3(0.2, 2.1, 1.2), vec3(0.8, 0.2, 1.0), 3.0)],
    images,
    ..LightChecks::new(&BULB, LightTwin::Alone(sample), in_mitsuba)
};

/// Exports it as an isotropic light.
fn in_mitsuba(export: &mut Export<'_>, _: usize, light: &Light) -> Result<(), ExportError> {
    let place = light.place().map(|(place, _)| vector(place));
    export.xml += &format!(
        "<emitter type=\"point\"><point name=\"position\" value=\"{}\"/><rgb name=\"intensity\" value=\"{}\"/></emitter>\n",
        place.unwrap_or_default(),
        vector(light.color())
    );
    Ok(())
}

const AXIS: Vec3 = vec3(0.36, -0.8, 0.48);

fn bulb(position: Vec3, color: Vec3, exponent: f32) -> Light {
    Light::Other {
        kind: &BULB,
        position,
        direction: AXIS,
        color,
        parameters: [exponent, 0.0, 0.0],
    }
}

fn sample(light: &Light, from: DVec3, _: [f64; 2], _: &mut Rounding) -> Option<LightSample> {
    let Light::Other {
        position,
        direction,
        color,
        parameters: [exponent, ..],
        ..
    } = light
    else {
        return None;
    };
    let axis = direction.as_dvec3();
    let way = position.as_dvec3() - from;
    let direction = way.normalize();
    let part = (0.5 - 0.5 * direction.dot(axis))
        .max(0.0)
        .powf(f64::from(*exponent));
    Some(LightSample {
        direction,
        distance: way.length(),
        radiance: color.as_dvec3() * (part / way.length_squared()),
        density: None,
        triangles: None,
    })
}

fn floor(material: Material) -> Result<SceneData, SceneError> {
    let mut scene = raystone::scene::named("single-triangle")?;
    let corners = [
        vec3(-9.0, 0.0, -9.0),
        vec3(0.0, 0.0, 18.0),
        vec3(9.0, 0.0, -9.0),
    ];
    scene.triangles[0].vertices = corners;
    scene.triangles.truncate(1);
    scene.material_ids = vec![0];
    scene.materials = vec![material];
    scene.camera = Some(Camera::upright(vec3(0.0, 2.0, 5.0), Vec3::ZERO, 45.0));
    (scene.environment, scene.daylight) = (Vec3::ZERO, None);
    Ok(scene)
}

/// The floor below the bulb, by the inverse square.
fn images() -> Result<Vec<KnownImage>, SceneError> {
    const PLACE: Vec3 = vec3(-0.3, 1.4, 0.2);
    let albedo = vec3(0.7, 0.5, 0.3);
    let color = vec3(4.0, 5.0, 6.0);
    let mut scene = floor(Material::diffuse("floor", albedo))?;
    scene.lights = vec![bulb(PLACE, color, 2.0)];
    let view = |(name, x, z): (&str, f32, f32)| {
        let point = vec3(x, 0.0, z);
        let way = (point - PLACE).as_dvec3();
        let cosine = -way.normalize().y;
        let part = (0.5 + 0.5 * way.normalize().dot(AXIS.as_dvec3())).powi(2);
        let irradiance = color.as_dvec3() * (part * cosine / way.length_squared());
        let shown = albedo.as_dvec3() / PI * irradiance;
        View::new(name, point, vec3(0.02, 0.05, -0.04), shown)
    };
    Ok(vec![KnownImage {
        name: "bulb",
        views: [("below", 0.0, 0.0), ("beside", 1.1, -0.8)]
            .map(view)
            .into(),
        scene,
        trial: ("path", vec![("max_depth", ParamValue::Integer(1))]),
    }])
}

fn kinds() -> KindChecks {
    let mut kinds = KindChecks::default();
    kinds.lights.register(&CHECKS);
    kinds
}

fn shows(scene: &SceneData, kind: &LightKind) -> bool {
    let list = LightList::of(scene);
    list.lights.iter().any(|light| light.kind(scene) == kind)
}

/// The scene of lights without triangles including the new one, and the new one alone in a room.
fn scenes() -> [SceneData; 2] {
    let trials = trial_scenes_of(&kinds()).expect("scenes").into_iter();
    let mut trials = trials.map(|trial: TrialScene| trial.scene);
    let points = trials.find(|scene| scene.name == "points");
    let mut alone = builtin("cornell-box", &[]);
    for material in &mut alone.materials {
        material.emission = Vec3::ZERO;
    }
    let bounds = alone.bounds();
    let place = 0.5 * (bounds.min + bounds.max);
    let size = bounds.max - bounds.min;
    alone.lights = vec![bulb(place, size * size, 3.0)];
    [points.expect("the trial scene of points"), alone]
}

#[test]
fn single_paths_are_those_of_the_formula_and_faults_are_seen() {
    if !is_exact(gpu()) {
        return;
    }
    let faults = [
        ("0.5 + 0.5 * cosine", "0.5 - 0.5 * cosine"),
        ("light.a.w)", "light.b.w)"),
    ];
    for (scene, (from, to)) in scenes().iter().zip(faults) {
        assert!(shows(scene, &BULB), "{}", scene.name);
        for choice in ["power", "tree"] {
            let more = ("light_choice", ParamValue::Name(choice.to_owned()));
            let record = verdict(gpu(), scene, &kinds(), &[more]);
            assert_eq!(record.fault, None, "{} {choice}", scene.name);
        }
        let unknown = PathOracle::new(scene).err();
        assert_eq!(unknown, Some("light `bulb`".to_owned()));
        let gpu = faulty_gpu(BULB.sources[0], from, to);
        let record = verdict(&gpu, scene, &kinds(), &[]);
        assert!(record.wrong > 0, "{to}: {record:?}");
    }
}

#[test]
fn a_floor_is_as_bright_as_the_inverse_square_says_and_faults_are_seen() {
    for view in ["below", "beside"] {
        assert_eq!(fault_in(gpu(), &kinds(), "bulb", view), None);
    }
    let gpu = faulty_gpu(BULB.sources[0], "light.a.w)", "1.02 * light.a.w)");
    assert!(fault_in(&gpu, &kinds(), "bulb", "beside").is_some());
}

#[test]
fn mitsuba_is_told_of_it_or_it_is_refused_by_name() {
    let mut scene = floor(Material::diffuse("floor", Vec3::ONE)).expect("a scene");
    scene.lights = vec![bulb(Vec3::Y, vec3(1.0, 2.5, 3.0), 1.0)];
    let folder = tempfile::tempdir().expect("a folder");
    let settings = MitsubaSettings {
        camera: scene.view(1.0),
        size: [8, 8],
        spp: 1,
        bounces: 1,
        fronts_only: true,
    };
    let export = |kinds: &KindChecks| export_mitsuba_of(kinds, &scene, &settings, folder.path());
    export(&kinds()).expect("a scene");
    let xml = std::fs::read_to_string(folder.path().join(MITSUBA_FILE)).expect("a file");
    roxmltree::Document::parse(&xml).expect("XML");
    assert!(
        xml.contains("<rgb name=\"intensity\" value=\"1 2.5 3\"/>"),
        "{xml}"
    );
    let refused = export(&KindChecks::default()).expect_err("a light that is not known");
    assert!(refused.to_string().contains("light 0, a bulb"), "{refused}");
}

/// Kinds without a row of checks, and those that nothing shows.
fn unchecked(all: &[&LightKind], kinds: &KindChecks) -> Vec<String> {
    let trials = trial_scenes_of(kinds).expect("scenes");
    let images = known_images_of(kinds).expect("images");
    let missing = |kind: &&LightKind| {
        let row = kinds.lights.get(kind.name);
        let row = row.is_some_and(|row| row.kind == *kind);
        let tried = trials.iter().any(|trial| shows(&trial.scene, kind));
        let known = images.iter().any(|image| shows(&image.scene, kind));
        let all = [(row, "row"), (tried, "trial scene"), (known, "known image")];
        let missing = all.into_iter().filter(|(there, _)| !there);
        let name = kind.name;
        let lines = missing.map(move |(_, what)| format!("{name}: no {what}"));
        lines.collect::<Vec<_>>()
    };
    all.iter().flat_map(missing).collect()
}

#[test]
fn every_kind_has_its_row_and_is_shown() {
    let default = KindChecks::default();
    assert_eq!(unchecked(&LIGHT_KINDS, &default), [""; 0]);
    assert_eq!(default.lights.iter().count(), LIGHT_KINDS.len());
    let all = ["row", "trial scene", "known image"].map(|what| format!("bulb: no {what}"));
    assert_eq!(unchecked(&[&BULB], &default), all);
    assert_eq!(unchecked(&[&BULB], &kinds()), [""; 0]);
}

//! The readers of untrusted bytes, one function each: called by the fuzz targets in `fuzz/` and by
//! `tests/mutated_files`, so that neither can rot alone.
//!
//! Each accepts any bytes and returns the outcome.
#![allow(dead_code)] // Every fuzz target calls one of them.

use raystone::accel::{AccelRegistry, BuildLog, TriangleSoup};
use raystone::config::{Catalogue, Experiment, Plan};
use raystone::discrepancy::PointSet;
use raystone::measure::record::{Line, RECORDS_FILE, read_records};
use raystone::params::{Params, Variant};
use raystone::report::data::RunData;
use raystone::report::{sections, terminal_tables};
use raystone::run::Registries;
use raystone::scene::{self, Bounds, IesProfile, LoadOptions, MAX_COORDINATE, SceneData};
use raystone::text::plain_text;
use std::path::Path;
use std::sync::LazyLock;

/// The result of a reader.
pub enum Outcome {
    /// Accepted; a call examines the result, and panics if that is unsound.
    Accepted(Box<dyn FnOnce()>),
    /// Refused, with the message that a user gets; it calls the file [`FILE`] with an extension.
    Refused(String),
}

impl Outcome {
    /// Examines an accepted result.
    ///
    /// # Panics
    /// If it is unsound.
    pub fn examine(self) {
        if let Self::Accepted(look) = self {
            look();
        }
    }
}

/// The file's name in messages, except for records, whose name is fixed.
pub const FILE: &str = "foreign";

type Error = Box<dyn std::error::Error>;

/// Reads some bytes.
pub type Target = fn(&[u8]) -> Outcome;

/// All readers, by the names of the fuzz targets and of the folders of their corpora.
pub const TARGETS: [(&str, Target); 7] = [
    ("experiment", experiment),
    ("obj", obj),
    ("gltf", gltf),
    ("ply", ply),
    ("ies", ies),
    ("points", points),
    ("records", records),
];

/// Between the text of an OBJ file and that of its library [`MTL_FILE`].
pub const OBJ_SEPARATOR: u8 = 0;

/// The library that OBJ texts may name.
pub const MTL_FILE: &str = "m.mtl";

/// An experiment file: parsed and checked; then planned.
pub fn experiment(bytes: &[u8]) -> Outcome {
    static KNOWN: LazyLock<(Registries, Catalogue)> = LazyLock::new(|| {
        let registries = Registries::default();
        let catalogue = registries.catalogue();
        (registries, catalogue)
    });
    let (registries, catalogue) = &*KNOWN;
    in_folder(&[("foreign.toml", bytes)], |folder| {
        let experiment = Experiment::load(&folder.join("foreign.toml"), &[], catalogue)?;
        let plan = Plan::new(&experiment, &[], |sequence, decorrelation| {
            registries.is_randomised(sequence, decorrelation)
        })?;
        Ok(Box::new(move || {
            assert!(!plan.structures.is_empty(), "a plan of nothing");
            assert!(!plan.describe().is_empty());
            let again = Experiment::parse(&experiment.text, &experiment.source, &[], catalogue);
            assert_eq!(again.expect("its own text is accepted"), experiment);
        }))
    })
}

/// An OBJ file, and the library beside it after [`OBJ_SEPARATOR`].
pub fn obj(bytes: &[u8]) -> Outcome {
    let mut parts = bytes.splitn(2, |byte| *byte == OBJ_SEPARATOR);
    let text = parts.next().unwrap_or_default();
    let library = parts.next().unwrap_or_default();
    in_folder(&[("foreign.obj", text), (MTL_FILE, library)], |folder| {
        load_scene(&folder.join("foreign.obj"))
    })
}

/// A glTF document or a GLB container.
pub fn gltf(bytes: &[u8]) -> Outcome {
    in_folder(&[("foreign.gltf", bytes)], |folder| {
        load_scene(&folder.join("foreign.gltf"))
    })
}

/// A PLY file.
pub fn ply(bytes: &[u8]) -> Outcome {
    in_folder(&[("foreign.ply", bytes)], |folder| {
        load_scene(&folder.join("foreign.ply"))
    })
}

/// A photometric file of a luminaire.
pub fn ies(bytes: &[u8]) -> Outcome {
    in_folder(&[("foreign.ies", bytes)], |folder| {
        let profile = IesProfile::read(&folder.join("foreign.ies"))?;
        Ok(Box::new(move || {
            let (vertical, horizontal) = (&profile.vertical, &profile.horizontal);
            assert_eq!(profile.candela.len(), vertical.len() * horizontal.len());
            let ascends = |angles: &[f32]| angles.windows(2).all(|pair| pair[0] < pair[1]);
            assert!(ascends(vertical) && ascends(horizontal), "{profile:?}");
            let is_intensity = |x: &f32| *x >= 0.0 && x.is_finite();
            assert!(profile.candela.iter().all(is_intensity), "{profile:?}");
        }))
    })
}

/// A list of points, as `raystone points` reads it.
pub fn points(bytes: &[u8]) -> Outcome {
    let look = |points: PointSet| {
        assert!(points.len() > 0 && points.dim() > 0);
        for point in points.points() {
            assert_eq!(point.len(), points.dim());
            assert!(point.iter().all(|x| (0.0..=1.0).contains(x)), "{point:?}");
        }
    };
    let text = match plain_text(bytes.to_vec()) {
        Ok(text) => text,
        Err(error) => {
            let line = error.line;
            return Outcome::Refused(format!("{FILE}.txt: line {line}: it is not UTF-8 text"));
        }
    };
    match PointSet::parse(&text) {
        Ok(points) => Outcome::Accepted(Box::new(move || look(points))),
        Err(error) => Outcome::Refused(format!("{FILE}.txt: {error}")),
    }
}

/// The records of a run.
pub fn records(bytes: &[u8]) -> Outcome {
    in_folder(&[(RECORDS_FILE, bytes)], |folder| {
        let records = read_records(folder)?;
        Ok(Box::new(move || {
            assert!(!records.lines.is_empty());
            for line in &records.lines {
                let text = serde_json::to_string(line).expect("what was read can be written");
                let again: Line = serde_json::from_str(&text).expect(&text);
                assert_eq!(*line, again);
            }
            terminal_tables(&records.lines);
            let data = RunData::new(&records.lines);
            let document = sections::document(Path::new(""), &data, &records.warnings);
            assert!(!document.sections.is_empty());
        }))
    })
}

/// Puts files into a folder of their own for `read`.
fn in_folder(
    files: &[(&str, &[u8])],
    read: impl FnOnce(&Path) -> Result<Box<dyn FnOnce()>, Error>,
) -> Outcome {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("a temporary file can be written");
    }
    match read(folder.path()) {
        Ok(look) => Outcome::Accepted(look),
        Err(error) => Outcome::Refused(error.to_string()),
    }
}

fn load_scene(path: &Path) -> Result<Box<dyn FnOnce()>, Error> {
    let variant = Variant {
        name: path.to_string_lossy().into_owned(),
        params: Params::default(),
        label: FILE.to_owned(),
    };
    let scene = scene::load(&variant, &LoadOptions::default())?;
    Ok(Box::new(move || check_scene(&scene)))
}

/// Checks the assumptions of structures and kernels about a scene.
fn check_scene(scene: &SceneData) {
    let triangles = scene.triangles.len();
    assert!(triangles > 0, "no triangle");
    assert_eq!(scene.material_ids.len(), triangles);
    assert!(scene.uvs.is_empty() || scene.uvs.len() == triangles);
    assert!(scene.normals.is_empty() || scene.normals.len() == triangles);
    let bounds = Bounds::of(&scene.triangles);
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    assert!(largest <= MAX_COORDINATE, "{bounds:?}");
    assert!(
        scene
            .triangles
            .iter()
            .flat_map(|t| t.vertices)
            .all(|v| v.is_finite())
    );
    assert!(scene.uvs.iter().flatten().all(|uv| uv.is_finite()));
    let materials = scene.materials.len();
    assert!(
        scene
            .material_ids
            .iter()
            .all(|id| (*id as usize) < materials)
    );
    for material in &scene.materials {
        let color = material.base_color;
        assert!(
            color.min_element() >= 0.0 && color.max_element() <= 1.0,
            "{material:?}"
        );
        let emission = material.emission;
        assert!(
            emission.is_finite() && emission.min_element() >= 0.0,
            "{material:?}"
        );
        for used in material.texture_uses().into_iter().flatten() {
            assert!(
                (used.texture as usize) < scene.textures.len(),
                "{material:?}"
            );
        }
    }
    for texture in &scene.textures {
        let texels = texture.width as usize * texture.height as usize;
        assert_eq!(texture.texels.len(), texels, "{}", texture.name);
    }
    let camera = scene.view(1.0);
    raystone::scene::check_camera(&camera).expect("a camera that sees something");
    if let Some(assembly) = &scene.assembly {
        assert_eq!(assembly.triangles(), triangles as u64);
    }
    check_structure(scene);
}

fn check_structure(scene: &SceneData) {
    let registry = AccelRegistry::default();
    let (kind, entry) = registry
        .get("bvh")
        .zip(registry.entries().into_iter().find(|e| e.name == "bvh"))
        .expect("there is a structure `bvh`");
    let soup = TriangleSoup::new(scene);
    let params = entry.default_variant().params;
    let built = kind.build(&soup, &params, &mut BuildLog::default());
    let built = built.expect("a small scene can be built");
    built.validate(&soup).expect("the structure is valid");
}

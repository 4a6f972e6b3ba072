//! Substitutes for the theses' scenes, with licences and sources.

use std::path::{Path, PathBuf};

/// A model used by the experiments of theses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Model {
    /// Path below the scene directory.
    pub path: &'static str,
    /// Number of triangles.
    pub triangles: u64,
    /// Licence and author.
    pub licence: &'static str,
    /// Its source.
    pub from: &'static str,
}

/// All models named by experiments in `experiments/thesis`.
#[rustfmt::skip]
pub static MODELS: [Model; 7] = [
    Model { path: "sponza-crytek/sponza.obj", triangles: 262_267,
            licence: "CC BY 3.0, Frank Meinl / Crytek, after Marko Dabrovic; conversion by Morgan McGuire",
            from: "https://casual-effects.com/data (Crytek Sponza); its objects merged into one file" },
    Model { path: "sponza-dabrovic/sponza_dabrovic.obj", triangles: 66_454,
            licence: "Marko Dabrovic; no licence stated",
            from: "https://casual-effects.com/data (Dabrovic Sponza)" },
    Model { path: "country-kitchen/kitchen.glb", triangles: 1_021_815,
            licence: "CC BY 3.0, Jay-Artist (BlendSwap 42851)",
            from: "https://benedikt-bitterli.me/resources (Country Kitchen), converted to glTF" },
    Model { path: "white-room/white_room.glb", triangles: 394_263,
            licence: "CC BY 3.0, Jay-Artist (BlendSwap 41683)",
            from: "https://casual-effects.com/data (Living Room), converted to glTF" },
    Model { path: "fireplace-room/fireplace_room.glb", triangles: 105_299,
            licence: "CC BY 3.0, Wig42 (BlendSwap 75795)",
            from: "https://casual-effects.com/data (Fireplace Room), converted to glTF" },
    Model { path: "stanford-bunny/stanford-bunny.obj", triangles: 69_451,
            licence: "Stanford 3D Scanning Repository, for research, with credit",
            from: "https://graphics.stanford.edu/data/3Dscanrep" },
    Model { path: "stanford-dragon/dragon_100k.obj", triangles: 99_999,
            licence: "Stanford 3D Scanning Repository, for research, with credit",
            from: "https://graphics.stanford.edu/data/3Dscanrep, reduced to 100,000 triangles" },
];

/// The folder of models as written in experiments.
pub(crate) const IN_FILES: &str = "../shared/scenes";

/// Returns the scene directory: `asked` if given, `../shared/scenes` if it exists, otherwise that of the user's data.
pub fn directory(asked: Option<&Path>) -> PathBuf {
    if let Some(asked) = asked {
        return asked.to_owned();
    }
    let shared = PathBuf::from(IN_FILES);
    if shared.is_dir() {
        return shared;
    }
    let data = std::env::var_os("XDG_DATA_HOME").map(PathBuf::from);
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".local/share"));
    let data = data.filter(|path| path.is_absolute()).or_else(home);
    data.map_or(shared, |data| data.join("raystone").join("scenes"))
}

/// Returns the scene of a substitute that selects a variant by a pattern, such as `instances(*count=8*`.
pub(crate) fn name_of(scene: &str) -> &str {
    scene.split_once('(').map_or(scene, |(name, _)| name)
}

/// Returns `true` if a substitute is a path, and not a built-in scene.
pub fn is_model(scene: &str) -> bool {
    name_of(scene).contains('.')
}

/// Returns instructions for getting a missing model.
pub fn what_to_get(scene: &str, directory: &Path) -> String {
    let place = directory.join(scene);
    let model = MODELS.iter().find(|model| model.path == scene);
    let from = model.map_or("", |model| model.from);
    format!(
        "{} is missing; get it from {from}, or name another folder with --scenes",
        place.display()
    )
}

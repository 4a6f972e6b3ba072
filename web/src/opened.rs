//! What the visitor opened: a model, with the files that it names, or an experiment.

use crate::memory::{Held, plain};
use raystone_bench::run::Registries;
use raystone_config::Catalogue;
use raystone_scene::SceneError;
use raystone_viewer::{START, Screen};
use std::path::{Path, PathBuf};

/// Endings of what can be shown, those first that name others.
const ENDINGS: [&str; 6] = ["toml", "xml", "gltf", "glb", "obj", "ply"];

/// Files that were opened together.
pub(crate) struct Opened {
    pub files: Held,
    /// What can be shown of them, the likeliest first; anything, if nothing can.
    pub shown: Vec<String>,
}

impl Opened {
    /// Files by the names that the page gave them: paths below what was opened.
    pub(crate) fn new(files: Vec<(String, Vec<u8>)>) -> Self {
        let (names, contents): (Vec<String>, Vec<Vec<u8>>) = files.into_iter().unzip();
        let paths: Vec<PathBuf> = names.iter().map(|name| plain(Path::new(name))).collect();
        let above = common_folder(&paths);
        let short = paths
            .iter()
            .map(|path| path.strip_prefix(&above).unwrap_or(path));
        let short: Vec<PathBuf> = short.map(Path::to_owned).collect();
        let mut ranked: Vec<(usize, usize, String)> = short
            .iter()
            .filter_map(|path| Some((rank(path)?, path.components().count(), text(path))))
            .collect();
        ranked.sort();
        let mut shown: Vec<String> = ranked.into_iter().map(|(.., name)| name).collect();
        if shown.is_empty() {
            shown.extend(short.first().map(|path| text(path)));
        }
        let contents = contents.into_iter().map(Into::into);
        Self {
            files: short.into_iter().zip(contents).collect(),
            shown,
        }
    }

    /// Whether an experiment is shown.
    pub(crate) fn is_experiment(&self) -> bool {
        let first = self.shown.first().map(Path::new);
        first.and_then(rank) == Some(0)
    }

    /// The models among them.
    pub(crate) fn models(&self) -> Vec<&String> {
        let is_model = |name: &&String| rank(Path::new(name.as_str())).is_some_and(|rank| rank > 0);
        self.shown.iter().filter(is_model).collect()
    }

    /// What is to be on screen after `now`.
    ///
    /// # Errors
    /// Nothing was opened, it is no experiment or model by its name, or the experiment has a mistake; in words.
    pub(crate) fn screen(
        &self,
        now: Option<&Screen>,
        registries: &Registries,
        catalogue: &Catalogue,
    ) -> Result<Screen, String> {
        let name = self
            .shown
            .first()
            .ok_or("nothing was opened: it holds no file")?;
        if self.is_experiment() {
            let bytes = self
                .files
                .get(Path::new(name))
                .map_or(&[][..], |bytes| bytes);
            let text = std::str::from_utf8(bytes).map_err(|e| format!("{name}: no text: {e}"))?;
            return Screen::parse(text, name, &[], registries);
        }
        if rank(Path::new(name)).is_none() {
            let path = PathBuf::from(name);
            return Err(SceneError::UnknownFormat { path }.to_string());
        }
        let mut screen = match now {
            Some(screen) => screen.clone(),
            None => Screen::parse(START, "view", &[], registries)?,
        };
        screen.open(name, catalogue)?;
        // It may have nothing that moves so.
        (screen.animation, screen.window.play, screen.window.frame) = (None, false, 0);
        Ok(screen)
    }
}

/// The place of a file's ending among [`ENDINGS`].
fn rank(path: &Path) -> Option<usize> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    ENDINGS.iter().position(|known| *known == ending)
}

fn text(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// The folder that all files are in.
fn common_folder(paths: &[PathBuf]) -> PathBuf {
    let mut folders = paths.iter().filter_map(|path| path.parent());
    let first = folders.next().map(Path::to_owned).unwrap_or_default();
    folders.fold(first, |common, folder| {
        let both = common.components().zip(folder.components());
        both.take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_config::Axis;

    fn opened(names: &[&str]) -> Opened {
        let file = |name: &&str| ((*name).to_owned(), Vec::new());
        Opened::new(names.iter().map(file).collect())
    }

    #[test]
    fn the_model_of_a_folder_is_found_and_the_folder_left_out_of_its_name() {
        let of = |names: &[&str]| opened(names).shown;
        assert_eq!(
            of(&["hall/maps/a.png", "hall/hall.mtl", "hall/hall.OBJ"]),
            ["hall.OBJ"]
        );
        assert_eq!(
            of(&["a/x.bin", "b/c/x.gltf", "b/y.gltf"]),
            ["b/y.gltf", "b/c/x.gltf"]
        );
        // What names others comes first: an experiment its models, Nori's XML its meshes.
        assert_eq!(of(&["m.obj", "s.xml"]), ["s.xml", "m.obj"]);
        let study = opened(&["m.ply", "s.toml"]);
        assert!(study.is_experiment());
        assert_eq!(study.models(), ["m.ply"]);
        // Anything, so that the sentence names it.
        assert_eq!(of(&["notes.txt"]), ["notes.txt"]);
        assert!(of(&[]).is_empty());
        let held = opened(&["hall/maps/a.png", "hall/hall.obj"]).files;
        assert_eq!(
            held.keys().collect::<Vec<_>>(),
            [Path::new("hall.obj"), Path::new("maps/a.png")]
        );
    }

    #[test]
    fn a_model_takes_the_place_of_the_scene_and_an_experiment_that_of_all() {
        let registries = Registries::default();
        let catalogue = registries.catalogue();
        let screen = |opened: &Opened, now| opened.screen(now, &registries, &catalogue);
        let model = screen(&opened(&["a.obj"]), None).unwrap();
        assert_eq!(model.cells[0][Axis::Scene].name, "a.obj");
        let text = "[run]\nspp = [3]\n[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\nsequence = [\"sobol\"]\n";
        let file = |text: &str| vec![("s.toml".to_owned(), text.as_bytes().to_vec())];
        let study = screen(&Opened::new(file(text)), Some(&model)).unwrap();
        assert_eq!(
            (study.spp, study.cells[0][Axis::Scene].name.as_str()),
            (3, "cornell-box")
        );
        for (wrong, says) in [
            (opened(&[]), "nothing was opened"),
            (opened(&["notes.txt"]), "notes.txt: unknown model format"),
            (Opened::new(file("[axes]\nscene = 7\n")), "s.toml"),
            (
                Opened::new(vec![("s.toml".to_owned(), vec![0xff])]),
                "no text",
            ),
        ] {
            let said = screen(&wrong, Some(&model)).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
    }
}

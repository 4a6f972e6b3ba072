//! Files of the visitor, held in memory: a browser has no file system.

use raystone_core::files::Files;
use std::collections::BTreeMap;
use std::io::{self, Cursor, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Contents by path.
pub(crate) type Held = BTreeMap<PathBuf, Arc<[u8]>>;

/// The files that were opened last; their folders are those in their names.
pub(crate) struct Memory(Mutex<Held>);

/// The files of the page.
pub(crate) static MEMORY: Memory = Memory(Mutex::new(Held::new()));

impl Memory {
    /// Holds these files in place of those of before, which are returned.
    pub(crate) fn replace(&self, files: Held) -> Held {
        std::mem::replace(&mut *self.held(), files)
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The path without `.` and `..`, from the root of all that is held.
pub(crate) fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => plain.push(name),
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir | Component::RootDir | Component::Prefix(_) => {}
        }
    }
    plain
}

fn is_inside(file: &Path, folder: &Path) -> bool {
    file != folder && file.starts_with(folder)
}

fn has_folder(held: &Held, folder: &Path) -> bool {
    held.keys().any(|file| is_inside(file, folder))
}

impl Files for Memory {
    fn open(&self, path: &Path) -> io::Result<(Box<dyn Read + Send>, u64)> {
        let (path, held) = (plain(path), self.held());
        match held.get(&path) {
            Some(bytes) => Ok((Box::new(Cursor::new(Arc::clone(bytes))), bytes.len() as u64)),
            None if has_folder(&held, &path) => Err(io::ErrorKind::IsADirectory.into()),
            None => Err(io::Error::new(
                io::ErrorKind::NotFound,
                "it is not among the opened files",
            )),
        }
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        let (inside, held) = (plain(folder), self.held());
        let files = held.keys().filter(|file| is_inside(file, &inside));
        let names = files.filter_map(|file| file.strip_prefix(&inside).ok()?.components().next());
        let mut found: Vec<PathBuf> = names.map(|name| folder.join(name)).collect();
        found.dedup();
        if found.is_empty() {
            return Err(io::ErrorKind::NotFound.into());
        }
        Ok(found)
    }

    fn is_folder(&self, path: &Path) -> bool {
        has_folder(&self.held(), &plain(path))
    }

    fn real(&self, path: &Path) -> io::Result<PathBuf> {
        let (path, held) = (plain(path), self.held());
        if held.contains_key(&path) || has_folder(&held, &path) {
            return Ok(path);
        }
        Err(io::ErrorKind::NotFound.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_scene::SceneError;

    fn held(files: &[(&str, &str)]) -> Held {
        let file = |(name, text): &(&str, &str)| (plain(Path::new(name)), text.as_bytes().into());
        files.iter().map(file).collect()
    }

    #[test]
    fn paths_lead_where_those_of_a_disk_do() {
        let memory = Memory(Mutex::new(held(&[
            ("a.obj", "x"),
            ("maps/wood/b.png", "yz"),
        ])));
        let read = |path: &str| {
            let (mut file, length) = memory.open(Path::new(path))?;
            let mut text = String::new();
            file.read_to_string(&mut text)?;
            assert_eq!(text.len() as u64, length);
            Ok::<_, io::Error>(text)
        };
        assert_eq!(read("maps/../maps/./wood/b.png").unwrap(), "yz");
        assert_eq!(read("./a.obj").unwrap(), "x");
        for missing in ["b.obj", "maps", "maps/wood/b.png/c", ""] {
            assert!(read(missing).is_err(), "{missing}");
        }
        let names = |folder: &str| memory.list(Path::new(folder)).unwrap();
        assert_eq!(names("."), [Path::new("./a.obj"), Path::new("./maps")]);
        assert_eq!(names("maps"), [Path::new("maps/wood")]);
        assert!(memory.list(Path::new("a.obj")).is_err());
        assert!(memory.is_folder(Path::new("maps/wood")) && !memory.is_folder(Path::new("a.obj")));
        assert_eq!(
            memory.real(Path::new("maps/../a.obj")).unwrap(),
            Path::new("a.obj")
        );
        assert!(memory.real(Path::new("no")).is_err());
    }

    /// Models are read from memory once it is handed in; a file that is missing is named.
    #[test]
    fn loaders_read_from_memory() {
        raystone_core::files::read_from(&MEMORY).unwrap();
        let obj = "mtllib maps/a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
        let before = MEMORY.replace(held(&[
            ("dir/a.obj", obj),
            ("dir/maps/a.mtl", "newmtl red\nKd 1 0 0\n"),
        ]));
        assert!(before.is_empty());
        let scene = raystone_scene::named("dir/a.obj").unwrap();
        assert_eq!(
            (scene.triangles.len(), scene.materials[0].name.as_str()),
            (1, "red")
        );
        MEMORY.replace(held(&[("dir/a.obj", obj)]));
        let scene = raystone_scene::named("dir/a.obj").unwrap();
        let notes = scene.report.lines().join(" ");
        assert!(
            notes.contains("maps/a.mtl") && notes.contains("among the opened"),
            "{notes}"
        );
        let missing = raystone_scene::named("dir/b.obj").unwrap_err();
        assert!(matches!(
            missing,
            SceneError::Read { .. } | SceneError::Unknown { .. }
        ));
        assert!(missing.to_string().contains("b.obj"), "{missing}");
        MEMORY.replace(Held::new());
    }
}

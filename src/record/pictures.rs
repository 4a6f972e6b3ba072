//! Files of images that records name.

use super::{Body, Key, Line};
use raystone_config::{Axis, Cell};
use raystone_core::text::slug;

/// The axes that distinguish the images of samplers.
pub const IMAGE_AXES: [Axis; 4] = [
    Axis::Scene,
    Axis::Integrator,
    Axis::Sequence,
    Axis::Decorrelation,
];

/// Images of all replicates of a sampler together: by how their names begin.
pub const SPREAD: [&str; 2] = ["mean", "variance"];

/// The images of a line, relative to the run's folder. A name that leads elsewhere is none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pictures {
    /// PNG files.
    pub shown: Vec<String>,
    /// Linear images beside them, without the extension, which is that of the requested format. Runs store small ones unasked.
    pub linear: Vec<String>,
    /// Linear images of the statistics of all replicates, without the extension: of randomised samplers, where a run was asked for
    /// images.
    pub spread: Vec<String>,
}

impl Pictures {
    /// Returns the images of a line.
    pub fn of(line: &Line) -> Self {
        let mut all = Self::default();
        match &line.body {
            Body::Error(record) => {
                all.shown.extend(record.error_map.iter().cloned());
                if let Some(image) = &record.image {
                    all.add_with_linear(image);
                    let folder = image.split_once('/').filter(|_| record.randomised);
                    let spread = |(folder, _)| SPREAD.map(|kind| named(folder, kind, &line.key));
                    all.spread.extend(folder.into_iter().flat_map(spread));
                }
            }
            Body::Structure(record) => all.shown.extend(record.heat_map.iter().cloned()),
            Body::Reference(record) => all.add_with_linear(&record.image),
            Body::Measured(record) => all.shown.extend(record.picture.iter().cloned()),
            _ => {}
        }
        for names in [&mut all.shown, &mut all.linear, &mut all.spread] {
            names.retain(|name| is_plain(name));
        }
        all
    }

    fn add_with_linear(&mut self, image: &str) {
        self.shown.push(image.to_owned());
        self.linear
            .extend(image.strip_suffix(".png").map(str::to_owned));
    }
}

/// Returns the name of an image of this kind of a sampler, without its ending.
fn named(folder: &str, kind: &str, key: &Key) -> String {
    let labels = Cell::from(key).labels(&IMAGE_AXES);
    let labels = labels.iter().map(String::as_str);
    let parts: Vec<&str> = std::iter::once(kind).chain(labels).collect();
    format!("{folder}/{}", slug(&parts))
}

/// Returns `true` if a name is that of a file in a folder of images.
fn is_plain(name: &str) -> bool {
    name.split_once('/').is_some_and(|(folder, file)| {
        folder.starts_with("images")
            && !file.is_empty()
            && !file.starts_with('.')
            && !file.contains(['/', '\\'])
    })
}

//! Names of competitors: their main label, and the further axes on which their run varies.

use raystone_record::{Body, Key, Line, axis};

/// Axes that are named only where a run has more than one value of them.
const NAMED_IF_VARIED: [&str; 6] = [
    axis::TRIANGLE,
    axis::BOX_TEST,
    axis::OFFSET,
    axis::ORGANISATION,
    axis::WORKGROUP,
    axis::LOAD,
];

/// The names of one run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    varied: Vec<&'static str>,
}

impl Names {
    /// Finds the axes on which the competitors of a run differ. References are none: they are rendered with the
    /// default offset, whatever a sampler's.
    pub fn new(lines: &[Line]) -> Self {
        let keys = || {
            let competing = |line: &&Line| !matches!(line.body, Body::Reference(_));
            lines.iter().filter(competing).map(|line| &line.key)
        };
        let is_varied = |axis: &&'static str| {
            let mut labels = keys().map(|key| key.label(axis)).filter(|l| !l.is_empty());
            let first = labels.next();
            labels.any(|label| Some(label) != first)
        };
        Self {
            varied: NAMED_IF_VARIED.into_iter().filter(is_varied).collect(),
        }
    }

    /// Returns the name of a structure among all of its scene.
    pub fn structure(&self, key: &Key) -> String {
        let main = key.label(axis::ACCEL).to_owned();
        let further = [axis::TRIANGLE, axis::BOX_TEST, axis::WORKGROUP, axis::LOAD];
        self.with_further(main + &kernels(key), key, &further)
    }

    /// Returns the name of a sampler among those of one view, or of one whose words were read back.
    pub fn sampler(&self, key: &Key) -> String {
        let [sequence, decorrelation] =
            [axis::SEQUENCE, axis::DECORRELATION].map(|axis| key.label(axis));
        let main = format!("{sequence} × {decorrelation}{}", kernels(key));
        self.with_further(main, key, &[axis::OFFSET])
    }

    /// Returns the name of the images of a view: the integrator, the tests of its rays against triangles and boxes,
    /// and its organisation.
    pub fn view(&self, key: &Key) -> String {
        let main = key.label(axis::INTEGRATOR).to_owned();
        let name = self.with_further(main, key, &[axis::TRIANGLE, axis::BOX_TEST]);
        // Errors are those of any organisation, and shown with the default one.
        match key.label(axis::ORGANISATION) {
            "" | "single-kernel" => name,
            _ => self.with_further(name, key, &[axis::ORGANISATION]),
        }
    }

    fn with_further(&self, main: String, key: &Key, axes: &[&str]) -> String {
        let varied = axes.iter().filter(|axis| self.varied.contains(axis));
        let labels = varied.map(|axis| key.label(axis));
        labels
            .filter(|label| !label.is_empty())
            .fold(main, |name, label| format!("{name} · {label}"))
    }
}

/// Returns ` @` and the kernels that replace the embedded ones; empty for these.
fn kernels(key: &Key) -> String {
    match key.label(axis::KERNELS) {
        "" => String::new(),
        kernels => format!(" @{kernels}"),
    }
}

//! The subject of a figure: a value on each of some axes.

use raystone_config::{Axis, Cell};
use raystone_core::params::{Params, Variant};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// Names of axes, in the order in which exports show them: those of experiments, and others that figures have.
pub mod axis {
    use raystone_config::Axis;

    /// The traced scene.
    pub const SCENE: &str = Axis::Scene.name();
    /// Acceleration structure.
    pub const ACCEL: &str = Axis::Accel.name();
    /// The computed quantity.
    pub const INTEGRATOR: &str = Axis::Integrator.name();
    /// Sample sequence.
    pub const SEQUENCE: &str = Axis::Sequence.name();
    /// Transform of the sequence from pixel to pixel.
    pub const DECORRELATION: &str = Axis::Decorrelation.name();
    /// Kernels in the place of the embedded ones; absent for these.
    pub const KERNELS: &str = Axis::Kernels.name();
    /// Ray–triangle test; absent where no ray is traced.
    pub const TRIANGLE: &str = Axis::Triangle.name();
    /// Ray–box test; absent where no ray is traced.
    pub const BOX_TEST: &str = Axis::BoxTest.name();
    /// Offset of rays from the surface that they leave; absent where there is none.
    pub const OFFSET: &str = Axis::Offset.name();
    /// Organisation of the path tracer; absent where none runs.
    pub const ORGANISATION: &str = Axis::Organisation.name();
    /// External ray caster; absent for this crate's own.
    pub const PEER: &str = Axis::Peer.name();
    /// Workgroups of the tracing kernels; absent where none trace.
    pub const WORKGROUP: &str = Axis::Workgroup.name();
    /// Load path of nodes and triangles in kernels; absent without kernels.
    pub const LOAD: &str = Axis::Load.name();
    /// Target mesh.
    pub const MESH: &str = "mesh";
    /// Scale and translation of a mesh.
    pub const PLACE: &str = "place";
    /// The target of rays.
    pub const AIM: &str = "aim";
    /// Class of rays.
    pub const RAYS: &str = "rays";
    /// Samples per pixel.
    pub const SPP: &str = "spp";
    /// Dimensions of a point set, and their use.
    pub const DIMENSIONS: &str = "dimensions";
    /// Number of points.
    pub const POINTS: &str = "points";
    /// Any other subject of figures.
    pub const SUBJECT: &str = "subject";
    /// All of them.
    pub const ALL: [&str; 21] = [
        SCENE,
        ACCEL,
        INTEGRATOR,
        SEQUENCE,
        DECORRELATION,
        KERNELS,
        TRIANGLE,
        BOX_TEST,
        OFFSET,
        ORGANISATION,
        PEER,
        WORKGROUP,
        LOAD,
        MESH,
        PLACE,
        AIM,
        RAYS,
        SPP,
        DIMENSIONS,
        POINTS,
        SUBJECT,
    ];
}

/// Axis → its value. An axis that does not matter to a figure is absent.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(from = "BTreeMap<String, Written>")]
pub struct Key(BTreeMap<String, Written>);

/// Records from before there was a choice of load paths have the default one.
impl From<BTreeMap<String, Written>> for Key {
    fn from(mut axes: BTreeMap<String, Written>) -> Self {
        if axes.contains_key(axis::WORKGROUP) && !axes.contains_key(axis::LOAD) {
            let load = Axis::Load.default_name().unwrap_or_default();
            axes.insert(axis::LOAD.to_owned(), Written(plain(load)));
        }
        Self(axes)
    }
}

/// A variant as it is written: a plain name where its label says no more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(from = "PlainOrWhole", into = "PlainOrWhole")]
struct Written(Variant);

#[derive(Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged)]
enum PlainOrWhole {
    Plain(String),
    Whole(Variant),
}

impl From<PlainOrWhole> for Written {
    fn from(written: PlainOrWhole) -> Self {
        Self(match written {
            PlainOrWhole::Plain(label) => plain(&label),
            PlainOrWhole::Whole(variant) => variant,
        })
    }
}

impl From<Written> for PlainOrWhole {
    fn from(Written(variant): Written) -> Self {
        if variant.params.0.is_empty() && variant.name == variant.label {
            Self::Plain(variant.label)
        } else {
            Self::Whole(variant)
        }
    }
}

/// Returns a variant without parameters.
fn plain(label: &str) -> Variant {
    Variant {
        name: label.to_owned(),
        params: Params::default(),
        label: label.to_owned(),
    }
}

impl From<&Cell> for Key {
    fn from(cell: &Cell) -> Self {
        let axes = Axis::ALL.into_iter();
        let variants = axes.filter_map(|axis| Some((axis, cell.get(axis)?)));
        variants.fold(Self::default(), |key, (axis, variant)| {
            key.with_variant(axis.name(), variant)
        })
    }
}

/// The cell of a line, for its name.
impl From<&Key> for Cell {
    fn from(key: &Key) -> Self {
        let axes = Axis::ALL.into_iter();
        let variants = axes.filter_map(|axis| Some((axis, key.get(axis.name())?)));
        variants.fold(Self::default(), |cell, (axis, variant)| {
            cell.with(axis, variant)
        })
    }
}

impl Key {
    /// Returns the same key with a name on an axis; an empty name leaves it out.
    #[must_use]
    pub fn with(self, axis: &str, label: impl fmt::Display) -> Self {
        self.with_variant(axis, &plain(&label.to_string()))
    }

    /// Returns the same key with a variant on an axis; one without a name (the embedded kernels) leaves it out.
    #[must_use]
    pub fn with_variant(mut self, axis: &str, variant: &Variant) -> Self {
        if variant.name.is_empty() {
            self.0.remove(axis);
        } else {
            self.0.insert(axis.to_owned(), Written(variant.clone()));
        }
        self
    }

    /// Returns the value on an axis.
    pub fn get(&self, axis: &str) -> Option<&Variant> {
        self.0.get(axis).map(|written| &written.0)
    }

    /// Returns the label of [`Key::get`]; empty without one.
    pub fn label(&self, axis: &str) -> &str {
        self.get(axis).map_or("", |variant| &variant.label)
    }

    /// Returns the registered name of [`Key::get`]; empty without one.
    pub fn name(&self, axis: &str) -> &str {
        self.get(axis).map_or("", |variant| &variant.name)
    }

    /// Returns the axes that matter, each with its label: known ones in their order, others after them.
    pub fn labels(&self) -> impl Iterator<Item = (&str, &str)> {
        let known = axis::ALL
            .into_iter()
            .filter(|axis| self.0.contains_key(*axis));
        let others = self.0.keys().map(String::as_str);
        let others = others.filter(|axis| !axis::ALL.contains(axis));
        known.chain(others).map(|axis| (axis, self.label(axis)))
    }

    /// Returns the same key with these axes alone.
    #[must_use]
    pub fn only(&self, axes: &[&str]) -> Self {
        let kept = self
            .0
            .iter()
            .filter(|(axis, _)| axes.contains(&axis.as_str()));
        Self(
            kept.map(|(axis, written)| (axis.clone(), written.clone()))
                .collect(),
        )
    }

    /// Returns this key, extended and overridden by another one.
    #[must_use]
    pub fn beside(mut self, other: &Self) -> Self {
        self.0.extend(other.0.clone());
        self
    }

    /// Returns `true` if two keys have the same labels on these axes.
    pub fn agrees(&self, other: &Self, axes: &[&str]) -> bool {
        axes.iter()
            .all(|axis| self.label(axis) == other.label(axis))
    }

    /// Returns the labels on some axes, in their order, empty where an axis does not matter: equal for keys that
    /// [agree].
    ///
    /// [agree]: Self::agrees
    pub fn labels_on(&self, axes: &[&str]) -> Vec<&str> {
        axes.iter().map(|axis| self.label(axis)).collect()
    }

    /// Returns `true` if no axis matters.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut between = "";
        for (axis, label) in self.labels() {
            write!(f, "{between}{axis} {label}")?;
            between = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_written_short_and_reads_back_with_every_parameter() {
        let mut grid = plain("grid");
        grid.params.0.insert(
            "lambda".into(),
            raystone_core::params::ParamValue::Number(3.0),
        );
        grid.label = "grid(lambda=3)".into();
        let key = Key::default()
            .with(axis::KERNELS, "idea")
            .with(axis::SCENE, "box");
        let key = key.with_variant(axis::ACCEL, &grid);
        assert_eq!(key.label(axis::ACCEL), "grid(lambda=3)");
        assert_eq!(Cell::from(&key).to_string(), "box, grid(lambda=3), @idea");
        let text = serde_json::to_string(&key).unwrap();
        assert!(
            text.contains(r#""scene":"box""#) && text.contains("lambda"),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<Key>(&text).unwrap(), key);
        assert_eq!(
            key.to_string(),
            "scene box, accel grid(lambda=3), kernels idea"
        );
        let embedded = Variant {
            label: "embedded".into(),
            ..Variant::default()
        };
        let cell = Cell::default().with(Axis::Accel, &grid);
        let cell = cell.with(Axis::Kernels, &embedded);
        assert_eq!(Key::from(&cell), key.only(&[axis::ACCEL]));
    }
}

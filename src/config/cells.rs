//! The cells of a plan.

use super::axis::{Axis, AxisMap};
use raystone_core::params::{Params, Variant};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Index;
use std::sync::Arc;

/// What is run together, and recorded under one key: a variant on each axis that matters to it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cell {
    /// Shared: a sweep has many cells and few variants.
    variants: AxisMap<Option<Arc<Variant>>>,
    /// Whether each seed makes its sampler draw other numbers; no without one.
    pub randomised: bool,
}

/// How names begin on the axis of integrators that are compactions of streams, which render nothing.
pub const COMPACTIONS: &str = "compaction:";

/// The name on the axis of peers that stands for none.
pub const NO_PEER: &str = "none";

/// How names begin on the axis of integrators that are parts of the numerical stress suite, which render nothing either.
pub const STRESS: &str = "stress:";

/// Whether an integrator renders nothing and needs no scene: it names a measurement of something else.
pub fn is_bench(integrator: &Variant) -> bool {
    [COMPACTIONS, STRESS]
        .iter()
        .any(|of| integrator.name.starts_with(of))
}

/// What stands on an axis that does not matter.
static NOTHING: Variant = Variant {
    name: String::new(),
    params: Params(BTreeMap::new()),
    label: String::new(),
};

impl Cell {
    /// What builds, gate and timings of a structure depend on.
    pub const STRUCTURE: [Axis; 6] = [
        Axis::Scene,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Accel,
        Axis::Workgroup,
        Axis::Kernels,
    ];
    /// What the error of a sampler depends on: not the structure, as hits are equal to the bit.
    pub const SAMPLER: [Axis; 8] = [
        Axis::Scene,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Integrator,
        Axis::Sequence,
        Axis::Decorrelation,
        Axis::Offset,
        Axis::Kernels,
    ];
    /// What the times of a ray caster of others depend on.
    pub const PEER: [Axis; 4] = [Axis::Scene, Axis::Triangle, Axis::BoxTest, Axis::Peer];
    /// What an image and its time depend on.
    pub(crate) const FULL: [Axis; 11] = [
        Axis::Scene,
        Axis::Accel,
        Axis::Sequence,
        Axis::Decorrelation,
        Axis::Integrator,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Offset,
        Axis::Organisation,
        Axis::Workgroup,
        Axis::Kernels,
    ];
    /// What may matter to a measurement that needs no scene.
    pub(crate) const BENCH: [Axis; 4] =
        [Axis::Integrator, Axis::Kernels, Axis::Triangle, Axis::Accel];
    /// What the words that a sampler draws depend on.
    pub const STREAM: [Axis; 3] = [Axis::Sequence, Axis::Decorrelation, Axis::Kernels];
    /// What is loaded, uploaded and judged once for all cells on it.
    pub const WORLD: [Axis; 3] = [Axis::Scene, Axis::Triangle, Axis::BoxTest];

    /// The variant on an axis, if that matters.
    pub fn get(&self, axis: Axis) -> Option<&Variant> {
        self.variants[axis].as_deref()
    }

    /// The same cell with this variant on an axis.
    #[must_use]
    pub fn with(self, axis: Axis, variant: &Variant) -> Self {
        self.sharing(axis, &Arc::new(variant.clone()))
    }

    /// The same cell with a variant on an axis that other cells have as well.
    #[must_use]
    pub(super) fn sharing(mut self, axis: Axis, variant: &Arc<Variant>) -> Self {
        self.variants[axis] = Some(Arc::clone(variant));
        self
    }

    /// Everything that stands on its axes, as a text that no other cell of the experiment has.
    pub fn identity(&self) -> String {
        let labels = self.variants.iter().map(|(_, variant)| match variant {
            Some(variant) => variant.label.as_str(),
            None => "",
        });
        labels.collect::<Vec<_>>().join("\u{1f}")
    }

    /// The part of the cell on these axes.
    #[must_use]
    pub fn on(&self, axes: &[Axis]) -> Self {
        let variants = axes
            .iter()
            .filter_map(|&axis| Some((axis, self.variants[axis].as_ref()?)));
        variants.fold(Self::default(), |cell, (axis, variant)| {
            cell.sharing(axis, variant)
        })
    }

    /// Whether `part` is this cell on the axes that matter to `part`.
    pub fn is_on(&self, part: &Cell) -> bool {
        let mut axes = part.variants.iter();
        axes.all(|(axis, variant)| variant.is_none() || *variant == self.variants[axis])
    }

    /// Labels on these axes, and behind them tests, offset, organisation, workgroup and kernels (`offset none`, `@idea`) where they
    /// are not the default ones: what tells cells of a run apart.
    pub fn labels(&self, axes: &[Axis]) -> Vec<String> {
        let named = axes.iter().map(|&axis| self[axis].label.clone());
        named.chain(self.unusual()).collect()
    }

    /// Whether something else than the default stands on an axis.
    pub fn is_unusual(&self, axis: Axis) -> bool {
        self.get(axis).is_some_and(|variant| {
            !variant.name.is_empty() && Some(variant.label.as_str()) != axis.default_name()
        })
    }

    fn unusual(&self) -> impl Iterator<Item = String> {
        let further = [
            Axis::Triangle,
            Axis::BoxTest,
            Axis::Offset,
            Axis::Organisation,
            Axis::Workgroup,
            Axis::Kernels,
        ];
        further.into_iter().filter_map(|axis| {
            let variant = self.get(axis).filter(|_| self.is_unusual(axis))?;
            Some(match axis {
                Axis::Kernels => format!("@{variant}"),
                axis => format!("{axis} {variant}"),
            })
        })
    }
}

/// The variant on an axis; one of an empty name where it does not matter.
impl Index<Axis> for Cell {
    type Output = Variant;

    fn index(&self, axis: Axis) -> &Variant {
        self.get(axis).unwrap_or(&NOTHING)
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let main = [Axis::Scene, Axis::Accel, Axis::Peer, Axis::Integrator];
        let main = main.into_iter().filter_map(|axis| self.get(axis));
        let mut parts: Vec<String> = main.map(Variant::to_string).collect();
        if let Some(sequence) = self.get(Axis::Sequence) {
            parts.push(format!("{sequence} × {}", self[Axis::Decorrelation]));
        }
        parts.extend(self.unusual());
        f.write_str(&parts.join(", "))
    }
}

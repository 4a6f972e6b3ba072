//! The cells of a plan.

use super::axis::{Axis, AxisMap};
use raystone_core::params::{Params, Variant};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Index;
use std::sync::Arc;

/// A unit of work recorded under one key: a variant on each axis that matters to it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cell {
    /// Shared, as a sweep has many cells and few variants.
    variants: AxisMap<Option<Arc<Variant>>>,
    /// True if each seed makes its sampler draw other numbers; false without a sampler.
    pub randomised: bool,
}

/// Name prefix of integrators that are stream compactions, which render nothing.
pub const COMPACTIONS: &str = "compaction:";

/// The peer name for none.
pub const NO_PEER: &str = "none";

/// Name prefix of integrators that are parts of the numerical stress suite, which render nothing either.
pub const STRESS: &str = "stress:";

/// Name prefix of integrators that are measurements of media, which render nothing either.
pub const MEDIA: &str = "media:";

/// Name prefix of integrators that are sets of rays in a room, traced through structures alone.
pub const RAYS: &str = "rays:";

/// Name prefix of integrators that search for points of reflection, which render nothing either.
pub const SPECULAR: &str = "specular:";

/// Name prefix of integrators that trace cones, against distributed rays, in scenes of their own.
pub const CONES: &str = "cones:";

/// Name prefixes of integrators that render nothing and need no scene.
pub(super) const BENCHES: [&str; 6] = [COMPACTIONS, STRESS, MEDIA, RAYS, SPECULAR, CONES];

/// True if an integrator renders nothing and needs no scene: it names a measurement of something else.
pub fn is_bench(integrator: &Variant) -> bool {
    BENCHES.iter().any(|of| integrator.name.starts_with(of))
}

/// The value of an axis that does not matter.
static NOTHING: Variant = Variant {
    name: String::new(),
    params: Params(BTreeMap::new()),
    label: String::new(),
};

impl Cell {
    /// Axes that build, correctness check and timings of a structure depend on.
    pub const STRUCTURE: [Axis; 7] = [
        Axis::Scene,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Accel,
        Axis::Workgroup,
        Axis::Load,
        Axis::Kernels,
    ];
    /// Axes that a sampler's error depends on: not the structure, as hits are bit-identical.
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
    /// Axes that the times of an external tracer depend on.
    pub const PEER: [Axis; 4] = [Axis::Scene, Axis::Triangle, Axis::BoxTest, Axis::Peer];
    /// Axes that an image and its time depend on.
    pub(crate) const FULL: [Axis; 12] = [
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
        Axis::Load,
        Axis::Kernels,
    ];
    /// Axes that a measurement without a scene depends on.
    pub(crate) const BENCH: [Axis; 6] = [
        Axis::Integrator,
        Axis::Kernels,
        Axis::Triangle,
        Axis::Accel,
        Axis::Sequence,
        Axis::Decorrelation,
    ];
    /// Axes that a sampler's random words depend on.
    pub const STREAM: [Axis; 3] = [Axis::Sequence, Axis::Decorrelation, Axis::Kernels];
    /// Axes of scene data loaded, uploaded and checked once for all cells.
    pub const WORLD: [Axis; 3] = [Axis::Scene, Axis::Triangle, Axis::BoxTest];

    /// The variant on an axis, if it matters.
    pub fn get(&self, axis: Axis) -> Option<&Variant> {
        self.variants[axis].as_deref()
    }

    /// The cell with this variant on an axis.
    #[must_use]
    pub fn with(self, axis: Axis, variant: &Variant) -> Self {
        self.sharing(axis, &Arc::new(variant.clone()))
    }

    /// [`Self::with`] for a variant shared with other cells.
    #[must_use]
    pub(super) fn sharing(mut self, axis: Axis, variant: &Arc<Variant>) -> Self {
        self.variants[axis] = Some(Arc::clone(variant));
        self
    }

    /// Text of all axes, unique within the experiment.
    pub fn identity(&self) -> String {
        let labels = self.variants.iter().map(|(_, variant)| match variant {
            Some(variant) => variant.label.as_str(),
            None => "",
        });
        labels.collect::<Vec<_>>().join("\u{1f}")
    }

    /// The cell restricted to these axes.
    #[must_use]
    pub fn on(&self, axes: &[Axis]) -> Self {
        let variants = axes
            .iter()
            .filter_map(|&axis| Some((axis, self.variants[axis].as_ref()?)));
        variants.fold(Self::default(), |cell, (axis, variant)| {
            cell.sharing(axis, variant)
        })
    }

    /// True if `part` equals this cell on the axes that matter to `part`.
    pub fn is_on(&self, part: &Cell) -> bool {
        let mut axes = part.variants.iter();
        axes.all(|(axis, variant)| variant.is_none() || *variant == self.variants[axis])
    }

    /// Labels on these axes, followed by non-default tests, offset, organisation, workgroup,
    /// load path and kernels (`offset none`, `@idea`), to distinguish the cells of a run.
    pub fn labels(&self, axes: &[Axis]) -> Vec<String> {
        let named = axes.iter().map(|&axis| self[axis].label.clone());
        named.chain(self.unusual()).collect()
    }

    /// True if an axis has a non-default value.
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
            Axis::Load,
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

/// The variant on an axis; one with an empty name if the axis does not matter.
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

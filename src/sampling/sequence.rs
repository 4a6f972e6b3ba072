//! What a sequence is.

use super::{Coordinate, Demand, SamplerTable};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// What others have to know of a sequence with its parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Facts {
    /// Another seed gives other points.
    pub random: bool,
    /// Points are independent from pixel to pixel by themselves: nothing is left to decorrelate.
    pub independent: bool,
    /// Points are digital in base 2: exclusive or keeps their nets.
    pub base_2: bool,
    /// Points go on as well as they begin: every aligned block of indices is as good as the first one.
    pub extensible: bool,
    /// Points depend on how many are drawn, so that each number of samples has a set of its own.
    pub by_count: bool,
    /// Dimensions it has; `None` is any number.
    pub dimensions: Option<u32>,
    /// Samples it has; `None` is any number.
    pub samples: Option<u32>,
}

/// A sequence of points; one static per sequence, one line in the registry.
pub trait Sequence: Sync {
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it is and where it comes from.
    fn description(&self) -> &'static str;
    /// Module of the kernel, relative to the kernel folder.
    fn kernel(&self) -> &'static str;
    /// Paths and texts of the kernel modules that it brings along, because they are not the program's.
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// What others have to know.
    fn facts(&self, params: &Params) -> Facts;
    /// Words that the kernel reads by `sequence_word`, as long as the demand needs; the demand is
    /// within the limits of the facts.
    fn table(&self, _params: &Params, _demand: &Demand) -> Vec<u32> {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self, _params: &Params) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Twin of the kernel's `sequence`: a fraction of 2³².
    fn sequence(&self, params: &Params, table: &SamplerTable, at: Coordinate) -> u32;
}

/// Whether pixels draw different random numbers: the parameter `seeding` of everything that hashes the
/// pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seeding {
    /// Each pixel draws its own.
    PixelSample,
    /// All pixels draw the same: coherence by force (Nilsson & Otte dag 2018, Table 5.3).
    Sample,
}

impl Seeding {
    /// The parameter.
    pub fn parameter() -> Parameter {
        Parameter {
            name: "seeding",
            description: "random numbers differ by pixel and sample, or by sample only (Nilsson & Otte dag 2018)",
            default: ParamValue::Name("pixel-sample".to_owned()),
            range: ParamRange::Choice(&["pixel-sample", "sample"]),
        }
    }

    /// What the parameters say; entries without the parameter leave pixels apart.
    pub fn of(params: &Params) -> Self {
        match params.0.get("seeding") {
            Some(ParamValue::Name(name)) if name == "sample" => Self::Sample,
            _ => Self::PixelSample,
        }
    }
}

//! The subjects of the checks.

use crate::{Check, CheckError, Plant};
use raystone::accel::{AccelKind, AccelRegistry, BuildLog, BuiltAccel, TriangleSoup};
use raystone::params::{Entry, ParamValue, Params, Variant};
use raystone::sampling::{Demand, Sampler, SamplerRegistry};

/// Parameters that are not at their defaults, as a user would write them.
pub type Changes = &'static [(&'static str, &'static str)];

/// The subject of the checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// An acceleration structure.
    Structure {
        /// Its name.
        name: &'static str,
        /// Its parameters.
        changes: Changes,
    },
    /// A sequence with a decorrelation.
    Sampler {
        /// Name of the sequence.
        sequence: &'static str,
        /// Its parameters.
        changes: Changes,
        /// Name of the decorrelation, at its defaults.
        decorrelation: &'static str,
    },
    /// The integrators, with a plain BVH and independent samples.
    Integrators,
    /// Single paths of the integrators, with the same.
    Paths,
    /// Single paths through media, with the same.
    Media,
    /// Images by an organisation of the path tracer, with the same.
    Organised(&'static str),
}

impl Subject {
    /// Describes it in few words.
    pub fn label(&self) -> String {
        let with = |name: &str, changes: Changes| {
            let texts = changes.iter().map(|(key, value)| format!(" {key}={value}"));
            name.to_owned() + &texts.collect::<String>()
        };
        match self {
            Self::Structure { name, changes } => with(name, changes),
            Self::Sampler {
                sequence,
                changes,
                decorrelation,
            } => format!("{} × {decorrelation}", with(sequence, changes)),
            Self::Integrators => "integrators".to_owned(),
            Self::Paths => "single paths".to_owned(),
            Self::Media => "paths through media".to_owned(),
            Self::Organised(name) => format!("images, {name}"),
        }
    }

    /// The checks that apply to it, cheapest first.
    pub fn checks(&self) -> &'static [Check] {
        match self {
            Self::Structure { .. } => &[Check::Lattice, Check::Gate, Check::Work, Check::Stacks],
            Self::Sampler { .. } => &[
                Check::Stream,
                Check::Known,
                Check::Integrand,
                Check::Discrepancy,
                Check::Integral,
            ],
            Self::Integrators => &[
                Check::Furnace,
                Check::Occlusion,
                Check::ThinWalls,
                Check::Bias,
            ],
            Self::Paths => &[Check::Paths],
            Self::Media => &[Check::Media],
            Self::Organised(_) => &[Check::Frames, Check::Counts],
        }
    }
}

/// An entry with the parameters of `changes`.
fn variant(entries: &[Entry], name: &str, changes: Changes) -> Result<Variant, CheckError> {
    let unknown = || CheckError::Stale(format!("`{name}` is not registered"));
    let entry = entries.iter().find(|e| e.name == name);
    let mut variant = entry.ok_or_else(unknown)?.default_variant();
    for (key, text) in changes {
        let bad = || CheckError::Stale(format!("{name} takes no {key} = {text}"));
        let slot = variant.params.0.get_mut(*key).ok_or_else(bad)?;
        *slot = match slot {
            ParamValue::Number(_) => ParamValue::Number(text.parse().map_err(|_| bad())?),
            ParamValue::Integer(_) => ParamValue::Integer(text.parse().map_err(|_| bad())?),
            ParamValue::Flag(_) => ParamValue::Flag(text.parse().map_err(|_| bad())?),
            ParamValue::Name(_) => ParamValue::Name((*text).to_owned()),
            ParamValue::List(_) => return Err(bad()),
        };
    }
    Ok(variant)
}

/// Builds the structure `name` and checks it.
pub fn build(
    name: &str,
    changes: Changes,
    soup: &TriangleSoup,
) -> Result<Box<dyn BuiltAccel>, CheckError> {
    let built = of_kind(name, changes, |kind, params| {
        Ok(kind.build(soup, params, &mut BuildLog::default())?)
    })?;
    built.validate(soup)?;
    Ok(built)
}

/// What `make` makes of the kind of structure `name` with its parameters.
pub fn of_kind<T>(
    name: &str,
    changes: Changes,
    make: impl FnOnce(&dyn AccelKind, &Params) -> Result<T, CheckError>,
) -> Result<T, CheckError> {
    let registry = AccelRegistry::default();
    let variant = variant(&registry.entries(), name, changes)?;
    let unknown = || CheckError::Stale(format!("there is no structure `{name}`"));
    make(registry.get(name).ok_or_else(unknown)?, &variant.params)
}

/// Samples and dimensions that samplers are made for, and the width of the image.
pub const DEMAND: Demand = Demand {
    samples: Some(1024),
    dimensions: 48,
    width: Some(64),
};

/// The same where words are compared: beyond 2¹⁶ samples and several tiles of a mask.
pub const LONG_DEMAND: Demand = Demand {
    samples: Some(1 << 17),
    dimensions: 48,
    width: Some(192),
};

/// The sampler of these names for `demand` or as much of it as there is, with the fault if it belongs
/// there.
pub fn sampler(
    (sequence, changes): (&str, Changes),
    decorrelation: &str,
    demand: &Demand,
    plant: &Plant,
) -> Result<Sampler, CheckError> {
    let registry = SamplerRegistry::default();
    let sequence = variant(&registry.sequence_entries(), sequence, changes)?;
    let decorrelation = variant(&registry.decorrelation_entries(), decorrelation, &[])?;
    let facts = registry.facts(&sequence).unwrap_or_default();
    let at_most = |wanted: u32, limit: Option<u32>| limit.map_or(wanted, |most| wanted.min(most));
    let demand = Demand {
        samples: demand.samples.map(|n| at_most(n, facts.samples)),
        dimensions: at_most(demand.dimensions, facts.dimensions),
        ..*demand
    };
    let made = registry.sampler(&sequence, &decorrelation, &demand);
    plant.in_sampler(made.map_err(|e| CheckError::Other(e.to_string()))?)
}

//! Point sets.

use super::blue_noise::best_candidates;
use raystone_core::parameters;
use raystone_core::params::{Choice as _, Entry, Variant};
use raystone_core::random::Pcg32;
use raystone_sampling::{Coordinate, Demand, SamplerRegistry, to_unit};

parameters! {
    /// A point set of the unit square.
    pub enum Points {
        /// independent
        Random = "random",
        /// middles of cells, row by row
        Grid = "grid",
        /// anywhere in cells, row by row
        Jitter = "jitter",
        /// radical inverses to the bases 2 and 3
        Halton = "halton",
        /// i / M, and the radical inverse to the base 2
        Hammersley = "hammersley",
        /// Hammersley's with its axes exchanged
        HammersleyTransposed = "hammersley-transposed",
        /// Sobol's first two dimensions
        Sobol = "sobol",
        /// Sobol's, scrambled as Owen did
        OwenSobol = "owen-sobol",
        /// Roberts' R2
        R2 = "r2",
        /// best of sixteen candidates each
        BlueNoise = "blue-noise",
    }
}

/// The m² points of a set, in their own order.
///
/// # Errors
/// A sequence of the sampling crate cannot be made.
pub fn point_set(points: Points, m: u32, seed: u64) -> Result<Vec<[f64; 2]>, String> {
    let count = m * m;
    let side = f64::from(m);
    let mut random = Pcg32::new(seed);
    let mut uniform = || random.uniform();
    let cell = |i: u32, [dx, dy]: [f64; 2]| {
        let [x, y] = [i % m, i / m].map(f64::from);
        [(x + dx) / side, (y + dy) / side]
    };
    let hammersley = |i: u32| [f64::from(i) / f64::from(count), radical_inverse(2, i)];
    let all = 0..count;
    Ok(match points {
        Points::Grid => all.map(|i| cell(i, [0.5; 2])).collect(),
        Points::Jitter => all.map(|i| cell(i, [uniform(), uniform()])).collect(),
        Points::Random => all.map(|_| [uniform(), uniform()]).collect(),
        Points::Halton => all
            .map(|i| [radical_inverse(2, i), radical_inverse(3, i)])
            .collect(),
        Points::Hammersley => all.map(hammersley).collect(),
        Points::HammersleyTransposed => all.map(hammersley).map(|[x, y]| [y, x]).collect(),
        Points::BlueNoise => best_candidates(count as usize, &mut random),
        Points::Sobol | Points::OwenSobol | Points::R2 => of_sequence(points.name(), count, seed)?,
    })
}

/// The first points of a sequence of the sampling crate.
fn of_sequence(name: &str, count: u32, seed: u64) -> Result<Vec<[f64; 2]>, String> {
    let registry = SamplerRegistry::default();
    let entry = |entries: Vec<Entry>, name: &str| {
        let found = entries.into_iter().find(|entry| entry.name == name);
        found.map(|entry| entry.default_variant())
    };
    let sequence: Option<Variant> = entry(registry.sequence_entries(), name);
    let sequence = sequence.ok_or_else(|| format!("there is no sequence `{name}`"))?;
    let none = Variant::plain("none");
    let demand = Demand {
        samples: Some(count),
        dimensions: 2,
        width: None,
    };
    let sampler = registry.sampler(&sequence, &none, &demand);
    let sampler = sampler.map_err(|error| error.to_string())?;
    let at = |sample: u32, dimension: u32| {
        let coordinate = Coordinate {
            pixel: 0,
            sample,
            dimension,
            seed: seed as u32,
        };
        f64::from(to_unit(sampler.sample_u32(coordinate)))
    };
    Ok((0..count).map(|i| [at(i, 0), at(i, 1)]).collect())
}

/// The digits of `i` behind the point, in reverse.
pub(crate) fn radical_inverse(base: u32, mut i: u32) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while i > 0 {
        place /= f64::from(base);
        value += f64::from(i % base) * place;
        i /= base;
    }
    value
}

//! The pass of photons through a medium to a grid.

use super::bending::{Bending, kernel};
use super::{Photon, PipelineError};
use crate::Medium;
use crate::scatter::{Adding, Scatter};
use raystone_gpu::{Gpu, GpuError, Recording, Storage, UniformValues, groups_for};

/// What is counted of photons beside their energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Counting {
    /// Nothing.
    None,
    /// Of each voxel, photons and their weights.
    Weights,
    /// Of each of so many cells along an axis, photons and the cells of so large a map that they came from: pilots.
    Origins {
        /// Cells of the grid along each axis.
        cells: u32,
        /// Cells of the map along each axis.
        map: u32,
    },
}

impl Counting {
    fn module(self) -> Option<&'static str> {
        match self {
            Self::None => None,
            Self::Weights => Some("media/adaptive/weights"),
            Self::Origins { .. } => Some("media/adaptive/origins"),
        }
    }

    /// Words of a voxel or cell.
    const fn words(self) -> u64 {
        match self {
            Self::None => 0,
            Self::Weights => 2,
            Self::Origins { .. } => 5,
        }
    }

    /// Zeros for so many voxels or cells.
    fn storage(self, gpu: &Gpu, places: u32) -> Result<Storage, GpuError> {
        let bytes = u64::from(places) * self.words() * 4;
        Ok(Storage::from(&gpu.zeroed("counts", bytes)?))
    }

    /// How many cells along each axis photons are counted in; 0 where it is in voxels.
    const fn cells(self) -> u32 {
        match self {
            Self::Origins { cells, .. } => cells,
            _ => 0,
        }
    }

    /// What the kernel counts of a photon.
    fn marks(self, photon: &Photon) -> [f32; 2] {
        match self {
            Self::Origins { map, .. } => photon.cell_of(map).map(|c| c as f32),
            _ => [photon.weight as f32, 0.0],
        }
    }
}

/// What photons go through.
#[derive(Clone, Copy)]
pub(super) struct Through<'a> {
    /// The medium.
    pub(super) medium: &'a Medium,
    /// What bends light in it.
    pub(super) bending: Option<&'a Bending>,
    /// True to read σ where it is known to be the same, too.
    pub(super) general: bool,
    /// True to cross voxels at once from which nothing is scattered and which no view reads, where ways are straight.
    pub(super) crosses: bool,
    /// All points of the light, to have those whose photons miss the medium in the list, too.
    pub(super) missed: Option<&'a [([f64; 2], f64)]>,
}

/// The greatest energy of a photon.
fn brightest(photons: &[Photon]) -> Result<f32, PipelineError> {
    let energies = photons.iter().map(|p| p.energy.max_element());
    let brightest = energies.fold(0.0, f32::max);
    if brightest > 0.0 {
        Ok(brightest)
    } else {
        Err(PipelineError::Dark(photons.len()))
    }
}

/// Words of the photons; with all points of the light, those that miss the medium have a place among them, too.
fn words_of(
    photons: &[Photon],
    points: Option<&[([f64; 2], f64)]>,
    counting: Counting,
) -> Vec<[[f32; 4]; 4]> {
    let words = |photon: &Photon| photon.words(counting.marks(photon));
    let Some(points) = points else {
        return photons.iter().map(words).collect();
    };
    let mut left = photons.iter().peekable();
    let meets = |(point, _): &([f64; 2], f64)| {
        let photon = left.next_if(|photon| photon.point == *point);
        photon.map_or(Photon::MISSED, words)
    };
    points.iter().map(meets).collect()
}

/// Photons with what they leave.
pub(super) struct Marched {
    /// The grid.
    pub(super) scatter: Scatter,
    /// What was counted.
    pub(super) counts: Option<Storage>,
    /// Weight of a unit of the counted weights.
    pub(super) unit: f64,
    /// The passes, with their downloads.
    pub(super) passes: Recording,
}

impl Marched {
    /// Records photons to a grid.
    ///
    /// # Errors
    /// They carry no power, an array exceeds what the adapter binds, or a kernel does not compile.
    pub(super) fn record(
        gpu: &Gpu,
        through: Through,
        adding: Adding,
        photons: &[Photon],
        counting: Counting,
    ) -> Result<Self, PipelineError> {
        let Through {
            medium,
            bending,
            general,
            crosses,
            missed,
        } = through;
        let brightest = brightest(photons)?;
        // No piece within a voxel is longer than its diagonal; rounding may make it a little so.
        let longest = medium.size_of_voxel().length() * 1.001;
        let cells = counting.cells();
        let places = match cells {
            0 => medium.field.len() as u32,
            cells => cells.pow(3),
        };
        let scatter = Scatter::new(gpu, adding, places, brightest * longest as f32)?;
        // A power of two with which all weights together stay below 2³¹.
        let all: f64 = photons.iter().map(|p| p.weight).sum();
        let units = (30.0 - all.max(1.0).log2().ceil()).exp2();
        let words = words_of(photons, missed, counting);
        let status = Storage::scratch("status", 64);
        let mut bindings = crate::upload::bindings(medium, gpu)?;
        scatter.bind(&mut bindings);
        if let Some(bending) = bending {
            bending.bind(gpu, &mut bindings)?;
        }
        let count = words.len() as u32;
        let values = UniformValues::new().u32("count", count).u32("cells", cells);
        bindings
            .uniform("photons", values)
            .buffer("list", &gpu.storage("photons", &words)?)
            .buffer("status", &status);
        let mut kernel = kernel("photons", bending)
            .with("structure", medium.structure.module())
            .feature("coarse", cells > 0)
            .feature("cross_empty", crosses && bending.is_none())
            .feature("general", general);
        let mut passes = Recording::new();
        passes.clear(&status);
        scatter.record_before(&mut passes);
        let counts = match counting.module() {
            None => None,
            Some(module) => {
                let counts = counting.storage(gpu, places)?;
                kernel = kernel.with("counts", module).feature("counted", true);
                bindings
                    .uniform("counting", UniformValues::new().f32("units", units as f32))
                    .buffer("counts", &counts);
                passes.clear(&counts);
                Some(counts)
            }
        };
        let pipeline = gpu.pipeline(&scatter.compose(kernel), true)?;
        let name = if cells > 0 { "pilots" } else { "photons" };
        passes.run(name, &pipeline, &bindings, groups_for(count));
        scatter.record_after(&mut passes, &status);
        passes.download("status", &status);
        Ok(Self {
            scatter,
            counts,
            unit: 1.0 / units,
            passes,
        })
    }
}

//! The passes from a grid of radiance to a smooth one, and the same in f64.

use super::{Filter, Smoothing};
use glam::{DVec3, IVec3, UVec3};
use raystone_gpu::{
    Bindings, Composition, Gpu, GpuError, Recording, Storage, UniformValues, groups_for,
};

/// Taps of the pyramid's Gaussian.
const NEAR: f64 = 0.28109;
const FAR: f64 = 0.21891;

/// Passes to a smooth grid.
pub(crate) struct Smoother {
    /// Energy and direction of each voxel, with the level in the word beside energy.
    pub(crate) smoothed: Storage,
    /// Bytes of the pyramid and of it.
    pub(crate) bytes: u64,
}

fn size_of(resolution: UVec3, level: u32) -> UVec3 {
    (resolution + ((1 << level) - 1)) >> level
}

/// The coarsest level: that of the thesis, or the one that is a single cell.
fn coarsest(resolution: UVec3, smoothing: &Smoothing) -> u32 {
    let levels = resolution.max_element().next_power_of_two().ilog2();
    smoothing.most.min(levels)
}

impl Smoother {
    /// Records the passes; `counts` has photons and weights of each voxel, with the weight of a unit.
    ///
    /// # Errors
    /// An array exceeds what the adapter binds, or a kernel does not compile.
    pub(crate) fn record(
        gpu: &Gpu,
        recording: &mut Recording,
        resolution: UVec3,
        smoothing: &Smoothing,
        radiance: &Storage,
        counts: Option<(&Storage, f64)>,
    ) -> Result<Self, GpuError> {
        let most = coarsest(resolution, smoothing);
        let sizes: Vec<u32> = (0..=most)
            .map(|level| size_of(resolution, level).element_product())
            .collect();
        let own = |name: &str, cells: u32| -> Result<Storage, GpuError> {
            Ok(Storage::from(&gpu.zeroed(name, u64::from(cells) * 32)?))
        };
        let all: u32 = sizes.iter().sum();
        let pyramid = own("pyramid", all)?;
        let smoothed = own("smoothed", sizes[0])?;
        let none = Storage::scratch("none", 8);
        let (counts, unit) = counts.unwrap_or((&none, 0.0));
        let bindings = |level: u32| {
            let values = UniformValues::new()
                .uvec("resolution", &resolution.to_array())
                .u32("most", most)
                .u32("level", level)
                .u32("rule", smoothing.filter.word())
                .u32("constant", smoothing.level)
                .u32("least", smoothing.least)
                .f32("weight_step", smoothing.weight_step as f32)
                .f32("unit", unit as f32);
            let mut bindings = Bindings::new();
            bindings
                .uniform("levels", values)
                .buffer("radiance", radiance)
                .buffer("counts", counts)
                .buffer("pyramid", &pyramid)
                .buffer("smoothed", &smoothed);
            bindings
        };
        let kernel =
            |name: &str| gpu.pipeline(&Composition::new(&format!("media/adaptive/{name}")), true);
        recording.run(
            "level 0",
            &kernel("level_0")?,
            &bindings(0),
            groups_for(sizes[0]),
        );
        if smoothing.filter != Filter::Blur {
            let mip = kernel("mip")?;
            for (level, cells) in (1..).zip(&sizes[1..]) {
                recording.run("mip", &mip, &bindings(level), groups_for(*cells));
            }
        }
        recording.run(
            "smooth",
            &kernel("smooth")?,
            &bindings(0),
            groups_for(sizes[0]),
        );
        Ok(Self {
            smoothed,
            bytes: u64::from(all + sizes[0]) * 32,
        })
    }
}

/// A cell of a pyramid in f64.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Cell {
    /// Energy, and direction times its mean.
    pub(crate) sums: [f64; 6],
    /// Photons.
    pub(crate) count: f64,
    /// Their mean weight.
    pub(crate) weight: f64,
}

/// A smooth grid in f64, written from the thesis (§3.6.5, §3.6.6, listings B.2 and B.3 with their loops mended).
pub(crate) struct Smoothed {
    resolution: UVec3,
    smoothing: Smoothing,
    levels: Vec<(UVec3, Vec<Cell>)>,
}

fn cells_in(size: UVec3) -> impl Iterator<Item = UVec3> {
    (0..size.z).flat_map(move |z| {
        (0..size.y).flat_map(move |y| (0..size.x).map(move |x| UVec3::new(x, y, z)))
    })
}

impl Smoothed {
    /// Makes the pyramid.
    pub(crate) fn new(resolution: UVec3, smoothing: &Smoothing, finest: Vec<Cell>) -> Self {
        let mut levels = vec![(resolution, finest)];
        for level in 1..=coarsest(resolution, smoothing) {
            let (of, cells) = &levels[levels.len() - 1];
            let size = size_of(resolution, level);
            let coarser = cells_in(size)
                .map(|cell| reduced(*of, cells, cell))
                .collect();
            levels.push((size, coarser));
        }
        Self {
            resolution,
            smoothing: *smoothing,
            levels,
        }
    }

    /// The coarsest level.
    pub(crate) fn most(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// Sums at the middle of a voxel by one level.
    pub(crate) fn fetched(&self, level: u32, voxel: UVec3) -> [f64; 6] {
        if self.smoothing.filter == Filter::Blur {
            return self.blurred(voxel);
        }
        let (size, cells) = &self.levels[level as usize];
        let place = (voxel.as_dvec3() + 0.5) / f64::from(1_u32 << level) - 0.5;
        let local = place.max(DVec3::ZERO).min((*size - 1).as_dvec3());
        let low = local.as_uvec3();
        let w = local - low.as_dvec3();
        let mut sums = [0.0; 6];
        for k in 0..8 {
            let offset = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let at = (low + offset).min(*size - 1);
            let part = DVec3::select(offset.cmpeq(UVec3::ONE), w, 1.0 - w).element_product();
            for (sum, value) in sums.iter_mut().zip(cell_of(*size, cells, at).sums) {
                *sum += part * value;
            }
        }
        sums
    }

    fn blurred(&self, voxel: UVec3) -> [f64; 6] {
        let (size, cells) = &self.levels[0];
        let mut sums = [0.0; 6];
        for tap in cells_in(UVec3::splat(3)) {
            let at = voxel.as_ivec3() + tap.as_ivec3() - 1;
            let at = at.max(IVec3::ZERO).min(size.as_ivec3() - 1).as_uvec3();
            let part = [0.25, 0.5, 0.25];
            let part: f64 = tap.to_array().map(|k| part[k as usize]).iter().product();
            for (sum, value) in sums.iter_mut().zip(cell_of(*size, cells, at).sums) {
                *sum += part * value;
            }
        }
        sums
    }

    fn around(&self, level: u32, voxel: UVec3) -> Cell {
        let (size, cells) = &self.levels[level as usize];
        cell_of(*size, cells, voxel >> level)
    }

    fn level_with(&self, least: f64, voxel: UVec3) -> u32 {
        let holds = |level: &u32| self.around(*level, voxel).count >= least;
        (0..self.most()).find(holds).unwrap_or(self.most())
    }

    fn level_by_surround(&self, voxel: UVec3) -> u32 {
        let change = |level: u32| {
            let energy = |l: u32| self.fetched(l, voxel)[..3].iter().sum::<f64>();
            (energy(level) - energy(level + 1)).abs()
        };
        let mut level = 0;
        // Level + 2 stays below the coarsest, as printed.
        while self.most() >= 2 && change(level + 1) <= change(level) && level + 2 < self.most() {
            level += 1;
        }
        level
    }

    fn level_by_weight(&self, voxel: UVec3) -> u32 {
        let weight = self.around(self.level_with(1.0, voxel), voxel).weight;
        let level = (weight / self.smoothing.weight_step).floor();
        level.min(f64::from(self.most())) as u32
    }

    /// The level that the rule chooses for a voxel.
    pub(crate) fn level_of(&self, voxel: UVec3) -> u32 {
        match self.smoothing.filter {
            Filter::None | Filter::Blur => 0,
            Filter::Constant => self.smoothing.level.min(self.most()),
            Filter::Count => self.level_with(f64::from(self.smoothing.least), voxel),
            Filter::Surround => self.level_by_surround(voxel),
            Filter::Weight => self.level_by_weight(voxel),
            Filter::Both => self
                .level_by_surround(voxel)
                .min(self.level_by_weight(voxel)),
        }
    }

    /// Voxels, x fastest.
    pub(crate) fn voxels(&self) -> impl Iterator<Item = UVec3> {
        cells_in(self.resolution)
    }
}

fn cell_of(size: UVec3, cells: &[Cell], at: UVec3) -> Cell {
    cells[(at.x + size.x * (at.y + size.y * at.z)) as usize]
}

/// A coarser cell from the finer level.
fn reduced(size: UVec3, cells: &[Cell], cell: UVec3) -> Cell {
    let mut all = Cell::default();
    let mut weights = 0.0;
    let most = size.as_ivec3() - 1;
    for tap in cells_in(UVec3::splat(4)) {
        let at = 2 * cell.as_ivec3() + tap.as_ivec3() - 1;
        let inside = at.clamp(IVec3::ZERO, most);
        let one = cell_of(size, cells, inside.as_uvec3());
        let factor = |k: u32| if k == 1 || k == 2 { NEAR } else { FAR };
        let factor: f64 = tap.to_array().map(factor).iter().product();
        for (sum, value) in all.sums.iter_mut().zip(one.sums) {
            *sum += factor * value;
        }
        let is_child = tap.to_array().iter().all(|k| *k == 1 || *k == 2);
        if is_child && inside == at {
            all.count += one.count;
            if one.weight > 0.0 {
                all.weight += one.weight;
                weights += 1.0;
            }
        }
    }
    if weights > 0.0 {
        all.weight /= weights;
    }
    all
}

//! What the passes left, read back.

use super::{Photon, Pipeline, PipelineError};
use crate::adaptive::Pilots;
use crate::photons::ImportanceMap;
use crate::scatter::Strategy;
use raystone_gpu::{Recording, Storage};

/// Six sums of a voxel, and the words beside energy and direction.
type Sums = ([f32; 6], [f32; 2]);

impl Pipeline {
    /// The photons of the last image that ran them.
    pub fn photons(&self) -> &[Photon] {
        self.grid.as_ref().map_or(&[], |grid| &grid.photons)
    }

    /// The pilots of the last image that ran them, what they left in each of their cells, and the map that followed.
    pub fn pilots(&self) -> Option<(&[Photon], &[Pilots], &ImportanceMap)> {
        let piloted = self.grid.as_ref()?.pilots.as_ref()?;
        Some((&piloted.photons, &piloted.cells, &piloted.map))
    }

    /// The grid of radiance: six sums for each voxel, as [`crate::scatter::scatter_list`] returns them.
    ///
    /// # Errors
    /// The device fails.
    pub fn radiance(&self) -> Result<Vec<[f32; 6]>, PipelineError> {
        let Some(grid) = &self.grid else {
            return Ok(Vec::new());
        };
        let words = self.words_of(&grid.marched.scatter.radiance)?;
        Ok(words.into_iter().map(|(sums, _)| sums).collect())
    }

    /// The grid that the view gathers, with the level that each voxel was smoothed by.
    ///
    /// # Errors
    /// The device fails.
    pub fn gathered(&self) -> Result<Vec<([f32; 6], u32)>, PipelineError> {
        let Some(grid) = &self.grid else {
            return Ok(Vec::new());
        };
        let words = self.words_of(grid.gathered())?;
        Ok(words
            .into_iter()
            .map(|(sums, [level, _])| (sums, level as u32))
            .collect())
    }

    /// Photons that crossed each voxel and the sum of their weights; empty where they were not counted.
    ///
    /// # Errors
    /// The device fails.
    pub fn counts(&self) -> Result<Vec<(u32, f64)>, PipelineError> {
        let Some(grid) = &self.grid else {
            return Ok(Vec::new());
        };
        let Some(counts) = &grid.marched.counts else {
            return Ok(Vec::new());
        };
        let words: Vec<[u32; 2]> = self.downloaded(counts)?;
        let unit = grid.marched.unit;
        Ok(words
            .into_iter()
            .map(|[count, weight]| (count, f64::from(weight) * unit))
            .collect())
    }

    /// Additions to sums of voxels and cells when photons last ran: those of photons, and those of pilots. A deposit adds to three sums,
    /// and to three more where directions are asked for; a photon that is counted in a voxel to two, a pilot in a cell to five.
    ///
    /// # Errors
    /// The device fails.
    pub fn additions(&self) -> Result<[u64; 2], PipelineError> {
        let Some(grid) = &self.grid else {
            return Ok([0; 2]);
        };
        let sums = if self.is_directed() { 6 } else { 3 };
        let visits: u64 = self.counts()?.iter().map(|(n, _)| u64::from(*n)).sum();
        let of_pilots = grid.pilots.as_ref().map_or(0, |pilots| {
            let cells: u64 = pilots.cells.iter().map(|cell| u64::from(cell.count)).sum();
            6 * pilots.deposits + 5 * cells
        });
        Ok([sums * grid.tallies.deposits + 2 * visits, of_pilots])
    }

    fn words_of(&self, grid: &Storage) -> Result<Vec<Sums>, PipelineError> {
        let words: Vec<[f32; 8]> = self.downloaded(grid)?;
        let sums = words
            .into_iter()
            .take(self.medium.field.len())
            .map(|[r, g, b, v, x, y, z, w]| ([r, g, b, x, y, z], [v, w]));
        Ok(sums.collect())
    }

    pub(super) fn downloaded<T: bytemuck::Pod>(
        &self,
        storage: &Storage,
    ) -> Result<Vec<T>, PipelineError> {
        let mut recording = Recording::new();
        recording.download("words", storage);
        Ok(self.player.play(&recording)?.download::<T>("words")?)
    }

    /// Half a unit of the whole numbers that energy is added as, which each deposit may be off by; 0 for floats.
    pub(crate) fn unit(&self) -> f64 {
        match (&self.grid, self.adding.strategy) {
            (None, _) | (_, Strategy::Swap | Strategy::Sort) => 0.0,
            (Some(grid), _) => grid.marched.scatter.unit() / 2.0,
        }
    }

    /// Steps of all rays of the view when it last ran.
    pub fn view_steps(&self) -> u64 {
        self.view_steps
    }

    /// Bytes of what photons write to and what is made of it, without the grid of sums.
    pub fn bytes(&self) -> u64 {
        self.grid.as_ref().map_or(0, |grid| {
            let smooth = grid
                .smooth
                .as_ref()
                .map_or(0, |(smoother, _)| smoother.bytes);
            grid.marched.scatter.bytes() + smooth
        })
    }
}

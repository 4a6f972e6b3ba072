//! Modelled cycles of the first rays, warp by warp: the model of coherence, on the host ([`raystone_bench::coherence`]).

use super::world::World;
use raystone_accel::{Access, BuiltAccel, Query, Ray, TriangleSoup};
use raystone_bench::coherence::paths::{RayPass, WORKGROUP};
use raystone_bench::coherence::{Machine, Memory, RayClass, Rays, Running, groups_of};
use raystone_bench::run::Registries;
use raystone_config::{Cell, Coherence};
use raystone_core::geometry::Camera;
use raystone_render::CountedRays;
use raystone_verify::rays::{primary_pixels, primary_rays};

/// A structure on the host, with the triangles of the scene.
pub(crate) struct Host {
    built: Box<dyn BuiltAccel>,
    soup: TriangleSoup,
}

impl Host {
    /// Builds the structure of a cell once more: what was uploaded was given up.
    pub(crate) fn new(world: &World, registries: &Registries, cell: &Cell) -> Result<Self, String> {
        let soup = world.soup();
        let built = world.built(registries, cell, &soup)?;
        if matches!(built.access(), Access::Pipeline(passes) if !passes.counts_work()) {
            return Err("it answers rays together, and its twin one by one".to_owned());
        }
        Ok(Self { built, soup })
    }
}

/// Modelled cycles of an image's first rays: bands of workgroups, from the top.
pub(crate) struct Cycles {
    pub size: [u32; 2],
    /// Of every pixel, row by row.
    pub values: Vec<f32>,
    /// The ray through the centre of every pixel, row by row.
    rays: Vec<Option<Ray>>,
    settings: Coherence,
    machine: Running,
    /// First row of the next band.
    row: u32,
}

impl Cycles {
    pub(crate) fn new(camera: Camera, size: [u32; 2]) -> Self {
        let [width, height] = size;
        let mut rays = vec![None; (width * height) as usize];
        let all = primary_rays(camera, width, height);
        for (pixel, ray) in primary_pixels(width, height).into_iter().zip(all) {
            rays[pixel as usize] = Some(ray);
        }
        let settings = Coherence::default();
        Self {
            size,
            values: vec![0.0; rays.len()],
            rays,
            machine: Running::new(&Machine::new(&settings)),
            settings,
            row: 0,
        }
    }

    /// Runs the next band of rows, whose groups of warps are beside one another; `false` if there was none left.
    ///
    /// # Errors
    /// The structure has no twin that tells what it reads; in words.
    pub(crate) fn add_band(&mut self, host: &Host) -> Result<bool, String> {
        let [width, height] = self.size;
        let rows = height.saturating_sub(self.row).min(WORKGROUP);
        if rows == 0 {
            return Ok(false);
        }
        let twin = host
            .built
            .cpu_twin(&host.soup)
            .ok_or("it has no twin on the host")?;
        let memory = Memory::new(&*host.built, &host.soup)?;
        let place = |[x, y]: [u32; 2]| ((self.row + y) * width + x) as usize;
        // As many groups as there are at most: all warps are in one.
        let counts = [width.div_ceil(WORKGROUP) * WORKGROUP, self.settings.warps];
        let groups = groups_of([width, rows], self.settings.warp, counts, 1);
        // A class for each warp of a group, so that each has its own tally.
        let class = |warp: usize| RayClass {
            depth: warp as u32,
            rays: CountedRays::Primary,
        };
        let warp = |(number, pixels): (usize, &Vec<Option<[u32; 2]>>)| {
            vec![RayPass {
                class: class(number),
                query: Query::Closest,
                lanes: pixels
                    .iter()
                    .map(|pixel| self.rays[place((*pixel)?)])
                    .collect(),
            }]
        };
        let rays = Rays {
            groups: groups
                .iter()
                .map(|warps| warps.iter().enumerate().map(warp).collect())
                .collect(),
            paths: 0,
        };
        let tallies = self.machine.then(&rays.through(&*twin, &memory)?);
        for (warps, tallies) in groups.iter().zip(tallies) {
            for (number, pixels) in warps.iter().enumerate() {
                let tally = tallies
                    .get(&class(number).word())
                    .copied()
                    .unwrap_or_default();
                let each = tally.cost() as f32 / tally.rays.max(1) as f32;
                for pixel in pixels.iter().flatten() {
                    self.values[((self.row + pixel[1]) * width + pixel[0]) as usize] = each;
                }
            }
        }
        self.row += rows;
        Ok(true)
    }
}

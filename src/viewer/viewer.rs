//! The viewer: what is on screen.

mod steps;

use super::display::{Display, Rendered};
use super::done::{Done, Work, note};
use super::frame::{Frame, encoded, figures, write_linear};
use super::inspect::{self, Grasp, Inspection, Trail};
use super::motion::{FrameClock, FrameTimes, Pose};
use super::points::SamplePoints;
use super::reference::{Accumulated, judged};
use super::screen::{SIDE_NAMES, Screen};
use super::side::{Lens, Side};
use super::world::{Structure, World};
use raystone_bench::run::{Estimator, Registries, RunError};
use raystone_config::{Axis, Cell};
use raystone_core::clock::Instant;
use raystone_core::geometry::Camera;
use raystone_core::program::Program;
use raystone_gpu::{Gpu, GpuError, wait_for};
use raystone_scene::check_camera;
use raystone_stats::metrics;
use std::path::Path as File;

/// The viewer of one device.
pub struct Viewer<'g> {
    gpu: &'g Gpu,
    registries: Registries,
    program: Program,
    allow_outside: bool,
    screen: Option<Screen>,
    world: Option<World>,
    sides: Vec<Side<'g>>,
    reference: Option<Accumulated<'g>>,
    /// The reference as it was last read, and when.
    judge: Option<(metrics::Reference, Instant)>,
    clock: FrameClock,
    /// What the last frame took, while frames follow one another.
    times: Option<FrameTimes>,
    /// Images of the screen that were not shown yet.
    unseen: usize,
    /// The files of the scene may be others than those that were read.
    is_stale: bool,
}

impl<'g> Viewer<'g> {
    /// A viewer that shows nothing yet. Models may name files outside their folder if `allow_outside` is set.
    pub fn new(
        gpu: &'g Gpu,
        registries: Registries,
        program: Program,
        allow_outside: bool,
    ) -> Self {
        Self {
            gpu,
            registries,
            program,
            allow_outside,
            screen: None,
            world: None,
            sides: Vec::new(),
            reference: None,
            judge: None,
            clock: FrameClock::default(),
            times: None,
            unseen: 0,
            is_stale: false,
        }
    }

    /// The registries.
    pub fn registries(&self) -> &Registries {
        &self.registries
    }

    /// What is on screen, if anything.
    pub fn screen(&self) -> Option<&Screen> {
        self.screen.as_ref()
    }

    /// True once each image of the screen was shown. Steps before it are better not stopped, so that a camera that moves
    /// is seen.
    pub fn is_seen(&self) -> bool {
        self.unseen == 0
    }

    /// Notes on the scene: what of its file is not shown as written.
    pub fn notes(&self) -> Vec<String> {
        let report = self.world.as_ref().map(|world| &world.stage.scene.report);
        report.map_or(Vec::new(), |report| report.lines())
    }

    /// The camera of the images.
    pub fn camera(&self) -> Option<Camera> {
        self.sides.first().map(|side| side.lens.camera)
    }

    /// Has the next screen's scene loaded anew, or no longer: its files may be others, of the same name.
    pub fn reload(&mut self, is_stale: bool) {
        self.is_stale = is_stale;
    }

    /// Changes what is on screen, and says what that took: what can be used further is. `tell` is called with what is being done
    /// before anything that may take long.
    ///
    /// # Errors
    /// The scene does not load, the camera sees nothing, or the device is lost: what was on screen stays. An image that cannot
    /// be made says so in its place instead.
    pub fn show(
        &mut self,
        screen: Screen,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Done>, RunError> {
        wait_for(self.show_async(screen, tell))
    }

    /// The same as a future, as are all that end in `_async`: a browser is not blocked.
    ///
    /// # Errors
    /// As [`Viewer::show`].
    pub async fn show_async(
        &mut self,
        screen: Screen,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Done>, RunError> {
        screen.check().map_err(RunError::Input)?;
        let mut done = Vec::new();
        let first = &screen.cells[0];
        let of_world = first.on(&Cell::WORLD);
        let loaded = match &self.world {
            Some(world) if world.cell == of_world && !self.is_stale => None,
            _ => {
                let scene = &first[Axis::Scene];
                tell(&format!("loading {scene}"));
                let clock = Instant::now();
                let allow = self.allow_outside;
                let world = World::load(self.gpu, &self.registries, first, allow).await?;
                note(
                    &mut done,
                    Work::Loaded,
                    format!("{scene}, {} triangles,", world.stage.scene.triangles.len()),
                    clock,
                );
                Some(world)
            }
        };
        let world = loaded.as_ref().or(self.world.as_ref());
        let Some(scene) = world.map(|world| &world.still) else {
            return Ok(done);
        };
        let camera = screen.camera.unwrap_or_else(|| scene.view(screen.aspect()));
        check_camera(&camera).map_err(|e| RunError::Input(e.to_string()))?;
        let mut pose = Pose {
            animation: screen.animation,
            frame: screen.window.frame,
            dragged: screen.dragged.clone(),
        };
        match loaded {
            Some(mut world) => {
                world.take(&pose)?;
                self.world = Some(world);
                self.is_stale = false;
                self.sides.clear();
                self.reference = None;
            }
            None => {
                pose.frame = self.frame_of(&screen);
                self.pose(&pose, &screen, &mut done)?;
            }
        }
        let lens = Lens {
            camera,
            size: screen.size,
            seed: screen.seed,
            spp: screen.plays().unwrap_or(screen.spp),
        };
        self.show_sides(&screen, lens, &mut done, tell)?;
        self.show_reference(&screen, lens);
        self.unseen = screen.cells.len();
        self.screen = Some(screen);
        Ok(done)
    }

    /// The frame of a screen: that which frames following one another came to, unless another is chosen.
    fn frame_of(&self, screen: &Screen) -> u32 {
        let goes_on = |was: &&Screen| {
            was.animation == screen.animation && was.window.frame == screen.window.frame
        };
        let on = self.screen.as_ref().filter(goes_on);
        let now = self.world.as_ref().map(|world| world.pose.frame);
        on.and(now).unwrap_or(screen.window.frame)
    }

    /// Moves the scene to a pose, if it is another one, and all structures after it.
    fn pose(&mut self, pose: &Pose, screen: &Screen, done: &mut Vec<Done>) -> Result<(), RunError> {
        let Some(world) = &mut self.world else {
            return Ok(());
        };
        let clock = Instant::now();
        let Some(soup) = world.take(pose)? else {
            return Ok(());
        };
        self.clock.scene_ms = clock.elapsed().as_secs_f64() * 1e3;
        self.reference = None;
        self.judge = None;
        let mut followed: Vec<Structure> = Vec::new();
        for side in &mut self.sides {
            let (cell, clock) = (side.cell.on(&Cell::STRUCTURE), Instant::now());
            let known = followed.iter().find(|known| known.cell == cell).cloned();
            let structure = known.map_or_else(
                || world.follow(&self.registries, (&side.cell, screen.window.follow), &soup),
                Ok,
            );
            followed.extend(structure.as_ref().ok().cloned());
            let work = of_fault(structure.as_ref().err(), Work::Followed);
            side.follow(structure, clock.elapsed().as_secs_f64() * 1e3);
            note(done, work, side.cell[Axis::Accel].to_string(), clock);
            lost(self.gpu)?;
        }
        Ok(())
    }

    fn show_sides(
        &mut self,
        screen: &Screen,
        lens: Lens,
        done: &mut Vec<Done>,
        tell: &mut dyn FnMut(&str),
    ) -> Result<(), RunError> {
        let Some(world) = &self.world else {
            return Ok(());
        };
        let mut old = std::mem::take(&mut self.sides);
        // Images of a scene that moved have begun anew.
        let is_moved = done.iter().any(|done| done.work == Work::Followed);
        for (cell, name) in screen.cells.iter().zip(SIDE_NAMES) {
            let name = if screen.cells.len() > 1 {
                format!("{name}: ")
            } else {
                String::new()
            };
            let same = |side: &Side| {
                side.cell == *cell && side.lens.size == lens.size && side.lens.spp == lens.spp
            };
            // An image that failed is tried again.
            let kept = old
                .iter()
                .position(|side| same(side) && side.fault.is_none());
            if let Some(place) = kept {
                let mut side = old.swap_remove(place);
                if side.lens == lens && !is_moved {
                    note(done, Work::Kept, format!("{name}image"), Instant::now());
                } else {
                    side.restart(lens);
                    note(
                        done,
                        Work::Restarted,
                        format!("{name}samples"),
                        Instant::now(),
                    );
                }
                self.sides.push(side);
                continue;
            }
            let accel = &cell[Axis::Accel];
            let clock = Instant::now();
            let structure = match known_structure(self.sides.iter().chain(&old), cell) {
                Some(known) => {
                    note(done, Work::Kept, format!("{name}{accel}"), clock);
                    Ok(known)
                }
                None => {
                    tell(&format!("{name}building {accel}"));
                    let built = world.build(&self.registries, cell);
                    let work = of_fault(built.as_ref().err(), Work::Built);
                    note(done, work, format!("{name}{accel}"), clock);
                    built
                }
            };
            let mut side = Side::new(self.gpu, cell, structure, lens);
            if side.fault.is_none() {
                let what = format!("{name}{}", cell[Axis::Integrator]);
                tell(&format!("{name}compiling {}", cell[Axis::Integrator]));
                let clock = Instant::now();
                side.compile((&self.registries, world));
                let work = of_fault(side.fault.as_ref(), Work::Compiled);
                note(done, work, what, clock);
            }
            self.sides.push(side);
            lost(self.gpu)?;
        }
        Ok(())
    }

    fn show_reference(&mut self, screen: &Screen, lens: Lens) {
        let first = self.sides.first().filter(|side| side.fault.is_none());
        let is_wanted = screen.window.error && screen.plays().is_none();
        let Some(side) = first.filter(|_| is_wanted) else {
            self.reference = None;
            self.judge = None;
            return;
        };
        let is_same = |known: &&Accumulated| {
            let its = known.lens;
            let lens = Lens {
                spp: its.spp,
                ..lens
            };
            known.cell == judged(&side.cell)
                && known.settings == screen.reference
                && Lens {
                    seed: its.seed,
                    ..lens
                } == its
        };
        let Some(structure) = &side.structure else {
            return;
        };
        if self.reference.as_ref().filter(is_same).is_none() {
            let (settings, structure) = (&screen.reference, structure.clone());
            self.reference = Some(Accumulated::new(
                self.gpu, &side.cell, structure, settings, lens,
            ));
            self.judge = None;
        }
    }

    /// What to draw now.
    pub fn frame(&self) -> Frame {
        let window = self.screen.as_ref().map(|screen| &screen.window);
        window.map_or_else(Frame::default, |window| self.display().frame(window))
    }

    /// What was rendered, to be drawn in other ways while this works on.
    pub fn display(&self) -> Display {
        let Some(screen) = &self.screen else {
            return Display::default();
        };
        let reference = self.judge.as_ref().map(|(reference, _)| reference);
        let side = |side: &Side| Rendered {
            image: side.image.clone(),
            maps: side.counting.maps.clone(),
            label: side.cell.to_string(),
            cell: side.cell.clone(),
            figures: figures(side, reference),
            fault: side.fault.clone(),
        };
        Display {
            sides: self.sides.iter().map(side).collect(),
            frame: Frame {
                reference_spp: self.reference.as_ref().map(Accumulated::spp),
                triangles: self
                    .world
                    .as_ref()
                    .map_or(0, |world| world.stage.scene.triangles.len()),
                objects: self.world.as_ref().map_or(0, World::objects),
                times: self.times.clone().filter(|_| screen.plays().is_some()),
                ..Frame::default()
            },
        }
    }

    /// The frame of the animation that is shown.
    pub fn frame_number(&self) -> u32 {
        self.world.as_ref().map_or(0, |world| world.pose.frame)
    }

    /// The instance that is seen at a pixel, and where; `None` where nothing is.
    ///
    /// # Errors
    /// The scene has no instances, or the device is lost; in words.
    pub fn grasp(&self, pixel: [u32; 2]) -> Result<Option<Grasp>, String> {
        wait_for(self.grasp_async(pixel))
    }

    /// See [`Viewer::grasp`].
    ///
    /// # Errors
    /// As [`Viewer::grasp`].
    pub async fn grasp_async(&self, pixel: [u32; 2]) -> Result<Option<Grasp>, String> {
        let (world, side) = self.at(0)?;
        inspect::grasp(world, side, pixel).await
    }

    /// Writes the linear image of a side, in the format of the file's ending; or what is on screen, as PNG.
    ///
    /// # Errors
    /// There is nothing to write yet, the ending is unknown, or the file cannot be written.
    pub fn save(&self, file: &File, side: usize) -> Result<(), RunError> {
        let nothing = || RunError::Input("there is nothing to save yet".to_owned());
        if file
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
        {
            let screen = self.screen.as_ref().ok_or_else(nothing)?;
            return self
                .frame()
                .write_png(file, screen.size, screen.window.swipe);
        }
        write_linear(
            self.sides.get(side).ok_or_else(nothing)?,
            file,
            &self.program,
        )
    }

    /// The linear image of a side as the bytes of such a file, which is not written.
    ///
    /// # Errors
    /// There is nothing to write yet, or the ending is unknown.
    pub fn encoded(&self, file: &File, side: usize) -> Result<Vec<u8>, RunError> {
        let nothing = || RunError::Input("there is nothing to save yet".to_owned());
        encoded(
            self.sides.get(side).ok_or_else(nothing)?,
            file,
            &self.program,
        )
    }

    /// What the images have at a pixel; `None` outside of them.
    ///
    /// # Errors
    /// The device is lost or hangs, or a kernel does not compile.
    pub fn inspect(&self, pixel: [u32; 2]) -> Result<Option<Inspection>, RunError> {
        wait_for(self.inspect_async(pixel))
    }

    /// See [`Viewer::inspect`].
    ///
    /// # Errors
    /// As [`Viewer::inspect`].
    pub async fn inspect_async(&self, pixel: [u32; 2]) -> Result<Option<Inspection>, RunError> {
        let sound: Vec<&Side> = self
            .sides
            .iter()
            .filter(|side| side.fault.is_none())
            .collect();
        match &self.world {
            Some(world) => Ok(inspect::inspect(world, &sound, pixel).await?),
            None => Ok(None),
        }
    }

    /// Every node that a side's structure visits with the ray through a pixel's centre, and every triangle that it tests.
    ///
    /// # Errors
    /// There is no such pixel, or the structure has no twin; in words.
    pub fn explain(&self, side: usize, pixel: [u32; 2]) -> Result<String, String> {
        let (world, side) = self.at(side)?;
        inspect::explained(&self.registries, world, side, pixel)
    }

    /// The path of one sample of a side's pixel, computed on the host.
    ///
    /// # Errors
    /// The oracle does not support the integrator or the scene; in words.
    pub fn path(&self, side: usize, pixel: [u32; 2], sample: u32) -> Result<Trail, String> {
        let (world, seen) = self.at(side)?;
        let path = inspect::path(&self.registries, world, seen, (pixel, sample))?;
        Ok(Trail::new((side, pixel, sample), seen.lens.camera, &path))
    }

    /// The first `count` points that a side's sampler gives a pixel, in two dimensions.
    ///
    /// # Errors
    /// A dimension that nothing draws, or a pixel outside of the image; in words.
    pub fn points(
        &self,
        side: usize,
        pixel: [u32; 2],
        dimensions: [u32; 2],
        count: u32,
    ) -> Result<SamplePoints, String> {
        let (_, side) = self.at(side)?;
        let (lens, cell) = (side.lens, &side.cell);
        let estimator = Estimator::of(&self.registries, cell, lens.spp, lens.size[0])?;
        let count = count.min(lens.spp);
        let at = (pixel, lens.size);
        SamplePoints::of(&estimator.sampler, at, dimensions, (count, lens.seed))
    }

    fn at(&self, side: usize) -> Result<(&World, &Side<'g>), String> {
        let world = self.world.as_ref().ok_or("there is no scene")?;
        let side = self.sides.get(side).ok_or("there is no such image")?;
        Ok((world, side))
    }
}

/// The structure of a cell, where one of these sides has it already.
fn known_structure<'a, 'g: 'a>(
    mut sides: impl Iterator<Item = &'a Side<'g>>,
    cell: &Cell,
) -> Option<Structure> {
    let wanted = cell.on(&Cell::STRUCTURE);
    sides.find_map(|side| side.structure.clone().filter(|known| known.cell == wanted))
}

/// What was done where there is no fault.
fn of_fault(fault: Option<&String>, work: Work) -> Work {
    fault.map_or(work, |_| Work::Failed)
}

/// An error if the device is lost.
fn lost(gpu: &Gpu) -> Result<(), RunError> {
    match gpu.lost() {
        Some(cause) => Err(GpuError::Lost(cause).into()),
        None => Ok(()),
    }
}

//! Scenes that move: the pose of a frame, and structures that follow it.

use super::world::{Structure, World};
use raystone_accel::{AccelError, AccelKind, BuildLog, BuiltAccel, TriangleSoup};
use raystone_bench::animation::{Actor, Taken, Way, moved};
use raystone_bench::run::{Registries, RunError};
use raystone_config::{Animation, Axis, Cell, Follow, Motion};
use raystone_core::clock::Instant;
use raystone_render::Stage;
use raystone_scene::SceneData;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Frames whose time is kept.
const HISTORY: usize = 240;

/// What is moved, and how far.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Pose {
    pub animation: Option<Animation>,
    /// A frame of the animation.
    pub frame: u32,
    /// Ways of instances that were dragged, scene units.
    pub dragged: BTreeMap<u32, glam::Vec3>,
}

impl Pose {
    /// The scene in this pose.
    fn of(&self, still: &Arc<SceneData>) -> Result<Arc<SceneData>, String> {
        let mut scene = Arc::clone(still);
        if !self.dragged.is_empty() {
            scene = Arc::new(SceneData::clone(&scene).shifted(&self.dragged)?);
        }
        match &self.animation {
            // The first frame of a motion without instances is refused, too.
            Some(animation) => Ok(Arc::new(moved(
                &scene,
                animation,
                self.frame.min(animation.frames - 1),
            )?)),
            None => Ok(scene),
        }
    }

    /// Whether the scene stands otherwise than it was loaded, so that structures had to follow it.
    pub(crate) fn is_moved(&self) -> bool {
        self.animation.is_some() || !self.dragged.is_empty()
    }

    fn motion(&self) -> Motion {
        self.animation
            .map_or(Motion::Instances, |animation| animation.motion)
    }
}

/// A structure of the scene as it was loaded, which follows it.
pub(crate) struct Follower {
    /// See [`Cell::STRUCTURE`].
    cell: Cell,
    motion: Motion,
    /// `None` if it can only be built anew.
    actor: Option<Actor<'static>>,
    /// Objects in their last pose, which take the next transforms.
    objects: Option<Box<dyn BuiltAccel>>,
}

impl Follower {
    /// Keeps objects for their next transforms.
    fn keep(&mut self, built: Box<dyn BuiltAccel>) {
        let is_updated = |actor: &Actor| actor.ways()[0] == Way::Update;
        if self.actor.as_ref().is_some_and(is_updated) {
            self.objects = Some(built);
        }
    }
}

impl World {
    /// Takes a pose; returns the triangles for structures, or `None` if it had it before.
    ///
    /// # Errors
    /// There are no instances that could move, or the device has no room; the pose of before stays.
    pub(crate) fn take(&mut self, pose: &Pose) -> Result<Option<TriangleSoup>, RunError> {
        if self.pose == *pose {
            return Ok(None);
        }
        let scene = pose.of(&self.still).map_err(RunError::Input)?;
        let tests = self.stage.soup.intersection;
        let mut stage = Stage::new(&self.stage.gpu, scene, tests)?;
        let none = TriangleSoup::default().intersecting(tests);
        let soup = std::mem::replace(&mut stage.soup, none);
        self.stage = stage;
        self.pose = pose.clone();
        Ok(Some(soup))
    }

    /// The structure of a cell over the triangles of the pose that was just taken.
    pub(crate) fn follow(
        &mut self,
        registries: &Registries,
        (cell, follow): (&Cell, Follow),
        soup: &TriangleSoup,
    ) -> Result<Structure, String> {
        let accel = &cell[Axis::Accel];
        let kind = registries.accel.named("structure", &accel.name)?;
        if follow == Follow::Refit {
            let place = self.follower((kind, cell), soup);
            if let Some(built) = self.refitted(place, soup)? {
                let structure = self.upload(registries, cell, &*built);
                self.followers[place].keep(built);
                return structure;
            }
        }
        let mut log = BuildLog::with_gpu(&self.stage.gpu);
        let built = kind.build(soup, &accel.params, &mut log);
        self.upload(registries, cell, &*built.map_err(|e| e.to_string())?)
    }

    fn still(&self, like: &TriangleSoup) -> TriangleSoup {
        TriangleSoup::new(&self.still).intersecting(like.intersection)
    }

    /// The place of a cell's follower, which is made at its first use.
    fn follower(
        &mut self,
        (kind, cell): (&'static dyn AccelKind, &Cell),
        soup: &TriangleSoup,
    ) -> usize {
        let (motion, cell) = (self.pose.motion(), cell.on(&Cell::STRUCTURE));
        let same = |known: &Follower| known.cell == cell && known.motion == motion;
        let known = self.followers.iter().position(same);
        known.unwrap_or_else(|| {
            let still = (&self.still(soup), &self.stage.gpu);
            let params = &cell[Axis::Accel].params;
            let actor = Actor::new(kind, params, motion, still).ok();
            self.followers.push(Follower {
                cell,
                motion,
                actor,
                objects: None,
            });
            self.followers.len() - 1
        })
    }

    /// The structure with new boxes or transforms; `None` if it can only be built anew.
    fn refitted(
        &mut self,
        place: usize,
        soup: &TriangleSoup,
    ) -> Result<Option<Box<dyn BuiltAccel>>, String> {
        let text = |e: AccelError| e.to_string();
        let objects = self.followers[place].objects.take();
        let Some(actor) = &self.followers[place].actor else {
            return Ok(None);
        };
        let mut log = BuildLog::with_gpu(&self.stage.gpu);
        let (way, ways) = (actor.ways()[0], actor.ways());
        // Without a device for builds, as in a browser, the host does the same, to the bit.
        let way = match way {
            Way::Device if log.gpu().is_none() && ways.contains(&Way::Host) => Way::Host,
            way => way,
        };
        let from = match objects {
            Some(objects) => Some(Taken::Built(objects)),
            // Objects are built over the scene as it was loaded; trees are there.
            None => actor.start(way, &self.still(soup)).map_err(text)?,
        };
        let taken = actor.take(way, from, soup, &mut log).map_err(text)?;
        actor.built(taken, soup).map(Some).map_err(text)
    }
}

/// Milliseconds of the parts of a frame while a scene moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameTimes {
    /// The frame that is shown, and their number.
    pub frame: [u32; 2],
    /// From one frame to the next, the last ones.
    pub whole_ms: Vec<f32>,
    /// Moving vertices or instances, and uploading the scene.
    pub scene_ms: f64,
    /// Of each image.
    pub sides: Vec<SideTimes>,
}

/// Milliseconds of an image of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SideTimes {
    /// The structure follows the scene, and is uploaded.
    pub update_ms: f64,
    /// Its samples are rendered.
    pub render_ms: f64,
    /// Of these, rays are traced; `None` if the organisation has one kernel for all.
    pub trace_ms: Option<f64>,
}

impl FrameTimes {
    /// What is left of the last frame: reading images back, and painting them.
    pub fn rest_ms(&self) -> f64 {
        let whole = self.whole_ms.last().copied().unwrap_or_default();
        let sides = self
            .sides
            .iter()
            .map(|side| side.update_ms + side.render_ms);
        (f64::from(whole) - self.scene_ms - sides.sum::<f64>()).max(0.0)
    }
}

/// The clock of frames.
#[derive(Default)]
pub(crate) struct FrameClock {
    began: Option<Instant>,
    whole_ms: VecDeque<f32>,
    /// Of the frame at hand.
    pub scene_ms: f64,
}

impl FrameClock {
    /// Begins a frame.
    pub(crate) fn tick(&mut self) {
        if let Some(began) = self.began.replace(Instant::now()) {
            self.whole_ms
                .push_back(began.elapsed().as_secs_f64() as f32 * 1e3);
            let old = self.whole_ms.len().saturating_sub(HISTORY);
            self.whole_ms.drain(..old);
        }
    }

    pub(crate) fn whole_ms(&self) -> Vec<f32> {
        self.whole_ms.iter().copied().collect()
    }
}

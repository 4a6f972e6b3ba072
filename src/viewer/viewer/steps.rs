//! The steps that lead to what is on screen.

use super::{Viewer, lost};
use crate::done::Step;
use crate::motion::{FrameTimes, Pose};
use crate::reference::Accumulated;
use crate::side::Side;
use raystone_bench::run::RunError;
use raystone_config::Pace;
use raystone_core::clock::Instant;
use raystone_gpu::{Gpu, GpuError, wait_for};

/// Time between two readings of the reference, seconds.
const JUDGE_S: f64 = 1.0;

impl Viewer<'_> {
    /// Does a piece of the work that is left: a coarse image first, then samples in turns, short slices at a time. `stop` is
    /// asked between slices; samples that were given up are begun anew, so it should agree only if they are not needed any more.
    ///
    /// # Errors
    /// The device is lost or hangs. An image that fails in another way says so in its place.
    pub fn step(&mut self, stop: &dyn Fn() -> bool) -> Result<Step, RunError> {
        wait_for(self.step_async(stop))
    }

    /// See [`Viewer::step`].
    ///
    /// # Errors
    /// As [`Viewer::step`].
    pub async fn step_async(&mut self, stop: &dyn Fn() -> bool) -> Result<Step, RunError> {
        let step = self.work(stop).await?;
        if step == Step::Shown {
            self.unseen = self.unseen.saturating_sub(1);
        }
        Ok(step)
    }

    async fn work(&mut self, stop: &dyn Fn() -> bool) -> Result<Step, RunError> {
        let (Some(world), Some(screen)) = (&self.world, &self.screen) else {
            return Ok(Step::Idle);
        };
        let with = (&self.registries, world);
        let window = screen.window;
        let (map, pace) = ((window.map, window.follow), window.pace);
        let plays = screen.plays().is_some();
        if let Some(side) = self
            .sides
            .iter_mut()
            .find(|side| side.fault.is_none() && side.is_coarse())
        {
            let step = side.refine(with, map, stop).await;
            return keep(step, side, self.gpu);
        }
        for side in self.sides.iter_mut().filter(|side| side.fault.is_none()) {
            match side.count(with, map, stop).await {
                Ok(None) => {}
                Ok(Some(step)) => return Ok(step),
                Err(error) => return keep(Err(error), side, self.gpu),
            }
        }
        if let Some(judge) = &self.judge {
            let is_last = self.reference.as_ref().is_none_or(Accumulated::is_finished);
            if self
                .sides
                .iter_mut()
                .any(|side| side.compare(judge, is_last))
            {
                return Ok(Step::Shown);
            }
        }
        let place = |side: &&mut Side| match pace {
            Pace::Samples => f64::from(side.done),
            Pace::Time => side.spent_ms(),
        };
        let behind = self.sides.iter_mut().filter(|side| !side.is_finished());
        let behind = behind.min_by(|a, b| place(a).total_cmp(&place(b)));
        let reference = self
            .reference
            .as_mut()
            .filter(|reference| !reference.is_finished());
        match (behind, reference) {
            // The reference has its turn once for each sample of the image that is behind.
            (side, Some(reference))
                if side.as_ref().is_none_or(|side| side.done > reference.spp()) =>
            {
                match reference.add(with, stop).await {
                    Ok(true) => self.judge_anew().await,
                    Ok(false) => Ok(Step::Stopped),
                    Err(reason) => {
                        lost(self.gpu)?;
                        self.reference = None;
                        Err(RunError::Input(format!("no reference: {reason}")))
                    }
                }
            }
            (Some(side), _) => {
                // Images of a frame are shown together.
                let step = side.accumulate(with, !plays, stop).await;
                keep(step, side, self.gpu)
            }
            (None, _) => self.next_frame().await,
        }
    }

    /// Reads the reference if it is time to.
    async fn judge_anew(&mut self) -> Result<Step, RunError> {
        let is_due = |(_, read): &(_, Instant)| read.elapsed().as_secs_f64() >= JUDGE_S;
        let (Some(world), Some(reference)) = (&self.world, &mut self.reference) else {
            return Ok(Step::Worked);
        };
        if !self.judge.as_ref().is_none_or(is_due) && !reference.is_finished() {
            return Ok(Step::Worked);
        }
        let read = reference
            .images((&self.registries, world))
            .await
            .map_err(RunError::Input)?;
        self.judge = read.map(|reference| (reference, Instant::now()));
        Ok(Step::Shown)
    }

    /// Shows a frame that has its samples, then begins the next one, if frames follow one another.
    async fn next_frame(&mut self) -> Result<Step, RunError> {
        let screen = self
            .screen
            .clone()
            .filter(|screen| screen.plays().is_some());
        let (Some(screen), Some(world)) = (screen, &self.world) else {
            return Ok(Step::Idle);
        };
        let mut is_new = false;
        for side in self.sides.iter_mut().filter(|side| side.fault.is_none()) {
            match side.refresh().await {
                Ok(is_read) => is_new |= is_read,
                Err(error) => return keep(Err(error), side, self.gpu),
            }
        }
        if is_new {
            return Ok(Step::Shown);
        }
        let frames = screen.animation.map_or(1, |animation| animation.frames);
        let frame = (world.pose.frame + 1) % frames;
        let pose = Pose {
            frame,
            ..world.pose.clone()
        };
        self.clock.tick();
        self.times = Some(FrameTimes {
            frame: [world.pose.frame, frames],
            whole_ms: self.clock.whole_ms(),
            scene_ms: self.clock.scene_ms,
            sides: self.sides.iter().map(Side::times).collect(),
        });
        self.pose(&pose, &screen, &mut Vec::new())?;
        self.sides.iter_mut().for_each(Side::skip_coarse);
        Ok(Step::Worked)
    }
}

/// Keeps a failure of an image with it; what a lost device does is not the image's fault.
fn keep(step: Result<Step, GpuError>, side: &mut Side, gpu: &Gpu) -> Result<Step, RunError> {
    step.or_else(|error| {
        lost(gpu)?;
        side.fault = Some(error.to_string());
        Ok(Step::Shown)
    })
}

//! What is on screen.

use super::inspect::Grasp;
use glam::Vec3;
use raystone_bench::run::Registries;
use raystone_config::{
    Animation, Axis, Catalogue, Cell, ConfigError, Experiment, Plan, Reference, Window, is_bench,
};
use raystone_core::geometry::Camera;
use raystone_core::params::Variant;
use std::collections::BTreeMap;

/// Names of the images, from left to right.
pub const SIDE_NAMES: [&str; 2] = ["A", "B"];

/// The experiment that a shell begins with.
pub const START: &str = r#"
[run]
resolution = [512, 384]
spp = [1024]
[axes]
scene = ["cornell-box"]
accel = ["cwbvh"]
sequence = ["sobol"]
decorrelation = ["cranley-patterson"]
"#;

/// Axes that images side by side share: they show the same triangles.
const SHARED: [Axis; 4] = [Axis::Scene, Axis::Triangle, Axis::BoxTest, Axis::Kernels];

/// What is on screen: one image or two side by side, in the words of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Screen {
    /// What each image is made of; one or two.
    pub cells: Vec<Cell>,
    /// The camera; `None` is that of the scene.
    pub camera: Option<Camera>,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Samples per pixel at which an image is finished.
    pub spp: u32,
    /// Seed of the images.
    pub seed: u32,
    /// What errors are taken against.
    pub reference: Reference,
    /// How the scene moves from frame to frame.
    pub animation: Option<Animation>,
    /// Ways of instances that were dragged, scene units; an experiment has them as `shifts` of the scene.
    pub dragged: BTreeMap<u32, Vec3>,
    /// How images are shown.
    pub window: Window,
}

impl Screen {
    /// The first two cells of an experiment that render.
    ///
    /// # Errors
    /// The experiment has no plan, renders nothing, or its first two cells show different triangles.
    pub fn of(experiment: &Experiment, registries: &Registries) -> Result<Self, String> {
        let plan = Plan::new(experiment, &[], |s, d| registries.is_randomised(s, d));
        let plan = plan.map_err(|error: ConfigError| error.to_string())?;
        let cells: Vec<Cell> = plan.times.into_iter().take(SIDE_NAMES.len()).collect();
        let screen = Self {
            cells,
            camera: experiment.camera,
            size: experiment.run.resolution,
            spp: experiment.run.spp.max(),
            seed: experiment.run.seed,
            reference: experiment.reference.clone(),
            animation: experiment.animation,
            dragged: BTreeMap::new(),
            window: experiment.window,
        };
        screen.check()?;
        Ok(screen)
    }

    /// Reads an experiment.
    ///
    /// # Errors
    /// As [`Screen::of`], or a text that is none.
    pub fn parse(
        text: &str,
        file: &str,
        overrides: &[String],
        registries: &Registries,
    ) -> Result<Self, String> {
        let experiment = Experiment::parse(text, file, overrides, &registries.catalogue());
        Self::of(&experiment.map_err(|e| e.to_string())?, registries)
    }

    /// The screen of an experiment that is read with overrides of its own for each image, one or two.
    ///
    /// # Errors
    /// As [`Screen::parse`].
    pub fn parse_sides(
        text: &str,
        file: &str,
        sides: &[Vec<String>],
        registries: &Registries,
    ) -> Result<Self, String> {
        let parse = |overrides: &Vec<String>| Self::parse(text, file, overrides, registries);
        let [first, others @ ..] = sides else {
            return Self::parse(text, file, &[], registries);
        };
        let mut screen = parse(first)?;
        if let [second, ..] = others {
            screen.cells.truncate(1);
            screen.cells.push(parse(second)?.cells.swap_remove(0));
            screen.check()?;
        }
        Ok(screen)
    }

    /// Checks what can be seen without a device.
    ///
    /// # Errors
    /// The reason why it cannot be shown.
    pub fn check(&self) -> Result<(), String> {
        let [first, others @ ..] = self.cells.as_slice() else {
            return Err("there is nothing to show: no cell of the experiment renders".to_owned());
        };
        if self.size.contains(&0) {
            return Err("the window has no room for an image: make it larger".to_owned());
        }
        if self
            .cells
            .iter()
            .any(|cell| is_bench(&cell[Axis::Integrator]))
        {
            return Err(format!(
                "{} renders nothing to show",
                first[Axis::Integrator]
            ));
        }
        if !first[Axis::Kernels].name.is_empty() {
            return Err(
                "the window shows the embedded kernels: leave out `axes.kernels`".to_owned(),
            );
        }
        for other in others {
            if let Some(axis) = SHARED.into_iter().find(|axis| first[*axis] != other[*axis]) {
                return Err(format!(
                    "A and B show the same triangles, but differ in {axis} ({} and {}): choose one",
                    first[axis], other[axis]
                ));
            }
        }
        Ok(())
    }

    /// Chooses a variant for an image; on axes that both share, for both.
    pub fn choose(&mut self, side: usize, axis: Axis, variant: &Variant) {
        if axis == Axis::Scene {
            self.camera = None;
            self.dragged.clear();
        }
        for (index, cell) in self.cells.iter_mut().enumerate() {
            if index == side || SHARED.contains(&axis) {
                *cell = cell.clone().with(axis, variant);
            }
        }
    }

    /// Shows another scene: a built-in one, or a model file.
    ///
    /// # Errors
    /// It is neither by its name; in words. Whether there is such a file is not known yet.
    pub fn open(&mut self, path: &str, catalogue: &Catalogue) -> Result<(), String> {
        // As an experiment with this scene alone has it.
        let name = toml::Value::from(path);
        let text = format!("[axes]\nscene = [{name}]\naccel = [\"bvh\"]\nsequence = [\"sobol\"]\n");
        let read = Experiment::parse(&text, "scene", &[], catalogue);
        let scenes = &read.map_err(|e| e.to_string())?.axes[Axis::Scene];
        if let Some(scene) = scenes.first() {
            self.choose(0, Axis::Scene, scene);
        }
        Ok(())
    }

    /// Moves the instance that is grasped along the image, by shares of its width to the right and of its height down: what is
    /// grasped stays under the pointer.
    pub fn drag(&mut self, grasp: &Grasp, camera: &Camera, [x, y]: [f32; 2]) {
        let [forward, right, up] = camera.basis(self.size);
        let depth = (grasp.point - camera.eye).dot(forward);
        let way = self.dragged.entry(grasp.instance).or_default();
        // The vectors reach from the middle of the image to its edges, at distance 1.
        *way += 2.0 * depth * (x * right - y * up);
    }

    /// Shows a second image, at first equal to the first; or no longer.
    pub fn split(&mut self, is_split: bool) {
        self.cells.truncate(1);
        if is_split {
            self.cells.extend(self.cells.first().cloned());
        }
    }

    /// Width over height.
    pub fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1].max(1) as f32
    }

    /// True if the samples of `other`'s images are not those of this one's.
    pub fn restarts(&self, other: &Self) -> bool {
        let samples = |s: &Self| (s.cells.clone(), s.camera, s.size, s.spp, s.seed);
        samples(self) != samples(other) || self.moves_on(other)
    }

    /// True if a path that was followed on `other` is one of this screen, too, seen by any camera.
    pub fn has_paths_of(&self, other: &Self) -> bool {
        self.cells == other.cells && self.size == other.size && !self.moves_on(other)
    }

    /// True if the scene stands otherwise than on `other`, or moves in another way.
    fn moves_on(&self, other: &Self) -> bool {
        let motion = |s: &Self| {
            let shown = s.window;
            (s.animation, s.dragged.clone(), shown.frame, shown.follow)
        };
        motion(self) != motion(other) || self.plays() != other.plays()
    }

    /// Samples per pixel of a frame, if frames follow one another.
    pub(crate) fn plays(&self) -> Option<u32> {
        let plays = self.window.play && self.animation.is_some();
        plays.then_some(self.window.frame_spp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projected;
    use raystone_bench::run::Registries;

    #[test]
    fn what_is_dragged_stays_under_the_pointer() {
        let mut screen = Screen::parse(START, "x", &[], &Registries::default()).unwrap();
        screen.size = [400, 300];
        let camera = Camera::upright(Vec3::new(3.0, 1.0, 2.0), Vec3::new(0.5, 0.2, -0.1), 50.0);
        let (instance, point) = (7, Vec3::new(0.9, 0.1, 0.4));
        let at = |point| projected(&camera, [400, 300], point).unwrap();
        let [x, y] = at(point);
        let grasp = Grasp { instance, point };
        // Two steps of a pointer, a tenth of the width to the right and a fifth of the height down in all.
        screen.drag(&grasp, &camera, [0.04, 0.2]);
        screen.drag(&grasp, &camera, [0.06, 0.0]);
        let [to_x, to_y] = at(point + screen.dragged[&7]);
        assert!(
            (to_x - x - 40.0).abs() < 1e-2 && (to_y - y - 60.0).abs() < 1e-2,
            "{to_x} {to_y}"
        );
        assert_eq!(screen.dragged.len(), 1);
    }

    #[test]
    fn all_that_changes_samples_begins_them_anew_and_the_rest_of_the_window_does_not() {
        let screen = Screen::parse(START, "x", &[], &Registries::default()).unwrap();
        let changed = |change: fn(&mut Screen)| {
            let mut other = screen.clone();
            change(&mut other);
            (screen.restarts(&other), other.restarts(&screen))
        };
        let changes: [fn(&mut Screen); 6] = [
            |s| s.cells.push(s.cells[0].clone()),
            |s| s.camera = Some(Camera::upright(Vec3::ONE, Vec3::ZERO, 50.0)),
            |s| s.size[1] += 1,
            |s| s.spp += 1,
            |s| s.seed += 1,
            |s| s.dragged.extend([(0, Vec3::X)]),
        ];
        for (number, change) in changes.into_iter().enumerate() {
            assert_eq!(changed(change), (true, true), "change {number}");
        }
        assert_eq!(changed(|s| s.reference.seed += 1), (false, false));
        assert_eq!(changed(|_| ()), (false, false));
    }
}

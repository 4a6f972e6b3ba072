//! Sections of experiment settings: a key is a field with meaning, type, default and range, used by
//! the parser, its messages, and the table in `docs/experiments.md`.

use super::settings::{Contradiction, Settings};
use raystone_core::geometry::Camera;
use raystone_core::parameters;
use raystone_core::params::{Bounded, ParamRange, ParamValue, ParameterType, Variant};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Ascending sample counts per pixel, at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SppCounts(Vec<u32>);

impl SppCounts {
    /// The sample counts, ascending.
    pub fn counts(&self) -> impl Iterator<Item = u32> {
        self.0.iter().copied()
    }

    /// The largest sample count, that of one render.
    pub fn max(&self) -> u32 {
        self.0.last().copied().unwrap_or(1)
    }
}

impl ParameterType for SppCounts {
    fn value(&self) -> ParamValue {
        self.0.value()
    }

    fn parse(value: &ParamValue) -> Option<Self> {
        let counts: Vec<u32> = Vec::parse(value)?;
        let ascend = counts.is_sorted_by(|a, b| a < b);
        (ascend && counts.first().is_some_and(|least| *least > 0)).then_some(Self(counts))
    }
}

impl Bounded for SppCounts {
    type Bound = u32;

    fn range(range: RangeInclusive<u32>) -> ParamRange {
        <Vec<u32>>::range(range).ascending()
    }
}

/// Largest number of samples per pixel for errors.
const MOST_SPP: u32 = 1 << 16;
const EDGES: RangeInclusive<u32> = 16..=8192;
const FEW: [u32; 6] = [1, 2, 4, 8, 16, 32];

parameters! {
    /// What every measurement of an experiment shares.
    pub struct Run {
        /// Name of the run in the report; without it, the name of the file.
        name: Option<String> = None;
        /// Independent seeds per randomised sampler; the unit of every interval of an error.
        replicates: u32 = 16, in 1..=1024;
        /// Seed of the first replicate.
        seed: u32 = 1, in 0..=u32::MAX;
        /// Width and height of every image, pixels.
        resolution: [u32; 2] = [192, 144], in EDGES;
        /// Samples per pixel at which the error is taken, in a list, `[1, 3, 10]`, or 2^lo, …, 2^hi.
        spp: SppCounts = SppCounts(FEW.to_vec()), in 1..=MOST_SPP;
        /// Whether images are rendered and samplers measured; if not, structures alone are built, gated and timed.
        images: bool = true;
        /// Keep the bounds checks and loop bounds that the driver layer adds to kernels.
        runtime_checks: bool = true;
    }

    /// Ends a sampler at one of the numbers of samples where its relMSE is below a target; without it, each takes them all.
    #[derive(Copy, Serialize, Deserialize, JsonSchema)]
    pub struct StopRule {
        /// Target of the relMSE, at which a sampler is ended.
        relmse: f64 = f64::NAN, in 0.0_f64.next_up()..=f64::MAX;
        /// Probability with which a sampler that is ended has it.
        confidence: f64 = f64::NAN, in 0.5..=1.0_f64.next_down();
        /// Edge of the tiles that end on their own, pixels; without it, the image ends as a whole.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tile: Option<u32> = None, in 8..=512, where multiple_of(8);
    }

    /// The camera of all scenes; without it, each has its own.
    #[derive(Copy)]
    pub struct View {
        /// Position of the pinhole, scene units.
        eye: [f32; 3] = [f32::NAN; 3], in f32::MIN..=f32::MAX;
        /// Point that projects to the centre of the image, scene units.
        target: [f32; 3] = [f32::NAN; 3], in f32::MIN..=f32::MAX;
        /// Up direction; not parallel to the viewing direction.
        up: [f32; 3] = [0.0, 1.0, 0.0], in f32::MIN..=f32::MAX;
        /// Vertical field of view, degrees.
        fov: f32 = 40.0, in 1.0..=179.0;
    }

    /// The image that errors are taken against.
    pub struct Reference {
        /// An image (.exr, .hdr, .pfm, .npy) of the run's resolution to compare with in place of a rendered one, relative
        /// to the current directory; its own noise is not known.
        file: Option<PathBuf> = None;
        /// Samples per pixel of the reference image, its eight parts together: rounded down to a multiple of 8, at least 8.
        spp: u32 = 16384, in 2..=1 << 24;
        /// Sequence of the reference, with its default parameters.
        sequence: Variant = Variant::plain("pixel-hash"), where entry_of("sequence");
        /// Decorrelation of the reference, with its default parameters.
        decorrelation: Variant = Variant::plain("none"), where entry_of("decorrelation");
        /// What the seeds of the reference's parts are hashed from; none of them may be a replicate's.
        seed: u32 = 9001, in 0..=u32::MAX;
    }

    /// How long and how often things are timed.
    #[derive(Copy, Eq)]
    pub struct Timing {
        /// Timed rounds; each times every cell of a scene once, in random order.
        rounds: u32 = 9, in 3..=1000;
        /// Samples per pixel of each timed render.
        spp: u32 = 1, in 1..=1024;
        /// Least warm-up of a kernel before it is timed, milliseconds.
        min_warmup_ms: u32 = 100, in 0..=60_000;
        /// Warm-up ends here even if the rate is not stable yet, milliseconds.
        max_warmup_ms: u32 = 2000, in 0..=600_000;
        /// Rays per class and dispatch.
        rays: u32 = 65_536, in 1024..=1 << 24;
        /// Whether full cells are also rendered in one pass, in 16 blocks and in the 256 passes of a quad-tree, and the time
        /// to the first picture without a gap is taken; at most 256 samples.
        orders: bool = false;
    }

    /// How much the gate checks.
    #[derive(Copy)]
    pub struct Gate {
        /// Rays per class that every structure must answer as the reference tracer does.
        rays: u32 = 32_768, in 256..=1 << 24;
        /// Ray-triangle tests spent on checking the reference tracer itself against brute force (at least 2,000 rays are).
        brute_force_tests: u64 = 2_000_000_000, in 0..=1_000_000_000_000;
        /// Rays of the reference tracer that the double-precision oracle decides again.
        oracle_rays: u32 = 2048, in 0..=1 << 20;
        /// Length of recorded AO rays, scene units; 0 is a tenth of the scene's diagonal.
        ao_length: f32 = 0.0, in 0.0..=1e16;
        /// How far rays that start on a surface are moved off it, scene units; 0 is 1e-5 of the scene's diagonal.
        offset: f32 = 0.0, in 0.0..=1e16;
        /// Whether shadow rays are recorded in three more classes: from the light, light by light, and both.
        shadow_orders: bool = false;
    }

    /// Which star discrepancies are taken.
    #[derive(Eq)]
    pub struct Discrepancy {
        /// Star discrepancy is taken at N = 2, 4, 8, … up to this many points.
        points: u32 = 4096, in 2..=65_536, where power_of_two();
        /// Pairs of dimensions of the path's table; the worst of all pairs that the integrators draw is measured as well.
        pairs: Vec<[u32; 2]> = vec![[0, 1], [2, 3], [4, 5], [0, 2], [1, 3], [2, 4]], in 0..=255, where different();
        /// Seeds measured where the stream is randomised.
        seeds: u32 = 8, in 1..=1024;
    }

    /// What the model of coherence looks at, and the machine; without it, nothing is modelled.
    #[derive(Eq, Serialize, Deserialize, JsonSchema)]
    pub struct Coherence {
        /// Width and height of the image whose rays are looked at, pixels; without it, `run.resolution`.
        resolution: [u32; 2] = [0, 0], in EDGES;
        /// Samples per pixel that samplers are made for, ascending; without it, those of `run.spp`.
        spp: Vec<u32> = Vec::new(), in 1..=MOST_SPP, where ascending();
        /// Groups of warps, spread over the image; each has an L1 of its own.
        groups: u32 = 4, in 1..=4096;
        /// Warps of a group: neighbours in the order of workgroups, with one L1.
        warps: u32 = 8, in 1..=256;
        /// Width and height of the pixels of a warp: workgroups of the image kernel are 8 × 8 pixels, and their lanes are
        /// numbered by rows.
        warp: [u32; 2] = [8, 4], in 1..=8, where power_of_two();
        /// Samples of each pixel that are looked at, spread over all of them.
        samples: u32 = 2, in 1..=1024;
        /// How a turn of a warp goes on after a visit: until no lane has a triangle to test, as kernels are written, or with
        /// one test.
        rule: Rule = Rule::Loop;
        /// Bytes of a cache line.
        line_bytes: u32 = 128, in 16..=4096, where power_of_two();
        /// Size of each group's L1, KiB.
        l1_kib: u32 = 128, in 1..=1 << 20;
        /// Its associativity; 0: fully associative. The line that was used longest ago goes (LRU).
        l1_ways: u32 = 0, in 0..=1024;
        /// Size of the L2 of all groups, KiB.
        l2_kib: u32 = 51_200, in 1..=1 << 20;
        /// Its associativity; 0: fully associative.
        l2_ways: u32 = 16, in 0..=1024;
    }

    /// How a turn of a warp goes on after its visits of nodes.
    #[derive(Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    pub enum Rule {
        /// While any lane has a triangle to test, those that have one test it; then comes the next turn. This is how the
        /// kernels are written: visit a node, test the triangles of its leaves.
        Loop = "loop",
        /// Lanes that had a triangle to test when the turn began test one; then comes the next turn ("if-if").
        IfIf = "if-if",
    }

    /// How a scene moves from frame to frame; without it, nothing does.
    #[derive(Copy, Serialize, Deserialize, JsonSchema)]
    pub struct Animation {
        /// What moves from frame to frame: vertices in a wave, or instances, each straight on.
        motion: Motion = Motion::Deform;
        /// Frames, the scene as it was loaded being the first. In each, the tree of the first is refitted, and built anew by
        /// its own builder.
        frames: u32 = 9, in 2..=1024;
        /// Amplitude of the wave, or the way of each instance until the last frame, in radii of the scene.
        amplitude: f64 = 0.05, in 0.0..=10.0;
        /// Wavelength of the wave, in radii of the scene.
        wavelength: f64 = 1.0, in 0.01..=100.0;
    }

    /// What moves.
    #[derive(Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    pub enum Motion {
        /// Every vertex, in a wave that travels through the scene.
        Deform = "deform",
        /// Every instance, straight on in a direction of its own.
        Instances = "instances",
    }
}

parameters! {
    /// How an interactive view shows images; no measurement depends on it.
    #[derive(Copy)]
    pub struct Window {
        /// Exposure in stops, over the automatic one.
        exposure: f32 = 0.0, in -20.0..=20.0;
        /// What is shown: the image, the work of every pixel's first ray, how often its paths bounce, or the cycles that a model
        /// of a GPU gives its first ray.
        map: Map = Map::None;
        /// Work at the upper end of the scale of colours; 0: the 99th percentile of all pixels.
        scale: f32 = 0.0, in 0.0..=1e9;
        /// Where two images meet: the share of the width that is left of it.
        swipe: f32 = 0.5, in 0.0..=1.0;
        /// What two images have the same of while samples are added.
        pace: Pace = Pace::Samples;
        /// Whether a reference is accumulated beside them, and their error against it shown.
        error: bool = false;
        /// The frame of `[animation]` that is shown.
        frame: u32 = 0, in 0..=1023;
        /// Whether its frames follow one another.
        play: bool = false;
        /// Samples per pixel of a frame while they do.
        frame_spp: u32 = 1, in 1..=256;
        /// How structures follow a scene that moves.
        follow: Follow = Follow::Refit;
    }

    /// How a structure follows a scene that moves.
    pub enum Follow {
        /// The tree of the scene as it was loaded, with new boxes, or objects under new transforms; built anew where it has neither.
        Refit = "refit",
        /// Built anew.
        Rebuild = "rebuild",
    }

    /// What a map shows of a pixel: work of its first ray through a structure, but for bounces and cycles.
    pub enum Map {
        /// None is shown.
        None = "none",
        /// Nodes or cells visited.
        Nodes = "nodes",
        /// Box tests.
        BoxTests = "box-tests",
        /// Triangle tests.
        Triangles = "triangles",
        /// Nodes or cells, and triangle tests.
        Steps = "steps",
        /// Deepest stack, entries.
        Stack = "stack",
        /// Bounces of its paths, the mean over some samples.
        Bounces = "bounces",
        /// Modelled cycles of its warp for first rays, over the warp's rays.
        Cycles = "cycles",
    }

    /// What two images have the same of.
    pub enum Pace {
        /// Samples per pixel.
        Samples = "samples",
        /// Time on the device.
        Time = "time",
    }
}

impl Settings for Window {
    const SECTION: &'static str = "window";
}

impl Settings for Run {
    const SECTION: &'static str = "run";

    fn contradiction(&self) -> Option<Contradiction> {
        let name = self.name.as_ref()?;
        let expected = || ("name", "a text without control characters".to_owned());
        name.contains(char::is_control).then(expected)
    }
}

impl Settings for StopRule {
    const SECTION: &'static str = "run.stop";
    const REQUIRED: &'static [&'static str] = &["relmse", "confidence"];
}

impl Settings for View {
    const SECTION: &'static str = "camera";
    const REQUIRED: &'static [&'static str] = &["eye", "target"];

    fn contradiction(&self) -> Option<Contradiction> {
        let camera = Camera::from(*self);
        // `try_normalize` also refuses lengths that overflow.
        let Some(view) = (camera.target - camera.eye).try_normalize() else {
            let expected = "another point than `camera.eye`, at a finite distance";
            return Some(("target", expected.to_owned()));
        };
        let up = camera.up.try_normalize();
        let is_parallel = up.is_none_or(|up| view.cross(up).length() < 1e-4);
        let expected = || "a direction that is neither zero nor parallel to the view".to_owned();
        is_parallel.then(|| ("up", expected()))
    }
}

impl From<View> for Camera {
    fn from(view: View) -> Self {
        Self {
            eye: view.eye.into(),
            target: view.target.into(),
            up: view.up.into(),
            vertical_fov_degrees: view.fov,
        }
    }
}

impl Settings for Reference {
    const SECTION: &'static str = "reference";
}

impl Settings for Timing {
    const SECTION: &'static str = "timing";

    fn contradiction(&self) -> Option<Contradiction> {
        let expected = || {
            (
                "max_warmup_ms",
                "at least `timing.min_warmup_ms`".to_owned(),
            )
        };
        (self.max_warmup_ms < self.min_warmup_ms).then(expected)
    }
}

impl Settings for Gate {
    const SECTION: &'static str = "gate";
}

impl Settings for Discrepancy {
    const SECTION: &'static str = "discrepancy";
}

impl Settings for Coherence {
    const SECTION: &'static str = "coherence";
}

impl Coherence {
    /// Fills unset values from the run's.
    pub(super) fn complete(&mut self, run: &Run) {
        if self.spp.is_empty() {
            self.spp = run.spp.counts().collect();
        }
        if self.resolution == Self::default().resolution {
            self.resolution = run.resolution;
        }
    }
}

impl Settings for Animation {
    const SECTION: &'static str = "animation";
}

impl Animation {
    /// Time of a frame, 0 for the first, 1 for the last.
    pub fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / f64::from(self.frames - 1)
    }
}

//! Records: one JSON line per thing measured, schema `raystone/1`. Every table, plot and export
//! derives from these lines alone; an absent value is absent, never 0.

use crate::accel::{Phase, Space, StructureStats};
use crate::config::{KERNELS_MARK, Variant};
use crate::geometry::Camera;
use crate::gpu::Environment;
use crate::sampling::to_unit;
use crate::scene::LoadReport;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version tag of every line; bumped together with any change of a field's meaning.
pub const SCHEMA: &str = "raystone/1";

/// One line of `records.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// Content hash of the cell that this line belongs to (hex), see [`crate::config`].
    pub hash: String,
    /// What was measured.
    pub record: Record,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Record {
    /// First line: what is run, where, and how many runs the plan saves.
    Run(RunRecord),
    /// A scene was loaded.
    Scene(SceneRecord),
    /// A structure was built, gated and traced with the recorded rays.
    Structure(StructureRecord),
    /// A reference image was rendered.
    Reference(ReferenceRecord),
    /// Error of one replicate of a sampler against the reference, per spp.
    Error(ErrorRecord),
    /// Verdict on the bias of a sampler over all its replicates.
    Bias(BiasRecord),
    /// What the error of a sampler looks like, over all its replicates.
    Spectrum(SpectrumRecord),
    /// Time of a full cell (structure × sampler × integrator).
    Time(TimeRecord),
    /// Star discrepancy of the words of a pair of dimensions, read back from a dump kernel that imports the
    /// renderer's modules.
    Stream(StreamRecord),
    /// What drawing from a sampler costs.
    SamplerCost(SamplerCostRecord),
    /// A cell that was not run, with the reason.
    Skipped(SkippedRecord),
    /// A cell that failed before it had a record of its own kind, with the reason.
    Failed(SkippedRecord),
    /// Something that went wrong beside the measuring, which is not touched by it.
    Warning(SkippedRecord),
    /// Last line: where the wall time went, how many cells failed.
    Finished(FinishedRecord),
    /// Last line of a run that was ended early.
    Interrupted(InterruptedRecord),
}

/// A figure with its 95 % interval, see [`crate::measure::statistics`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The estimate (median for times and rates, mean for errors).
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
}

impl Interval {
    /// A figure whose interval has no width: it is exact, or nothing is known of its spread.
    pub fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// Whether two intervals have no point in common: only then is a winner named.
    pub fn is_apart_from(&self, other: &Interval) -> bool {
        self.low > other.high || other.low > self.high
    }
}

/// What a record's figures were taken with, beyond the names of its cell. Records of earlier versions
/// lack it: their texts are empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Ran {
    /// Kernels in the place of the embedded ones, as on the axis; empty for the embedded ones. Labels
    /// of the cell end with ` @` and this.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub kernels: String,
    /// BLAKE3 of the composed text of the kernels that ran; empty if it did not come to that.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub kernel_hash: String,
    /// The ray-triangle test; empty where no ray is traced.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub triangle: String,
    /// The ray-box test; empty where no ray is traced.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub box_test: String,
    /// How rays are moved off the surface that they leave; empty where no ray is traced.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub offset: String,
}

impl Ran {
    /// The label of a cell without the kernels that it ends with.
    pub fn without_kernels<'a>(&self, label: &'a str) -> &'a str {
        let kernels = self.kernels.as_str();
        let stem = label.strip_suffix(kernels).filter(|_| !kernels.is_empty());
        stem.and_then(|stem| stem.strip_suffix(KERNELS_MARK))
            .unwrap_or(label)
    }
}

/// A folder of kernels that a run put in the place of embedded ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct KernelFolder {
    /// Its label, as in [`Ran::kernels`].
    pub label: String,
    /// The folder as given.
    pub folder: String,
    /// BLAKE3 of the names and texts of all its kernels.
    pub hash: String,
    /// Its kernels.
    pub files: Vec<KernelFile>,
}

/// A kernel of a folder.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct KernelFile {
    /// Path below the folder.
    pub file: String,
    /// BLAKE3 of its text.
    pub hash: String,
    /// Whether it replaces an embedded kernel; if not, another kernel imports it.
    pub replaces: bool,
}

/// First line of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// `run.name` of the experiment.
    pub name: String,
    /// The experiment file as given.
    pub experiment: String,
    /// The whole experiment text with overrides appended as comments, so that it can be repeated.
    pub experiment_text: String,
    /// Seconds since 1970-01-01 UTC.
    pub started_unix_s: u64,
    /// Where it ran.
    pub environment: Environment,
    /// Renders (image × replicate) that the full product of all axes would need.
    pub renders_full_product: usize,
    /// Renders that this plan needs, since images are equal across structures.
    pub renders_planned: usize,
    /// Folders of kernels that stood in the place of embedded ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kernels: Vec<KernelFolder>,
}

/// A loaded scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// Name or path as given.
    pub scene: String,
    /// Number of triangles.
    pub triangles: usize,
    /// Minimum corner of the bounding box.
    pub bounds_min: [f32; 3],
    /// Maximum corner of the bounding box.
    pub bounds_max: [f32; 3],
    /// Parse and prepare, milliseconds (structures not included).
    pub load_ms: f64,
    /// Bytes of the scene's arrays on the host.
    pub bytes: u64,
    /// Number of materials.
    pub materials: usize,
    /// Number of textures.
    pub textures: usize,
    /// Number of emissive triangles.
    pub emitters: usize,
    /// The camera in use.
    pub camera: Camera,
    /// Dropped and approximated things.
    pub report: LoadReport,
    /// BLAKE3 of the content.
    pub scene_hash: String,
}

/// Ray classes of the recorded ray sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayClass {
    /// Camera rays through pixel centres, 8×8 tiles; closest hit.
    Primary,
    /// Rays from first hits towards emitters (or towards points of the bounding sphere); any hit.
    Shadow,
    /// Cosine-distributed rays of limited length from first hits; any hit.
    Ao,
    /// Cosine-distributed rays from first hits; closest hit.
    Bounce,
    /// Rays between random points of the bounding box; closest hit.
    Chord,
    /// Rays that faults hide behind (see [`super::hard_rays`]); both queries, never timed.
    Hard,
}

/// Gate result for one ray class.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClassVerdict {
    /// Which rays.
    pub class: RayClass,
    /// Rays compared to the bit (id, t, u, v; hit or miss for any-hit queries).
    pub rays: usize,
    /// Rays whose answer differs and is not a tie.
    pub wrong: usize,
    /// Rays whose id or t differs but both triangles lie within 4 ulp of the same distance.
    pub ties: usize,
    /// The first wrong ray, replayable, with both answers.
    pub first_wrong: Option<String>,
}

/// Comparison of the judge with a slower, simpler judge.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct JudgeCheck {
    /// Rays compared.
    pub rays: usize,
    /// Rays that differ.
    pub wrong: usize,
    /// Rays that pass within rounding error of an edge or of another surface (oracle only).
    pub ambiguous: usize,
    /// How many of these are hard rays, made to pass there.
    #[serde(default)]
    pub hard_ambiguous: usize,
    /// When it was carried out, if that was before this run: the same rays and answers, found again on disk.
    #[serde(default)]
    pub reused_unix_s: Option<u64>,
}

/// The verdict of the gate on one structure and scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GateVerdict {
    /// Nothing wrong, no fuse blown, judge itself sound.
    pub passed: bool,
    /// Per ray class.
    pub classes: Vec<ClassVerdict>,
    /// The judge (scalar plain BVH) against brute force.
    pub brute_force: JudgeCheck,
    /// The judge against the f64 oracle.
    pub oracle: JudgeCheck,
    /// Error words raised by kernels (step fuse, stack overflow), in words.
    pub kernel_errors: Vec<String>,
    /// Structural faults found by `validate`.
    pub structural: Option<String>,
    /// What is wrong on the gate's second scene.
    #[serde(default)]
    pub elsewhere: Option<String>,
}

/// Work counted per ray, means over a class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct CountersPerRay {
    /// Nodes or cells visited.
    pub nodes: f64,
    /// Ray–box tests.
    pub box_tests: f64,
    /// Ray–triangle tests.
    pub triangle_tests: f64,
    /// Deepest stack seen in the class (entries).
    pub stack_high_water: u32,
}

/// Speed of one ray class through one structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClassTiming {
    /// Which rays.
    pub class: RayClass,
    /// Rays per dispatch.
    pub rays: usize,
    /// Fraction of the rays that hit something.
    pub hit_fraction: f64,
    /// Every kept sample, milliseconds, an empty dispatch already subtracted.
    pub ms: Vec<f64>,
    /// The same dispatches by the wall clock, milliseconds.
    pub wall_ms: Vec<f64>,
    /// Million rays per second, median with interval.
    pub mrays_s: Interval,
    /// Counted work, from a separate run.
    pub counters: CountersPerRay,
}

/// A structure on a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StructureRecord {
    /// Whether the failure is the driver's, which ends loops too early for this structure: the cell then
    /// counts as skipped.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub refused: bool,
    /// Scene name.
    pub scene: String,
    /// Structure with parameters.
    pub accel: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Feature flags of the composed kernel.
    pub features: Vec<String>,
    /// Whether the driver's bounds checks and loop bounds were on.
    pub runtime_checks: bool,
    /// Where triangles are met, which decides on the judge: see [`Space`].
    #[serde(default)]
    pub space: Space,
    /// Timed build phases.
    pub build: Vec<Phase>,
    /// Sum of the phases, milliseconds.
    pub build_ms: f64,
    /// Most host memory that the build needed beyond what was in use before it, the result included,
    /// bytes; absent where allocations are not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub build_peak_bytes: Option<u64>,
    /// Milliseconds to take over new transforms of all instances, objects kept: median of several;
    /// absent where a moved object needs a full build.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub update_ms: Option<f64>,
    /// Static figures.
    pub stats: StructureStats,
    /// Verdict; `None` only if the build failed.
    pub gate: Option<GateVerdict>,
    /// Speeds; empty unless the gate passed.
    pub timings: Vec<ClassTiming>,
    /// Heat map of traversal cost of primary rays, a PNG relative to the run's folder.
    pub heat_map: Option<String>,
    /// Cost (nodes + triangle tests) at the top of the heat map's colour scale.
    pub heat_map_max: Option<f64>,
    /// Why there are no figures.
    pub failure: Option<String>,
}

/// A reference image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRecord {
    /// Scene name.
    pub scene: String,
    /// Integrator with parameters.
    pub integrator: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Samples per pixel of both halves together; 0 if nothing had to be rendered.
    pub spp: u32,
    /// The value of every pixel, if it is known: then this is the reference.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<f64>,
    /// Sampler, as `sequence × decorrelation`; `exact` if there was none.
    pub sampler: String,
    /// Seconds it took.
    pub seconds: f64,
    /// Estimated mean squared error of the reference itself, from its two halves.
    pub mse: f64,
    /// Tone-mapped PNG relative to the run's folder; empty if it could not be written.
    pub image: String,
    /// Mean radiance over pixels and channels.
    pub mean: f64,
}

/// Error at one number of samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorAtSpp {
    /// Samples per pixel.
    pub spp: u32,
    /// Metric id with version → value, for instance `rmse/v1`, `relmse/eps=1e-2/v1`.
    pub metrics: BTreeMap<String, f64>,
    /// Id of an unbiased metric → its values with each part of the reference left out, those of its
    /// first half first: the reference's share in the metric's uncertainty.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub without_part: BTreeMap<String, Vec<f64>>,
}

/// Error of one replicate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorRecord {
    /// Scene name.
    pub scene: String,
    /// Integrator with parameters.
    pub integrator: Variant,
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Whether the pair is randomised by its seed; a deterministic pair has one replicate.
    pub randomised: bool,
    /// Number of this replicate, from 0.
    pub replicate: u32,
    /// Its seed.
    pub seed: u32,
    /// Image size in pixels.
    pub resolution: [u32; 2],
    /// Error at 1, 2, 4, … samples per pixel.
    pub errors: Vec<ErrorAtSpp>,
    /// Pixels that were NaN or infinite (any is a failure).
    pub non_finite_pixels: usize,
    /// BLAKE3 of the f32 image at the highest spp.
    pub image_hash: String,
    /// Tone-mapped image at the highest spp (first replicate only).
    pub image: Option<String>,
    /// Error map at the highest spp (first replicate only).
    pub error_map: Option<String>,
}

/// Bias check of one sampler: Welch's t of the replicates against the reference, for the whole image and
/// per tile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BiasRecord {
    /// Scene name.
    pub scene: String,
    /// Integrator with parameters.
    pub integrator: Variant,
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Tiles tested.
    pub tiles: usize,
    /// Tiles rejected after Benjamini–Hochberg at `alpha`.
    pub rejected: usize,
    /// Bound on the probability of calling a sampler without bias biased: half of it is for the whole
    /// image, half is the false-discovery rate among tiles.
    pub alpha: f64,
    /// Smallest p-value of a tile.
    pub min_p: f64,
    /// Histogram of the p-values in ten equal bins: flat when there is no bias.
    pub p_histogram: Vec<usize>,
    /// Difference of the mean luminance of all replicates from the reference's beyond what rounding
    /// explains, in standard errors (Welch's t); absent where it is not testable or has no spread.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z: Option<f64>,
    /// p-value of `z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// Degrees of freedom of `z`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// Whether the sampler is one whose mean over seeds is not the integral, so that a bias is no fault.
    #[serde(default)]
    pub by_design: bool,
    /// `no-bias-found`, `biased`, or `not-testable` with the reason.
    pub verdict: String,
}

/// The signed luminance error of the image at the highest spp, see [`crate::measure::spectrum`]: means
/// over replicates with intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpectrumRecord {
    /// Scene name.
    pub scene: String,
    /// Integrator with parameters.
    pub integrator: Variant,
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Samples per pixel.
    pub spp: u32,
    /// Replicates.
    pub replicates: usize,
    /// Power by frequency, white noise being 1; empty if the error is the same in all pixels.
    pub power: Vec<PowerAt>,
    /// Mean power up to 1/8 cycle per pixel, white noise being 1.
    pub low_frequency: Option<Interval>,
    /// Correlation of the errors of neighbouring pixels.
    pub autocorrelation: Option<Interval>,
    /// What Gaussian filters leave of the error.
    pub filtered: Vec<FilteredError>,
}

/// A point of a radial spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PowerAt {
    /// Cycles per pixel.
    pub frequency: f64,
    /// Mean power around that frequency, white noise being 1.
    pub power: Interval,
}

/// Error after a Gaussian filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilteredError {
    /// Standard deviation of the filter, pixels; 0 is no filter.
    pub sigma: f64,
    /// Root mean square of what is left of the luminance error.
    pub rmse: Interval,
}

/// Time of a full cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimeRecord {
    /// Scene name.
    pub scene: String,
    /// Structure with parameters.
    pub accel: Variant,
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// Integrator with parameters.
    pub integrator: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Image size in pixels.
    pub resolution: [u32; 2],
    /// Samples per pixel of each timed render.
    pub spp: u32,
    /// Every kept sample, milliseconds per render on the GPU clock.
    pub ms: Vec<f64>,
    /// The same renders by the wall clock, milliseconds.
    pub wall_ms: Vec<f64>,
    /// Milliseconds per sample per pixel for the whole image, median with interval; absent if the
    /// cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ms_per_spp: Option<Interval>,
    /// Rays of each class in one render, from a separate counting run of the same seed.
    pub rays: BTreeMap<String, u64>,
    /// All rays over time, million per second; absent if the cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mrays_s: Option<Interval>,
    /// BLAKE3 of the image.
    pub image_hash: String,
    /// Whether the image equals to the bit that of the scene's first gated structure.
    pub image_equal: bool,
    /// Whether the driver's bounds checks and loop bounds were on.
    pub runtime_checks: bool,
    /// Feature flags of the composed kernel.
    pub features: Vec<String>,
    /// Why there are no figures.
    pub failure: Option<String>,
}

/// Star discrepancy of a dumped stream.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StreamRecord {
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// The two dimensions of the path's table.
    pub dimensions: [u32; 2],
    /// What the path uses them for, for instance `bounce 0: direction`.
    pub purpose: String,
    /// Whether the experiment names the pair.
    #[serde(default = "yes")]
    pub named: bool,
    /// Among how many pairs that the integrators draw this one has the sampler's greatest D*; absent where it
    /// is not the worst.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_of: Option<usize>,
    /// Whether each seed gives another point set.
    pub randomised: bool,
    /// Seeds measured (one for a deterministic stream).
    pub seeds: usize,
    /// Linear index of the pixel whose words were read for each seed.
    #[serde(default)]
    pub pixels: Vec<u32>,
    /// `(N, D*)` for the first N points: mean over seeds with interval.
    pub star: Vec<StarAtCount>,
    /// Everything else, see [`crate::measure::stream`].
    #[serde(default)]
    pub figures: StreamFigures,
    /// Points for pictures, of one pair of each sampler.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<RecordedPoints>,
}

fn yes() -> bool {
    true
}

/// The words of a stream, for pictures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedPoints {
    /// Samples of each pixel; the sampler was made for so many.
    pub samples: u32,
    /// Pixels 0, 1, … to this, excluded.
    pub pixels: u32,
    /// Seed.
    pub seed: u32,
    /// The kernel's words in Base64, low byte first: pixel by pixel, sample by sample, dimension by
    /// dimension.
    pub words: String,
    /// Mean power of 1024 points of pixel 0 by length of the frequency, 1 first, white noise being 1; empty
    /// if it was not computed.
    pub spectrum: Vec<f64>,
}

impl RecordedPoints {
    /// `words` of so many samples of so many pixels.
    pub fn new([samples, pixels]: [u32; 2], seed: u32, words: &[u32], spectrum: Vec<f64>) -> Self {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Self {
            samples,
            pixels,
            seed,
            words: STANDARD.encode(bytes),
            spectrum,
        }
    }

    /// The points of each pixel as the renderer's floats; `None` if the text does not hold them.
    pub fn points(&self) -> Option<Vec<Vec<[f64; 2]>>> {
        let bytes = STANDARD.decode(&self.words).ok()?;
        let number = |b: &[u8]| f64::from(to_unit(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        let points = bytes.chunks_exact(8).map(|b| [number(b), number(&b[4..])]);
        let points: Vec<[f64; 2]> = points.collect();
        let [samples, pixels] = [self.samples, self.pixels].map(|n| n as usize);
        let whole = samples > 0 && points.len() == samples * pixels;
        whole.then(|| points.chunks_exact(samples).map(<[_]>::to_vec).collect())
    }
}

/// Figures of a dumped stream beside its star discrepancy.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StreamFigures {
    /// Exponent of D* in N: slope of the mean over seeds.
    pub star_slope: Option<Interval>,
    /// L2-star discrepancy (the root).
    pub l2_star: Vec<FigureAtCount>,
    /// Its exponent.
    pub l2_star_slope: Option<Interval>,
    /// Centered discrepancy (the square).
    pub centered: Vec<FigureAtCount>,
    /// Errors of integrals that are known.
    pub integrands: Vec<IntegrandFigures>,
    /// What neighbouring and superposed pixels draw; only of pairs that are a direction.
    pub pixels: Vec<PixelsAtCount>,
}

/// A figure at one number of points: mean over seeds with interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FigureAtCount {
    /// Number of points.
    pub n: usize,
    /// The figure.
    pub value: Interval,
}

/// Errors of one function on the unit square.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IntegrandFigures {
    /// Its name, as in `integrand:NAME`.
    pub function: String,
    /// The exact value.
    pub integral: f64,
    /// RMSE over seeds; of a deterministic stream the absolute error.
    pub rmse: Vec<FigureAtCount>,
    /// Exponent of the RMSE in N.
    pub slope: Option<Interval>,
}

/// What several pixels draw for N samples each, one seed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PixelsAtCount {
    /// Samples of a pixel.
    pub n: usize,
    /// Mean angle between the directions of neighbouring pixels at the same sample, radians.
    pub neighbour_angle: f64,
    /// Share of the cells of a grid of 4√N × 4√N that the points of 150 pixels fall into.
    pub coverage: f64,
}

/// What drawing from a sampler costs, see [`crate::measure::sampler_cost`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SamplerCostRecord {
    /// Sequence with parameters.
    pub sequence: Variant,
    /// Decorrelation with parameters.
    pub decorrelation: Variant,
    /// What it ran with.
    #[serde(default)]
    pub ran: Ran,
    /// Nanoseconds of adapter time per two-dimensional sample, median; near zero it may be negative.
    pub ns_per_sample: Interval,
    /// Nanoseconds of the empty loop that was taken off.
    pub loop_ns_per_sample: Interval,
}

/// Star discrepancy at one number of points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StarAtCount {
    /// Number of points.
    pub n: usize,
    /// Exact 2-D star discrepancy.
    pub star: Interval,
}

/// A cell left out, or failed, or with a warning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkippedRecord {
    /// The cell, in words.
    pub cell: String,
    /// Why.
    pub reason: String,
}

/// Last line of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FinishedRecord {
    /// Whole wall time, seconds.
    pub wall_s: f64,
    /// Named parts of it, seconds: `load`, `build`, `gate`, `gpu`, `judge`, `report`, …
    pub parts_s: BTreeMap<String, f64>,
    /// Wall time that is neither GPU work nor building, judging or loading.
    pub overhead_s: f64,
    /// Cells that failed.
    pub failed: usize,
    /// Cells that were skipped.
    pub skipped: usize,
}

/// Last line of a run that was ended early: what it had not measured by then is missing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InterruptedRecord {
    /// What ended it, for instance `SIGINT`.
    pub reason: String,
    /// Wall time until then, seconds.
    pub wall_s: f64,
}

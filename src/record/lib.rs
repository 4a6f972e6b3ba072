//! Records: one JSON line per measurement. A line is a [`Key`], which names its subject by axis, and a body. Every
//! table, plot and export derives from these lines alone; an absent value is absent, never 0.
#![warn(missing_docs)]

mod animation;
mod cell;
mod coherence;
mod environment;
mod error;
pub mod figure;
mod key;
mod known_cells;
pub mod known_readings;
mod old;
mod paths;
mod peer;
mod pictures;
mod read;
mod reading;
pub mod replicates;
mod run;
mod sound;
mod stream;
mod structure;
mod time;

pub use animation::*;
pub use cell::*;
pub use coherence::*;
pub use environment::{Environment, MachineLoad};
pub use error::*;
pub use key::{Key, axis};
pub use paths::PathsRecord;
pub use peer::{PeerRecord, PeerTiming};
pub use pictures::{IMAGE_AXES, Pictures, SPREAD};
pub use read::{
    PARTIAL, RECORDS_FILE, RecordError, Records, read_lines, read_records, records_file, text_of,
};
pub use reading::{MeasuredRecord, Note, Reading, Samples};
pub use run::*;
pub use sound::{Sound, contradiction, fault_of};
pub use stream::*;
pub use structure::*;
pub use time::*;

use raystone_core::text::cell_hash;
pub use raystone_stats::interval::Interval;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// Version tag of every line; bumped together with any change of a field's meaning.
pub const SCHEMA: &str = "raystone/3";

/// One line: of a run, or of another file of records with bodies of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Line<B = Body> {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// The subject, by axis; empty for lines about the whole run.
    #[serde(default, skip_serializing_if = "Key::is_empty")]
    pub key: Key,
    /// Content hash of the cell that this line belongs to (hex), see [`raystone_config`].
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub hash: String,
    /// Its kernels and features.
    #[serde(default, skip_serializing_if = "Ran::is_empty")]
    pub ran: Ran,
    /// The figures that were measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub readings: Vec<Reading>,
    /// The result.
    pub body: B,
}

impl<B> Line<B> {
    /// Returns a line without a hash.
    pub fn new(key: Key, ran: Ran, body: B) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            key,
            hash: String::new(),
            ran,
            readings: Vec::new(),
            body,
        }
    }

    /// Returns a line about the whole run.
    pub fn about_all(body: B) -> Self {
        Self::new(Key::default(), Ran::default(), body)
    }

    /// Returns the same line with the hash of its cell.
    #[must_use]
    pub fn hashed(mut self, hash: impl Into<String>) -> Self {
        self.hash = hash.into();
        self
    }

    /// Returns the same line with the figures that were measured.
    #[must_use]
    pub fn with_readings(mut self, readings: Vec<Reading>) -> Self {
        self.readings = readings;
        self
    }

    /// Returns the content hash of its cell: its key, the hash of its scene, its kernels, and other inputs of its figures.
    pub fn content_hash(&self, scene_hash: &str, also: &[(&str, &str)]) -> String {
        // A scene is identified by its bytes, not its path.
        let key = self.key.clone().with(axis::SCENE, "");
        let key = serde_json::to_string(&key).unwrap_or_default();
        let parts = [
            ("key", key.as_str()),
            ("scene", scene_hash),
            ("kernel", &self.ran.kernel_hash),
            ("version", env!("CARGO_PKG_VERSION")),
        ];
        cell_hash(&[&parts, also].concat())
    }

    /// Returns the same line about another body.
    pub fn with_body<C>(self, body: impl FnOnce(B) -> C) -> Line<C> {
        Line {
            schema: self.schema,
            key: self.key,
            hash: self.hash,
            ran: self.ran,
            readings: self.readings,
            body: body(self.body),
        }
    }

    /// Returns one part of the body beside the key.
    pub fn of<'a, T>(&'a self, body: &'a T) -> Recorded<'a, T> {
        Recorded {
            hash: &self.hash,
            key: &self.key,
            ran: &self.ran,
            readings: &self.readings,
            body,
        }
    }
}

/// A body with the key that it belongs to; reads like the body.
#[derive(Debug, PartialEq)]
pub struct Recorded<'a, T> {
    /// Content hash of the cell that the line belongs to; empty if it belongs to none.
    pub hash: &'a str,
    /// The subject.
    pub key: &'a Key,
    /// Its kernels and features.
    pub ran: &'a Ran,
    /// The figures that were measured.
    pub readings: &'a [Reading],
    /// The result.
    pub body: &'a T,
}

impl<T> Recorded<'_, T> {
    /// Returns the reading of a figure for the whole line, not a part of it.
    pub fn reading(&self, id: &str) -> Option<&Reading> {
        let mut readings = self.readings.iter();
        readings.find(|reading| reading.figure == id && reading.at.is_empty())
    }
}

impl<T> Copy for Recorded<'_, T> {}

impl<T> Clone for Recorded<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Deref for Recorded<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.body
    }
}

/// The content of a line of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Body {
    /// First line: the experiment, the machine, and the number of renders that the plan saves.
    Run(RunRecord),
    /// A scene was loaded.
    Scene(SceneRecord),
    /// A structure was built, gated and traced with the recorded rays.
    Structure(StructureRecord),
    /// An external ray caster was traced with the recorded rays.
    Peer(PeerRecord),
    /// Single paths of an integrator were checked.
    Paths(PathsRecord),
    /// A reference image was rendered.
    Reference(ReferenceRecord),
    /// Error of one replicate of a sampler against the reference, per spp.
    Error(ErrorRecord),
    /// Verdict on the bias of a sampler over all its replicates.
    Bias(BiasRecord),
    /// The spectrum of a sampler's error, over all its replicates.
    Spectrum(SpectrumRecord),
    /// Time of a full cell (structure × sampler × integrator).
    Time(TimeRecord),
    /// Modelled coherence of the rays of neighbouring lanes in a full cell.
    Coherence(CoherenceRecord),
    /// A structure was updated from frame to frame of a moving scene.
    Animation(AnimationRecord),
    /// Star discrepancy of the words of a pair of dimensions, read back from a dump kernel that imports the
    /// renderer's modules.
    Stream(StreamRecord),
    /// A cell of a measurement whose figures are readings alone.
    Measured(MeasuredRecord),
    /// A cell that was not run, with the reason.
    Skipped(SkippedRecord),
    /// A cell that failed before it had a record of its own kind, with the reason.
    Failed(SkippedRecord),
    /// A problem outside the measurements, which does not affect them.
    Warning(SkippedRecord),
    /// The source files of kernels, for the cells that name them.
    Kernels(KernelSetRecord),
    /// A cell is done, failed or left out: the last line of all that were written of it.
    Cell(CellRecord),
    /// Last line: the parts of the wall time, the number of failed cells.
    Finished(FinishedRecord),
    /// Last line of a run that was ended early.
    Interrupted(InterruptedRecord),
}

/// A kind of record of a run.
pub trait Kind: Sized {
    /// Returns the record of this kind in a body.
    fn of(body: &Body) -> Option<&Self>;
}

/// The kinds that a body holds in one way only.
macro_rules! kinds {
    ($($variant:ident: $record:ty),* $(,)?) => {$(
        impl Kind for $record {
            fn of(body: &Body) -> Option<&Self> {
                match body {
                    Body::$variant(record) => Some(record),
                    _ => None,
                }
            }
        }
    )*};
}

kinds! {
    Run: RunRecord,
    Scene: SceneRecord,
    Structure: StructureRecord,
    Peer: PeerRecord,
    Paths: PathsRecord,
    Reference: ReferenceRecord,
    Error: ErrorRecord,
    Bias: BiasRecord,
    Spectrum: SpectrumRecord,
    Time: TimeRecord,
    Coherence: CoherenceRecord,
    Animation: AnimationRecord,
    Stream: StreamRecord,
    Measured: MeasuredRecord,
    Kernels: KernelSetRecord,
    Cell: CellRecord,
    Finished: FinishedRecord,
    Interrupted: InterruptedRecord,
}

/// Returns all records of one kind, with their keys.
pub fn all_of<'a, T: Kind + 'a>(lines: &'a [Line]) -> impl Iterator<Item = Recorded<'a, T>> {
    lines
        .iter()
        .filter_map(|line| Some(line.of(T::of(&line.body)?)))
}

/// The conditions of figures beyond their key.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct Ran {
    /// BLAKE3 of the composed text of the kernels; empty if none was composed.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub kernel_hash: String,
    /// Feature flags of the composed kernel.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub features: Vec<String>,
    /// Feature flags that other scenes need and that were compiled out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// True if the driver's bounds checks and loop bounds were off: another competitor.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub unchecked: bool,
}

impl Ran {
    /// Describes a kernel under the driver's checks.
    pub fn kernel(kernel_hash: String) -> Self {
        Self {
            kernel_hash,
            ..Self::default()
        }
    }

    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The verdict of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It was looked at, and holds.
    Pass,
    /// It does not hold.
    Fail,
    /// There was nothing to check.
    Open,
}

impl Verdict {
    /// Fails if anything is wrong; stays open if nothing was looked at.
    pub fn new(looked_at: bool, wrong: bool) -> Self {
        match (wrong, looked_at) {
            (true, _) => Self::Fail,
            (false, true) => Self::Pass,
            (false, false) => Self::Open,
        }
    }

    /// Returns `PASS`, `FAIL` or `OPEN`: a verdict must not depend on colour.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "PASS",
            Self::Fail => "FAIL",
            Self::Open => "OPEN",
        }
    }
}

//! Records of cells as such: their outcome, and the inputs of their figures, by which a later run sees whether the figures still hold.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The outcome of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// All its records are written.
    Done,
    /// It failed: a resumed run measures it again.
    Failed,
    /// It cannot be measured on this adapter, and was left out with a reason.
    LeftOut,
}

/// Modules that kernels were made of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct KernelSetRecord {
    /// Hash of `kernels` and `modules`.
    pub id: String,
    /// Label of the folder of kernels that was in use; empty for the program's own.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub kernels: String,
    /// Name of each module → first digits of BLAKE3 of its text.
    pub modules: BTreeMap<String, String>,
}

/// The end of a cell, and its inputs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CellRecord {
    /// Its name, unique in its plan.
    pub unit: String,
    /// Its outcome.
    pub outcome: Outcome,
    /// The reason, unless it is done.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// Start of the run that measured it, in seconds since 1970; 0 in records of older programs. A value other than
    /// the neighbouring cells' marks a run that this one resumed or was merged with.
    #[serde(default)]
    pub run_began_unix_s: u64,
    /// Its inputs.
    #[serde(flatten)]
    pub inputs: Inputs,
    /// Content hashes of the lines that belong to it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<String>,
}

/// All that the figures of a cell depend on.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default)]
pub struct Inputs {
    /// The program's sources on the host, as far as figures depend on them.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub program: String,
    /// Hash of the cell's parameters and of the settings that matter to its kind.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub settings: String,
    /// Hash of the scene's content; empty where there is none.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub scene: String,
    /// [`KernelSetRecord::id`]; empty without a kernel.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub kernels: String,
    /// The device whose clocks were read; empty if none was.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub device: String,
}

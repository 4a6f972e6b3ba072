//! What is recorded of cells as such: that they are done, and what their figures depend on, so that a later run knows whether they still hold.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How a cell ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// All its records are written.
    Done,
    /// It failed: a run that is resumed takes it again.
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

/// That a cell ended, and what it depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CellRecord {
    /// Its name, unique in its plan.
    pub unit: String,
    /// How it ended.
    pub outcome: Outcome,
    /// Why, if it is not done.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// When the run began that measured it, in seconds since 1970; 0 in records of older programs. Cells with another
    /// value than their neighbours' were measured in another run that this one went on with, or was merged with.
    #[serde(default)]
    pub run_began_unix_s: u64,
    /// What it depends on.
    #[serde(flatten)]
    pub inputs: Inputs,
    /// Content hashes of the lines that belong to it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<String>,
}

/// What the figures of a cell depend on.
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
    /// [`KernelSetRecord::id`]; empty if no kernel ran.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub kernels: String,
    /// Where clocks were read; empty where none was.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub device: String,
}

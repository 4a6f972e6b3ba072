//! `raystone doctor`.

use super::adapters::{self, largest_binding, mesa_major};
use super::failure::{NO_ADAPTER, tell_error};
use super::list::{Row, table};
use super::output::OutputArguments;
use super::system::{self, System};
use anyhow::Result;
use clap::Args;
use raystone::accel::triangle::TriangleRecord;
use raystone::gpu::{
    self, AdapterChoice, AdapterSummary, ArithmeticProbe, Gpu, GpuError, KernelLibrary,
    probe_arithmetic,
};
use raystone::report::format::{bytes, count};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Say in words what works on this machine, and what to do where something does not
#[derive(Args)]
pub struct Doctor {
    /// Adapter to examine, by its number or a part of its name [default: the one that would be used]
    #[arg(long, value_name = "INDEX|NAME")]
    adapter: Option<AdapterChoice>,
    #[command(flatten)]
    output: OutputArguments,
}

impl Doctor {
    pub fn execute(self) -> Result<ExitCode> {
        let system = System::this();
        let found = gpu::adapters();
        let mut text = machine(&system);
        text += "\nAdapters, best first\n";
        let rows: Vec<Row> = found.iter().map(adapters::row).collect();
        text += &table(&rows);
        if found.is_empty() {
            text += "  none\n";
        }
        text += "\nEnvironment\n";
        text += &system::environment();
        let choice = self.adapter.unwrap_or_default();
        let examined = gpu::open(&choice, KernelLibrary::default())
            .and_then(|gpu| examine(&gpu, &choice, &found, &system));
        let (examined, failed) = match examined {
            Ok(findings) => (Some(findings), None),
            Err(failure) => (None, Some(failure)),
        };
        text += &examined.as_ref().map_or(String::new(), Examined::text);
        if found.is_empty() {
            text += &remedy(&system);
        }
        let fields = as_json(&system, rows, examined.as_ref());
        self.output.show("doctor", fields, &text)?;
        // Whatever the failure: no command could use this adapter.
        Ok(failed.map_or(ExitCode::SUCCESS, |failure| {
            tell_error(&failure.into());
            ExitCode::from(NO_ADAPTER)
        }))
    }
}

/// Returns the output of [`Doctor`] as JSON; `in_use` is null if no adapter works.
fn as_json(system: &System, found: Vec<Row>, examined: Option<&Examined>) -> Value {
    let remedy = found.is_empty().then(|| remedy(system).trim().to_owned());
    let in_use = examined.map(|examined| {
        let rows = examined.rows.iter().map(|(name, what)| {
            let words: Vec<&str> = what.split_whitespace().collect();
            (name.replace(' ', "_"), Value::from(words.join(" ")))
        });
        let rows: Map<String, Value> = rows.collect();
        json!({ "adapter": examined.adapter, "whole_loops": examined.whole_loops, "findings": rows })
    });
    json!({
        "version": super::VERSION.as_str(),
        "system": system.name,
        "architecture": std::env::consts::ARCH,
        "processor": system::processor(),
        "adapters": found.into_iter().map(|row| row.json).collect::<Vec<Value>>(),
        "in_use": in_use,
        "remedy": remedy,
    })
}

fn machine(system: &System) -> String {
    format!(
        "Raystone {}\n  system     {}, {}\n  processor  {}\n",
        super::VERSION.as_str(),
        system.name,
        std::env::consts::ARCH,
        system::processor(),
    )
}

/// Returns the steps to take if no adapter answers.
fn remedy(system: &System) -> String {
    let mut text = "\nWhat to do\n".to_owned();
    if let Ok(backend) = std::env::var("WGPU_BACKEND") {
        let _ = writeln!(
            text,
            "  WGPU_BACKEND={backend} narrows the search; try without it."
        );
    }
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        if let Ok(files) = std::env::var(variable) {
            let _ = writeln!(
                text,
                "  {variable}={files} hides the installed drivers; check it."
            );
        }
    }
    let _ = writeln!(
        text,
        "  For a software driver, which runs on any processor, type:\n    {}",
        system.install_line()
    );
    text
}

/// Runs a kernel on the adapter that would be used, and describes its abilities.
fn examine(
    gpu: &Gpu,
    choice: &AdapterChoice,
    found: &[AdapterSummary],
    system: &System,
) -> Result<Examined, GpuError> {
    let probe = probe_arithmetic(gpu)?;
    let position = found.iter().find(|adapter| adapter.info == gpu.info);
    let number = position.map_or(String::new(), |adapter| format!("{}, ", adapter.index));
    let reason = match choice {
        AdapterChoice::Best if found.len() == 1 => "it is the only one",
        AdapterChoice::Best => {
            "discrete goes before integrated, virtual and software, and Vulkan before GL"
        }
        _ => "--adapter asks for it",
    };
    let timestamps = match gpu.timestamp_period {
        Some(_) => "present: passes are timed by the GPU's own clock",
        None => "absent: the wall clock is used instead, and marked in the report",
    };
    let limit = largest_binding(&gpu.limits);
    let triangle = size_of::<TriangleRecord>();
    let millions = limit as f64 / triangle as f64 / 1e6;
    let size = format!(
        "at most about {millions:.1} million triangles ({} per binding, {triangle} bytes each)",
        bytes(limit),
    );
    let rows = [
        ("dispatch", "a kernel ran, and its results came back".into()),
        ("arithmetic", arithmetic(probe)),
        ("denormals", denormals(probe).into()),
        ("loops", loops(gpu, system)),
        ("timestamps", timestamps.into()),
        ("scene size", size),
    ];
    Ok(Examined {
        adapter: gpu.info.name.clone(),
        head: format!("\nAdapter in use: {number}{}; {reason}\n", gpu.info.name),
        rows: rows.into_iter().chain(speed(gpu, system)).collect(),
        whole_loops: gpu.loop_limit.is_none(),
    })
}

/// Findings on the adapter in use.
struct Examined {
    adapter: String,
    head: String,
    rows: Vec<(&'static str, String)>,
    whole_loops: bool,
}

impl Examined {
    fn text(&self) -> String {
        let mut text = self.head.clone();
        for (name, what) in &self.rows {
            let _ = writeln!(text, "  {name:<10}  {what}");
        }
        text + if self.whole_loops {
            "\nEverything that Raystone needs works here.\n"
        } else {
            "\nRaystone works here, but for what loops long: see above.\n"
        }
    }
}

fn denormals(probe: ArithmeticProbe) -> &'static str {
    if probe.denormals {
        "kept, as on the host"
    } else {
        "taken for 0: hits of rays and scenes of such sizes may differ from the host's"
    }
}

/// Describes whether the driver ends loops early, with the consequences.
fn loops(gpu: &Gpu, system: &System) -> String {
    let Some(limit) = gpu.loop_limit else {
        return "run to their end".to_owned();
    };
    let remedy = if system.has_backports() {
        "type: scripts/install-driver --backports"
    } else {
        "install a newer driver"
    };
    format!(
        "END IN SILENCE once an invocation took {} turns in all: kernels check for it,\n              \
         and what needs more is refused (long brute force). For whole loops, {remedy}",
        count(limit.into())
    )
}

fn arithmetic(probe: ArithmeticProbe) -> String {
    let faults: Vec<_> = [
        (probe.unfused, "a*b + c is fused"),
        (probe.exact_division, "division is not correctly rounded"),
        (probe.exact_sqrt, "sqrt is not correctly rounded"),
    ]
    .into_iter()
    .filter_map(|(sound, fault)| (!sound).then_some(fault))
    .collect();
    match (faults.is_empty(), probe.is_exact()) {
        (true, _) => "equals the host's to the bit: hits must, too".to_owned(),
        (false, true) => format!("{}; hits do not depend on it", faults.join(", ")),
        (false, false) => format!(
            "differs from the host's ({}): the double-precision oracle decides hits that differ",
            faults.join(", ")
        ),
    }
}

/// Describes the speed of a software adapter, and the way to a faster driver if there is one.
fn speed(gpu: &Gpu, system: &System) -> Option<(&'static str, String)> {
    let mut text = "software: times compare structures on this adapter only".to_owned();
    if let Some(major @ ..=22) = mesa_major(&gpu.info.driver_info) {
        text += &format!("\n              Mesa {major} takes about twice as long as Mesa 25");
        if system.has_backports() {
            text += "; to get that, type: scripts/install-driver --backports";
        }
    }
    gpu.is_software().then_some(("speed", text))
}

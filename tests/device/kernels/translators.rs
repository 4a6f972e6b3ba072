//! Kernels through other translators than the one that runs here: Chromium's (`tint`), and naga's
//! for Direct3D, Metal and OpenGL.

use crate::support::needs;
use naga::back::{glsl, hlsl, msl};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use std::io::Write as _;
use std::process::{Command, Stdio};

/// Chromium's translator; `None` where it is not installed.
pub fn tint() -> Option<&'static str> {
    let version = Command::new("tint").arg("--help").output();
    match version {
        Ok(_) => Some("tint"),
        Err(error) => {
            needs::skip("tint", format!("`tint --help` does not run: {error}"));
            None
        }
    }
}

/// Returns the error of a browser's translator for a kernel.
pub fn tint_fault(tint: &str, wgsl: &str) -> Option<String> {
    let mut file = tempfile::Builder::new()
        .suffix(".wgsl")
        .tempfile()
        .expect("a file");
    file.write_all(wgsl.as_bytes()).expect("the text");
    let mut command = Command::new(tint);
    command
        .args(["--format", "wgsl", "-o", "/dev/null"])
        .arg(file.path());
    let output = command
        .stdin(Stdio::null())
        .output()
        .expect("it was there before");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    (!output.status.success()).then_some(text)
}

/// Returns the error of naga's other back ends for a kernel.
pub fn naga_fault(wgsl: &str) -> Option<String> {
    let module = naga::front::wgsl::parse_str(wgsl).expect("a kernel");
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(&module).expect("a valid kernel");
    [to_hlsl, to_msl, to_glsl]
        .into_iter()
        .find_map(|translate| translate(&module, &info).err())
}

fn to_hlsl(module: &naga::Module, info: &ModuleInfo) -> Result<(), String> {
    let options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V6_0,
        ..hlsl::Options::default()
    };
    let pipeline = hlsl::PipelineOptions::default();
    let mut text = String::new();
    let mut writer = hlsl::Writer::new(&mut text, &options, &pipeline);
    let written = writer.write(module, info, None);
    let written = written.map_err(|error| format!("HLSL: {error}"))?;
    let names: Result<Vec<_>, _> = written.entry_point_names.into_iter().collect();
    names.map(|_| ()).map_err(|error| format!("HLSL: {error}"))
}

fn to_msl(module: &naga::Module, info: &ModuleInfo) -> Result<(), String> {
    let options = msl::Options {
        lang_version: (2, 4),
        fake_missing_bindings: true,
        ..msl::Options::default()
    };
    let pipeline = msl::PipelineOptions::default();
    let written = msl::write_string(module, info, &options, &pipeline);
    let (_, written) = written.map_err(|error| format!("MSL: {error}"))?;
    let names: Result<Vec<_>, _> = written.entry_point_names.into_iter().collect();
    names.map(|_| ()).map_err(|error| format!("MSL: {error}"))
}

fn to_glsl(module: &naga::Module, info: &ModuleInfo) -> Result<(), String> {
    let options = glsl::Options {
        version: glsl::Version::new_gles(310),
        ..glsl::Options::default()
    };
    let pipeline = glsl::PipelineOptions {
        shader_stage: naga::ShaderStage::Compute,
        entry_point: module.entry_points[0].name.clone(),
        multiview: None,
    };
    let mut text = String::new();
    let bounds = naga::proc::BoundsCheckPolicies::default();
    let writer = glsl::Writer::new(&mut text, module, info, &options, &pipeline, bounds);
    let written = writer.and_then(|mut writer| writer.write());
    written
        .map(|_| ())
        .map_err(|error| format!("GLSL: {error}"))
}

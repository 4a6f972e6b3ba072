//! Kernel errors in terms of the author's file and line.
//!
//! naga reports positions in the composed text. The declaration around the position tells the source
//! module; within it, the source line is the one whose text is nearest to the offending line once
//! both are stripped of white space, brackets and composition's name mangling.

use super::GpuError;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use wesl::{BasicSourceMap, SourceMap};

type Paths = BTreeMap<String, PathBuf>;

/// Rewrites module paths in a WESL error to file names.
pub(super) fn wesl_error(text: &str, paths: &Paths) -> String {
    let mut out = without_colours(text);
    // Longest first, so that `package::accel::bvh` does not eat part of `package::accel::bvh4`.
    let mut known: Vec<_> = paths.iter().collect();
    known.sort_by_key(|(module, _)| std::cmp::Reverse(module.len()));
    for (module, path) in known {
        out = out.replace(module.as_str(), &path.display().to_string());
    }
    out
}

/// Text without terminal escape sequences, since it goes into records too.
fn without_colours(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |out, part| out + part.split_once('m').map_or(part, |(_, rest)| rest))
}

/// Parses and validates composed WGSL with the capabilities of plain WebGPU.
pub(super) fn parse_and_validate(
    wgsl: &str,
    map: &BasicSourceMap,
    paths: &Paths,
) -> Result<(naga::Module, naga::valid::ModuleInfo), GpuError> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| {
        let line = e.location(wgsl).map(|l| l.line_number as usize);
        GpuError::Kernel(describe(wgsl, line, e.message(), map, paths))
    })?;
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::default());
    let info = validator.validate(&module).map_err(|e| {
        let line = e.location(wgsl).map(|l| l.line_number as usize);
        let mut message = e.as_inner().to_string();
        let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(e.as_inner());
        while let Some(inner) = cause {
            let _ = write!(message, ": {inner}");
            cause = inner.source();
        }
        GpuError::Kernel(describe(wgsl, line, &message, map, paths))
    })?;
    Ok((module, info))
}

/// One message: file and line of the source, the error, and the offending line.
fn describe(wgsl: &str, line: Option<usize>, message: &str, map: &BasicSourceMap, paths: &Paths) -> String {
    let Some(line) = line else {
        return format!("kernel error: {message}");
    };
    let offending = wgsl.lines().nth(line - 1).unwrap_or("").trim();
    match source_position(wgsl, line, map, paths) {
        Some((file, source_line, text)) => format!("{file}:{source_line}: {message}\n    {}", text.trim()),
        None => format!("composed kernel, line {line}: {message}\n    {offending}"),
    }
}

/// Source file, line and text for a line of the composed kernel.
fn source_position(wgsl: &str, line: usize, map: &BasicSourceMap, paths: &Paths) -> Option<(String, usize, String)> {
    let lines: Vec<&str> = wgsl.lines().collect();
    let mangled = (0..line).rev().find_map(|i| declared_name(lines.get(i)?))?;
    let (module, item) = match map.get_decl(mangled) {
        Some((module, item)) => (Some(module.to_string()), item.to_owned()),
        // Declarations of the entry module keep their names.
        None => (None, mangled.to_owned()),
    };
    let (source, file) = match &module {
        Some(name) => {
            let path = paths.get(name)?;
            let source = map.get_source(&name.parse().ok()?)?;
            (source, path.display().to_string())
        }
        None => {
            let source = map.get_default_source()?;
            let path = paths.iter().find(|(module, _)| {
                module.parse().ok().and_then(|m| map.get_source(&m)).is_some_and(|s| s == source)
            })?;
            (source, path.1.display().to_string())
        }
    };
    let offending = normalise(lines[line - 1]);
    let start = source.lines().position(|l| declared_name(l) == Some(item.as_str()))?;
    let candidates = source.lines().enumerate().skip(start);
    let in_declaration = candidates.take_while(|(i, l)| *i == start || declared_name(l).is_none());
    let best = in_declaration.max_by(|a, b| {
        let score = |l: &str| strsim::normalized_levenshtein(&normalise(l), &offending);
        score(a.1).total_cmp(&score(b.1)).then(b.0.cmp(&a.0))
    })?;
    Some((file, best.0 + 1, best.1.to_owned()))
}

/// The name declared by a line such as `fn name(`, `struct name {`, `var<storage> name:`.
fn declared_name(line: &str) -> Option<&str> {
    if line.starts_with(char::is_whitespace) {
        return None;
    }
    let mut rest = line.trim_start();
    while let Some(after) = rest.strip_prefix('@') {
        let end = after.find([' ', ')']).map_or(after.len(), |i| if after[i..].starts_with(')') { i + 1 } else { i });
        rest = after[end..].trim_start();
    }
    for keyword in ["fn ", "struct ", "const ", "override ", "alias ", "var"] {
        if let Some(after) = rest.strip_prefix(keyword) {
            let after = match after.strip_prefix('<') {
                Some(space) => space.split_once('>')?.1,
                None => after,
            };
            let name = after.trim_start();
            let end = name.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(name.len());
            return (end > 0).then(|| &name[..end]);
        }
    }
    None
}

/// A line without white space, brackets and mangled prefixes, for comparison.
fn normalise(line: &str) -> String {
    let mut out = String::new();
    for word in line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty()) {
        // `package__1accel_bvh_closest_hit` → its last part is what the author wrote; a suffix match
        // is enough for a distance.
        let short = if word.starts_with("package_") { word.rsplit("_1").next().unwrap_or(word) } else { word };
        out.push_str(short);
        out.push(' ');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_names_are_found_behind_attributes() {
        assert_eq!(declared_name("fn closest_hit(ray: Ray) -> Hit {"), Some("closest_hit"));
        assert_eq!(declared_name("@group(0) @binding(1) var<storage, read> nodes: array<u32>;"), Some("nodes"));
        assert_eq!(declared_name("    let x = 1;"), None);
        assert_eq!(declared_name("@compute @workgroup_size(64)"), None);
    }
}

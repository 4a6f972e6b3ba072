//! Kernel errors in terms of the author's file and line.
//!
//! naga reports positions in the composed text. The declaration around the position tells the source
//! module; within it, the statements of source and composed text are aligned in order (composition
//! drops comments and switched-off statements, rejoins lines and renames), so that the offending
//! statement leads to its own source line even where the same line is repeated.

use super::GpuError;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use wesl::syntax::{ImportContent, PathOrigin, TranslationUnit};
use wesl::{BasicSourceMap, SourceMap};

type Paths = BTreeMap<String, PathBuf>;

/// A WESL error as `file:line: message` and the excerpt that WESL shows; module paths become file
/// names. `sources` are all files with their texts.
pub(super) fn wesl_error<'a>(
    text: &str,
    paths: &Paths,
    sources: impl Iterator<Item = (&'a Path, &'a str)>,
) -> String {
    let mut out = without_colours(text);
    let place = import_of_missing_module(&out, paths, sources);
    // Longest first, so that `package::accel::bvh` does not eat part of `package::accel::bvh4`.
    let mut known: Vec<_> = paths.iter().collect();
    known.sort_by_key(|(module, _)| std::cmp::Reverse(module.len()));
    for (module, path) in known {
        out = out.replace(module.as_str(), &path.display().to_string());
    }
    let place = place.or_else(|| {
        let (file_and_line, _column) = out
            .lines()
            .find_map(|l| l.trim().strip_prefix("--> "))?
            .rsplit_once(':')?;
        Some(file_and_line.to_owned())
    });
    match place {
        Some(place) => format!("{place}: {}", out.trim_start_matches("error: ")),
        None => out,
    }
}

/// `file:line` of the import that names a module which does not exist; WESL tells the file alone.
fn import_of_missing_module<'a>(
    text: &str,
    paths: &Paths,
    mut sources: impl Iterator<Item = (&'a Path, &'a str)>,
) -> Option<String> {
    let missing = text
        .split_once("module not found: `")?
        .1
        .split('`')
        .next()?;
    let importer = text.split_once("= note: in ")?.1.lines().next()?.trim();
    let path = paths.get(importer)?;
    let (_, source) = sources.find(|(file, _)| file == path)?;
    let names_it = |line: &str| line.contains("import ") && line.contains(missing);
    let line = source.lines().position(names_it)?;
    Some(format!("{}:{}", path.display(), line + 1))
}

/// The paths that a file's imports name, from the root of the package; what is imported stands last.
///
/// # Errors
/// The text is no WESL: file, line and what stands there.
pub(super) fn imports(file: &Path, text: &str, module: &str) -> Result<Vec<Vec<String>>, String> {
    let unit = text.parse::<TranslationUnit>().map_err(|error| {
        let start = error.span.range().start.min(text.len());
        let line = text.as_bytes()[..start]
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        let offending = text.lines().nth(line).unwrap_or_default().trim();
        let what = error.error.to_string();
        // The parser lists every token that it would have taken.
        let what = what.split(", expected").next().unwrap_or_default();
        format!("{}:{}: {what}\n    {offending}", file.display(), line + 1)
    })?;
    let mut paths = Vec::new();
    for import in &unit.imports {
        let mut base: Vec<String> = Vec::new();
        if let Some(path) = &import.path {
            if let PathOrigin::Relative(up) = path.origin {
                let parts: Vec<&str> = module.split('/').collect();
                let kept = parts.len().saturating_sub(up);
                base.extend(parts[..kept].iter().map(|part| (*part).to_owned()));
            }
            base.extend(path.components.iter().cloned());
        }
        leaves(base, &import.content, &mut paths);
    }
    Ok(paths)
}

fn leaves(base: Vec<String>, content: &ImportContent, paths: &mut Vec<Vec<String>>) {
    match content {
        ImportContent::Item(item) => {
            let name = item.ident.name().to_string();
            paths.push(base.into_iter().chain([name]).collect());
        }
        ImportContent::Collection(imports) => {
            for import in imports {
                let path = base.iter().chain(&import.path).cloned().collect();
                leaves(path, &import.content, paths);
            }
        }
    }
}

/// Text without terminal escape sequences, since it goes into records too.
fn without_colours(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |out, part| {
        out + part.split_once('m').map_or(part, |(_, rest)| rest)
    })
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
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default(),
    );
    let info = validator.validate(&module).map_err(|e| {
        // The outer spans are the function and the block around the fault.
        let width = |span: &naga::Span| span.to_range().map_or(usize::MAX, |r| r.len());
        let narrowest = e.spans().map(|(span, _)| *span).min_by_key(width);
        let line = narrowest.map(|span| span.location(wgsl).line_number as usize);
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
fn describe(
    wgsl: &str,
    line: Option<usize>,
    message: &str,
    map: &BasicSourceMap,
    paths: &Paths,
) -> String {
    let message = readable(message, map);
    let Some(line) = line else {
        return format!("kernel error: {message}");
    };
    let offending = wgsl.lines().nth(line - 1).unwrap_or("").trim();
    match source_position(wgsl, line, map, paths) {
        Some((file, source_line, text)) => {
            format!("{file}:{source_line}: {message}\n    {}", text.trim())
        }
        None => format!("composed kernel, line {line}: {message}\n    {offending}"),
    }
}

/// Source file, line and text for a line of the composed kernel.
fn source_position(
    wgsl: &str,
    line: usize,
    map: &BasicSourceMap,
    paths: &Paths,
) -> Option<(String, usize, String)> {
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
                module
                    .parse()
                    .ok()
                    .and_then(|m| map.get_source(&m))
                    .is_some_and(|s| s == source)
            })?;
            (source, path.1.display().to_string())
        }
    };
    let end_of = |lines: &[&str], start: usize| {
        lines
            .iter()
            .skip(start + 1)
            .position(|l| declared_name(l).is_some())
            .map_or(lines.len(), |n| start + 1 + n)
    };
    let composed_start = (0..line)
        .rev()
        .find(|&i| declared_name(lines[i]).is_some())?;
    let composed = statements(&lines[composed_start..end_of(&lines, composed_start)], map);
    let source_lines: Vec<&str> = source.lines().collect();
    let start = source_lines
        .iter()
        .position(|l| declared_name(l) == Some(item.as_str()))?;
    let written = statements(&source_lines[start..end_of(&source_lines, start)], map);
    let offending = composed
        .iter()
        .rposition(|s| s.line <= line - 1 - composed_start)?;
    let found = start + written.get(aligned(&composed, &written, offending))?.line;
    Some((file, found + 1, source_lines[found].to_owned()))
}

/// A statement, or a part of one that ends in a brace.
struct Statement {
    /// Its first line, from 0.
    line: usize,
    /// Its words as the author wrote them, separated by spaces.
    words: String,
}

/// Cuts lines into statements; comments, attributes and empty ones are left out.
fn statements(lines: &[&str], map: &BasicSourceMap) -> Vec<Statement> {
    let mut out: Vec<Statement> = Vec::new();
    let mut is_open = false;
    for (line, text) in lines.iter().enumerate() {
        let code = text.split("//").next().unwrap_or("").trim();
        let words = normalise(code, map);
        if !words.is_empty() {
            match out.last_mut() {
                Some(last) if is_open => last.words.push_str(&words),
                _ => out.push(Statement { line, words }),
            }
        }
        is_open = if code.is_empty() {
            is_open
        } else {
            !code.ends_with([';', '{', '}'])
        };
    }
    out
}

/// Index of the written statement that became `composed[offending]`, by the in-order pairing of
/// both lists with the greatest sum of likeness (Needleman & Wunsch 1970, free gaps).
fn aligned(composed: &[Statement], written: &[Statement], offending: usize) -> usize {
    let likeness = |i: usize, j: usize| {
        let same = strsim::normalized_levenshtein(&composed[i].words, &written[j].words);
        // Statements that have little in common are better left alone.
        (same - 0.4).max(0.0)
    };
    let (rows, columns) = (composed.len(), written.len());
    let mut gain = vec![vec![0.0_f64; columns + 1]; rows + 1];
    let mut pair = vec![vec![0.0_f64; columns]; rows];
    for i in (0..rows).rev() {
        for j in (0..columns).rev() {
            pair[i][j] = likeness(i, j);
            gain[i][j] = (pair[i][j] + gain[i + 1][j + 1])
                .max(gain[i + 1][j])
                .max(gain[i][j + 1]);
        }
    }
    let (mut i, mut j) = (0, 0);
    while i < offending && j < columns {
        if gain[i][j] == pair[i][j] + gain[i + 1][j + 1] && pair[i][j] > 0.0 {
            (i, j) = (i + 1, j + 1);
        } else if gain[i][j] == gain[i][j + 1] {
            j += 1;
        } else {
            i += 1;
        }
    }
    // The offending statement itself: the likest of what is left before the alignment goes on.
    let rest = j.min(columns - 1)..columns;
    rest.max_by(|&a, &b| {
        let total = |j: usize| pair[offending][j] + gain[offending + 1][j + 1];
        total(a).total_cmp(&total(b)).then(b.cmp(&a))
    })
    .unwrap_or(0)
}

/// The name declared by a line such as `fn name(`, `struct name {`, `var<storage> name:`.
fn declared_name(line: &str) -> Option<&str> {
    if line.starts_with(char::is_whitespace) {
        return None;
    }
    let mut rest = line.trim_start();
    while let Some(after) = rest.strip_prefix('@') {
        let end = after.find([' ', ')']).map_or(after.len(), |i| {
            if after[i..].starts_with(')') {
                i + 1
            } else {
                i
            }
        });
        rest = after[end..].trim_start();
    }
    for keyword in ["fn ", "struct ", "const ", "override ", "alias ", "var"] {
        if let Some(after) = rest.strip_prefix(keyword) {
            let after = match after.strip_prefix('<') {
                Some(space) => space.split_once('>')?.1,
                None => after,
            };
            let name = after.trim_start();
            let end = name
                .find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(name.len());
            return (end > 0).then(|| &name[..end]);
        }
    }
    None
}

/// A message with the author's names in the place of mangled ones.
fn readable(message: &str, map: &BasicSourceMap) -> String {
    let mut out = String::new();
    let mut rest = message;
    while let Some(start) = rest.find("package_") {
        let (before, tail) = rest.split_at(start);
        let end = tail
            .find(|c: char| !c.is_alphanumeric() && c != '_')
            .unwrap_or(tail.len());
        let (word, after) = tail.split_at(end);
        out.push_str(before);
        out.push_str(map.get_decl(word).map_or(word, |(_, item)| item));
        rest = after;
    }
    out + rest
}

/// The words of a line as the author wrote them, each followed by a space.
fn normalise(line: &str, map: &BasicSourceMap) -> String {
    let mut out = String::new();
    for word in line
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .filter(|w| !w.is_empty())
    {
        out.push_str(map.get_decl(word).map_or(word, |(_, item)| item));
        out.push(' ');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declared_names_are_found_behind_attributes() {
        assert_eq!(
            declared_name("fn closest_hit(ray: Ray) -> Hit {"),
            Some("closest_hit")
        );
        assert_eq!(
            declared_name("@group(0) @binding(1) var<storage, read> nodes: array<u32>;"),
            Some("nodes")
        );
        assert_eq!(declared_name("    let x = 1;"), None);
        assert_eq!(declared_name("@compute @workgroup_size(64)"), None);
    }
}

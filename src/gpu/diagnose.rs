//! Kernel errors with source file and line.
//!
//! naga reports positions in the composed text. Composition drops comments, removes disabled
//! features and renames, but its syntax tree nodes have the spans of their source files. The
//! composed text is therefore parsed again: the node at the reported position has the same number
//! in the composed tree, whose span leads to the source.

use super::GpuError;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
use wesl::syntax::{
    CompoundStatement, GlobalDeclaration, GlobalDeclarationNode, ImportContent, PathOrigin,
    Statement, TranslationUnit,
};
use wesl::{BasicSourceMap, CompileResult, ModulePath, SourceMap};

type Paths = BTreeMap<String, PathBuf>;

/// A WESL error as `file:line: message` with WESL's excerpt; module paths become file names.
/// `sources` are all files with their texts.
pub(super) fn wesl_error<'a>(
    text: &str,
    paths: &Paths,
    sources: impl Iterator<Item = (&'a Path, &'a str)>,
) -> String {
    let mut out = without_colours(text);
    let place = import_of_missing_module(&out, paths, sources);
    // Longest first, so that `package::accel::bvh` does not match part of `package::accel::bvh4`.
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

/// `file:line` of the import of a missing module; WESL reports the file only.
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

/// The paths in a file's imports, from the root of the package, with the imported item last.
///
/// # Errors
/// The text is not valid WESL: file, line and the text there.
pub(super) fn imports(file: &Path, text: &str, module: &str) -> Result<Vec<Vec<String>>, String> {
    let unit = text.parse::<TranslationUnit>().map_err(|error| {
        let (line, offending) = line_at(text, error.span.range().start);
        let what = error.error.to_string();
        // The parser lists every token it would have accepted.
        let what = what.split(", expected").next().unwrap_or_default();
        format!("{}:{line}: {what}\n    {offending}", file.display())
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

/// Text without terminal escape sequences, since it is also stored in records.
fn without_colours(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |out, part| {
        out + part.split_once('m').map_or(part, |(_, rest)| rest)
    })
}

/// A composed kernel and the map back to its sources.
pub(super) struct Composed<'a> {
    pub wgsl: &'a str,
    /// The syntax tree of the text.
    pub result: &'a CompileResult,
    /// The module whose declarations are not renamed.
    pub entry: &'a ModulePath,
    pub paths: &'a Paths,
}

/// Parses and validates composed WGSL with the capabilities of plain WebGPU plus subgroups: a
/// device without these rejects such a kernel.
pub(super) fn parse_and_validate(
    kernel: &Composed,
) -> Result<(naga::Module, naga::valid::ModuleInfo), GpuError> {
    let module = naga::front::wgsl::parse_str(kernel.wgsl).map_err(|e| {
        let offset = e.location(kernel.wgsl).map(|l| l.offset as usize);
        GpuError::Kernel(describe(kernel, offset, e.message()))
    })?;
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default() | naga::valid::Capabilities::SUBGROUP,
    );
    let info = validator.validate(&module).map_err(|e| {
        // The outer spans are the function and the block around the fault.
        let ranges = e.spans().filter_map(|(span, _)| span.to_range());
        let narrowest = ranges.min_by_key(ExactSizeIterator::len);
        let mut message = e.as_inner().to_string();
        let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(e.as_inner());
        while let Some(inner) = cause {
            let _ = write!(message, ": {inner}");
            cause = inner.source();
        }
        GpuError::Kernel(describe(
            kernel,
            narrowest.map(|range| range.start),
            &message,
        ))
    })?;
    Ok((module, info))
}

/// One message: file and line of the source, the error, and the offending line.
fn describe(kernel: &Composed, offset: Option<usize>, message: &str) -> String {
    let message = match &kernel.result.sourcemap {
        Some(map) => readable(message, map),
        None => message.to_owned(),
    };
    let Some(offset) = offset else {
        return format!("kernel error: {message}");
    };
    let (place, line) = match source_position(kernel, offset) {
        Some((file, line, text)) => (format!("{file}:{line}"), text),
        None => {
            let (line, text) = line_at(kernel.wgsl, offset);
            (format!("composed kernel, line {line}"), text)
        }
    };
    format!("{place}: {message}\n    {line}")
}

/// Source file, line and text for a byte of the composed kernel.
fn source_position<'a>(kernel: &Composed<'a>, offset: usize) -> Option<(String, usize, &'a str)> {
    let reparsed = kernel.wgsl.parse::<TranslationUnit>().ok()?;
    let written = kernel.result.syntax.global_declarations.iter();
    let written = written.filter(|d| !matches!(d.node(), GlobalDeclaration::Void));
    let (composed, written) = reparsed
        .global_declarations
        .iter()
        .zip(written)
        .find(|(composed, _)| composed.span().range().contains(&offset))?;
    let map = kernel.result.sourcemap.as_ref()?;
    let name = name(written.node());
    let module = match map.get_decl(&name) {
        Some((module, _)) => module,
        None => kernel.entry,
    };
    let source = map.get_source(module)?;
    let file = kernel.paths.get(&module.to_string())?;
    let (places, origins) = (spans(composed), spans(written));
    let around = places
        .iter()
        .zip(&origins)
        .filter(|(place, _)| place.contains(&offset));
    let (_, narrowest) = around.min_by_key(|(place, _)| place.len())?;
    let start = after_attributes(source, narrowest.start);
    let (line, text) = line_at(source, start);
    Some((file.display().to_string(), line, text))
}

/// Number of the line around a byte, from 1, and the line.
fn line_at(text: &str, offset: usize) -> (usize, &str) {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let shown = text.lines().nth(line).unwrap_or_default();
    (line + 1, shown.trim())
}

fn name(declaration: &GlobalDeclaration) -> String {
    let ident = match declaration {
        GlobalDeclaration::Declaration(d) => &d.ident,
        GlobalDeclaration::TypeAlias(d) => &d.ident,
        GlobalDeclaration::Struct(d) => &d.ident,
        GlobalDeclaration::Function(d) => &d.ident,
        GlobalDeclaration::Void | GlobalDeclaration::ConstAssert(_) => return String::new(),
    };
    ident.name().to_string()
}

/// Skips attributes, which may be on a line before the fault.
fn after_attributes(text: &str, start: usize) -> usize {
    let mut rest = &text[start..];
    while let Some(attribute) = rest.trim_start().strip_prefix('@') {
        let name = attribute.trim_start_matches(is_of_word);
        let mut depth = 0;
        // Without brackets, nothing; with brackets, everything up to the one that closes the first.
        let end = name.find(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth == 0
        });
        rest = name[end.unwrap_or(name.len())..].trim_start_matches(')');
    }
    text.len() - rest.trim_start().len()
}

fn spans(declaration: &GlobalDeclarationNode) -> Vec<Range<usize>> {
    let mut out = vec![declaration.span().range()];
    match declaration.node() {
        GlobalDeclaration::Struct(d) => out.extend(d.members.iter().map(|m| m.span().range())),
        GlobalDeclaration::Function(d) => statements(&d.body, &mut out),
        _ => {}
    }
    out
}

fn statements(block: &CompoundStatement, out: &mut Vec<Range<usize>>) {
    let mut rest = vec![block];
    while let Some(block) = rest.pop() {
        for statement in &block.statements {
            // Left by disabled features, and not printed.
            if !matches!(statement.node(), Statement::Void) {
                out.push(statement.span().range());
            }
            match statement.node() {
                Statement::Compound(s) => rest.push(s),
                Statement::If(s) => {
                    rest.push(&s.if_clause.body);
                    for clause in &s.else_if_clauses {
                        out.push(clause.expression.span().range());
                        rest.push(&clause.body);
                    }
                    rest.extend(s.else_clause.iter().map(|clause| &clause.body));
                }
                Statement::Switch(s) => rest.extend(s.clauses.iter().map(|clause| &clause.body)),
                Statement::Loop(s) => {
                    rest.push(&s.body);
                    if let Some(end) = &s.continuing {
                        rest.push(&end.body);
                        let condition = end.break_if.as_ref().map(|b| b.expression.span().range());
                        out.extend(condition);
                    }
                }
                Statement::For(s) => rest.push(&s.body),
                Statement::While(s) => rest.push(&s.body),
                _ => {}
            }
        }
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The message with source names instead of mangled ones.
fn readable(message: &str, map: &BasicSourceMap) -> String {
    let pieces = message.split_inclusive(|c| !is_of_word(c));
    let written = |piece: &str| {
        let word = piece.trim_end_matches(|c| !is_of_word(c));
        match map.get_decl(word) {
            Some((_, item)) => piece.replacen(word, item, 1),
            None => piece.to_owned(),
        }
    };
    pieces.map(written).collect()
}

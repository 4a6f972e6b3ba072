//! Reports: plots, tables, `index.html`, `summary.md` and the terminal's tables, all derived from a
//! run's records alone.
//!
//! Data flows one way: [`raystone_record`] parses the lines, [`data`] sorts them, [`samplers`] and `ruling`
//! draw conclusions, [`sections`] writes them into a [`document::Document`], and [`html`],
//! [`markdown`] and [`terminal`] show that document.
#![warn(missing_docs)]

pub mod advice;
pub mod compare;
pub mod data;
pub mod document;
pub mod export;
mod failures;
pub mod format;
pub mod gallery;
pub mod history;
pub mod html;
mod known_page;
pub mod markdown;
pub(crate) mod names;
pub(crate) mod pictures;
pub mod pivot;
pub mod plot;
pub mod point_page;
pub mod repro;
pub(crate) mod ruling;
pub mod samplers;
pub mod sections;
pub(crate) mod spec;
pub mod terminal;
pub mod terms;
#[cfg(test)]
mod tests;
pub(crate) mod trust;
pub mod values;

pub use known_page::check_texts;
pub use ruling::check as check_rulings;
pub use terminal::{failed_checks, terminal_tables};

use data::RunData;
use document::Document;
use raystone_core::atomic::write_atomic;
use raystone_record::{RecordError, read_records};
use sections::cells::{self, Cells};
use std::path::{Path, PathBuf};

/// An error while a report is written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The records cannot be read.
    #[error(transparent)]
    Records(#[from] RecordError),
    /// A file of the report cannot be written.
    #[error(
        "cannot write {}: {source}; make space, or the folder writable: records are kept, and `raystone report` makes their page", path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// A table does not hold what was to be written to it.
    #[error("{} would not hold the figures of its records: {fault}; this program is at fault: report this", path.display())]
    Altered {
        /// The file.
        path: PathBuf,
        /// The first difference.
        fault: String,
    },
    /// A plot cannot be drawn.
    #[error("cannot draw a plot: {0}")]
    Draw(String),
    /// The page cannot be filled in.
    #[error("cannot fill in the page: {0:#}")]
    Template(#[from] minijinja::Error),
}

/// Files of a report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportPaths {
    /// The page.
    pub html: PathBuf,
    /// The summary in Markdown.
    pub summary: PathBuf,
    /// Every figure as comma-separated values.
    pub figures: PathBuf,
    /// Every plot, SVG and PNG.
    pub plots: Vec<PathBuf>,
    /// Parts left out while reading the records, in words.
    pub warnings: Vec<String>,
}

/// Writes `index.html`, `summary.md`, `figures.csv` and `plots/*.{svg,png}` beside the `records.jsonl` in `dir`, and
/// `cells.html` where the page has no room for all cells.
/// Each file is whole or absent: it is written under another name and renamed.
///
/// # Errors
/// Unreadable records, see [`read_records`], a table that is wrong, or a folder that cannot be written.
pub fn write_report(dir: &Path) -> Result<ReportPaths, ReportError> {
    known_page::check().map_err(|fault| ReportError::Altered {
        path: dir.join("index.html"),
        fault,
    })?;
    let records = read_records(dir)?;
    let data = RunData::new(&records.lines);
    let values = values::values(&data);
    let cells = Cells::new(&data, &values);
    let mut document = sections::with_cells(dir, &data, &cells, &records.warnings);
    let (html, plots) = write_page(dir, &mut document)?;
    write_cells(dir, cells.document(&data))?;
    let summary = dir.join("summary.md");
    write_file(&summary, markdown::summary(&document).as_bytes())?;
    let figures = dir.join("figures.csv");
    let table = values::csv(&values);
    if let Some(fault) = values::csv_fault(&values, &table) {
        let path = figures;
        return Err(ReportError::Altered { path, fault });
    }
    write_file(&figures, table.as_bytes())?;
    Ok(ReportPaths {
        html,
        summary,
        figures,
        plots,
        warnings: records.warnings,
    })
}

/// Writes the page of the cells, or removes that of an earlier report.
fn write_cells(dir: &Path, document: Option<Document>) -> Result<(), ReportError> {
    let path = dir.join(cells::FILE);
    match document {
        Some(document) => write_file(&path, html::page(&document)?.as_bytes()),
        None => {
            let _ = std::fs::remove_file(&path);
            Ok(())
        }
    }
}

/// Paints the document and writes `index.html` and `plots/*.{svg,png}` into `dir`, which is made if
/// it is not there: the page and the plots.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_page(
    dir: &Path,
    document: &mut Document,
) -> Result<(PathBuf, Vec<PathBuf>), ReportError> {
    let folder = dir.join("plots");
    std::fs::create_dir_all(&folder).map_err(|source| ReportError::Write {
        path: folder.clone(),
        source,
    })?;
    let mut plots = Vec::new();
    document.paint(|name, painted| {
        let svg = Some(("svg", painted.svg.as_bytes()));
        let png = painted.png.as_ref().map(|png| ("png", &png[..]));
        for (extension, bytes) in svg.into_iter().chain(png) {
            let path = folder.join(format!("{name}.{extension}"));
            write_file(&path, bytes)?;
            plots.push(path);
        }
        Ok(())
    })?;
    let html = dir.join("index.html");
    write_file(&html, html::page(document)?.as_bytes())?;
    Ok((html, plots))
}

/// Writes a file of a report whole or not at all.
///
/// # Errors
/// [`ReportError::Write`].
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    write_atomic(path, bytes).map_err(|source| ReportError::Write {
        path: path.into(),
        source,
    })
}

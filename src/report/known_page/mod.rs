//! A page of known records, made anew before any is written: columns that are exchanged, a figure in another unit, a curve
//! along another value or a winner of the wrong side look like other measurements.
//!
//! `records.jsonl` is a synthetic run of one scene. `page.txt` has what a page and the terminal show of it:
//! tables, checks, and of each plot its words and the mean places and colours of its shapes. Its figures were worked out by
//! another program (`the_figures_of_the_page` below says which); the rest was read. A changed page is written by
//! `RAYSTONE_WRITE_PAGES=1 cargo test -p raystone-report known_page`; read the difference before you commit it.

use crate::data::RunData;
use crate::document::{Block, Document, Illustration, Table};
use crate::plot::drawing::{Drawing, Ink, Point, Shape};
use crate::sections;
use crate::terminal::Screen;
use crate::values::values;
use crate::{markdown, sections::cells::Cells};
use raystone_record::Line;
use std::fmt::Write as _;
use std::path::Path;

mod texts;

pub use texts::check as check_texts;

const RECORDS: &str = include_str!("records.jsonl");
const PAGE: &str = include_str!("page.txt");

/// Makes the page.
///
/// # Errors
/// A line of it is another: both.
pub(crate) fn check() -> Result<(), String> {
    differing("a page", &page(&records()?), PAGE)
}

fn records() -> Result<Vec<Line>, String> {
    let lines = RECORDS.lines().map(serde_json::from_str);
    let lines: Result<Vec<Line>, _> = lines.collect();
    lines.map_err(|error| format!("known records: {error}"))
}

fn differing(what: &str, found: &str, expected: &str) -> Result<(), String> {
    let mut pairs = found.lines().zip(expected.lines());
    let pair = pairs.find(|(found, expected)| found != expected);
    match pair {
        Some((found, expected)) => Err(format!(
            "{what} of known records has the line `{found}` in place of `{expected}`"
        )),
        None if found.lines().count() != expected.lines().count() => Err(format!(
            "{what} of known records has more or fewer lines than it should"
        )),
        None => Ok(()),
    }
}

/// What is compared of a page and of the terminal.
fn page(lines: &[Line]) -> String {
    let data = RunData::new(lines);
    let values = values(&data);
    let cells = Cells::new(&data, &values);
    let document = sections::with_cells(Path::new("no such folder"), &data, &cells, &[]);
    let mut text = of_document(&document);
    text += "terminal\n";
    text += &Screen::default().tables(lines);
    text
}

fn of_document(document: &Document) -> String {
    let sections = document.sections.iter();
    // Cells repeat the figures of the others.
    let sections = sections.filter(|section| section.id != "cells");
    sections
        .flat_map(|section| &section.blocks)
        .map(of_block)
        .collect()
}

fn of_block(block: &Block) -> String {
    match block {
        Block::Fold(fold) => fold.blocks.iter().map(of_block).collect(),
        Block::Beside(beside) => beside.blocks.iter().map(of_block).collect(),
        Block::Checks(checks) => checks.iter().map(|check| check.line()).collect(),
        Block::Table(table) => of_table(table),
        Block::Figures(figures) => figures.iter().map(of_plot).collect(),
        _ => String::new(),
    }
}

/// As in `summary.md`, without the caption.
fn of_table(table: &Table) -> String {
    markdown::table(&Table {
        caption: String::new(),
        ..table.clone()
    })
}

/// A plot's words, and the mean place and colour of its lines, areas, texts, tooltips and rasters, each shape counted once more
/// than the one before it, up to seven: shapes that are exchanged change them.
fn of_plot(figure: &Illustration) -> String {
    let drawing = &figure.drawing;
    let texts = drawing.shapes.iter().filter_map(|shape| match shape {
        Shape::Text { text, .. } => Some(text.as_str()),
        _ => None,
    });
    let texts: Vec<&str> = texts.collect();
    let mut text = format!("plot {}: {}\n", drawing.says, texts.join(" "));
    for (kind, of) in Mean::of(drawing) {
        let [x, y, color] = of.mean();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {kind} around {x:.0} {y:.0}, {color:.0}", of.count);
    }
    text
}

#[derive(Default)]
struct Mean {
    count: usize,
    weight: f64,
    sums: [f64; 3],
}

impl Mean {
    fn of(drawing: &Drawing) -> [(&'static str, Self); 4] {
        let [mut lines, mut areas, mut texts, mut rasters] = <[Self; 4]>::default();
        for shape in &drawing.shapes {
            match shape {
                Shape::Line { points, ink, .. } => lines.add(points, *ink),
                Shape::Area { points, ink } => areas.add(points, *ink),
                Shape::Text { at, ink, .. } => texts.add(&[*at], *ink),
            }
        }
        for raster in &drawing.rasters {
            let (left, top) = raster.at;
            let (width, height) = raster.size;
            let pixels = raster.rgb.iter().enumerate();
            for (place, rgb) in pixels {
                let column = (place % raster.columns.max(1)) as f64 + 0.5;
                let row = (place / raster.columns.max(1)) as f64 + 0.5;
                // Dark pixels count.
                let dark = 255.0 - rgb.map(f64::from).iter().sum::<f64>() / 3.0;
                let x = left + width * column / raster.columns.max(1) as f64;
                let y = top + height * row / raster.rows().max(1) as f64;
                rasters.count += 1;
                rasters.note((x, y), f64::from(rgb[0]), dark);
            }
        }
        [
            ("lines", lines),
            ("areas", areas),
            ("texts", texts),
            ("pixels", rasters),
        ]
    }

    fn add(&mut self, points: &[Point], ink: Ink) {
        self.count += 1;
        let weight = (1 + self.count % 7) as f64;
        let color = ink.rgb.iter().zip([1.0, 2.0, 3.0]);
        let color = color.map(|(x, of)| f64::from(*x) * of).sum::<f64>() / 6.0;
        points
            .iter()
            .for_each(|at| self.note(*at, color * ink.alpha, weight));
    }

    fn note(&mut self, (x, y): Point, color: f64, weight: f64) {
        self.weight += weight;
        for (sum, value) in self.sums.iter_mut().zip([x, y, color]) {
            *sum += weight * value;
        }
    }

    fn mean(&self) -> [f64; 3] {
        self.sums.map(|sum| sum / self.weight.max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_the_known_one() {
        if std::env::var_os("RAYSTONE_WRITE_PAGES").is_some() {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("known_page/page.txt");
            std::fs::write(file, page(&records().unwrap())).expect("written");
            return;
        }
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn a_line_that_is_another_is_told() {
        let text = page(&records().unwrap());
        for (from, to) in [("5.02", "5.03"), ("36", "35"), ("around", "about")] {
            let wrong = text.replacen(from, to, 1);
            assert!(wrong != text, "{from}");
            assert!(differing("a page", &wrong, &text).is_err(), "{from}");
        }
        let (less, _) = text.trim_end().rsplit_once('\n').unwrap();
        assert!(differing("a page", less, &text).is_err());
    }

    #[test]
    fn columns_that_are_exchanged_are_told() {
        let mut lines = records().unwrap();
        lines.swap(2, 3);
        assert!(differing("a page", &page(&lines), PAGE).is_err());
    }
}

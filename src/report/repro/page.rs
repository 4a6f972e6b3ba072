//! The page of all tables: verdicts first, then each table in the layout of the original with both numbers.

use super::claim::Row;
use super::judge::{ClaimVerdict, ONCE, ONCE_MS};
use super::table::{Placed, Reproduced};
use super::{NotCovered, plots};
use crate::data::without_repeats;
use crate::document::{Banner, Block, Document, Section, Table, TableCell, Tone};
use crate::format;
use raystone_config::expect::{Expect, Substitute};
use raystone_record::Interval;

/// Tables that failed to run: name and reason.
pub type Failures = [(String, String)];

/// Returns the whole page.
pub fn document(tables: &[Reproduced], failed: &Failures, not_covered: &NotCovered) -> Document {
    let mut document = Document {
        title: "What holds of four theses".to_owned(),
        subtitle: subtitle(tables),
        ..Document::default()
    };
    if tables.iter().any(|table| table.quick) {
        document.banners.push(Banner::new(
            Tone::Note,
            "A short run on small built-in scenes: verdicts hold for what was run, not for the theses' scenes.",
        ));
    }
    for (name, reason) in failed {
        let text = format!("{name} could not be run: {reason}");
        document.banners.push(Banner::new(Tone::Bad, text));
    }
    document.sections.push(summary(tables));
    document.sections.extend(tables.iter().map(section));
    document.sections.push(uncovered(not_covered));
    document
}

fn subtitle(tables: &[Reproduced]) -> String {
    let first = tables
        .iter()
        .find_map(|t| Some((t.environment.as_ref()?, t.started)));
    first.map_or_else(String::new, |(e, at)| format::where_and_when(e, at))
}

/// Returns the number of claims with each verdict, in words.
pub fn tally(tables: &[Reproduced]) -> String {
    let of = |t: &Reproduced| {
        (0..t.claims.len())
            .map(|i| t.verdict(i))
            .collect::<Vec<_>>()
    };
    let verdicts: Vec<ClaimVerdict> = tables.iter().flat_map(of).collect();
    counted(&verdicts)
}

/// Returns the number of each verdict among them, in words.
fn counted(verdicts: &[ClaimVerdict]) -> String {
    let all = [
        ClaimVerdict::Supported,
        ClaimVerdict::Contradicted,
        ClaimVerdict::Undecided,
        ClaimVerdict::NotTestable,
        ClaimVerdict::Faulty,
    ];
    let counts = all.map(|v| (v, verdicts.iter().filter(|found| **found == v).count()));
    let said = counts.iter().filter(|(_, n)| *n > 0);
    let said: Vec<String> = said.map(|(v, n)| format!("{n} {}", v.word())).collect();
    said.join(", ")
}

fn summary(tables: &[Reproduced]) -> Section {
    let mut section = Section::new("claims", "Verdicts");
    section.blocks.push(Block::Paragraph(format!(
        "Claims: {}. A claim about several places is contradicted by one of them, and supported where all that can be tested \
         support it. Absolute times are shown, never judged. Intervals are of 95 %; those of ratios of what was timed in the same \
         rounds are taken round by round, those of predicted cycles group by group of the pixels that were followed; those of \
         other ratios and of slopes combine the intervals of their parts on \
         logarithms (Zou & Donner 2008). What was measured once is taken to be within a factor of \
         {ONCE}, and a time to within {ONCE_MS} ms besides. A contradicted claim is a finding.",
        tally(tables)
    )));
    let columns = [
        "table",
        ":claim",
        ":what the thesis says",
        ":verdict",
        ":places",
    ];
    let rows = tables.iter().flat_map(|reproduced| {
        let expects = reproduced.thesis.expects.iter().enumerate();
        let judged =
            expects.map(|(i, expect)| (reproduced.verdict(i), &reproduced.claims[i], expect));
        let judged = judged.filter(|(verdict, ..)| *verdict != ClaimVerdict::Shown);
        judged.map(|(verdict, rows, expect)| {
            [
                reproduced.name.into(),
                claim_name(expect).into(),
                expect.says.as_str().into(),
                verdict_cell(verdict),
                places(rows).into(),
            ]
        })
    });
    let table = Table::of("Every claim that was looked at", &columns, rows);
    section.blocks.extend(table.into_block());
    section
}

/// Returns the hypotheses of the digest, or the expectation's own name.
pub fn claim_name(expect: &Expect) -> String {
    if expect.claims.is_empty() {
        expect.id.clone()
    } else {
        expect.claims.join(", ")
    }
}

fn verdict_cell(verdict: ClaimVerdict) -> TableCell {
    let tone = match verdict {
        ClaimVerdict::Supported => Tone::Good,
        ClaimVerdict::Contradicted | ClaimVerdict::Faulty => Tone::Bad,
        ClaimVerdict::Undecided => Tone::Note,
        _ => Tone::Plain,
    };
    TableCell::from(verdict.word()).toned(tone)
}

/// Summarises the verdicts of all places.
fn places(rows: &[Row]) -> String {
    if let [row] = rows {
        return row.ours.map_or_else(|| row.reason.clone(), interval);
    }
    if rows
        .iter()
        .any(|row| row.verdict != ClaimVerdict::NotTestable)
    {
        return counted(&rows.iter().map(|row| row.verdict).collect::<Vec<_>>());
    }
    // If nothing could be tested, the reason of most places.
    let reasons = rows.iter().map(|row| row.reason.as_str());
    let times = |reason: &&str| rows.iter().filter(|row| row.reason == **reason).count();
    let reason = reasons.max_by_key(times).unwrap_or_default();
    format!("{} places: {reason}", rows.len())
}

/// Formats a figure with its interval.
pub fn interval(i: Interval) -> String {
    if i.low < i.high {
        format::interval(&i)
    } else {
        format::number(i.value)
    }
}

fn section(table: &Reproduced) -> Section {
    let mut section = Section::new(table.name, table.name);
    let blocks = &mut section.blocks;
    blocks.push(Block::Heading(table.thesis.title.clone()));
    if let Some(environment) = &table.environment {
        let place = format::where_and_when(environment, table.started);
        blocks.push(Block::Paragraph(place));
    }
    if !table.thesis.reading.is_empty() {
        blocks.push(Block::Paragraph(table.thesis.reading.trim().to_owned()));
    }
    if !table.changes.is_empty() {
        let kind = if table.quick {
            "This short run"
        } else {
            "On a software adapter the run"
        };
        blocks.push(Block::Paragraph(format!(
            "{kind} has {}.",
            table.changes.join(", ")
        )));
    }
    blocks.extend(scenes(table).into_block());
    blocks.extend(original(table).map(Block::Table));
    blocks.extend(plots::of(table));
    for (index, expect) in table.thesis.expects.iter().enumerate() {
        blocks.extend(claim(table, index, expect));
    }
    section
}

fn scenes(table: &Reproduced) -> Table {
    let columns = ["thesis", "triangles", ":ours", "triangles", ":remark"];
    let count = |n: Option<u64>| n.map_or(format::ABSENT.to_owned(), format::count);
    let row = |(substitute, ours): &(Substitute, Result<Placed, String>)| {
        let (scene, triangles, remark) = match ours {
            Ok((scene, n)) => (scene.clone(), n.map(|n| n as u64), substitute.why.clone()),
            Err(reason) => (format::ABSENT.to_owned(), None, reason.clone()),
        };
        let thesis = substitute.original.clone();
        [
            thesis,
            count(substitute.triangles),
            scene,
            count(triangles),
            remark,
        ]
        .map(TableCell::from)
    };
    let scenes = table.scenes.iter().map(row);
    Table::of("Scenes in the place of the thesis's", &columns, scenes)
}

/// Rows and columns of the original, with the thesis's number before ours.
pub struct Grid<'t> {
    /// Heads of the columns.
    pub columns: Vec<&'t str>,
    /// Name of each row and its cells.
    pub rows: Vec<(&'t str, Vec<Option<&'t Row>>)>,
}

impl<'t> Grid<'t> {
    /// Returns all places with a column; `None` if there are none.
    pub fn new(table: &'t Reproduced) -> Option<Self> {
        let placed = || {
            let rows = table.claims.iter().flatten();
            rows.filter(|row| !row.column.is_empty() && !row.row.is_empty())
        };
        let columns = without_repeats(placed().map(|row| row.column.as_str()).collect());
        let names = without_repeats(placed().map(|row| row.row.as_str()).collect());
        let cell =
            |name: &str, column: &str| placed().find(|row| row.row == name && row.column == column);
        let rows = names.into_iter().map(|name| {
            let cells = columns.iter().map(|column| cell(name, column));
            (name, cells.collect())
        });
        let rows: Vec<_> = rows.collect();
        (!columns.is_empty()).then_some(Self { columns, rows })
    }
}

/// Formats a measured number, or a dash.
pub fn optional(value: Option<f64>) -> String {
    value.map_or(format::ABSENT.to_owned(), format::number)
}

/// Formats a thesis's number to its last digit, or a dash.
pub fn printed(value: Option<f64>) -> String {
    let text = |x: f64| match x.to_string() {
        // A converted number may have digits that the thesis did not print.
        long if long.len() > 9 => format::number(x),
        text => text.replace('-', "−"),
    };
    value.map_or(format::ABSENT.to_owned(), text)
}

fn original(table: &Reproduced) -> Option<Table> {
    let grid = Grid::new(table)?;
    let mut shown = Table::new("As the thesis prints it: its number, then ours", &["row"]);
    for column in &grid.columns {
        shown.add_column(*column);
    }
    for (name, cells) in &grid.rows {
        let cells = cells.iter().map(|cell| match cell {
            None => TableCell::from(format::ABSENT),
            Some(row) => {
                let ours = optional(row.ours.map(|ours| ours.value));
                TableCell::from(format!("{} | {ours}", printed(row.thesis)))
            }
        });
        let name = TableCell::from(*name);
        shown
            .rows
            .push(std::iter::once(name).chain(cells).collect());
    }
    Some(shown)
}

/// Returns the blocks of a claim with its places.
fn claim(table: &Reproduced, index: usize, expect: &Expect) -> Vec<Block> {
    let verdict = table.verdict(index);
    if verdict == ClaimVerdict::Shown && expect.explain.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![Block::Heading(format!(
        "{} ({}): {}",
        expect.says,
        claim_name(expect),
        verdict.word()
    ))];
    if !expect.reading.is_empty() {
        blocks.push(Block::Paragraph(expect.reading.clone()));
    }
    let columns = ["place", "thesis", "ours", ":verdict", ":why", ":counted"];
    let row = |row: &Row| {
        let place = [row.row.as_str(), row.column.as_str()];
        let place: Vec<&str> = place.into_iter().filter(|s| !s.is_empty()).collect();
        let counted = row.counted.iter();
        let counted = counted.map(|(title, value)| format!("{title} {}", format::number(*value)));
        [
            place.join(", ").into(),
            printed(row.thesis).into(),
            row.ours.map_or(format::ABSENT.to_owned(), interval).into(),
            verdict_cell(row.verdict),
            row.reason.as_str().into(),
            counted.collect::<Vec<_>>().join("; ").into(),
        ]
    };
    let shown = Table::of(
        how(table, expect),
        &columns,
        table.claims[index].iter().map(row),
    );
    blocks.extend(shown.into_block());
    blocks
}

/// Describes the comparison, with the unit if it has one.
fn how(table: &Reproduced, expect: &Expect) -> String {
    use raystone_config::expect::Compare;
    let figure = table.figure(&expect.figure);
    let with_unit = figure.map_or_else(|| expect.figure.clone(), |figure| figure.heading());
    let title = figure.map_or(expect.figure.as_str(), |figure| &figure.title);
    match expect.compare {
        Compare::Shown => format!("{with_unit}: shown"),
        Compare::Bound => with_unit,
        Compare::Ratio => format!("{title}: a ratio"),
        Compare::Order => format!("{title}: the least ratio of neighbours in the order"),
        Compare::Slope => format!("{title}: the exponent"),
    }
}

fn uncovered(not_covered: &NotCovered) -> Section {
    let mut section = Section::new("not-covered", "What is not tested");
    let tables = not_covered.table.iter();
    let tables = tables.map(|t| [&t.name, &t.title, &t.why].map(|text| text.as_str().into()));
    let caption = "Tables and figures that cannot be run yet";
    let tables = Table::of(caption, &["name", ":what", ":why"], tables);
    let claims = not_covered.claim.iter();
    let claims = claims.map(|c| [&c.source, &c.ids.join(", "), &c.why].map(|t| t.as_str().into()));
    let caption = "Claims that nothing tests";
    let claims = Table::of(caption, &["thesis", ":claims", ":why"], claims);
    section.blocks.extend(tables.into_block());
    section.blocks.extend(claims.into_block());
    section
}

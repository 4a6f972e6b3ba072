//! The essence of a report for the end of a run.

use super::data::RunData;
use super::document::{Check, Table, TableCell, Tone};
use super::samplers::Metric;
use super::sections::specs::{GAINS, TREES};
use super::sections::{
    animation, belief, compactions, kernels, measured, rendering, run, samplers, stress,
    structures, verdict,
};
use super::values::{of_structures, of_view};
use raystone_core::text::escape::visible;
use raystone_record::{Line, Verdict};

/// The screen or file that shows text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Screen {
    /// Columns of characters; `None` for a file or a pipe, where lines may have any length.
    pub width: Option<usize>,
    /// True if it shows colours.
    pub colour: bool,
}

/// Formats verdicts, speeds, errors and checks as aligned plain text of any width.
pub fn terminal_tables(records: &[Line]) -> String {
    Screen::default().tables(records)
}

/// Returns the failed checks with their findings: any is a failure of the run.
pub fn failed_checks(records: &[Line]) -> Vec<String> {
    let checks = belief::checks(&RunData::new(records)).into_iter();
    let failed = checks.filter(|check| check.verdict == Verdict::Fail);
    failed
        .map(|c| format!("{}: {}", c.title, c.detail))
        .collect()
}

impl Screen {
    /// Formats verdicts, speeds, errors and checks.
    pub fn tables(self, records: &[Line]) -> String {
        let data = RunData::new(records);
        let tables = tables(&data);
        let mut out = String::new();
        for table in tables.iter().filter(|table| !table.rows.is_empty()) {
            out += &(self.table(table) + "\n");
        }
        for line in data.scenes.iter().flat_map(rendering::disagreements) {
            out += &self.lines(&format!("warning: {line}"));
        }
        if data.run.is_some_and(|run| run.environment.software) {
            out += &self.lines("Software adapter: times compare structures on this adapter only.");
        }
        if let Some(text) = run::overhead(&data) {
            out += &self.lines(&text);
        }
        belief::checks(&data)
            .iter()
            .for_each(|check| out += &self.check(check));
        out
    }

    /// Formats a check, its verdict in colour if the screen has any: the word alone suffices.
    pub fn check(self, check: &Check) -> String {
        let text = self.lines(check.line().trim_end());
        let word = check.verdict.word();
        let tone = match check.verdict {
            Verdict::Pass => Tone::Good,
            Verdict::Fail => Tone::Bad,
            Verdict::Open => Tone::Note,
        };
        match text.strip_prefix(word) {
            Some(rest) => self.toned(word, tone) + rest,
            None => text,
        }
    }

    /// Colours a text by its tone, where the screen shows any.
    fn toned(self, text: &str, tone: Tone) -> String {
        let colour = match tone {
            Tone::Good => 32,
            Tone::Bad => 31,
            Tone::Note => 33,
            Tone::Plain => return text.to_owned(),
        };
        if self.colour && !text.is_empty() {
            format!("\u{1b}[{colour}m{text}\u{1b}[0m")
        } else {
            text.to_owned()
        }
    }

    /// Breaks a text into lines at the ends of words, with a break at its end.
    pub fn lines(self, text: &str) -> String {
        let text = visible(text);
        match self.width {
            None => text + "\n",
            Some(width) => wrapped(&text, width).join("\n") + "\n",
        }
    }

    /// Formats the table with columns padded to equal width; figures lose their intervals, which would not fit a
    /// terminal, except in tables of text. Where the lines are too long, heads and texts continue in the next line,
    /// and then columns continue below, beside the first one again: a figure is never cut.
    pub fn table(self, table: &Table) -> String {
        let grid = Grid::new(table);
        let mut out = self.lines(&table.caption.replace(" [95 % interval]", ""));
        match self.width {
            Some(width) if grid.natural().iter().sum::<usize>() > width => {
                let widths = grid.fitted(width);
                for columns in grid.blocks(&widths, width) {
                    out += &grid.block(&columns, &widths, self);
                }
            }
            _ => out += &grid.block(&Vec::from_iter(0..grid.columns()), &grid.natural(), self),
        }
        out
    }
}

/// Returns every table that the end of a run shows.
fn tables(data: &RunData) -> Vec<Table> {
    let against_original = kernels::against_original(data).into_iter();
    let mut tables: Vec<Table> = against_original.map(|(table, _)| table).collect();
    let names = &data.names;
    for scene in &data.scenes {
        let values = of_structures(data, scene);
        tables.push(structures::speed_table(names, scene, &values));
        tables.push(structures::outside_table(data, scene, &values));
        let of_frames = animation::values(data, scene);
        let bounds = animation::bounds(data, scene);
        tables.push(TREES.table(names, &of_frames, &[&bounds]));
        let mut of_views = Vec::new();
        for view in &scene.views {
            let values = of_view(data, scene, view);
            tables.push(samplers::error_table(names, view, &values, Metric::RelMse));
            tables.push(samplers::efficiency_table(names, view, &values));
            of_views.extend(values);
        }
        tables.push(GAINS.table(names, &of_views, &[scene.name]));
        tables.push(verdict::table(scene));
    }
    let values = compactions::values(data);
    tables.push(compactions::growth_table(data, &values));
    tables.push(compactions::table(data, &values));
    tables.extend(stress::tables(data));
    tables.extend(measured::tables(data));
    tables
}

/// Blanks between columns.
const GAP: usize = 2;
/// No text is broken into narrower columns than this.
const NARROWEST: usize = 12;

/// Texts of a table, its heads first, with their columns.
struct Grid {
    texts: Vec<Vec<String>>,
    /// Of the rows below the heads.
    tones: Vec<Vec<Tone>>,
    is_text: Vec<bool>,
}

impl Grid {
    fn new(table: &Table) -> Self {
        let wordy = table.columns.iter().filter(|column| column.text).count() > 2;
        let text = |cell: &TableCell| {
            if wordy {
                visible(&cell.flat())
            } else {
                visible(&cell.text)
            }
        };
        let heads = table.columns.iter().map(|column| visible(&column.title));
        let rows = table.rows.iter().map(|row| row.iter().map(text).collect());
        let tones = table.rows.iter();
        Self {
            tones: tones
                .map(|row| row.iter().map(|cell| cell.tone).collect())
                .collect(),
            texts: std::iter::once(heads.collect()).chain(rows).collect(),
            is_text: table.columns.iter().map(|column| column.text).collect(),
        }
    }

    fn columns(&self) -> usize {
        self.is_text.len()
    }

    /// Returns the greatest width of a column's cells, with or without its head.
    fn widest(&self, column: usize, with_head: bool) -> usize {
        let rows = self.texts.iter().skip(usize::from(!with_head));
        let cells = rows.filter_map(|row| row.get(column));
        cells.map(|text| width_of(text)).max().unwrap_or(0)
    }

    /// Widths of whole texts, each with the gap before it.
    fn natural(&self) -> Vec<usize> {
        let columns = 0..self.columns();
        let gap = |column| if column == 0 { 0 } else { GAP };
        columns.map(|c| gap(c) + self.widest(c, true)).collect()
    }

    /// Returns widths, with gaps, of columns whose heads are broken, and then of texts that are, the widest first,
    /// until the table fits or no text gets narrower.
    fn fitted(&self, width: usize) -> Vec<usize> {
        let natural = self.natural();
        let gap = |column| if column == 0 { 0 } else { GAP };
        let head = |column: usize| {
            let words = self.texts[0][column].split(' ').map(width_of);
            words.max().unwrap_or(0)
        };
        let least = |column| gap(column) + self.widest(column, false).max(head(column));
        let mut widths: Vec<usize> = (0..self.columns()).map(least).collect();
        let texts = || (0..self.columns()).filter(|column| self.is_text[*column]);
        while widths.iter().sum::<usize>() > width {
            let Some(widest) = texts().max_by_key(|column| widths[*column]) else {
                break;
            };
            if widths[widest] <= gap(widest) + NARROWEST {
                break;
            }
            widths[widest] -= 1;
        }
        // The remaining width goes back to the heads.
        let mut spare = width.saturating_sub(widths.iter().sum());
        for (wide, natural) in widths.iter_mut().zip(natural) {
            let more = natural.saturating_sub(*wide).min(spare);
            *wide += more;
            spare -= more;
        }
        widths
    }

    /// Returns the columns of each block: all, or as many as fit beside the first.
    fn blocks(&self, widths: &[usize], width: usize) -> Vec<Vec<usize>> {
        let mut blocks = Vec::new();
        let mut block = vec![0];
        let mut used = widths.first().copied().unwrap_or(0);
        for (column, wide) in widths.iter().copied().enumerate().skip(1) {
            if used + wide > width && block.len() > 1 {
                blocks.push(std::mem::replace(&mut block, vec![0]));
                used = widths[0];
            }
            block.push(column);
            used += wide;
        }
        blocks.push(block);
        blocks
    }

    fn tone(&self, row: usize, column: usize) -> Tone {
        let tones = row.checked_sub(1).and_then(|row| self.tones.get(row));
        let tone = tones.and_then(|tones| tones.get(column));
        tone.copied().unwrap_or_default()
    }

    /// Formats these columns: heads, a rule, rows.
    fn block(&self, columns: &[usize], widths: &[usize], screen: Screen) -> String {
        let inner = |column: usize| match column {
            0 => widths[0],
            _ => widths[column] - GAP,
        };
        let rule: usize = columns.iter().map(|column| widths[*column]).sum();
        let mut out = String::new();
        for (number, row) in self.texts.iter().enumerate() {
            let cell = |column: &usize| {
                let text = row.get(*column).map_or("", String::as_str);
                wrapped(text, inner(*column))
            };
            let cells: Vec<Vec<String>> = columns.iter().map(cell).collect();
            let height = cells.iter().map(Vec::len).max().unwrap_or(0);
            for line in 0..height {
                let mut parts = Vec::new();
                for (cell, column) in cells.iter().zip(columns) {
                    // Broken heads are aligned to the rule.
                    let from = if number == 0 { height - cell.len() } else { 0 };
                    let text = line.checked_sub(from).and_then(|at| cell.get(at));
                    let text = text.map_or("", String::as_str);
                    let blanks = " ".repeat(inner(*column).saturating_sub(width_of(text)));
                    let text = screen.toned(text, self.tone(number, *column));
                    parts.push(if self.is_text[*column] {
                        format!("{text}{blanks}")
                    } else {
                        format!("{blanks}{text}")
                    });
                }
                out += &(parts.join(&" ".repeat(GAP)).trim_end().to_owned() + "\n");
            }
            if number == 0 {
                out += &("─".repeat(rule) + "\n");
            }
        }
        out
    }
}

/// Returns the width of a text in cells of a terminal: two for a wide character of East Asia.
fn width_of(text: &str) -> usize {
    console::measure_text_width(text)
}

/// Breaks a text into lines of at most this width: at blanks, and inside of words that are longer.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let (mut lines, mut line) = (Vec::new(), String::new());
    for word in text.split(' ') {
        let joined = if line.is_empty() {
            word.to_owned()
        } else {
            format!("{line} {word}")
        };
        if width_of(&joined) <= width {
            line = joined;
            continue;
        }
        if !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        for c in word.chars() {
            line.push(c);
            if width_of(&line) > width && line.chars().count() > 1 {
                line.pop();
                lines.push(std::mem::replace(&mut line, c.to_string()));
            }
        }
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAIN: Screen = Screen {
        width: None,
        colour: false,
    };

    fn screen(width: usize) -> Screen {
        let width = Some(width);
        Screen { width, ..PLAIN }
    }

    fn wide_table() -> Table {
        let mut table = Table::new("speed", &["structure"]);
        for spp in 0..20 {
            table.add_column(format!("relMSE at {} spp", 1 << spp));
        }
        let row = |name: &str| {
            let figures = (0..20).map(|i| TableCell::from(format!("{}.25e-{i}", 7 + i)));
            std::iter::once(name.into()).chain(figures).collect()
        };
        table.rows.push(row("bvh"));
        table.rows.push(row(
            "a structure of a long name, builder=sweep, leaf_size=4, width=8",
        ));
        table
    }

    #[test]
    fn columns_line_up_and_figures_stand_right() {
        let mut table = Table::new("speed", &["structure", "Mrays/s"]);
        table
            .rows
            .push(vec!["bvh".into(), TableCell::with_detail("5.02", "[4, 6]")]);
        table.rows.push(vec!["uniform-grid λ".into(), "1".into()]);
        let text = PLAIN.table(&table);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[3], "bvh                5.02");
        assert_eq!(lines[4], "uniform-grid λ        1");
        // A table that fits is unchanged.
        assert_eq!(screen(80).table(&table), text);
    }

    #[test]
    fn a_table_fits_every_width_and_keeps_every_figure_whole() {
        let table = wide_table();
        for width in [40, 80, 120, 200] {
            let text = screen(width).table(&table);
            assert!(
                text.lines().all(|line| width_of(line) <= width),
                "{width}\n{text}"
            );
            for figure in table.rows.iter().flat_map(|row| &row[1..]) {
                let mut words = text.split_whitespace();
                assert!(
                    words.any(|word| word == figure.text),
                    "{width}: {}",
                    figure.text
                );
            }
            let words = text.split_whitespace();
            let of_name = words.filter(|word| *word == "structure").count();
            // Each block names its rows again.
            assert!(of_name >= 2, "{text}");
        }
        assert!(PLAIN.table(&table).lines().any(|line| width_of(line) > 200));
    }

    #[test]
    fn what_a_terminal_would_obey_is_shown_instead() {
        let mut table = Table::new("a\u{1b}]0;b", &["scene\u{7}"]);
        table.rows.push(vec!["x\u{1b}[2J\r".into()]);
        let text = PLAIN.table(&table);
        assert!(
            !text.contains(|c: char| c.is_control() && c != '\n'),
            "{text:?}"
        );
        assert!(text.contains("x[U+001B][2J[U+000D]"), "{text}");
    }

    #[test]
    fn colour_is_beside_the_words_and_only_where_it_is_shown() {
        let check = Check {
            verdict: Verdict::Fail,
            title: "t".into(),
            detail: "d".into(),
        };
        assert_eq!(PLAIN.check(&check), "FAIL  t: d\n");
        let coloured = Screen {
            colour: true,
            ..PLAIN
        };
        assert_eq!(coloured.check(&check), "\u{1b}[31mFAIL\u{1b}[0m  t: d\n");
        let mut table = Table::new("", &["gate", "time"]);
        let cell = TableCell::from("FAILED").toned(super::Tone::Bad);
        table
            .rows
            .extend([vec![cell, "1".into()], vec!["passed".into(), "2".into()]]);
        let row = |screen: Screen, row: usize| {
            screen.table(&table).lines().nth(3 + row).map(str::to_owned)
        };
        assert_eq!(
            row(coloured, 0).as_deref(),
            Some("\u{1b}[31mFAILED\u{1b}[0m     1")
        );
        // The columns are as wide as without.
        assert_eq!(row(coloured, 1), row(PLAIN, 1));
    }
}

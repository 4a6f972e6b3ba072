//! A comparison as text: for a terminal, as Markdown for a pull request, as JSON.

use super::judge::ChangeVerdict;
use super::{Comparison, Finding};
use crate::document::{Table, TableCell, Tone};
use crate::format;
use crate::terminal::Screen;
use raystone_core::text::escape::markdown as escaped;
use raystone_record::figure::Shown;
use raystone_record::{Interval, axis};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Greatest number of rows in the short table of a comment.
const MOST_ROWS: usize = 20;
/// Greatest number of listed findings that are undecided for the same reason.
const MOST_ALIKE: usize = 4;
/// GitHub's limit of 65,536 characters per comment.
const MOST_OF_COMMENT: usize = 65_536;
/// Greatest length of the verdict and of each note in a comment.
const MOST_OF_LINE: usize = 2_000;
/// Reserve for lines that count the rows cut, and for the mark by which continuous integration finds its comment.
const RESERVE: usize = 1_000;
/// Greatest number of characters of a fact's text; the records have it whole.
const MOST_CHARACTERS: usize = 40;

/// Verdicts listed first, in this order.
const NOTABLE: [ChangeVerdict; 5] = [
    ChangeVerdict::Worse,
    ChangeVerdict::Undecided,
    ChangeVerdict::Changed,
    ChangeVerdict::Better,
    ChangeVerdict::New,
];

/// Returns the overall verdict as one sentence.
pub fn verdict_line(comparison: &Comparison) -> String {
    let word = match comparison.verdict() {
        ChangeVerdict::Worse => "WORSE",
        ChangeVerdict::Undecided => "UNDECIDED",
        ChangeVerdict::Better => "BETTER",
        _ => "SAME",
    };
    let verdicts = NOTABLE
        .into_iter()
        .chain([ChangeVerdict::Same, ChangeVerdict::Told]);
    let counts = verdicts.map(|verdict| (verdict, comparison.count(verdict)));
    let counts = counts.filter(|(_, n)| *n > 0);
    let counts = counts.map(|(v, n)| format!("{} {}", format::count(n as u64), v.word()));
    let counts: Vec<String> = counts.collect();
    let [base, candidate] = &comparison.names;
    format!("{word}: {candidate} against {base}: {}", counts.join(", "))
}

/// Returns the axes on which the findings differ: shared labels need not be named each time.
fn varied(comparison: &Comparison) -> BTreeSet<String> {
    let mut first = std::collections::BTreeMap::new();
    let mut varied = BTreeSet::new();
    for (axis, label) in comparison.findings.iter().flat_map(|f| f.key.labels()) {
        if *first.entry(axis).or_insert(label) != label {
            varied.insert(axis.to_owned());
        }
    }
    // These axes are named even if they have only one label.
    varied.extend([axis::ACCEL, axis::SEQUENCE, axis::RAYS, axis::SUBJECT].map(str::to_owned));
    varied
}

/// Returns the cell in words.
fn cell(finding: &Finding, varied: &BTreeSet<String>) -> String {
    let labels = finding.key.labels();
    let known = labels.filter(|(axis, _)| varied.contains(*axis));
    let words = known.map(|(axis, label)| match axis {
        axis::RAYS => format!("{label} rays"),
        axis::SPP => format!("{label} spp"),
        axis::POINTS => format!("{label} points"),
        axis::KERNELS => format!("@{label}"),
        axis::OFFSET | axis::TRIANGLE | axis::BOX_TEST | axis::WORKGROUP | axis::LOAD => {
            format!("{axis} {label}")
        }
        _ => label.to_owned(),
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Returns the difference with its interval, in the figure's own direction.
pub(crate) fn change(finding: &Finding) -> String {
    let Some(measured) = finding.measured else {
        return exact_change(finding).unwrap_or_default();
    };
    let Interval { value, low, high } = measured.change;
    let absolute = finding.figure.shown == Shown::Exponent;
    let number = |x: f64| match absolute {
        _ if !x.is_finite() => if x > 0.0 { "∞" } else { "−∞" }.to_owned(),
        true => format!("{x:+.3}").replace('-', "−"),
        false => format!("{:+.1}", 100.0 * x).replace('-', "−"),
    };
    let unit = if absolute { "" } else { " %" };
    let [value, low, high] = [value, low, high].map(number);
    format!("{value}{unit} [{low}, {high}]")
}

/// Returns the fraction by which an exact figure changed, where both are plain numbers.
fn exact_change(finding: &Finding) -> Option<String> {
    let change = finding.exact_change?;
    let text = match change.abs() {
        x if x < 1e-3 => format!("{:+.1e} %", 100.0 * change),
        _ => format!("{:+.2} %", 100.0 * change),
    };
    Some(text.replace('-', "−"))
}

fn values(finding: &Finding) -> String {
    let [old, new] = finding.shown.each_ref().map(|side| match side {
        Some(text) => shortened(text),
        None => format::ABSENT.to_owned(),
    });
    format!("{old} → {new}")
}

/// Returns the findings of a verdict, and the numbers of those left out because they are undecided for the same reason.
fn listed(
    comparison: &Comparison,
    verdict: ChangeVerdict,
) -> (Vec<&Finding>, Vec<(String, usize)>) {
    let mut seen = std::collections::BTreeMap::<&str, usize>::new();
    let mut kept = Vec::new();
    for finding in comparison.findings.iter().filter(|f| f.verdict == verdict) {
        let alike = seen.entry(&finding.why).or_default();
        *alike += 1;
        if verdict == ChangeVerdict::Worse || finding.measured.is_some() || *alike <= MOST_ALIKE {
            kept.push(finding);
        }
    }
    let is_shown = |why: &str| {
        let mut measured = kept.iter().filter(|f| f.measured.is_some());
        verdict == ChangeVerdict::Worse || measured.any(|f| f.why == why)
    };
    let more = seen
        .into_iter()
        .filter(|(why, n)| *n > MOST_ALIKE && !is_shown(why));
    let more = more
        .map(|(why, n)| (why.to_owned(), n - MOST_ALIKE))
        .collect();
    (kept, more)
}

/// Returns the text for a terminal: a table of changes first, the verdict last, where it stays visible.
pub fn terminal(comparison: &Comparison, screen: Screen) -> String {
    let (table, reasons, more) = changes(comparison);
    let notes = comparison.notes.iter().map(|note| format!("note: {note}"));
    let mut out: String = notes.map(|note| screen.lines(&note)).collect();
    if !table.rows.is_empty() {
        out += &screen.table(&table);
    }
    for (number, why) in reasons.iter().enumerate() {
        out += &screen.lines(&format!("({}) {why}", number + 1));
    }
    out.extend(more.iter().map(|line| screen.lines(line)));
    if comparison.tests > 0 {
        out += &screen.lines(&of_tests(comparison));
    }
    out + &screen.lines(&verdict_line(comparison))
}

/// Returns the table of findings that are not the same, the numbered reasons of its last column, and notes on omissions.
fn changes(comparison: &Comparison) -> (Table, Vec<&str>, Vec<String>) {
    let varied = varied(comparison);
    let heads = [
        "verdict",
        ":figure",
        "change [95 %]",
        ":base → candidate",
        ":cell",
        "why",
    ];
    let mut table = Table::new("What is not the same", &heads);
    let (mut reasons, mut more) = (Vec::new(), Vec::new());
    for verdict in NOTABLE {
        let (kept, left_out) = listed(comparison, verdict);
        for f in kept {
            let why = match reasons.iter().position(|known| *known == f.why) {
                _ if f.why.is_empty() => String::new(),
                Some(at) => format!("({})", at + 1),
                None => {
                    reasons.push(&*f.why);
                    format!("({})", reasons.len())
                }
            };
            table.rows.push(vec![
                TableCell::from(verdict.word()).toned(tone(verdict)),
                f.figure.title.as_ref().into(),
                change(f).into(),
                values(f).into(),
                cell(f, &varied).into(),
                why.into(),
            ]);
        }
        let lines = left_out.into_iter();
        more.extend(lines.map(|(why, n)| match &*why {
            "" => format!("{n} more {}", verdict.word()),
            why => format!("{n} more {}: {why}", verdict.word()),
        }));
    }
    (table, reasons, more)
}

fn tone(verdict: ChangeVerdict) -> Tone {
    match verdict {
        ChangeVerdict::Worse => Tone::Bad,
        ChangeVerdict::Better => Tone::Good,
        ChangeVerdict::Undecided => Tone::Note,
        _ => Tone::Plain,
    }
}

/// Describes the number of tests and the error rate of the verdicts.
fn of_tests(comparison: &Comparison) -> String {
    format!(
        "{} tested together; of those called better or worse at most {} is expected to be false.",
        format::plural(comparison.tests, "difference"),
        format::percent(comparison.alpha)
    )
}

/// Shortens a text to [`MOST_CHARACTERS`].
fn shortened(text: &str) -> String {
    if text.chars().count() <= MOST_CHARACTERS {
        return text.to_owned();
    }
    let kept = text.chars().take(MOST_CHARACTERS - 1);
    kept.chain(['…']).collect()
}

/// Returns a comment: a line with the verdict, a short table, everything else folded. Beyond the limit of a comment, rows
/// at the end are cut, those that are the same first, and then notes; the text counts the cut ones.
pub fn markdown(comparison: &Comparison) -> String {
    let sign = match comparison.verdict() {
        ChangeVerdict::Worse => "❌",
        ChangeVerdict::Undecided => "❔",
        _ => "✅",
    };
    let mut comment = Comment {
        varied: varied(comparison),
        text: format!("### {sign} {}\n", line(&verdict_line(comparison))),
        left: MOST_OF_COMMENT - RESERVE,
    };
    let end = format!("\n{}\n", of_tests(comparison));
    comment.left -= comment.text.len() + end.len();
    let decided = [
        ChangeVerdict::Worse,
        ChangeVerdict::Better,
        ChangeVerdict::Changed,
    ];
    let decisive = |f: &&Finding| decided.contains(&f.verdict);
    let mut first: Vec<&Finding> = comparison.findings.iter().filter(decisive).collect();
    // Worse findings come before the others, in the order of the findings.
    first.sort_by_key(|f| f.verdict != ChangeVerdict::Worse);
    let table = comment.rows(&first[..first.len().min(MOST_ROWS)]);
    comment.notes(&comparison.notes);
    let kept = comment.table(table);
    if first.len() > kept {
        comment.text += &format!("\n… and {} more below.\n", first.len() - kept);
    }
    let others = |f: &&Finding| f.verdict != ChangeVerdict::Same && !decisive(f);
    let all = comparison.findings.iter();
    let rest = first
        .into_iter()
        .skip(kept)
        .chain(all.clone().filter(others));
    comment.folded("Open, new and told", &rest.collect::<Vec<_>>());
    let same = all.filter(|f| f.verdict == ChangeVerdict::Same && f.measured.is_some());
    let title = "Known to be the same within the effect that counts, and controls";
    comment.folded(title, &same.collect::<Vec<_>>());
    comment.text + &end
}

/// Returns a text in one line, shortened to the limit of a line.
fn line(text: &str) -> String {
    let whole = escaped(text);
    if whole.len() <= MOST_OF_LINE {
        return whole;
    }
    // The longest escape of a character.
    let longest = escaped("\u{202e}").len();
    let kept: String = text.chars().take(MOST_OF_LINE / longest).collect();
    escaped(&kept) + "…"
}

/// A comment that is being written.
struct Comment {
    varied: BTreeSet<String>,
    text: String,
    /// Remaining bytes.
    left: usize,
}

const HEAD: &str = "\n| verdict | cell | figure | base → candidate | change [95 %] | why |\n|:---|:---|:---|:---|:---|:---|\n";

impl Comment {
    /// Reserves room for a text; `false` if there is too little.
    fn takes(&mut self, text: &str) -> bool {
        let left = self.left.checked_sub(text.len());
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// Adds as many of these notes as there is room for.
    fn notes(&mut self, notes: &[String]) {
        for (index, note) in notes.iter().enumerate() {
            let text = format!("\n> {}\n", line(note));
            if !self.takes(&text) {
                self.text += &format!("\n> … and {} more notes.\n", notes.len() - index);
                return;
            }
            self.text += &text;
        }
    }

    /// Returns rows of as many of these findings as there is room for.
    fn rows(&mut self, findings: &[&Finding]) -> Vec<String> {
        if findings.is_empty() || !self.takes(HEAD) {
            return Vec::new();
        }
        let row = |f: &&Finding| {
            let cells = [
                f.verdict.word().to_owned(),
                cell(f, &self.varied),
                f.figure.heading(),
                values(f),
                change(f),
                f.why.clone(),
            ];
            format!("| {} |\n", cells.map(|text| line(&text)).join(" | "))
        };
        let rows: Vec<String> = findings.iter().map(row).collect();
        rows.into_iter().take_while(|row| self.takes(row)).collect()
    }

    /// Writes rows below their head and returns their number.
    fn table(&mut self, rows: Vec<String>) -> usize {
        if !rows.is_empty() {
            self.text += HEAD;
            self.text += &rows.concat();
        }
        rows.len()
    }

    fn folded(&mut self, title: &str, findings: &[&Finding]) {
        let count = findings.len();
        let open = format!("\n<details><summary>{title} ({count})</summary>\n");
        let close = "\n</details>\n";
        if findings.is_empty() {
            return;
        }
        let rows = if self.takes(&open) && self.takes(close) {
            self.rows(findings)
        } else {
            Vec::new()
        };
        let more = match count - rows.len() {
            0 => String::new(),
            n => format!("\n… and {n} more: see the terminal's table or --json.\n"),
        };
        if rows.is_empty() {
            self.text += &format!("\n{title}: {more}");
            return;
        }
        self.text += &open;
        self.table(rows);
        self.text += &(more + close);
    }
}

/// Returns the comparison as JSON for other programs.
pub fn json(comparison: &Comparison) -> Value {
    let finding = |f: &Finding| {
        let key = f
            .key
            .labels()
            .map(|(axis, label)| (axis.to_owned(), label.into()));
        let key: serde_json::Map<String, Value> = key.collect();
        // Without bounds there is no number in JSON.
        let finite = |x: f64| x.is_finite().then_some(x);
        json!({
            "key": key,
            "figure": f.figure.id,
            "verdict": f.verdict,
            "why": f.why,
            "base": f.shown[0],
            "candidate": f.shown[1],
            "change": f.measured.map(|m| m.change.value).or(f.exact_change).and_then(finite),
            "low": f.measured.and_then(|m| finite(m.change.low)),
            "high": f.measured.and_then(|m| finite(m.change.high)),
            "p": f.measured.and_then(|m| finite(m.p)),
            "margin": f.measured.map(|m| m.margin),
            "control": f.is_control,
        })
    };
    json!({
        "verdict": comparison.verdict(),
        "base": comparison.names[0],
        "candidate": comparison.names[1],
        "notes": comparison.notes,
        "alpha": comparison.alpha,
        "tests": comparison.tests,
        "findings": comparison.findings.iter().map(finding).collect::<Vec<_>>(),
    })
}

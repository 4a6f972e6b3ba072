//! A comparison as text: for a terminal of some width, as Markdown for a pull request, as JSON.

use super::judge::Verdict;
use super::{Comparison, Finding};
use crate::measure::figure::Shown;
use crate::measure::record::{Interval, axis};
use crate::report::format;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Rows of the short table of a comment.
const MOST_ROWS: usize = 20;
/// Findings that stay open for the same reason are listed up to this many.
const MOST_ALIKE: usize = 4;
/// A comment of GitHub has 65,536 characters at most; details beyond this are counted.
const MOST_DETAILS: usize = 40_000;
/// From this width on the values themselves are shown beside the change.
const WIDE: usize = 100;

/// Verdicts that a reader looks at first, in this order.
const NOTABLE: [Verdict; 5] = [
    Verdict::Worse,
    Verdict::Undecided,
    Verdict::Changed,
    Verdict::Better,
    Verdict::New,
];

/// One sentence: what it comes to.
pub fn verdict_line(comparison: &Comparison) -> String {
    let word = match comparison.verdict() {
        Verdict::Worse => "WORSE",
        Verdict::Undecided => "UNDECIDED",
        Verdict::Better => "BETTER",
        _ => "SAME",
    };
    let verdicts = NOTABLE.into_iter().chain([Verdict::Same, Verdict::Told]);
    let counts: Vec<String> = verdicts
        .filter(|verdict| comparison.count(*verdict) > 0)
        .map(|verdict| {
            format!(
                "{} {}",
                format::count(comparison.count(verdict) as u64),
                verdict.word()
            )
        })
        .collect();
    let [base, candidate] = comparison.names.each_ref().map(|name| plain(name));
    format!("{word}: {candidate} against {base}: {}", counts.join(", "))
}

/// Text without what a terminal or a page would act on: control characters, and those that turn the direction of text.
fn plain(text: &str) -> String {
    let acts = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
    };
    text.chars()
        .map(|c| if acts(c) { '\u{fffd}' } else { c })
        .collect()
}

/// Axes on which the findings differ: what all share need not be named each time.
fn varied(comparison: &Comparison) -> BTreeSet<String> {
    let mut first = std::collections::BTreeMap::new();
    let mut varied = BTreeSet::new();
    for (axis, label) in comparison.findings.iter().flat_map(|f| f.key.labels()) {
        if *first.entry(axis).or_insert(label) != label {
            varied.insert(axis.to_owned());
        }
    }
    // What is measured of several things is named by one of them even if it is the only one.
    varied.extend([axis::ACCEL, axis::SEQUENCE, axis::RAYS, axis::SUBJECT].map(str::to_owned));
    varied
}

/// The cell in words.
fn cell(finding: &Finding, varied: &BTreeSet<String>) -> String {
    let known = finding
        .key
        .labels()
        .filter(|(axis, _)| varied.contains(*axis));
    let words = known.map(|(axis, label)| match axis {
        axis::RAYS => format!("{label} rays"),
        axis::SPP => format!("{label} spp"),
        axis::POINTS => format!("{label} points"),
        axis::KERNELS => format!("@{label}"),
        axis::OFFSET | axis::TRIANGLE | axis::BOX_TEST | axis::WORKGROUP => {
            format!("{axis} {label}")
        }
        _ => label.to_owned(),
    });
    plain(&words.collect::<Vec<_>>().join(", "))
}

/// The difference with its interval, in the figure's own direction.
fn change(finding: &Finding) -> String {
    let Some(measured) = finding.measured else {
        return exact_change(finding).unwrap_or_default();
    };
    let Interval { value, low, high } = measured.change;
    let absolute = finding.figure.shown == Shown::Exponent;
    let number = |x: f64| match (x.is_finite(), absolute) {
        (false, _) => {
            if x > 0.0 {
                "∞".into()
            } else {
                "−∞".to_owned()
            }
        }
        (true, true) => format!("{x:+.3}").replace('-', "−"),
        (true, false) => format!("{:+.1}", 100.0 * x).replace('-', "−"),
    };
    let unit = if absolute { "" } else { " %" };
    format!(
        "{}{unit} [{}, {}]",
        number(value),
        number(low),
        number(high)
    )
}

/// The part by which an exact figure changed, where both are plain numbers.
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
        Some(text) => plain(&text.chars().take(40).collect::<String>()),
        None => format::ABSENT.to_owned(),
    });
    format!("{old} → {new}")
}

/// Those of a verdict, and how many others were left out because they stay open for the same reason.
fn listed(comparison: &Comparison, verdict: Verdict) -> (Vec<&Finding>, Vec<(String, usize)>) {
    let mut seen = std::collections::BTreeMap::<&str, usize>::new();
    let mut kept = Vec::new();
    for finding in comparison.findings.iter().filter(|f| f.verdict == verdict) {
        let alike = seen.entry(&finding.why).or_default();
        *alike += 1;
        if verdict == Verdict::Worse || finding.measured.is_some() || *alike <= MOST_ALIKE {
            kept.push(finding);
        }
    }
    let more = seen.into_iter().filter(|(why, n)| {
        *n > MOST_ALIKE
            && !comparison
                .findings
                .iter()
                .any(|f| f.why == **why && f.measured.is_some() && f.verdict == verdict)
    });
    let more = more
        .map(|(why, n)| (why.to_owned(), n - MOST_ALIKE))
        .collect();
    (
        kept,
        if verdict == Verdict::Worse {
            Vec::new()
        } else {
            more
        },
    )
}

/// What changed first, as a table of at most so many columns; the verdict comes last, where a terminal ends.
pub fn terminal(comparison: &Comparison, width: usize) -> String {
    let varied = varied(comparison);
    let heads = [
        "verdict",
        "figure",
        "change [95 %]",
        "base → candidate",
        "cell",
    ]
    .map(str::to_owned);
    let mut rows: Vec<([String; 5], String)> = vec![(heads, String::new())];
    let mut more = Vec::new();
    for verdict in NOTABLE {
        let (kept, left_out) = listed(comparison, verdict);
        rows.extend(kept.into_iter().map(|f| {
            let row = [
                verdict.word().into(),
                plain(&f.figure.title),
                change(f),
                values(f),
                cell(f, &varied),
            ];
            (row, plain(&f.why))
        }));
        more.extend(
            left_out
                .into_iter()
                .map(|(why, n)| format!("{n} more {}: {}", verdict.word(), plain(&why))),
        );
    }
    let mut out = String::new();
    for note in &comparison.notes {
        out += &wrapped(&format!("note: {}", plain(note)), width, "      ");
    }
    if rows.len() > 1 {
        out += &table(&rows, width);
    }
    for line in more {
        out += &wrapped(&line, width, "  ");
    }
    let tests = comparison.tests;
    if tests > 0 {
        let text = format!(
            "{} tested together; of those called better or worse at most {} is expected to be false.",
            format::plural(tests, "difference"),
            format::percent(comparison.alpha)
        );
        out += &wrapped(&text, width, "");
    }
    out + &wrapped(&verdict_line(comparison), width, "  ")
}

/// Rows as columns, each with its reason below where that is not the one above.
fn table(rows: &[([String; 5], String)], width: usize) -> String {
    let columns: &[usize] = if width >= WIDE {
        &[0, 1, 2, 3]
    } else {
        &[0, 1, 2]
    };
    let most = |column: usize| if column == 3 { 28 } else { 30 };
    let size = |column: usize| {
        let sizes = rows.iter().map(|(row, _)| row[column].chars().count());
        sizes.max().unwrap_or(0).min(most(column))
    };
    let sizes: Vec<usize> = columns.iter().map(|c| size(*c)).collect();
    let left = sizes.iter().sum::<usize>() + 2 * sizes.len();
    let mut out = String::new();
    let mut last = "";
    for (row, why) in rows {
        let cells = columns.iter().zip(&sizes);
        let cells = cells.map(|(c, size)| format!("{:<size$}  ", shortened(&row[*c], *size)));
        let text = cells.collect::<String>() + &row[4];
        out += &wrapped(&text, width, &" ".repeat(left.min(width / 2)));
        if !why.is_empty() && why != last {
            out += &wrapped(&format!("  ({why})"), width, "   ");
        }
        last = why;
    }
    out
}

/// A text of at most so many characters.
fn shortened(text: &str, most: usize) -> String {
    match text.chars().count() > most {
        true => text
            .chars()
            .take(most.saturating_sub(1))
            .chain(['…'])
            .collect(),
        false => text.to_owned(),
    }
}

/// Lines of at most so many characters, broken between words, the later ones behind `indent`. Spaces in columns stay.
fn wrapped(text: &str, width: usize, indent: &str) -> String {
    let mut out = String::new();
    let mut line = String::new();
    for word in text.split_inclusive(' ') {
        let long = line.chars().count() + word.trim_end().chars().count() > width;
        if long && !line.trim().is_empty() {
            out += line.trim_end();
            out.push('\n');
            line = indent.to_owned();
        }
        line += word;
    }
    out + line.trim_end() + "\n"
}

/// As a comment: a line of verdict, a short table, everything else folded.
pub fn markdown(comparison: &Comparison) -> String {
    let varied = varied(comparison);
    let sign = match comparison.verdict() {
        Verdict::Worse => "❌",
        Verdict::Undecided => "❔",
        _ => "✅",
    };
    let mut out = format!("### {sign} {}\n", escaped(&verdict_line(comparison)));
    let notes = comparison
        .notes
        .iter()
        .map(|note| format!("\n> {}\n", escaped(note)));
    out.extend(notes);
    let decisive = |f: &&Finding| {
        matches!(
            f.verdict,
            Verdict::Worse | Verdict::Better | Verdict::Changed
        )
    };
    let first: Vec<&Finding> = comparison.findings.iter().filter(decisive).collect();
    out += &rows(&first[..first.len().min(MOST_ROWS)], &varied);
    if first.len() > MOST_ROWS {
        out += &format!("\n… and {} more below.\n", first.len() - MOST_ROWS);
    }
    let others = |f: &&Finding| f.verdict != Verdict::Same && !decisive(f);
    let rest: Vec<&Finding> = first
        .into_iter()
        .skip(MOST_ROWS)
        .chain(comparison.findings.iter().filter(others))
        .collect();
    out += &folded("Open, new and told", &rest, &varied);
    let same: Vec<&Finding> = comparison
        .findings
        .iter()
        .filter(|f| f.verdict == Verdict::Same && f.measured.is_some())
        .collect();
    out += &folded(
        "Known to be the same within the effect that counts, and controls",
        &same,
        &varied,
    );
    out + &format!(
        "\n{} tested together; of those called better or worse at most {} is expected to be false.\n",
        format::plural(comparison.tests, "difference"),
        format::percent(comparison.alpha)
    )
}

fn folded(title: &str, findings: &[&Finding], varied: &BTreeSet<String>) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let mut kept = findings.len();
    let mut text = rows(findings, varied);
    while text.len() > MOST_DETAILS {
        kept /= 2;
        text = rows(&findings[..kept], varied);
    }
    let more = match findings.len() - kept {
        0 => String::new(),
        n => format!("\n… and {n} more: see the terminal's table or --json.\n"),
    };
    format!(
        "\n<details><summary>{title} ({})</summary>\n{text}{more}\n</details>\n",
        findings.len()
    )
}

fn rows(findings: &[&Finding], varied: &BTreeSet<String>) -> String {
    if findings.is_empty() {
        return String::new();
    }
    let mut out = "\n| verdict | cell | figure | base → candidate | change [95 %] | why |\n|:---|:---|:---|:---|:---|:---|\n".to_owned();
    for f in findings {
        let cells = [
            f.verdict.word().to_owned(),
            cell(f, varied),
            f.figure.heading(),
            values(f),
            change(f),
            f.why.clone(),
        ];
        let cells = cells.map(|text| escaped(&text));
        out += &format!("| {} |\n", cells.join(" | "));
    }
    out
}

/// Text that a page of Markdown shows as it is: no markup, no tags, no mention of a person or an issue.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Pages make links of addresses.
    for c in plain(text).replace("://", ":\u{2060}//").chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '@' => out += "&#64;",
            '#' => out += "&#35;",
            '\\' | '`' | '*' | '_' | '|' | '[' | ']' | '~' | '!' | '$' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}

/// For other programs.
pub fn json(comparison: &Comparison) -> Value {
    let finding = |f: &Finding| {
        let key: serde_json::Map<String, Value> = f
            .key
            .labels()
            .map(|(axis, label)| (axis.to_owned(), label.into()))
            .collect();
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

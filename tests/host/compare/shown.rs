//! Output for readers.

use super::compared;
use super::records::Made;
use raystone::compare::judge::ChangeVerdict;
use raystone::compare::show::{json, markdown, terminal, verdict_line};
use raystone::compare::side::Side;
use raystone::measure::record::{Body, axis};
use raystone::report::terminal::Screen;

const HOSTILE: &str = "\u{1b}[31mred\u{1b}[0m | <script>alert(1)</script> @someone #1 ![x](http://x) `\n# head \u{202e}";

fn screen(width: usize) -> Screen {
    Screen {
        width: Some(width),
        colour: false,
    }
}

fn hostile() -> [Side; 2] {
    let base = Made::default();
    let named = |sah: f64| {
        let mut lines = base.lines();
        for line in &mut lines {
            if line.key.label(axis::ACCEL) == "structure-3" {
                line.key = line.key.clone().with(axis::ACCEL, HOSTILE);
                if let Body::Structure(record) = &mut line.body {
                    record.stats.sah_cost = Some(sah);
                }
            }
        }
        Side::new(HOSTILE, lines, vec![HOSTILE.into()])
    };
    [named(12.5), named(13.0)]
}

#[test]
fn hostile_names_are_inert() {
    let [base, candidate] = hostile();
    let found = compared(&base, &candidate);
    assert_eq!(found.verdict(), ChangeVerdict::Worse);
    for width in [60, 80, 120] {
        let text = terminal(&found, screen(width));
        assert!(!text.contains(['\u{1b}', '\u{202e}', '\r']), "{text}");
        assert!(text.contains("[31mred"), "{text}");
    }
    let comment = markdown(&found);
    let bad = [
        "<script", "@someone", "#1 ", "![x]", "http://", "\n# head", "\u{1b}",
    ];
    for bad in bad {
        assert!(!comment.contains(bad), "{bad} in {comment}");
    }
    // Rows stay rows.
    let rows: Vec<&str> = comment
        .lines()
        .filter(|line| line.starts_with("| worse"))
        .collect();
    assert_eq!(rows.len(), 1);
    let bars = rows[0].replace("\\|", "").matches('|').count();
    assert_eq!(bars, 7, "{}", rows[0]);
    let text = json(&found).to_string();
    assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok() && !text.contains('\u{1b}'));
}

#[test]
fn lines_fit_the_width_and_the_worst_comes_first() {
    let base = Made::default();
    let candidate = Made {
        worse: |sampler| if sampler == 2 { 1.01 } else { 1.0 },
        ..base.clone()
    };
    let found = compared(&base.side(), &candidate.side());
    for width in [80, 120] {
        let text = terminal(&found, screen(width));
        let longest = text.lines().map(|line| line.chars().count()).max();
        assert!(longest <= Some(width), "{longest:?}: {text}");
    }
    let text = terminal(&found, screen(120));
    let first = text
        .lines()
        .skip_while(|line| !line.starts_with("verdict"))
        .nth(2);
    assert!(
        first.is_some_and(|line| line.starts_with("worse") && line.ends_with("(1)")),
        "{text}"
    );
    assert!(text.contains("\n(1) pairs of equal seeds\n"), "{text}");
    // Coloured on request.
    let coloured = Screen {
        colour: true,
        ..screen(120)
    };
    assert!(!text.contains('\u{1b}'));
    assert!(terminal(&found, coloured).contains("\n\u{1b}[31mworse\u{1b}[0m "));
    assert!(verdict_line(&found).starts_with("WORSE: "));
    let value = json(&found);
    assert_eq!(value["verdict"], "worse");
    assert_eq!(
        value["findings"].as_array().map(Vec::len),
        Some(found.findings.len())
    );
}

#[test]
fn a_comment_stays_below_what_a_pull_request_takes() {
    let base = Made {
        structures: 400,
        ..Made::default()
    };
    let mut other = base.side();
    for line in &mut other.lines {
        if let Body::Structure(record) = &mut line.body {
            record.stats.sah_cost = Some(13.0);
            record.stats.nodes += 1;
        }
    }
    let text = markdown(&compared(&base.side(), &other));
    assert!(text.len() < 65_536, "{}", text.len());
    assert!(
        text.contains("… and ") && text.contains("<details>"),
        "{text}"
    );
}

#[test]
fn a_comment_holds_the_verdict_and_the_worst_however_much_there_is_to_say() {
    let base = Made {
        structures: 400,
        ..Made::default()
    };
    let mut other = base.side();
    for line in &mut other.lines {
        if let Body::Structure(record) = &mut line.body {
            record.stats.nodes += 1;
        }
    }
    let mut found = compared(&base.side(), &other);
    // Both folded sections are full, reasons and notes are long, and worse findings come last.
    let mut same = found.findings.clone();
    for (index, finding) in same.iter_mut().enumerate() {
        finding.verdict = [ChangeVerdict::Same, ChangeVerdict::Undecided][index % 2];
        finding.why = format!("@ {index} ").repeat(20);
    }
    found.findings.extend(same);
    let mut worst = found.findings[0].clone();
    (worst.verdict, worst.why) = (ChangeVerdict::Worse, "the worst".to_owned());
    found.findings.push(worst);
    for count in [0, 60] {
        found.notes.resize(count, "&\u{202e}".repeat(3000));
        for name in ["candidate".to_owned(), "<".repeat(40_000)] {
            found.names[1] = name;
            let text = markdown(&found);
            // The comment's name is preceded by a mark.
            assert!(text.len() <= 65_536 - 400, "{}", text.len());
            assert!(text.starts_with("### ❌ WORSE: "), "{}", &text[..40]);
            assert!(text.contains("| the worst |"), "the worst is cut");
            assert!(text.trim_end().ends_with("is expected to be false."));
            assert_eq!(text.contains(" more notes."), count > 0);
            let [open, closed] = ["<details>", "</details>"].map(|tag| text.matches(tag).count());
            assert_eq!(open, closed);
            assert!(
                text.contains(" more below.") && text.contains(" more: see the terminal's table")
            );
        }
    }
}

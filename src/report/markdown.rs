//! The document as Markdown.

use super::document::*;
use std::fmt::Write;

/// The summary: everything but the pictures, with plots linked under `plots/`.
pub fn summary(document: &Document) -> String {
    let mut out = format!(
        "# {}\n\n{}\n",
        escape(&document.title),
        escape(&document.subtitle)
    );
    for banner in &document.banners {
        push(&mut out, format_args!("\n> **{}**\n", escape(&banner.text)));
    }
    for section in &document.sections {
        push(&mut out, format_args!("\n## {}\n", escape(&section.title)));
        for block in &section.blocks {
            out.push('\n');
            push_block(&mut out, block);
        }
    }
    out
}

fn push_block(out: &mut String, block: &Block) {
    match block {
        Block::Heading(text) => push(out, format_args!("### {}\n", escape(text))),
        Block::Paragraph(text) => push(out, format_args!("{}\n", escape(text))),
        Block::Verbatim(text) => {
            // A fence longer than any in the text.
            let fence = "`".repeat(longest_run(text, '`').max(2) + 1);
            push(out, format_args!("{fence}\n{}\n{fence}\n", text.trim_end()));
        }
        Block::Checks(checks) => {
            for check in checks {
                let (title, detail) = (escape(&check.title), escape(&check.detail));
                push(
                    out,
                    format_args!("- **{}** {title}: {detail}\n", check.verdict.word()),
                );
            }
        }
        Block::Table(table) => push_table(out, table),
        Block::Figures(figures) => {
            for figure in figures {
                push(
                    out,
                    format_args!(
                        "![{}](plots/{}.png)\n\n",
                        escape(&figure.caption),
                        figure.name
                    ),
                );
            }
        }
        Block::Gallery(gallery) => {
            push(out, format_args!("{}:\n\n", escape(&gallery.caption)));
            for item in &gallery.items {
                let caption = escape(&item.caption);
                match item.data {
                    Some(_) => push(out, format_args!("- [{caption}](<{}>)\n", item.path)),
                    None => push(
                        out,
                        format_args!("- {caption}: {}\n", escape(&item.missing)),
                    ),
                }
            }
        }
    }
}

fn push_table(out: &mut String, table: &Table) {
    push(out, format_args!("{}\n\n|", escape(&table.caption)));
    for column in &table.columns {
        push(out, format_args!(" {} |", escape(&column.title)));
    }
    out.push_str("\n|");
    for column in &table.columns {
        out.push_str(if column.text { ":---|" } else { "---:|" });
    }
    for row in &table.rows {
        out.push_str("\n|");
        for cell in row {
            let text = escape(&cell.flat());
            match cell.tone {
                Tone::Good | Tone::Bad => push(out, format_args!(" **{text}** |")),
                _ => push(out, format_args!(" {text} |")),
            }
        }
    }
    out.push('\n');
}

/// Text that Markdown shows as it is.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' => escaped.push(' '),
            '\\' | '`' | '*' | '_' | '<' | '>' | '|' | '[' | ']' | '#' => escaped.extend(['\\', c]),
            c => escaped.push(c),
        }
    }
    escaped
}

fn longest_run(text: &str, wanted: char) -> usize {
    text.split(|c| c != wanted).map(str::len).max().unwrap_or(0)
}

fn push(out: &mut String, arguments: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = out.write_fmt(arguments);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_a_table() {
        let mut table = Table::new("t", &["a", "b"]);
        table
            .rows
            .push(vec!["x|y<b>".into(), Cell::from("FAILED").toned(Tone::Bad)]);
        let mut out = String::new();
        push_table(&mut out, &table);
        assert!(out.ends_with("| x\\|y\\<b\\> | **FAILED** |\n"), "{out}");
    }

    #[test]
    fn a_fence_is_longer_than_any_inside() {
        let mut out = String::new();
        push_block(&mut out, &Block::Verbatim("a ```` b".into()));
        assert!(out.starts_with("`````\n"));
    }
}

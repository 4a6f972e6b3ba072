//! The document as Markdown.

use super::document::*;
use raystone_core::text::escape::markdown as escape;

/// Returns the summary: everything but the pictures, with plots linked under `plots/`.
pub fn summary(document: &Document) -> String {
    let (title, subtitle) = (escape(&document.title), escape(&document.subtitle));
    let mut out = format!("# {title}\n\n{subtitle}\n");
    for banner in &document.banners {
        out += &format!("\n> **{}**\n", escape(&banner.text));
    }
    for section in &document.sections {
        out += &format!("\n## {}\n", escape(&section.title));
        for content in &section.blocks {
            out += &format!("\n{}", block(content));
        }
    }
    out
}

fn block(of: &Block) -> String {
    match of {
        Block::Heading(text) => format!("### {}\n", escape(text)),
        Block::Fold(fold) => {
            let note = if fold.note.is_empty() {
                String::new()
            } else {
                format!("{}\n", escape(&fold.note))
            };
            let inside: Vec<String> = fold.blocks.iter().map(block).collect();
            format!(
                "#### {}\n\n{note}\n{}",
                escape(&fold.title),
                inside.join("\n")
            )
        }
        Block::Beside(beside) => {
            let pictures: String = beside.pictures.iter().map(picture).collect();
            let inside: Vec<String> = beside.blocks.iter().map(block).collect();
            format!("{}\n{pictures}", inside.join("\n"))
        }
        Block::Terms(terms) => {
            let line = |t: &Term| format!("- *{}*: {}\n", escape(t.word), escape(t.meaning));
            terms.iter().map(line).collect()
        }
        Block::Comparer(comparer) => {
            let names = comparer.layers.iter().map(|layer| escape(&layer.name));
            let names = names.collect::<Vec<_>>().join(", ");
            format!("{}: in the page, {names}\n", escape(&comparer.caption))
        }
        Block::Paragraph(text) => format!("{}\n", escape(text)),
        Block::Verbatim(text) => {
            // A fence longer than any in the text.
            let runs = text.split(|c| c != '`').map(str::len);
            let fence = "`".repeat(runs.max().unwrap_or(0).max(2) + 1);
            format!("{fence}\n{}\n{fence}\n", text.trim_end())
        }
        Block::Checks(checks) => {
            let line = |check: &Check| {
                let (title, detail) = (escape(&check.title), escape(&check.detail));
                format!("- **{}** {title}: {detail}\n", check.verdict.word())
            };
            checks.iter().map(line).collect()
        }
        Block::Table(content) => table(content),
        Block::Figures(figures) => {
            let line = |f: &Illustration| {
                let extension = if f.has_png { "png" } else { "svg" };
                let caption = escape(&f.caption);
                format!("![{caption}](plots/{}.{extension})\n\n", f.name)
            };
            figures.iter().map(line).collect()
        }
        Block::Gallery(gallery) => {
            let items: String = gallery.items.iter().map(picture).collect();
            format!("{}:\n\n{items}", escape(&gallery.caption))
        }
    }
}

fn picture(item: &Picture) -> String {
    let caption = escape(&item.caption);
    match item.data {
        Some(_) => format!("- [{caption}](<{}>)\n", item.path),
        None => format!("- {caption}: {}\n", escape(&item.missing)),
    }
}

/// Returns a table with its caption before it.
pub fn table(table: &Table) -> String {
    let columns = || table.columns.iter();
    let heads: String = columns()
        .map(|column| format!(" {} |", escape(&column.title)))
        .collect();
    let rule = columns().map(|column| if column.text { ":---|" } else { "---:|" });
    let rule: String = rule.collect();
    let mut out = format!("{}\n\n|{heads}\n|{rule}", escape(&table.caption));
    for row in &table.rows {
        out += "\n|";
        for cell in row {
            let text = escape(&cell.flat());
            out += &match cell.tone {
                Tone::Good | Tone::Bad => format!(" **{text}** |"),
                _ => format!(" {text} |"),
            };
        }
    }
    out + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_a_table_nor_texts_a_fence() {
        let mut content = Table::new("t", &["a", "b"]);
        let failed = TableCell::from("FAILED").toned(Tone::Bad);
        content.rows.push(vec!["x|y<b>".into(), failed]);
        let out = table(&content);
        assert!(out.ends_with("| x\\|y&lt;b&gt; | **FAILED** |\n"), "{out}");
        assert!(block(&Block::Verbatim("a ```` b".into())).starts_with("`````\n"));
    }
}

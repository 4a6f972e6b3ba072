//! LaTeX tables with booktabs. Texts are escaped, so that a name is shown and never executed; the result works with
//! pdfTeX, XeTeX and LuaTeX.

use super::{Exported, Source, tables::tables};
use crate::document::Table;
use raystone_core::text::escape::latex as escape;

pub(super) fn write(source: &Source) -> Exported {
    let mut text = "% \\usepackage{booktabs}\n".to_owned();
    for table in tables(&source.values) {
        text += &latex(&table);
    }
    Exported {
        text,
        left_out: Vec::new(),
    }
}

fn latex(table: &Table) -> String {
    let columns = table.columns.iter();
    let columns: String = columns.map(|c| if c.text { 'l' } else { 'r' }).collect();
    let row = |cells: Vec<String>| format!("    {} \\\\\n", cells.join(" & "));
    let heads = table.columns.iter().map(|c| escape(&c.title)).collect();
    let body = table.rows.iter();
    let body = body.map(|cells| row(cells.iter().map(|cell| escape(&cell.flat())).collect()));
    format!(
        "\n\\begin{{table}}\n  \\centering\n  \\caption{{{}}}\n  \\begin{{tabular}}{{{columns}}}\n    \\toprule\n{}    \
         \\midrule\n{}    \\bottomrule\n  \\end{{tabular}}\n\\end{{table}}\n",
        escape(&table.caption),
        row(heads),
        body.collect::<String>(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format;
    use raystone_record::figure::FIGURES;

    #[test]
    fn every_text_of_a_figure_has_a_command() {
        let mut texts: Vec<String> = Vec::new();
        for figure in FIGURES {
            texts.extend([figure.heading(), figure.spread.words().to_owned()]);
            for exponent in -12..13 {
                let value = 6.333 * 10f64.powi(exponent);
                texts.extend([value, -value, 0.0, f64::NAN].map(|v| format::figure(figure, v)));
            }
        }
        for text in texts {
            let shown = escape(&text);
            assert!(shown.is_ascii() && !shown.contains("U+"), "{text}: {shown}");
        }
    }

    #[test]
    fn exponents_come_back_from_a_table() {
        for exponent in (-300..300).filter(|e| !(-3..6).contains(e)) {
            let text = escape(&format::number(-2.5 * 10f64.powi(exponent)));
            let back = text.strip_prefix("$-$2.50$\\cdot$10$^{");
            let back = back.and_then(|rest| rest.strip_suffix("}$"));
            assert_eq!(back.and_then(|e| e.parse().ok()), Some(exponent), "{text}");
        }
    }
}

//! LaTeX tables with booktabs. Texts are escaped, so that a name is shown and never run; pdfTeX, XeTeX and LuaTeX
//! take the result alike.

use super::{Exported, Source, tables::tables};
use crate::document::Table;

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

/// Text that LaTeX shows as it is. Brackets and stars are kept from `\\`, which takes them for its arguments; a
/// character outside of ASCII that these tables do not use is shown by its number.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '<' => escaped += "\\textless{}",
            '>' => escaped += "\\textgreater{}",
            '|' => escaped += "\\textbar{}",
            '"' => escaped += "{\\char34}",
            '\'' => escaped += "\\textquotesingle{}",
            '`' => escaped += "\\textasciigrave{}",
            '[' | ']' | '*' | '-' => escaped.extend(['{', c, '}']),
            '#' | '$' | '%' | '&' | '_' | '{' | '}' => escaped.extend(['\\', c]),
            ' '..='~' => escaped.push(c),
            '\n' | '\t' | '\r' => escaped.push(' '),
            '–' => escaped += "--",
            '−' => escaped += "$-$",
            '×' => escaped += "$\\times$",
            '≤' => escaped += "$\\le$",
            '≥' => escaped += "$\\ge$",
            '·' => escaped += "$\\cdot$",
            '⁻' => escaped += "$^{-}$",
            'λ' => escaped += "$\\lambda$",
            'σ' => escaped += "$\\sigma$",
            'π' => escaped += "$\\pi$",
            'µ' | 'μ' => escaped += "$\\mu$",
            '°' => escaped += "$^\\circ$",
            '’' => escaped += "\\textquoteright{}",
            c => escaped += &format!("{{[}}U+{:04X}{{]}}", u32::from(c)),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hostile_name_is_shown_and_never_run() {
        assert_eq!(
            escape("\\input{/etc/passwd}%$x_1^2&#"),
            "\\textbackslash{}input\\{/etc/passwd\\}\\%\\$x\\_1\\textasciicircum{}2\\&\\#"
        );
        assert_eq!(escape("[1] *"), "{[}1{]} {*}");
        assert_eq!(escape("中\u{1b}"), "{[}U+4E2D{]}{[}U+001B{]}");
    }
}

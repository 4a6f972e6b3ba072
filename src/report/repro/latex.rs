//! Tables in the layout of the originals for LaTeX (packages `booktabs` and `fontenc`): thesis and ours side by side.

use super::page::{Grid, optional, printed};
use super::table::Reproduced;

/// Every table that has columns.
pub fn tables(tables: &[Reproduced]) -> String {
    let mut text =
        String::from("% Needs \\usepackage{booktabs}. In each cell pair: the thesis, then ours.\n");
    for table in tables {
        if let Some(grid) = Grid::new(table) {
            text += &tabular(table, &grid);
        }
    }
    text
}

fn tabular(table: &Reproduced, grid: &Grid) -> String {
    let pairs = "rr".repeat(grid.columns.len());
    let heads = grid.columns.iter();
    let heads: String = heads
        .map(|head| format!(" & \\multicolumn{{2}}{{c}}{{{}}}", escape(head)))
        .collect();
    let under = " & thesis & ours".repeat(grid.columns.len());
    let mut text = format!(
        "\n\\begin{{table}}\n\\caption{{{}}}\n\\label{{tab:{}}}\n\\begin{{tabular}}{{l{pairs}}}\n\\toprule\n{heads} \\\\\n{under} \\\\\n\\midrule\n",
        escape(&table.thesis.title),
        table.name,
    );
    for (name, cells) in &grid.rows {
        text += &escape(name);
        for cell in cells {
            let thesis = cell.and_then(|row| row.thesis);
            let ours = cell.and_then(|row| row.ours).map(|i| i.value);
            text += &format!(
                " & {} & {}",
                escape(&printed(thesis)),
                escape(&optional(ours))
            );
        }
        text += " \\\\\n";
    }
    text + "\\bottomrule\n\\end{tabular}\n\\end{table}\n"
}

/// Text that LaTeX shows as it is.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\\' => out += "\\textbackslash{}",
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            '–' => out += "--",
            '·' => out += "$\\cdot$",
            '×' => out += "$\\times$",
            '√' => out += "$\\surd$",
            'μ' => out += "$\\mu$",
            '≥' => out += "$\\geq$",
            '≤' => out += "$\\leq$",
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_latex_reads_as_commands_is_shown() {
        assert_eq!(super::escape("5 % of a_b & c"), "5 \\% of a\\_b \\& c");
        assert_eq!(
            super::escape("≥ ≤ – √×μ"),
            "$\\geq$ $\\leq$ -- $\\surd$$\\times$$\\mu$"
        );
        assert_eq!(super::escape("\\x·y"), "\\textbackslash{}x$\\cdot$y");
    }
}

//! Tables in the layout of the originals for LaTeX (packages `booktabs` and `fontenc`): thesis and ours side by side.

use super::page::{Grid, optional, printed};
use super::table::Reproduced;
use raystone_core::text::escape::latex as escape;

/// Returns every table that has columns.
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

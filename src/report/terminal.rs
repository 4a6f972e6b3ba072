//! The essence of a report for the end of a run.

use super::data::RunData;
use super::document::{Table, TableCell};
use super::samplers::Metric;
use super::sections::{
    animation, belief, compactions, kernels, rendering, run, samplers, structures, verdict,
};
use super::values::{of_structures, of_view};
use crate::measure::record::{Line, Verdict};

/// Verdicts, speeds, errors and checks as aligned plain text.
pub fn terminal_tables(records: &[Line]) -> String {
    let data = RunData::new(records);
    let mut tables = Vec::new();
    for scene in &data.scenes {
        let values = of_structures(&data, scene);
        tables.push(structures::speed_table(scene, &values));
        tables.push(structures::outside_table(&data, scene, &values));
        let of_frames = animation::values(&data, scene);
        tables.push(animation::costs_table(scene, &of_frames));
        let mut of_views = Vec::new();
        for view in &scene.views {
            let values = of_view(scene, view);
            tables.push(samplers::error_table(view, &values, Metric::RelMse));
            tables.push(samplers::efficiency_table(view, &values));
            of_views.extend(values);
        }
        tables.push(kernels::gains_table(scene, &of_views));
        tables.push(verdict::table(scene));
    }
    let values = compactions::values(&data);
    tables.push(compactions::growth_table(&data, &values));
    tables.push(compactions::table(&data, &values));
    let mut out = String::new();
    for table in tables.iter().filter(|table| !table.rows.is_empty()) {
        out += &(aligned(table) + "\n");
    }
    for line in data.scenes.iter().flat_map(rendering::disagreements) {
        out += &format!("warning: {line}\n");
    }
    if data.run.is_some_and(|run| run.environment.software) {
        out += "Software adapter: times compare structures on this adapter only.\n";
    }
    out += &run::overhead(&data).map_or(String::new(), |text| text + "\n");
    belief::checks(&data)
        .iter()
        .for_each(|check| out += &check.line());
    out
}

/// The checks that failed, each with what it found: any is a failure of the run.
pub fn failed_checks(records: &[Line]) -> Vec<String> {
    let checks = belief::checks(&RunData::new(records)).into_iter();
    let failed = checks.filter(|check| check.verdict == Verdict::Fail);
    failed
        .map(|c| format!("{}: {}", c.title, c.detail))
        .collect()
}

/// The table with columns padded to equal width; of figures only the value is kept, since intervals
/// would not fit a terminal, except in tables of text.
pub fn aligned(table: &Table) -> String {
    let wordy = table.columns.iter().filter(|column| column.text).count() > 2;
    let shown = |cell: &TableCell| match wordy {
        true => cell.flat(),
        false => cell.text.clone(),
    };
    let heads = table.columns.iter().map(|column| column.title.clone());
    let rows = table.rows.iter().map(|row| row.iter().map(shown).collect());
    let lines: Vec<Vec<String>> = std::iter::once(heads.collect()).chain(rows).collect();
    let width = |i: usize| {
        let cells = lines.iter().filter_map(|line| line.get(i));
        cells.map(|text| text.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..table.columns.len()).map(width).collect();
    let padded = |(i, text): (usize, &String)| {
        let width = widths[i];
        match table.columns[i].text {
            true => format!("{text:<width$}"),
            false => format!("{text:>width$}"),
        }
    };
    let line = |cells: &Vec<String>| {
        let cells: Vec<String> = cells.iter().enumerate().map(padded).collect();
        cells.join("  ").trim_end().to_owned() + "\n"
    };
    let rule = "─".repeat(widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1));
    let body: String = lines[1..].iter().map(line).collect();
    format!("{}\n{}{rule}\n{body}", table.caption, line(&lines[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_figures_stand_right() {
        let mut table = Table::new("speed", &["structure", "Mrays/s"]);
        table
            .rows
            .push(vec!["bvh".into(), TableCell::with_detail("5.02", "[4, 6]")]);
        table.rows.push(vec!["uniform-grid λ".into(), "1".into()]);
        let text = aligned(&table);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[3], "bvh                5.02");
        assert_eq!(lines[4], "uniform-grid λ        1");
    }
}

//! Aligned plain text.

/// A table for the terminal.
pub struct Table {
    /// Whether a column holds numbers, which are aligned to the right.
    numeric: Vec<bool>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headings; a column of numbers has a `#` before its heading.
    pub fn new(headings: &[&str]) -> Self {
        Self {
            numeric: headings.iter().map(|h| h.starts_with('#')).collect(),
            rows: vec![
                headings
                    .iter()
                    .map(|h| h.trim_start_matches('#').to_owned())
                    .collect(),
            ],
        }
    }

    /// Adds a row; missing cells at its end are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let mut cells: Vec<_> = cells.into_iter().collect();
        cells.resize(self.numeric.len(), String::new());
        self.rows.push(cells);
    }

    /// The lines, columns two spaces apart.
    pub fn text(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| row[column].chars().count());
            cells.max().unwrap_or(0)
        };
        let widths: Vec<_> = (0..self.numeric.len()).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let cells = row.iter().zip(&widths).zip(&self.numeric);
            let cells = cells.map(|((cell, &width), numeric)| match numeric {
                true => format!("{cell:>width$}"),
                false => format!("{cell:<width$}"),
            });
            text += cells.collect::<Vec<_>>().join("  ").trim_end();
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_end_and_words_begin_in_one_column() {
        let mut table = Table::new(&["name", "#rays"]);
        table.row(["bvh".to_owned(), "7".to_owned()]);
        table.row(["grid × 2".to_owned()]);
        assert_eq!(table.text(), "name      rays\nbvh          7\ngrid × 2\n");
    }
}

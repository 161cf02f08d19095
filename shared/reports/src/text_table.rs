//! A table of text without lines, whose columns are as wide as their entries.

use comfy_table::{CellAlignment, Row, Table, presets};

/// How a column is aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table of text. Its columns are two spaces apart, and no row ends with spaces.
#[derive(Debug)]
pub struct TextTable(Table);

impl TextTable {
    /// A table with these columns and no rows.
    #[must_use]
    pub fn new(columns: &[(&str, Align)]) -> Self {
        let mut table = Table::new();
        table.load_style(presets::NOTHING);
        table.set_header(columns.iter().map(|(name, _)| *name));
        for (column, (_, align)) in table.column_iter_mut().zip(columns) {
            column.set_padding((0, 2));
            column.set_cell_alignment(match align {
                Align::Left => CellAlignment::Left,
                Align::Right => CellAlignment::Right,
            });
        }
        Self(table)
    }

    /// Adds a row: an entry for each column from the first. The columns without one are empty.
    pub fn add(&mut self, row: impl Into<Row>) {
        self.0.add_row(row);
    }

    /// The head and the rows, each with a line break.
    #[must_use]
    pub fn to_text(&self) -> String {
        self.0.trim_fmt() + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_entries() {
        let mut table = TextTable::new(&[("", Align::Left), ("p50", Align::Right), ("note", Align::Left)]);
        table.add(["a name that is longer than all others", "7", "slow"]);
        table.add(["größe", "1234.5"]);
        assert_eq!(
            table.to_text(),
            "                                          p50  note\n\
             a name that is longer than all others       7  slow\n\
             größe                                  1234.5\n"
        );
    }
}

//! Rows of text in columns, for a terminal.

use std::fmt::Write as _;

/// The first column to the left, the numbers to the right.
pub(super) fn push_aligned(rows: &[Vec<String>], out: &mut String) {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        let mut line = String::from("  ");
        for (i, (cell, width)) in row.iter().zip(&widths).enumerate() {
            if i == 0 {
                write!(line, "{cell:<width$}").expect("writing to a string cannot fail");
            } else {
                write!(line, "  {cell:>width$}").expect("writing to a string cannot fail");
            }
        }
        out.push_str(line.trim_end());
        out.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let mut out = String::new();
        push_aligned(&[vec!["a".into(), "m".into()], vec!["long".into(), "12.5".into()]], &mut out);
        assert_eq!(out, "  a        m\n  long  12.5\n");
    }
}

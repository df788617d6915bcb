//! A cell of a CSV that somebody opens in a spreadsheet.

/// What a spreadsheet takes for the beginning of a formula, also in the full width of East Asian keyboards.
pub(crate) const BEGINS_A_FORMULA: [char; 10] = ['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠'];

/// A text: quoted, and with an apostrophe where a spreadsheet would take it for a formula.
pub(crate) fn harmless(cell: &str) -> String {
    let guard = if cell.starts_with(BEGINS_A_FORMULA) { "'" } else { "" };
    format!("\"{guard}{}\"", cell.replace('"', "\"\""))
}

#[cfg(test)]
mod tests {
    use super::harmless;

    #[test]
    fn a_cell_is_no_formula_and_no_two_cells() {
        assert_eq!(harmless("=1+1"), "\"'=1+1\"");
        assert_eq!(harmless("@a"), "\"'@a\"");
        assert_eq!(harmless("＝1+1"), "\"'＝1+1\"");
        assert_eq!(harmless("say \"a,b\"\n"), "\"say \"\"a,b\"\"\n\"");
    }
}

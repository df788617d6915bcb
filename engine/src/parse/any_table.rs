//! A table whose columns are not known yet: its header and its cells as text, for people to say which
//! column is which.

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::table;
use crate::parse::table_text::TableText;

/// The most rows of such a table: fifty sites of FAST's size.
const MOST_ROWS: usize = 100_000;
/// What a header looks like, for those who left it out.
const EXAMPLE: &str = "name,e_m,n_m,u_m";

/// A table as it stands in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnyTable {
    /// How its text is written: `UTF-8`, `UTF-16` or `GBK`.
    pub encoding: &'static str,
    /// Whether its numbers have commas for decimal points.
    pub decimal_comma: bool,
    /// The names of the columns; some may be empty.
    pub columns: Vec<String>,
    /// What a row of units below the names says of each; empty where there is none.
    pub units: Vec<String>,
    /// Its rows; each has a cell for every column.
    pub rows: Vec<AnyRow>,
}

/// A row of such a table.
#[derive(Clone, Debug, PartialEq)]
pub struct AnyRow {
    /// The line of the file, counted from 1, the header included.
    pub line: u64,
    /// Its cells without the blanks around them.
    pub cells: Vec<String>,
}

/// Reads a table as spreadsheets and surveyors' programs write it: in UTF-8, UTF-16 or GBK, parted by commas, semicolons
/// or tabulators, with lines above its header or a row of units below it. A spreadsheet's guard against formulas is taken
/// off its cells again.
///
/// # Errors
///
/// The first thing that keeps it from being a table.
pub fn read(bytes: &[u8]) -> Result<AnyTable, ParseError> {
    let text = TableText::read(bytes)?;
    let (encoding, decimal_comma) = (text.encoding, text.decimal_comma);
    let mut columns = Vec::new();
    // Columns without names are called by their numbers, in a line of their own.
    let mut named: Vec<u8> = Vec::new();
    if let Some(width) = text.headless {
        let numbers: Vec<String> = (1..=width).map(|number| format!("#{number}")).collect();
        named.extend(numbers.join(&char::from(text.delimiter).to_string()).into_bytes());
        named.push(b'\n');
    }
    let above = text.above.wrapping_sub(u64::from(text.headless.is_some()));
    let at = |line: u64| line.wrapping_add(above);
    named.extend_from_slice(text.header_onward());
    let rows = table::read_parted(
        &named,
        text.delimiter,
        EXAMPLE,
        |header| {
            columns = header.names().to_vec();
            Ok(())
        },
        |(), record| {
            let cells =
                record.fields().map(|field| table::unguarded(&String::from_utf8_lossy(field)).to_owned());
            Ok(AnyRow { line: at(record.line), cells: cells.collect() })
        },
    );
    let mut rows = rows.map_err(|error| ParseError { line: error.line.map(at), ..error })?;
    for row in &mut rows {
        row.cells.resize(columns.len(), String::new());
    }
    let units = if text.units_below && !rows.is_empty() { rows.remove(0).cells } else { Vec::new() };
    rows.retain(|row| row.cells.iter().any(|cell| !cell.is_empty()));
    if rows.len() > MOST_ROWS {
        return Err(ParseError::new(
            ParseErrorKind::TooLong,
            format!("at most {MOST_ROWS} rows"),
            format!("{} rows", rows.len()),
            "split the table",
        ));
    }
    Ok(AnyTable { encoding, decimal_comma, columns, units, rows })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn any_columns_are_told_as_they_are() {
        let table = read("\u{feff}点名, X ,\"Y, m\"\r\n'=1+1,-2.5, 3\r\nB,,\r\n".as_bytes()).unwrap();
        assert_eq!(
            (table.encoding, table.columns),
            ("UTF-8", vec!["点名".into(), "X".into(), "Y, m".into()])
        );
        assert_eq!(table.rows[0], AnyRow { line: 2, cells: vec!["=1+1".into(), "-2.5".into(), "3".into()] });
        assert_eq!(table.rows[1].cells, ["B", "", ""]);
        let (bytes, _, _) = encoding_rs::GBK.encode("名称,东,北\n甲,1,2\n");
        let table = read(&bytes).unwrap();
        assert_eq!((table.encoding, table.columns[0].as_str()), ("GBK", "名称"));
    }

    #[test]
    fn a_table_reads_alike_whatever_wrote_it() {
        let plain = read(b"name,e_m,n_m,u_m\nA10,12.189,33.609,2.135\nA11,-30.393,41.833,4.484\n").unwrap();
        let utf16: Vec<u8> =
            "\u{feff}name\te_m\tn_m\tu_m\r\nA10\t12.189\t33.609\t2.135\r\nA11\t-30.393\t41.833\t4.484\r\n"
                .encode_utf16()
                .flat_map(u16::to_le_bytes)
                .collect();
        for bytes in [
            &b"sep=,\nname,e_m,n_m,u_m\nA10,12.189,33.609,2.135\nA11,-30.393,41.833,4.484\n"[..],
            b"Anchors of 2026\n\nname,e_m,n_m,u_m\nA10,12.189,33.609,2.135\nA11,-30.393,41.833,4.484\n,,,\n",
            b"name,e_m,n_m,u_m\n,m,m,m\nA10,12.189,33.609,2.135\nA11,-30.393,41.833,4.484\n\0\0\0\x1a",
            b"name|e_m|n_m|u_m\rA10|12.189|33.609|2.135\rA11|-30.393|41.833|4.484\r",
            &utf16,
        ] {
            let table = read(bytes).unwrap();
            let cells = |table: &AnyTable| table.rows.iter().map(|row| row.cells.clone()).collect::<Vec<_>>();
            assert_eq!((&table.columns, cells(&table)), (&plain.columns, cells(&plain)));
        }
        let commas = read("\u{feff}name;e_m;n_m;u_m\nA10;12,189;33,609;2,135\n".as_bytes()).unwrap();
        assert!(
            commas.decimal_comma && commas.columns == plain.columns && commas.rows[0].cells[1] == "12,189"
        );
    }

    #[test]
    fn what_is_no_table_is_told() {
        let headless = read(b"A10,33.609,12.189,2.135\nA11,41.833,-30.393,4.484\n").unwrap();
        assert_eq!((headless.columns.join(" "), headless.rows.len()), ("#1 #2 #3 #4".to_owned(), 2));
        assert_eq!((headless.rows[0].line, &*headless.rows[0].cells[0]), (1, "A10"));
        let blanks =
            read(b"Pt   N      E     H\nA10  33.609 12.189 2.135\nA11  41.833 -30.393 4.484\n").unwrap();
        assert_eq!((blanks.columns.join(" "), &*blanks.rows[1].cells[2]), ("Pt N E H".to_owned(), "-30.393"));
        for (text, code) in [
            ("", "empty_file"),
            ("a,b\n1,2,3\n", "wrong_field_count"),
            ("1,2\n3,4\n", "missing_header"),
            ("\u{89}PNG\r\n\u{1a}\n\0\0", "not_text"),
        ] {
            assert_eq!(read(text.as_bytes()).unwrap_err().code(), code, "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&bytes);
        }
    }
}

//! A table whose columns are not known yet: its header and its cells as text, for people to say which
//! column is which.

use std::borrow::Cow;

use crate::parse::error::{ParseError, ParseErrorKind};
use crate::parse::markers_csv::decode;
use crate::parse::table;

/// The most rows of such a table: fifty sites of FAST's size.
const MOST_ROWS: usize = 100_000;
/// What a header looks like, for those who left it out.
const EXAMPLE: &str = "name,e_m,n_m,u_m";

/// A table as it stands in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnyTable {
    /// How its text is written: `UTF-8` or `GBK`.
    pub encoding: &'static str,
    /// The names of the columns; some may be empty.
    pub columns: Vec<String>,
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

/// Reads a table in UTF-8 or GBK. A spreadsheet's guard against formulas is taken off its cells again.
///
/// # Errors
///
/// The first thing that keeps it from being a table.
pub fn read(bytes: &[u8]) -> Result<AnyTable, ParseError> {
    let text = decode(bytes)?;
    let encoding = if matches!(text, Cow::Borrowed(_)) { "UTF-8" } else { "GBK" };
    let mut columns = Vec::new();
    let rows = table::read(
        text.as_bytes(),
        EXAMPLE,
        |header| {
            columns = header.names().to_vec();
            Ok(())
        },
        |(), record| {
            let cells =
                record.fields().map(|field| table::unguarded(&String::from_utf8_lossy(field)).to_owned());
            Ok(AnyRow { line: record.line, cells: cells.collect() })
        },
    )?;
    if rows.len() > MOST_ROWS {
        return Err(ParseError::new(
            ParseErrorKind::TooLong,
            format!("at most {MOST_ROWS} rows"),
            format!("{} rows", rows.len()),
            "split the table",
        ));
    }
    Ok(AnyTable { encoding, columns, rows })
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
    fn what_is_no_table_is_told() {
        for (text, code) in [
            ("", "empty_file"),
            ("a,b\n1\n", "wrong_field_count"),
            ("a,a\n1,2\n", "repeated_column"),
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

//! The canonical log of a stream of numbers: CSV with a header, `t_s` and the columns that the system declares for the
//! stream, in any order, one row a reading.

use crate::parse::error::{ParseError, no_rows};
use crate::parse::header::Header;
use crate::parse::name_number::{holds_names, need_name};
use crate::parse::number::{need_number, need_time_ns, optional_number};
use crate::parse::records::{Record, Records};
use crate::stream::Rows;
use crate::system::Column;

/// The column of the time, s.
pub const TIME: &str = "t_s";

/// A push parser: takes bytes in pieces of any size and gives the rows that they complete.
pub struct ValuesCsv {
    records: Records,
    table: Table,
}

impl ValuesCsv {
    /// A parser at the start of a file with these columns beside the time.
    pub fn new(columns: &'static [Column]) -> ValuesCsv {
        ValuesCsv { records: Records::new(), table: Table { columns, header: None, rows: 0 } }
    }

    /// Takes some bytes and appends the rows that they complete, with values in the order of the declared columns; NaN
    /// where an optional one has none.
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the parser is then of no further use.
    pub fn push(&mut self, bytes: &[u8], rows: &mut Rows) -> Result<(), ParseError> {
        let ValuesCsv { records, table } = self;
        let head: Vec<u8> = records.head().iter().chain(bytes).take(8).copied().collect();
        records.push(bytes, |record| table.take(record, &head, rows))
    }

    /// The file is over: appends the last row, when no line feed ends it.
    ///
    /// # Errors
    ///
    /// When the last row is wrong, or the file holds none.
    pub fn finish(&mut self, rows: &mut Rows) -> Result<(), ParseError> {
        let ValuesCsv { records, table } = self;
        let head = records.head().to_vec();
        records.finish(|record| table.take(record, &head, rows))?;
        if table.rows > 0 {
            return Ok(());
        }
        Err(no_rows(table.header.is_some(), &table.names(false).join(","), "reading"))
    }

    /// How many rows it has given so far.
    pub fn rows(&self) -> u64 {
        self.table.rows
    }
}

impl std::fmt::Debug for ValuesCsv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ValuesCsv").field("rows", &self.table.rows).finish_non_exhaustive()
    }
}

struct Table {
    columns: &'static [Column],
    header: Option<(Header, Places)>,
    rows: u64,
}

/// Where each column stands in the file.
struct Places {
    time: usize,
    values: Vec<Option<usize>>,
}

impl Table {
    /// The time and the columns, optional ones or not.
    fn names(&self, only_required: bool) -> Vec<&'static str> {
        let columns = self.columns.iter().filter(|column| column.required || !only_required);
        std::iter::once(TIME).chain(columns.map(|column| column.name)).collect()
    }

    fn take(&mut self, record: &Record<'_>, head: &[u8], rows: &mut Rows) -> Result<(), ParseError> {
        let Some((header, places)) = &self.header else {
            let header = Header::read(record, head, &self.names(true).join(","))?;
            let places = self.places(&header)?;
            self.header = Some((header, places));
            return Ok(());
        };
        header.check_width(record)?;
        let t_ns = need_time_ns(record, places.time, TIME)?;
        let mut values = Vec::with_capacity(self.columns.len());
        for (column, place) in self.columns.iter().zip(&places.values) {
            values.push(match place {
                None => f64::NAN,
                Some(index) if holds_names(column) => need_name(record, *index, column.name)?,
                Some(index) if column.required => need_number(record, *index, column.name)?,
                Some(index) => optional_number(record, *index, column.name)?.unwrap_or(f64::NAN),
            });
        }
        rows.push(t_ns, values);
        self.rows += 1;
        Ok(())
    }

    fn places(&self, header: &Header) -> Result<Places, ParseError> {
        let known = self.names(false);
        let mut values = Vec::with_capacity(self.columns.len());
        for column in self.columns {
            values.push(match column.required {
                true => Some(header.need(column.name, &known)?),
                false => header.find(column.name),
            });
        }
        Ok(Places { time: header.need(TIME, &known)?, values })
    }
}

/// Appends a table with the time and the columns of these names.
pub fn write<'a>(names: &[&str], rows: impl IntoIterator<Item = (i64, &'a [f64])>, out: &mut String) {
    use std::fmt::Write as _;
    out.push_str(TIME);
    for name in names {
        out.push(',');
        out.push_str(name);
    }
    out.push('\n');
    for (t_ns, values) in rows {
        crate::track::csv::push_seconds(t_ns, out);
        for value in values {
            out.push(',');
            if !value.is_nan() {
                write!(out, "{value}").expect("writing to a string cannot fail");
            }
        }
        out.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const COLUMNS: &[Column] = &[
        Column { name: "e_m", required: true, about: "" },
        Column { name: "n_m", required: true, about: "" },
        Column { name: "sigma_m", required: false, about: "" },
    ];

    const NAMES: &[&str] = &["e_m", "n_m", "sigma_m"];

    fn read(pieces: &[&[u8]]) -> Result<Rows, ParseError> {
        let mut rows = Rows::new(COLUMNS.len());
        let mut parser = ValuesCsv::new(COLUMNS);
        for piece in pieces {
            parser.push(piece, &mut rows)?;
        }
        parser.finish(&mut rows)?;
        assert_eq!(parser.rows(), rows.len() as u64);
        Ok(rows)
    }

    fn rows(all: &[(i64, [f64; 3])]) -> Rows {
        let mut rows = Rows::new(3);
        all.iter().for_each(|(t_ns, values)| rows.push(*t_ns, *values));
        rows
    }

    #[test]
    fn columns_come_in_any_order_and_optional_ones_may_be_left_out_or_empty() {
        let expected = rows(&[(1_500_000_000, [2.0, -3.0, f64::NAN])]);
        assert_eq!(read(&[b"t_s,e_m,n_m\n1.5,2,-3\n"]).unwrap(), expected);
        assert_eq!(read(&[b"note,sigma_m,n_m,e_m,t_s\nhere,,-3,2,1.5"]).unwrap(), expected);
        let sure = rows(&[(1_500_000_000, [2.0, -3.0, 0.25])]);
        assert_eq!(read(&["\u{feff}n_m,sigma_m,e_m,t_s\r\n-3,0.25,2,1.5\r\n".as_bytes()]).unwrap(), sure);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (text, code, line, column) in [
            ("", "empty_file", None, None),
            ("t_s,e_m,n_m\n", "empty_file", None, None),
            ("t_s,e_m\n1,2\n", "missing_column", Some(1), Some("n_m")),
            ("e_m,n_m\n1,2\n", "missing_column", Some(1), Some("t_s")),
            ("1,2,3\n4,5,6\n", "missing_header", Some(1), None),
            ("t_s,e_m,n_m,e_m\n1,2,3,4\n", "repeated_column", Some(1), Some("e_m")),
            ("t_s,e_m,n_m\n1,2,3\n2,2\n", "wrong_field_count", Some(3), None),
            ("t_s,e_m,n_m\n1,2,east\n", "not_a_number", Some(2), Some("n_m")),
            ("t_s,e_m,n_m\n1,,3\n", "empty_field", Some(2), Some("e_m")),
            ("t_s,e_m,n_m,sigma_m\n1,2,3,low\n", "not_a_number", Some(2), Some("sigma_m")),
            ("t_s,e_m,n_m\ninf,2,3\n", "bad_time", Some(2), Some("t_s")),
        ] {
            let error = read(&[text.as_bytes()]).unwrap_err();
            let found = (error.code(), error.line, error.column.as_deref());
            assert_eq!(found, (code, line, column), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_written_log_is_read_back() {
        let all = rows(&[(0, [1.0, 2.5, f64::NAN]), (2_000_000_001, [-1e-9, 1e20, 0.5])]);
        let mut text = String::new();
        write(NAMES, all.iter(), &mut text);
        assert_eq!(text.lines().next(), Some("t_s,e_m,n_m,sigma_m"));
        assert_eq!(read(&[text.as_bytes()]).unwrap(), all);
    }

    proptest! {
        #[test]
        fn a_log_reads_alike_however_it_is_cut(
            values in prop::collection::vec((0_i64..1_000_000_000_000, -1e6..1e6, -1e6..1e6, prop::option::of(0.0..9.0)), 1..20),
            cuts in prop::collection::vec(0_usize..400, 0..6),
        ) {
            let mut all = Rows::new(3);
            for (t_ns, e, n, sigma) in &values {
                all.push(*t_ns, [*e, *n, sigma.unwrap_or(f64::NAN)]);
            }
            let mut text = String::new();
            write(NAMES, all.iter(), &mut text);
            let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut % (text.len() + 1)).collect();
            cuts.extend([0, text.len()]);
            cuts.sort_unstable();
            let pieces: Vec<&[u8]> =
                cuts.windows(2).map(|ends| &text.as_bytes()[ends[0]..ends[1]]).collect();
            prop_assert_eq!(read(&pieces).unwrap(), all);
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = read(&[b"t_s,e_m,n_m\n", &bytes]);
            let _ = read(&[&bytes]);
        }
    }
}

//! Tables whose rows begin with a time and the names of things: a fix of an antenna, a ray from a station to a prism. CSV with a
//! header, columns in any order; a name that is not on the list of its column is refused.

use crate::parse::error::{ParseError, ParseErrorKind, no_rows, quoted};
use crate::parse::header::Header;
use crate::parse::number::{need_time_ns, number, optional_number};
use crate::parse::records::{Record, Records};

/// The column of the time, s.
const TIME: &str = "t_s";

/// A column of names.
#[derive(Clone, Debug)]
pub struct NameColumn {
    /// Its name in the header.
    pub name: &'static str,
    /// The names that may stand in it.
    pub known: Vec<String>,
}

/// What a table holds.
#[derive(Clone, Debug)]
pub struct NamedTable {
    /// Columns of names.
    pub names: Vec<NameColumn>,
    /// Columns of numbers that have to be there.
    pub numbers: Vec<&'static str>,
    /// Columns of numbers that may be left out or empty.
    pub optional: Vec<&'static str>,
}

/// One row.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRow {
    /// Its time, ns.
    pub t_ns: i64,
    /// The names, each by its place in the list of its column.
    pub names: Vec<usize>,
    /// The numbers, those that may be left out last; NaN where there is none.
    pub values: Vec<f64>,
}

/// A push parser: takes bytes in pieces of any size and gives the rows that they complete.
pub struct NamedCsv {
    records: Records,
    table: Table,
}

struct Table {
    holds: NamedTable,
    header: Option<(Header, Places)>,
    rows: u64,
}

struct Places {
    time: usize,
    names: Vec<usize>,
    numbers: Vec<usize>,
    optional: Vec<Option<usize>>,
}

impl NamedCsv {
    /// A parser at the start of a file.
    pub fn new(holds: NamedTable) -> NamedCsv {
        NamedCsv { records: Records::new(), table: Table { holds, header: None, rows: 0 } }
    }

    /// Takes some bytes and appends the rows that they complete.
    ///
    /// # Errors
    ///
    /// At the first thing that is wrong; the parser is then of no further use.
    pub fn push(&mut self, bytes: &[u8], rows: &mut Vec<NamedRow>) -> Result<(), ParseError> {
        let NamedCsv { records, table } = self;
        let head: Vec<u8> = records.head().iter().chain(bytes).take(8).copied().collect();
        records.push(bytes, |record| table.take(record, &head, rows))
    }

    /// The file is over: appends the last row, when no line feed ends it.
    ///
    /// # Errors
    ///
    /// When the last row is wrong, or the file holds none.
    pub fn finish(&mut self, rows: &mut Vec<NamedRow>) -> Result<(), ParseError> {
        let NamedCsv { records, table } = self;
        let head = records.head().to_vec();
        records.finish(|record| table.take(record, &head, rows))?;
        if table.rows > 0 {
            return Ok(());
        }
        Err(no_rows(table.header.is_some(), &table.holds.columns(false).join(","), "reading"))
    }
}

impl std::fmt::Debug for NamedCsv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NamedCsv").field("rows", &self.table.rows).finish_non_exhaustive()
    }
}

impl NamedTable {
    fn columns(&self, with_optional: bool) -> Vec<&'static str> {
        let names = self.names.iter().map(|column| column.name);
        let optional = self.optional.iter().copied().filter(|_| with_optional);
        std::iter::once(TIME).chain(names).chain(self.numbers.iter().copied()).chain(optional).collect()
    }
}

impl Table {
    fn take(&mut self, record: &Record<'_>, head: &[u8], rows: &mut Vec<NamedRow>) -> Result<(), ParseError> {
        let Some((header, places)) = &self.header else {
            let header = Header::read(record, head, &self.holds.columns(false).join(","))?;
            let places = self.places(&header)?;
            self.header = Some((header, places));
            return Ok(());
        };
        header.check_width(record)?;
        let t_ns = need_time_ns(record, places.time, TIME)?;
        let mut names = Vec::with_capacity(self.holds.names.len());
        for (column, place) in self.holds.names.iter().zip(&places.names) {
            names.push(known(record, *place, column)?);
        }
        let mut values = Vec::with_capacity(self.holds.numbers.len() + self.holds.optional.len());
        for (name, place) in self.holds.numbers.iter().zip(&places.numbers) {
            // An empty field is a device that had nothing to say, which is one bad row and not a bad file.
            values.push(match number(record.field(*place)) {
                Some(value) => value,
                None => optional_number(record, *place, name)?.unwrap_or(f64::NAN),
            });
        }
        for (name, place) in self.holds.optional.iter().zip(&places.optional) {
            let value = place.map(|place| optional_number(record, place, name)).transpose()?;
            values.push(value.flatten().unwrap_or(f64::NAN));
        }
        rows.push(NamedRow { t_ns, names, values });
        self.rows += 1;
        Ok(())
    }

    fn places(&self, header: &Header) -> Result<Places, ParseError> {
        let all = self.holds.columns(true);
        let need = |name: &str| header.need(name, &all);
        Ok(Places {
            time: need(TIME)?,
            names: self.holds.names.iter().map(|column| need(column.name)).collect::<Result<_, _>>()?,
            numbers: self.holds.numbers.iter().map(|name| need(name)).collect::<Result<_, _>>()?,
            optional: self.holds.optional.iter().map(|name| header.find(name)).collect(),
        })
    }
}

fn known(record: &Record<'_>, place: usize, column: &NameColumn) -> Result<usize, ParseError> {
    let found = record.field(place).trim_ascii();
    column.known.iter().position(|name| name.as_bytes() == found).ok_or_else(|| {
        ParseError::new(
            ParseErrorKind::OutOfRange,
            format!("one of the {}s {}", column.name, column.known.join(", ")),
            quoted(found),
            "correct the name, or add it where the instrument is described",
        )
        .at_line(record.line)
        .in_column(column.name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> NamedTable {
        let known = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        NamedTable {
            names: vec![
                NameColumn { name: "station", known: known(&["S1", "S2"]) },
                NameColumn { name: "target", known: known(&["P1", "P2"]) },
            ],
            numbers: vec!["slant_m"],
            optional: vec!["pressure_hpa"],
        }
    }

    fn read(text: &str, piece: usize) -> Result<Vec<NamedRow>, ParseError> {
        let (mut parser, mut rows) = (NamedCsv::new(table()), Vec::new());
        for bytes in text.as_bytes().chunks(piece) {
            parser.push(bytes, &mut rows)?;
        }
        parser.finish(&mut rows)?;
        Ok(rows)
    }

    #[test]
    fn rows_are_read_in_any_order_of_columns_however_they_are_cut() {
        let text = "target,slant_m,t_s,station\nP2,152.5,1.25,S1\nP1,,1.5,S2";
        for piece in 1..text.len() {
            let rows = read(text, piece).unwrap();
            assert_eq!(rows[0].t_ns, 1_250_000_000);
            assert_eq!((&rows[0].names[..], rows[0].values[0]), (&[0, 1][..], 152.5));
            assert!(rows[0].values[1].is_nan() && rows[1].values[0].is_nan());
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (text, code, line, column) in [
            ("", "empty_file", None, None),
            ("t_s,station,target,slant_m\n", "empty_file", None, None),
            ("t_s,station,slant_m\n1,S1,2\n", "missing_column", Some(1), Some("target")),
            ("t_s,station,target,slant_m\n1,S7,P1,2\n", "out_of_range", Some(2), Some("station")),
            ("t_s,station,target,slant_m\n1,S1,P1,far\n", "not_a_number", Some(2), Some("slant_m")),
            ("t_s,station,target,slant_m\nnow,S1,P1,2\n", "not_a_number", Some(2), Some("t_s")),
        ] {
            let error = read(text, 1000).unwrap_err();
            let found = (error.code(), error.line, error.column.as_deref());
            assert_eq!(found, (code, line, column), "{text:?}: {error}");
        }
    }
}

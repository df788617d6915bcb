//! The names of a table's columns, and help for those who misspelt one.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::records::{Record, not_text};

/// The first line of a table.
#[derive(Clone, Debug)]
pub(super) struct Header {
    names: Vec<String>,
    line: u64,
}

impl Header {
    /// Reads the header; `head` is the start of the file and `example` the header that belongs there.
    pub(super) fn read(record: &Record<'_>, head: &[u8], example: &str) -> Result<Header, ParseError> {
        let header = Header::any(record, head, example)?;
        let twice =
            header.names.iter().enumerate().find(|(i, n)| !n.is_empty() && header.names[..*i].contains(n));
        if let Some((_, name)) = twice {
            return Err(header
                .wrong(ParseErrorKind::RepeatedColumn, "every column once".to_owned())
                .in_column(name.clone())
                .advise("remove or rename one of the two"));
        }
        Ok(header)
    }

    /// The same, where columns may be called alike.
    pub(super) fn any(record: &Record<'_>, head: &[u8], example: &str) -> Result<Header, ParseError> {
        let mut names = Vec::with_capacity(record.len());
        for field in record.fields() {
            if let Some(error) = not_text(head, field) {
                return Err(error);
            }
            names.push(String::from_utf8_lossy(field).trim().trim_matches('"').to_owned());
        }
        let header = Header { names, line: record.line };
        if header.names.iter().all(|name| name.is_empty() || fast_float2::parse::<f64, _>(name).is_ok()) {
            return Err(header
                .wrong(ParseErrorKind::MissingHeader, format!("a header such as \"{example}\""))
                .advise("put the names of the columns into the first line"));
        }
        if header.names.len() == 1 && header.names[0].contains([';', '\t']) {
            return Err(header
                .wrong(
                    ParseErrorKind::MissingColumn,
                    format!("columns parted by commas, as in \"{example}\""),
                )
                .advise("export the table with commas between the fields and points in the numbers"));
        }
        Ok(header)
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// The names as they stand in the file.
    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    /// Where a column stands, when it is there.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Where a column stands that has to be there; `known` are all the names that mean something.
    pub(super) fn need(&self, name: &str, known: &[&str]) -> Result<usize, ParseError> {
        if let Some(index) = self.find(name) {
            return Ok(index);
        }
        let error = self.wrong(ParseErrorKind::MissingColumn, format!("a column {name}")).in_column(name);
        Err(match self.nearest(name, known) {
            Some(near) => error
                .advise(format!("if {} is meant, rename it, and check its unit", quoted(near.as_bytes()))),
            None => error.advise(format!("name the columns {}", known.join(","))),
        })
    }

    /// Refuses a row that has not one field for every column.
    pub(super) fn check_width(&self, record: &Record<'_>) -> Result<(), ParseError> {
        if record.len() == self.len() {
            return Ok(());
        }
        let whole: Vec<&[u8]> = record.fields().collect();
        Err(ParseError::new(
            ParseErrorKind::WrongFieldCount,
            format!("{} fields, as in the header", self.len()),
            format!("{} in {}", record.len(), quoted(&whole.join(&b','))),
            "complete the line, or delete it if the recorder was switched off while it wrote",
        )
        .at_line(record.line))
    }

    /// The same for a row of a small table, whose last cells may be left out where they are empty.
    pub(super) fn check_row(&self, record: &Record<'_>) -> Result<(), ParseError> {
        self.check_width(record).map_err(|error| {
            error.advise("complete the line: a cell for every column, empty or in quotes where it holds what parts cells")
        })
    }

    /// The same where cells that hold nothing may be left out at the end of a row, or follow it.
    pub(super) fn check_longest(&self, record: &Record<'_>) -> Result<(), ParseError> {
        let more = (self.len()..record.len()).any(|at| !record.field(at).trim_ascii().is_empty());
        if more { self.check_row(record) } else { Ok(()) }
    }

    fn wrong(&self, kind: ParseErrorKind, expected: String) -> ParseError {
        let found = format!("the header {}", shortened(&self.names.join(",")));
        ParseError::new(kind, expected, found, "").at_line(self.line)
    }

    /// The unknown name that is most like the wanted one, when it is like it at all.
    fn nearest(&self, wanted: &str, known: &[&str]) -> Option<&str> {
        self.names
            .iter()
            .filter(|name| !known.contains(&name.as_str()))
            .map(|name| (edits(&name.to_ascii_lowercase(), wanted), name.as_str()))
            // `gyr_x` is short of a unit, not far from its name.
            .filter(|(edits, name)| {
                *edits <= wanted.len() / 2
                    || name.len() >= 3 && wanted.starts_with(&name.to_ascii_lowercase())
            })
            .min_by_key(|(edits, _)| *edits)
            .map(|(_, name)| name)
    }
}

impl ParseError {
    fn advise(mut self, advice: impl Into<String>) -> ParseError {
        self.advice = advice.into();
        self
    }
}

fn shortened(names: &str) -> String {
    const MOST: usize = 160;
    if names.chars().count() <= MOST {
        return format!("\"{names}\"");
    }
    let start: String = names.chars().take(MOST).collect();
    format!("\"{start}…\"")
}

/// How many letters have to be inserted, deleted or exchanged to make one word of the other.
fn edits(a: &str, b: &str) -> usize {
    // Names from a file may be long; beyond this they are like nothing.
    const MOST: usize = 64;
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(MOST).collect(), b.chars().take(MOST).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let exchanged = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = exchanged.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_counted() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("abc", "abc"), 0);
    }
}

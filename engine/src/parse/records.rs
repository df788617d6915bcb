//! CSV records out of bytes that come in pieces of any size.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};

use crate::parse::error::{ParseError, ParseErrorKind, quoted};

/// The longest record, bytes: a hundred times an honest one.
pub(super) const MOST_RECORD_BYTES: usize = 16 * 1024;
/// The most fields in a record.
pub(super) const MOST_FIELDS: usize = 256;
/// What some programs put before a text in UTF-8.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// How many of the first bytes tell what a file is.
pub(super) const HEAD_BYTES: usize = 8;

/// One line of a file, taken apart.
pub(super) struct Record<'a> {
    /// The line, counted from 1.
    pub(super) line: u64,
    pub(super) bytes: &'a [u8],
    pub(super) ends: &'a [usize],
    /// Bytes between the end of a field and the next field.
    pub(super) gap: usize,
    /// Whether a line feed ends it; the last line of a file may have none.
    pub(super) ended: bool,
}

impl<'a> Record<'a> {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The field at an index that is below [`Record::len`].
    pub(super) fn field(&self, index: usize) -> &'a [u8] {
        let start = if index == 0 { 0 } else { self.ends[index - 1] + self.gap };
        &self.bytes[start..self.ends[index]]
    }

    pub(super) fn fields(&self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.len()).map(|i| self.field(i))
    }

    /// A line of blanks, as editors leave them at the end of a file.
    pub(super) fn is_blank(&self) -> bool {
        self.len() == 1 && self.field(0).trim_ascii().is_empty()
    }
}

/// A push parser: hands each record to a closure as soon as it is complete.
pub(super) struct Records {
    reader: Reader,
    delimiter: u8,
    bytes: Vec<u8>,
    ends: Vec<usize>,
    byte_count: usize,
    end_count: usize,
    /// The reader may be in the middle of a record.
    mid_record: bool,
    head: Vec<u8>,
    /// So many bytes of a byte order mark have come; `None` once it is known whether there is one. The reader knows only
    /// one that comes in one piece.
    mark: Option<usize>,
    /// The reader has been given something.
    begun: bool,
}

impl Records {
    pub(super) fn new() -> Records {
        Records::parted_by(b',')
    }

    /// Records whose fields are parted by this byte.
    pub(super) fn parted_by(delimiter: u8) -> Records {
        Records {
            reader: ReaderBuilder::new().delimiter(delimiter).build(),
            delimiter,
            bytes: vec![0; MOST_RECORD_BYTES],
            ends: vec![0; MOST_FIELDS],
            byte_count: 0,
            end_count: 0,
            mid_record: false,
            head: Vec::with_capacity(HEAD_BYTES),
            mark: Some(0),
            begun: false,
        }
    }

    /// Takes some bytes and hands on the records that they complete.
    pub(super) fn push(
        &mut self,
        mut input: &[u8],
        mut each: impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<(), ParseError> {
        let missing = HEAD_BYTES - self.head.len();
        self.head.extend_from_slice(&input[..input.len().min(missing)]);
        if let Some(come) = self.mark {
            let rest = &BYTE_ORDER_MARK[come..];
            let more = rest.iter().zip(input).take_while(|(mark, byte)| mark == byte).count();
            input = &input[more..];
            self.mark = Some(come + more);
            if more < rest.len() && input.is_empty() {
                return Ok(());
            }
            if more < rest.len() {
                self.no_mark(&mut each)?;
            }
            self.mark = None;
        }
        self.read(input, &mut each)
    }

    /// What looked like a byte order mark so far is none.
    fn no_mark(
        &mut self,
        each: &mut impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<(), ParseError> {
        let come = self.mark.take().unwrap_or_default();
        self.read(&BYTE_ORDER_MARK[..come], each)
    }

    fn read(
        &mut self,
        mut input: &[u8],
        each: &mut impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<(), ParseError> {
        while !input.is_empty() {
            let read = match self.plain_line(input, each)? {
                // The reader would take off one more mark, where all of it comes at once.
                0 if !self.begun => self.step(&input[..1], each)?,
                0 => self.step(input, each)?,
                read => read,
            };
            self.begun = true;
            input = &input[read..];
        }
        Ok(())
    }

    /// Takes a line that is all there and holds nothing but fields and delimiters, as nearly all do: that
    /// needs no copy and a third of the time. The number of bytes read, or 0 where the reader has to look.
    fn plain_line(
        &mut self,
        input: &[u8],
        each: &mut impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<usize, ParseError> {
        // The first line is the header, which is read once.
        if self.mid_record || self.reader.line() == 1 {
            return Ok(0);
        }
        let mut fields = 0;
        for (k, byte) in input.iter().enumerate().take(MOST_RECORD_BYTES) {
            match byte {
                _ if (*byte == self.delimiter || *byte == b'\n') && fields < MOST_FIELDS => {
                    self.ends[fields] = k;
                    fields += 1;
                    if *byte == b'\n' {
                        break;
                    }
                }
                b'\n' | b'"' | b'\r' => return Ok(0),
                _ if *byte == self.delimiter => return Ok(0),
                _ => {}
            }
        }
        let end = if fields > 0 { self.ends[fields - 1] } else { input.len() };
        if input.get(end) != Some(&b'\n') {
            return Ok(0);
        }
        let line = self.reader.line();
        self.reader.set_line(line + 1);
        let record = Record { line, bytes: &input[..end], ends: &self.ends[..fields], gap: 1, ended: true };
        if end > 0 && !record.is_blank() {
            each(&record)?;
        }
        Ok(end + 1)
    }

    /// Hands on the last record, when no line feed ends it.
    pub(super) fn finish(
        &mut self,
        mut each: impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<(), ParseError> {
        self.no_mark(&mut each)?;
        // To the reader, empty input is the end of the file.
        self.step(&[], &mut each).map(|_| ())
    }

    /// The first bytes of the file.
    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }

    fn step(
        &mut self,
        input: &[u8],
        each: &mut impl FnMut(&Record<'_>) -> Result<(), ParseError>,
    ) -> Result<usize, ParseError> {
        let (result, read, written, ended) = self.reader.read_record(
            input,
            &mut self.bytes[self.byte_count..],
            &mut self.ends[self.end_count..],
        );
        self.byte_count += written;
        self.end_count += ended;
        self.mid_record = !matches!(result, ReadRecordResult::Record);
        match result {
            ReadRecordResult::InputEmpty | ReadRecordResult::End => {}
            ReadRecordResult::OutputFull => {
                return Err(self.too_long(format!("at most {MOST_RECORD_BYTES} bytes in a line")));
            }
            ReadRecordResult::OutputEndsFull => {
                return Err(self.too_long(format!("at most {MOST_FIELDS} fields in a line")));
            }
            ReadRecordResult::Record => {
                // The reader has counted the line feed that ends the record, if it has read it.
                let after_line_feed = read > 0 && input[read - 1] == b'\n';
                let record = Record {
                    line: self.reader.line() - u64::from(after_line_feed),
                    bytes: &self.bytes[..self.byte_count],
                    ends: &self.ends[..self.end_count],
                    gap: 0,
                    ended: after_line_feed,
                };
                self.byte_count = 0;
                self.end_count = 0;
                if !record.is_blank() {
                    each(&record)?;
                }
            }
        }
        Ok(read)
    }

    fn too_long(&self, expected: String) -> ParseError {
        if let Some(error) = not_text(&self.head, &self.bytes[..self.byte_count]) {
            return error;
        }
        ParseError::new(
            ParseErrorKind::TooLong,
            expected,
            "more",
            "check that the file is a comma-separated table with one row a line",
        )
        .at_line(self.reader.line())
    }
}

/// The error for bytes that are no text at all, if they are not; `head` is the start of the file.
pub(super) fn not_text(head: &[u8], bytes: &[u8]) -> Option<ParseError> {
    const MAGIC: [(&[u8], &str); 8] = [
        (b"\x89PNG", "a PNG picture"),
        (b"\xFF\xD8\xFF", "a JPEG picture"),
        (b"GIF8", "a GIF picture"),
        (b"%PDF", "a PDF document"),
        (b"PK\x03\x04", "a ZIP archive or an office document"),
        (b"\x1F\x8B", "a gzip stream inside the gzip stream"),
        (b"\x28\xB5\x2F\xFD", "a zstd stream inside the zstd stream"),
        (b"\x7FELF", "a program"),
    ];
    let utf16 = head.starts_with(b"\xFF\xFE") || head.starts_with(b"\xFE\xFF");
    let found = match MAGIC.iter().find(|(magic, _)| head.starts_with(magic)) {
        Some((_, what)) => (*what).to_owned(),
        None if utf16 => "text in UTF-16".to_owned(),
        None if bytes.contains(&0) => format!("binary data ({})", quoted(bytes)),
        None => return None,
    };
    Some(ParseError::new(
        ParseErrorKind::NotText,
        "a CSV table, plain or compressed once with gzip or zstd",
        found,
        "choose the log file, or export the table as CSV in UTF-8",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str, chunk: usize) -> Vec<(u64, Vec<String>)> {
        let mut records = Records::new();
        let mut out = Vec::new();
        let mut each = |record: &Record<'_>| {
            let fields = record.fields().map(|f| String::from_utf8_lossy(f).into_owned()).collect();
            out.push((record.line, fields));
            Ok(())
        };
        for piece in text.as_bytes().chunks(chunk) {
            records.push(piece, &mut each).unwrap();
        }
        records.finish(&mut each).unwrap();
        out
    }

    #[test]
    fn lines_are_counted_whatever_ends_them_and_however_they_come() {
        for end in ["\n", "\r\n"] {
            let text = ["a,b", "1,2", "", "3,\"4 \"", "  ", "5,6"].join(end);
            for chunk in 1..=text.len() {
                let lines: Vec<u64> = all(&text, chunk).iter().map(|(line, _)| *line).collect();
                assert_eq!(lines, [1, 2, 4, 6], "chunk {chunk}, end {end:?}");
            }
        }
        assert_eq!(all("a\n1", 1)[1], (2, vec!["1".to_owned()]));
    }

    #[test]
    fn plain_lines_and_others_give_the_same_fields_wherever_they_are_cut() {
        let text = "a,b\n1,2\n,\n\"3\n,3\",4\n\n5,\"\"\r\n6,7\r\n8,9\n \n10,11\n12,13";
        let byte_by_byte = all(text, 1);
        assert_eq!(byte_by_byte[3], (5, vec!["3\n,3".to_owned(), "4".to_owned()]));
        assert_eq!(byte_by_byte.last(), Some(&(12, vec!["12".to_owned(), "13".to_owned()])));
        for chunk in 2..=text.len() {
            assert_eq!(all(text, chunk), byte_by_byte, "chunk {chunk}");
        }
    }

    #[test]
    fn a_byte_order_mark_is_taken_off_wherever_it_is_cut() {
        let mark = "\u{feff}";
        let fields = |line: u64, fields: &[&str]| (line, fields.iter().map(ToString::to_string).collect());
        for (text, expected) in [
            (format!("{mark}\"a,b\",c\n1,2"), vec![fields(1, &["a,b", "c"]), fields(2, &["1", "2"])]),
            (format!("{mark}\na,b"), vec![fields(2, &["a", "b"])]),
            (format!("{mark} \t"), vec![]),
            (mark.to_owned(), vec![]),
            (format!("{mark}{mark}a"), vec![fields(1, &["\u{feff}a"])]),
            ("\u{feef}a".to_owned(), vec![fields(1, &["\u{feef}a"])]),
        ] {
            for chunk in 1..=text.len() {
                assert_eq!(all(&text, chunk), expected, "{text:?} in pieces of {chunk}");
            }
        }
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let mut records = Records::new();
        let error = records.push(&vec![b'x'; 100_000], |_| Ok(())).unwrap_err();
        assert_eq!(error.code(), "too_long");
        let mut records = Records::new();
        let error = records.push(&vec![b','; 1000], |_| Ok(())).unwrap_err();
        assert_eq!(error.code(), "too_long");
    }
}

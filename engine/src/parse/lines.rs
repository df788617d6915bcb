//! Lines of a log out of bytes that come in pieces of any size. Unlike a record of a table, a line ends where it ends,
//! whatever is in it: one garbled line costs that line alone.

use crate::parse::records::{BYTE_ORDER_MARK, HEAD_BYTES, MOST_FIELDS, MOST_RECORD_BYTES, Record};

/// Zeros, as a card leaves a file that was reserved and never closed, and the end-of-file mark of old programs.
const FILLING: [u8; 2] = [0, 0x1A];
/// What stands for filling in the middle of a line, so that what was torn apart does not read as one number.
const TORN: u8 = 0x1A;

/// What a byte is to a line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    Plain,
    Delimiter,
    LineFeed,
    /// Something for a closer look.
    Odd,
}

/// A push parser: hands each line to a closure as soon as it is complete.
pub(super) struct Lines {
    delimiter: u8,
    classes: [Class; 256],
    /// The beginning of a line that has not ended yet.
    begun: Vec<u8>,
    too_long: bool,
    line: u64,
    ends: Vec<usize>,
    head: Vec<u8>,
    filling_bytes: u64,
}

/// A line as it is handed on.
pub(super) enum Line<'a> {
    /// Its fields.
    Record(Record<'a>),
    /// Line of this number has more bytes or fields than any honest one.
    TooLong(u64),
}

impl Lines {
    pub(super) fn parted_by(delimiter: u8) -> Lines {
        let mut classes = [Class::Plain; 256];
        for odd in FILLING.into_iter().chain([b'"']) {
            classes[usize::from(odd)] = Class::Odd;
        }
        // Blanks part fields as many as there are: that takes a closer look.
        classes[usize::from(delimiter)] = if delimiter == b' ' { Class::Odd } else { Class::Delimiter };
        classes[usize::from(b'\n')] = Class::LineFeed;
        Lines {
            delimiter,
            classes,
            begun: Vec::new(),
            too_long: false,
            line: 1,
            ends: Vec::with_capacity(MOST_FIELDS),
            head: Vec::with_capacity(HEAD_BYTES),
            filling_bytes: 0,
        }
    }

    /// The first bytes of the file.
    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }

    /// Bytes of filling so far.
    pub(super) fn filling_bytes(&self) -> u64 {
        self.filling_bytes
    }

    /// Takes some bytes and hands on the lines that they complete.
    pub(super) fn push<E>(
        &mut self,
        mut input: &[u8],
        mut each: impl FnMut(&Line<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let missing = HEAD_BYTES - self.head.len();
        self.head.extend_from_slice(&input[..input.len().min(missing)]);
        while !input.is_empty() {
            if self.begun.is_empty() && !self.too_long && self.line > 1 {
                let read = self.plain(input, &mut each)?;
                if read > 0 {
                    input = &input[read..];
                    continue;
                }
            }
            let Some(end) = input.iter().position(|byte| *byte == b'\n') else {
                self.keep(input);
                return Ok(());
            };
            self.keep(&input[..end]);
            input = &input[end + 1..];
            self.end_line(true, &mut each)?;
        }
        Ok(())
    }

    /// Hands on the last line, when no line feed ends it.
    pub(super) fn finish<E>(&mut self, mut each: impl FnMut(&Line<'_>) -> Result<(), E>) -> Result<(), E> {
        self.end_line(false, &mut each)
    }

    /// Takes a line that is all there and holds nothing but fields and delimiters, as nearly all do, without a copy.
    /// The number of bytes read, or 0 where a closer look is needed.
    fn plain<E>(
        &mut self,
        input: &[u8],
        each: &mut impl FnMut(&Line<'_>) -> Result<(), E>,
    ) -> Result<usize, E> {
        self.ends.clear();
        for (k, byte) in input.iter().enumerate().take(MOST_RECORD_BYTES) {
            match self.classes[usize::from(*byte)] {
                Class::Plain => {}
                Class::Delimiter if self.ends.len() < MOST_FIELDS - 1 => self.ends.push(k),
                Class::LineFeed => {
                    let ends_line = input[..k].iter().rev().take_while(|byte| **byte == b'\r').count();
                    let end = k - ends_line;
                    self.ends.push(end);
                    let record = Record {
                        line: self.line,
                        bytes: &input[..end],
                        ends: &self.ends,
                        gap: 1,
                        ended: true,
                    };
                    self.line += 1;
                    if !record.is_blank() {
                        each(&Line::Record(record))?;
                    }
                    return Ok(k + 1);
                }
                _ => return Ok(0),
            }
        }
        Ok(0)
    }

    /// Keeps a part of a line, without filling.
    fn keep(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let filling = FILLING.contains(byte);
            self.filling_bytes += u64::from(filling);
            if self.too_long || filling && matches!(self.begun.last(), None | Some(&TORN)) {
                continue;
            }
            if self.begun.len() == MOST_RECORD_BYTES {
                self.too_long = true;
                continue;
            }
            self.begun.push(if filling { TORN } else { *byte });
        }
    }

    fn end_line<E>(
        &mut self,
        ended: bool,
        each: &mut impl FnMut(&Line<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let line = self.line;
        self.line += 1;
        let mut begun = std::mem::take(&mut self.begun);
        if std::mem::take(&mut self.too_long) {
            begun.clear();
            self.begun = begun;
            return each(&Line::TooLong(line));
        }
        if line == 1 && begun.starts_with(BYTE_ORDER_MARK) {
            begun.drain(..BYTE_ORDER_MARK.len());
        }
        while matches!(begun.last(), Some(&(TORN | b'\r'))) {
            begun.pop();
        }
        if self.delimiter == b' ' {
            squeeze(&mut begun);
        }
        self.ends.clear();
        let (bytes, gap) = if begun.contains(&b'"') {
            (unquoted(&begun, self.delimiter, &mut self.ends), 0)
        } else {
            let delimiters = begun.iter().enumerate().filter(|(_, byte)| **byte == self.delimiter);
            self.ends.extend(delimiters.map(|(at, _)| at));
            self.ends.push(begun.len());
            (std::mem::take(&mut begun), 1)
        };
        let told = if self.ends.len() > MOST_FIELDS {
            each(&Line::TooLong(line))
        } else {
            let record = Record { line, bytes: &bytes, ends: &self.ends, gap, ended };
            if record.is_blank() { Ok(()) } else { each(&Line::Record(record)) }
        };
        self.begun = bytes;
        self.begun.clear();
        told
    }
}

/// Leaves one blank for every run of them, and none at the ends.
fn squeeze(line: &mut Vec<u8>) {
    let mut after_blank = true;
    line.retain(|byte| {
        let blank = *byte == b' ';
        let kept = !(blank && after_blank);
        after_blank = blank;
        kept
    });
    if line.last() == Some(&b' ') {
        line.pop();
    }
}

/// The fields of a line without the quotes around them, one after the other; a quote that is not closed ends with the line.
fn unquoted(line: &[u8], delimiter: u8, ends: &mut Vec<usize>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(line.len());
    let mut quoted = false;
    let mut at = 0;
    let mut field = 0;
    while let Some(byte) = line.get(at) {
        match byte {
            b'"' if quoted && line.get(at + 1) == Some(&b'"') => {
                bytes.push(b'"');
                at += 1;
            }
            b'"' if quoted || bytes.len() == field => quoted = !quoted,
            _ if *byte == delimiter && !quoted => {
                ends.push(bytes.len());
                field = bytes.len();
            }
            _ => bytes.push(*byte),
        }
        at += 1;
    }
    ends.push(bytes.len());
    bytes
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(pieces: &[&[u8]]) -> (Vec<(u64, Vec<String>, bool)>, u64) {
        let mut lines = Lines::parted_by(b',');
        let mut all = Vec::new();
        let mut each = |line: &Line<'_>| {
            match line {
                Line::Record(record) => {
                    let fields = record.fields().map(|field| String::from_utf8_lossy(field).into_owned());
                    all.push((record.line, fields.collect(), record.ended));
                }
                Line::TooLong(line) => all.push((*line, Vec::new(), true)),
            }
            Ok::<_, ()>(())
        };
        for piece in pieces {
            lines.push(piece, &mut each).unwrap();
        }
        lines.finish(&mut each).unwrap();
        (all, lines.filling_bytes())
    }

    #[test]
    fn a_line_ends_where_it_ends() {
        let (lines, filling) = read(&[b"\xEF\xBB\xBFa,b\r\n1,\"2\n\n3,\"4,\"\"5\"\n6,7"]);
        let fields: Vec<(u64, Vec<&str>)> = lines
            .iter()
            .map(|(line, fields, _)| (*line, fields.iter().map(String::as_str).collect()))
            .collect();
        assert_eq!(
            fields,
            [(1, vec!["a", "b"]), (2, vec!["1", "2"]), (4, vec!["3", "4,\"5"]), (5, vec!["6", "7"])]
        );
        assert_eq!((lines[2].2, lines[3].2, filling), (true, false, 0));
    }

    #[test]
    fn filling_is_counted_and_never_joins_what_it_tore_apart() {
        let mut text = b"a,b\n1,2\n3,4".to_vec();
        text.extend_from_slice(&[0; 40_000]);
        text.extend_from_slice(b"\n5,6\n7\0\0,8\n\x1A");
        let (lines, filling) = read(&[&text]);
        assert_eq!(lines[2].1, ["3", "4"]);
        assert_eq!(lines[3].1, ["5", "6"]);
        assert_eq!(lines[4].1, ["7\u{1a}", "8"]);
        assert_eq!((lines.len(), filling), (5, 40_003));
    }

    #[test]
    fn a_line_that_is_too_long_costs_itself_alone() {
        let text = format!("a,b\n{}\n3,4\n{}\n5,6\n", "1,".repeat(20_000), "1,".repeat(300));
        let (lines, _) = read(&[text.as_bytes()]);
        assert_eq!(lines.iter().map(|line| line.1.len()).collect::<Vec<_>>(), [2, 0, 2, 0, 2]);
    }

    proptest! {
        #[test]
        fn lines_are_the_same_however_they_are_cut(
            text in prop::collection::vec(prop_oneof![
                Just(b'\n'), Just(b','), Just(b'"'), Just(0_u8), Just(b'\r'), Just(0x1A_u8), Just(b'1'), Just(0xEF_u8), Just(b'\t')
            ], 0..200),
            cuts in prop::collection::vec(0_usize..200, 0..6),
        ) {
            let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut % (text.len() + 1)).collect();
            cuts.extend([0, text.len()]);
            cuts.sort_unstable();
            let pieces: Vec<&[u8]> = cuts.windows(2).map(|ends| &text[ends[0]..ends[1]]).collect();
            prop_assert_eq!(read(&pieces), read(&[&text]));
        }
    }
}

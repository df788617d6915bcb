//! Names in rows of numbers: a short name of a device or a prism as a number that a float holds exactly, and back.
//!
//! Eight places of six bits, the first letter at the top: 0 is no letter, then `A`–`Z`, `a`–`z`, `0`–`9` and `_`. A number below
//! [`FIRST_NAME`] is no name but a place in a list, counted from 1.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::records::Record;
use crate::system::Column;

/// Letters of a name at most.
pub const MOST_LETTERS: usize = 8;
/// The smallest number of a name.
pub const FIRST_NAME: f64 = 4_398_046_511_104.0;

const LETTERS: &[u8; 63] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";

/// Whether a column holds names: those of antennas, stations and prisms do.
pub(super) fn holds_names(column: &Column) -> bool {
    ["antenna", "station", "target"].contains(&column.name)
}

/// A name as a number; `None` where it has none.
pub fn number(name: &str) -> Option<f64> {
    if name.is_empty() || name.len() > MOST_LETTERS {
        return None;
    }
    let mut packed = 0_u64;
    for place in 0..MOST_LETTERS {
        let letter = match name.as_bytes().get(place) {
            Some(byte) => LETTERS.iter().position(|letter| letter == byte)? as u64 + 1,
            None => 0,
        };
        packed = packed << 6 | letter;
    }
    Some(packed as f64)
}

/// The name of a number; `None` where it is of none.
pub fn name(number: f64) -> Option<String> {
    if !(FIRST_NAME..(1_u64 << 48) as f64).contains(&number) || number.fract() != 0.0 {
        return None;
    }
    let packed = number as u64;
    let codes = (0..MOST_LETTERS).rev().map(|place| (packed >> (6 * place)) as usize & 63);
    let used: Vec<usize> = codes.take_while(|code| *code > 0).collect();
    let name: String = used.iter().map(|code| char::from(LETTERS[code - 1])).collect();
    // Nothing may follow where a name has ended.
    (self::number(&name) == Some(number)).then_some(name)
}

/// A field of a column that holds names.
pub(super) fn need_name(record: &Record<'_>, index: usize, column: &str) -> Result<f64, ParseError> {
    let field = record.field(index).trim_ascii();
    let name = std::str::from_utf8(field).ok().and_then(number);
    name.ok_or_else(|| {
        ParseError::new(
            ParseErrorKind::OutOfRange,
            "a name of 1 to 8 letters, digits and underscores",
            quoted(field),
            "name it so here and where the instrument is described",
        )
        .at_line(record.line)
        .in_column(column)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_comes_back_from_its_number_and_nothing_else_does() {
        for text in ["A1", "S", "P3", "pillar_9", "________", "zzzzzzzz", "0"] {
            let packed = number(text).unwrap();
            assert!(packed >= FIRST_NAME && packed.fract() == 0.0, "{text}: {packed}");
            assert_eq!(name(packed).as_deref(), Some(text));
        }
        assert_eq!(number("A1"), Some(f64::from(1_u32) * 64_f64.powi(7) + 54.0 * 64_f64.powi(6)));
        for wrong in ["", "nine_long", "S 1", "测站"] {
            assert_eq!(number(wrong), None, "{wrong:?}");
        }
        // A place in a list, half a number, a letter after the end.
        for wrong in [0.0, 6.0, FIRST_NAME + 0.5, FIRST_NAME + 1.0, f64::NAN, 1e300] {
            assert_eq!(name(wrong), None, "{wrong}");
        }
    }
}

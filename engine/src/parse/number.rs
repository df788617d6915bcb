//! Numbers out of fields.

use crate::parse::error::{ParseError, ParseErrorKind, quoted};
use crate::parse::records::{Record, not_text};

/// A field as a number; `nan` and `inf` are numbers, which the session reports as an anomaly.
pub(super) fn number(field: &[u8]) -> Option<f64> {
    fast_float2::parse(field).or_else(|_| fast_float2::parse(field.trim_ascii())).ok()
}

/// Whether a field says that there is no value, in the words of spreadsheets and of programs.
pub(super) fn is_missing(field: &[u8]) -> bool {
    if field.first().is_some_and(u8::is_ascii_digit) {
        return false;
    }
    let text = field.trim_ascii();
    let words: [&[u8]; 14] = [
        b"",
        b"nan",
        b"null",
        b"none",
        b"nil",
        b"n/a",
        b"na",
        b"#n/a",
        b"-",
        b"--",
        b"-nan",
        b"-nan(ind)",
        b"1.#qnan",
        b"-1.#ind",
    ];
    words.iter().any(|word| text.eq_ignore_ascii_case(word)) || text == "无".as_bytes()
}

/// A field that has to be a number.
pub(super) fn need_number(record: &Record<'_>, index: usize, column: &str) -> Result<f64, ParseError> {
    number(record.field(index)).ok_or_else(|| bad_number(record, index, column))
}

/// A field that has to be a finite number.
pub(super) fn need_finite(record: &Record<'_>, index: usize, column: &str) -> Result<f64, ParseError> {
    let value = need_number(record, index, column)?;
    if value.is_finite() {
        return Ok(value);
    }
    Err(bad_number(record, index, column))
}

/// A value that may be missing: an empty field, or NaN as the binary frame spells it.
pub(super) fn optional_number(
    record: &Record<'_>,
    index: usize,
    column: &str,
) -> Result<Option<f64>, ParseError> {
    let field = record.field(index);
    if field.is_empty() {
        return Ok(None);
    }
    match number(field) {
        Some(value) => Ok((!value.is_nan()).then_some(value)),
        None if is_missing(field) => Ok(None),
        None => Err(bad_number(record, index, column)),
    }
}

/// A field that has to be a time in seconds; given in whole nanoseconds.
pub(super) fn need_time_ns(record: &Record<'_>, index: usize, column: &str) -> Result<i64, ParseError> {
    let field = record.field(index);
    match seconds_to_ns(field) {
        Some(t_ns) => Ok(t_ns),
        None if number(field).is_some() => Err(ParseError::new(
            ParseErrorKind::BadTime,
            "a finite time in seconds, up to about 9·10⁹",
            quoted(field),
            "give the seconds since the start of the log",
        )
        .at_line(record.line)
        .in_column(column)),
        None => Err(bad_number(record, index, column)),
    }
}

/// The error for a field that is not a number.
pub(super) fn bad_number(record: &Record<'_>, index: usize, column: &str) -> ParseError {
    let field = record.field(index);
    if let Some(error) = not_text(&[], field) {
        return error.at_line(record.line).in_column(column);
    }
    let (kind, found) = if field.trim_ascii().is_empty() {
        (ParseErrorKind::EmptyField, "an empty field".to_owned())
    } else {
        (ParseErrorKind::NotANumber, quoted(field))
    };
    let advice =
        "correct the field: a point, not a comma, parts off the decimals, and nothing follows the number";
    ParseError::new(kind, "a number", found, advice).at_line(record.line).in_column(column)
}

/// Decimal seconds as whole nanoseconds, exactly as far as nine decimals go and rounded from there:
/// seconds since 1970 in a float would already be off by 0.1 µs.
pub(super) fn seconds_to_ns(field: &[u8]) -> Option<i64> {
    let field = field.trim_ascii();
    let (negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        all => (false, all),
    };
    let mut magnitude_ns: i64 = 0;
    let mut decimals: Option<u32> = None;
    let mut seen = false;
    let mut round_up = false;
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                seen = true;
                let digit = i64::from(byte - b'0');
                match decimals {
                    Some(9) => {
                        round_up = digit >= 5;
                        decimals = Some(10);
                    }
                    Some(10) => {}
                    _ => {
                        magnitude_ns = magnitude_ns.checked_mul(10)?.checked_add(digit)?;
                        decimals = decimals.map(|n| n + 1);
                    }
                }
            }
            b'.' if decimals.is_none() => decimals = Some(0),
            b'e' | b'E' if seen => return exponent_seconds_to_ns(field),
            _ => return None,
        }
    }
    if !seen {
        return None;
    }
    let scale = 10_i64.pow(9 - decimals.unwrap_or(0).min(9));
    let ns = magnitude_ns.checked_mul(scale)?.checked_add(i64::from(round_up))?;
    Some(if negative { -ns } else { ns })
}

fn exponent_seconds_to_ns(field: &[u8]) -> Option<i64> {
    let ns = (number(field)? * 1e9).round();
    // 2⁶³ is exact as a float; the largest i64 is not.
    (ns.abs() < 9_223_372_036_854_775_808.0).then_some(ns as i64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn seconds_are_exact() {
        let ns = |text: &str| seconds_to_ns(text.as_bytes());
        assert_eq!(ns("0"), Some(0));
        assert_eq!(ns("0.0049"), Some(4_900_000));
        assert_eq!(ns("1700000000.123456789"), Some(1_700_000_000_123_456_789));
        assert_eq!(ns("-0.5"), Some(-500_000_000));
        assert_eq!(ns(" 2. "), Some(2_000_000_000));
        assert_eq!(ns(".25"), Some(250_000_000));
        assert_eq!(ns("0.00000000049"), Some(0));
        assert_eq!(ns("0.0000000005"), Some(1));
        assert_eq!(ns("0.99999999951"), Some(1_000_000_000));
        assert_eq!(ns("1.5e1"), Some(15_000_000_000));
        for wrong in
            ["", ".", "-", "nan", "inf", "1,5", "0x1", "1.2.3", "99999999999", "e5", "1e30", "1e", "5 s"]
        {
            assert_eq!(ns(wrong), None, "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn every_nanosecond_comes_back(t_ns in -9_000_000_000_000_000_000_i64..9_000_000_000_000_000_000) {
            let sign = if t_ns < 0 { "-" } else { "" };
            let text = format!("{sign}{}.{:09}", t_ns.abs() / 1_000_000_000, t_ns.abs() % 1_000_000_000);
            prop_assert_eq!(seconds_to_ns(text.as_bytes()), Some(t_ns));
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let _ = seconds_to_ns(&bytes);
        }
    }
}

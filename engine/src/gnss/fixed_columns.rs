//! Lines of fixed columns, and the numbers in them.

/// The lines of a file, with their number; a carriage return at the end is no part of the line.
#[derive(Clone, Debug)]
pub struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    /// The lines of these bytes.
    pub fn new(bytes: &'a [u8]) -> Lines<'a> {
        Lines { rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), number: 0 }
    }

    /// The number of the line that came last, counted from 1.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Whether every line has been taken.
    pub fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    /// The next line, which stays.
    pub fn peek(&self) -> Option<&'a [u8]> {
        self.clone().next()
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = self.rest.iter().position(|&byte| byte == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &self.rest[self.rest.len()..]),
        };
        self.rest = rest;
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// The columns from `start` (counted from 0) on, at most `width`; fewer, or none, where the line is shorter.
pub fn columns(line: &[u8], start: usize, width: usize) -> &[u8] {
    let end = (start + width).min(line.len());
    line.get(start..end).unwrap_or_default()
}

/// A number with a decimal point, or a whole one; blanks around it are allowed, an exponent is `E` or `D`. None where nothing or no
/// number stands.
pub fn number(field: &[u8]) -> Option<f64> {
    let field = field.trim_ascii();
    let (negative, digits) = match field.first()? {
        b'-' => (true, &field[1..]),
        b'+' => (false, &field[1..]),
        _ => (false, field),
    };
    let mut value: u64 = 0;
    let mut seen = 0;
    let mut decimals = None;
    let mut exponent = 0;
    for (k, &byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => {
                if value > 900_000_000_000_000_000 {
                    return spelt(field);
                }
                value = value * 10 + u64::from(byte - b'0');
                seen += 1;
                if let Some(places) = &mut decimals {
                    *places += 1;
                }
            }
            b'.' if decimals.is_none() => decimals = Some(0),
            b'D' | b'd' | b'E' | b'e' if seen > 0 => {
                exponent = i32::from(whole(&digits[k + 1..])?);
                break;
            }
            _ => return None,
        }
    }
    if seen == 0 {
        return None;
    }
    let power = exponent - decimals.unwrap_or(0);
    if value >= 1 << 53 || power.abs() > 22 {
        return spelt(field);
    }
    // Both are exact, so that the quotient is the number nearest to what is written.
    let scale = POWERS[power.unsigned_abs() as usize];
    let magnitude = if power < 0 { value as f64 / scale } else { value as f64 * scale };
    Some(if negative { -magnitude } else { magnitude })
}

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The long way, for numbers of more digits than fit.
fn spelt(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.replace(['D', 'd'], "E");
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// A whole number; blanks around it are allowed.
pub fn whole(field: &[u8]) -> Option<i16> {
    std::str::from_utf8(field.trim_ascii()).ok()?.parse().ok()
}

/// A year, of which two digits may stand for four.
pub fn of_century(year: i16) -> i16 {
    match year {
        0..80 => year + 2000,
        80..100 => year + 1900,
        _ => year,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_the_nearest_to_what_is_written() {
        for text in [
            "36842422.530",
            "-1.774230040610D-04",
            " 5.153635631561e+03",
            "-.353",
            "9.",
            "198766.1231234567890123",
        ] {
            let expected: f64 = text.trim().replace('D', "E").parse().unwrap();
            assert_eq!(number(text.as_bytes()), Some(expected), "{text}");
        }
        for text in ["", "   ", "-", ".", "12x4", "1.2.3", "E5"] {
            assert_eq!(number(text.as_bytes()), None, "{text:?}");
        }
    }

    #[test]
    fn lines_end_in_any_way() {
        let lines: Vec<_> = Lines::new(b"a\r\nb\n\nc").collect();
        assert_eq!(lines, [&b"a"[..], b"b", b"", b"c"]);
    }

    #[test]
    fn a_short_line_has_short_columns() {
        assert_eq!(columns(b"abc", 1, 5), b"bc");
        assert_eq!(columns(b"abc", 5, 5), b"");
    }
}

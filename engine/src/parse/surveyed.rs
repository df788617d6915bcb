//! Numbers and angles as surveyors' tables and spreadsheets have them: wide digits, decimal commas, degrees with minutes
//! and seconds.

/// A number: wide digits, a real minus sign, blanks, thousands and a unit behind it are taken as they are meant.
pub fn number(text: &str, decimal_comma: bool) -> Option<f64> {
    let narrow = narrow(text);
    let plain = narrow.trim().trim_end_matches(['m', 'M', '米', '°', '度']).trim();
    let blanks_out: String =
        plain.chars().filter(|c| !matches!(c, ' ' | '\u{a0}' | '\u{202f}' | '\'' | '_')).collect();
    let (points, commas) = (blanks_out.matches('.').count(), blanks_out.matches(',').count());
    let decimal = match (points, commas) {
        (_, 0) => blanks_out,
        // The one that comes last parts the decimals, where there are both.
        (1.., 1..) if blanks_out.rfind(',') > blanks_out.rfind('.') => {
            blanks_out.replace('.', "").replace(',', ".")
        }
        (1.., 1..) => blanks_out.replace(',', ""),
        (0, 1) if decimal_comma => blanks_out.replace(',', "."),
        _ if in_thousands(&blanks_out) => blanks_out.replace(',', ""),
        _ => return None,
    };
    let number = decimal.as_bytes();
    // Words such as `nan` and `inf` are no surveyed numbers.
    if !number.first().is_some_and(|first| first.is_ascii_digit() || b"+-.".contains(first)) {
        return None;
    }
    decimal.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// An angle in degrees: decimal, or `25°39′11.69″N`, `25 39 11.69`, `N25:39:11.69`, `25-39-11.69`, `25d39m11.69s`,
/// `25 deg 39 min 11.69 sec`, `25度39分11.69秒`.
pub fn angle_deg(text: &str, decimal_comma: bool) -> Option<f64> {
    let spelt = marks(&narrow(text));
    let text = spelt.trim();
    let mut negative = false;
    let mut bare = String::new();
    for letter in text.chars() {
        match letter.to_ascii_uppercase() {
            'N' | 'E' | '北' | '东' | '纬' | '经' => {}
            'S' | 'W' | '南' | '西' => negative = true,
            other => bare.push(other),
        }
    }
    let decimal = || number(&bare, decimal_comma).map(|value| if negative { -value } else { value });
    let parted: String =
        bare.chars().map(|c| if "°º˚∘⁰゜度′'’‘ʹ´`分″\"”“ʺ秒:D".contains(c) { ' ' } else { c }).collect();
    let parted = dashes_out(&parted).unwrap_or(parted);
    let parts: Vec<&str> = parted.split_whitespace().collect();
    let (degrees, minutes, seconds) = match parts[..] {
        [degrees, minutes] => (degrees, minutes, "0"),
        [degrees, minutes, seconds] => (degrees, minutes, seconds),
        // Blanks part thousands in a number, not in an angle.
        [_, _, _, _, ..] => return None,
        _ => return decimal(),
    };
    let Some(angle) = sexagesimal(degrees, minutes, seconds, decimal_comma) else { return decimal() };
    Some(if negative != degrees.starts_with('-') { -angle } else { angle })
}

/// The words and letters for degrees, minutes and seconds as their marks.
fn marks(text: &str) -> String {
    let mut spelt = text.to_lowercase();
    for (word, mark) in [
        ("degrees", "°"),
        ("degree", "°"),
        ("deg", "°"),
        ("minutes", "′"),
        ("minute", "′"),
        ("min", "′"),
        ("seconds", "″"),
        ("second", "″"),
        ("sec", "″"),
    ] {
        if spelt.contains(word) {
            spelt = spelt.replace(word, mark);
        }
    }
    // An s behind d and m is no south.
    if let (Some(d), Some(m)) = (spelt.find('d'), spelt.find('m'))
        && d < m
    {
        spelt = spelt.replacen('d', "°", 1).replacen('m', "′", 1).replacen('s', "″", 1);
    }
    spelt
}

/// `25-39-11.69` with blanks for its dashes.
fn dashes_out(text: &str) -> Option<String> {
    let (sign, rest) = match text.trim().strip_prefix('-') {
        Some(rest) => ("-", rest),
        None => ("", text.trim()),
    };
    let parts: Vec<&str> = rest.split('-').map(str::trim).collect();
    let digits =
        |part: &&str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b',');
    let [_, _, ..] = parts[..] else { return None };
    (parts.len() <= 3 && parts.iter().all(digits)).then(|| format!("{sign}{}", parts.join(" ")))
}

/// How angles are written as one number that is no decimal of degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packed {
    /// `25.391169`: degrees, and minutes and seconds as decimals.
    DegreesPointMinutesSeconds,
    /// `253911.69`.
    DegreesMinutesSeconds,
    /// `2539.195`: degrees and minutes, as NMEA has them.
    DegreesMinutes,
}

impl Packed {
    /// All of them.
    pub const ALL: [Packed; 3] =
        [Packed::DegreesPointMinutesSeconds, Packed::DegreesMinutesSeconds, Packed::DegreesMinutes];

    /// The angle in degrees; `None` where minutes or seconds are sixty or more.
    pub fn degrees(self, value: f64) -> Option<f64> {
        let of = match self {
            Packed::DegreesPointMinutesSeconds => value.abs() * 10_000.0,
            Packed::DegreesMinutesSeconds => value.abs(),
            Packed::DegreesMinutes => {
                let (degrees, minutes) = ((value.abs() / 100.0).floor(), value.abs() % 100.0);
                return (minutes < 60.0).then(|| (degrees + minutes / 60.0).copysign(value));
            }
        };
        // What a float cannot hold is no sixtieth second.
        let of = (of * 1e6).round() / 1e6;
        let seconds = of % 100.0;
        let minutes = (of / 100.0).floor() % 100.0;
        let degrees = (of / 10_000.0).floor();
        (minutes < 60.0 && seconds < 60.0)
            .then(|| (degrees + minutes / 60.0 + seconds / 3600.0).copysign(value))
    }
}

/// Degrees, minutes and seconds together, without the sign.
fn sexagesimal(degrees: &str, minutes: &str, seconds: &str, decimal_comma: bool) -> Option<f64> {
    let whole: f64 = degrees.trim_start_matches(['-', '+']).parse::<u16>().ok()?.into();
    let below_sixty = |text: &str| number(text, decimal_comma).filter(|value| (0.0..60.0).contains(value));
    Some(whole + below_sixty(minutes)? / 60.0 + below_sixty(seconds)? / 3600.0)
}

/// Wide forms, as Chinese input methods write them, in their narrow ones; every minus sign as one.
pub(super) fn narrow(text: &str) -> String {
    text.chars()
        .map(|c| match u32::from(c) {
            code @ 0xFF01..=0xFF5E => char::from_u32(code - 0xFEE0).unwrap_or(c),
            0x3000 => ' ',
            0x2212 | 0x2010..=0x2015 => '-',
            0x3002 => '.',
            _ => c,
        })
        .filter(|c| !matches!(u32::from(*c), 0x200B..=0x200F | 0x202A..=0x202E | 0x2060 | 0xFEFF))
        .collect()
}

/// Whether commas part groups of three digits.
fn in_thousands(text: &str) -> bool {
    let whole = text.trim_start_matches(['-', '+']);
    let mut groups = whole.split(',');
    let digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups.next().is_some_and(|first| (1..=3).contains(&first.len()) && digits(first));
    first && groups.all(|group| group.len() == 3 && digits(group)) && whole.matches(',').count() > 1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_what_they_mean() {
        for (text, value) in [
            ("１２．１８９", 12.189),
            ("－３０．３９３", -30.393),
            ("−2", -2.0),
            (" 1.5 m", 1.5),
            ("2,838,033.609", 2_838_033.609),
            ("2 838 033.609", 2_838_033.609),
            ("2.838.033,609", 2_838_033.609),
            ("1.2e3", 1200.0),
        ] {
            assert_eq!(number(text, false), Some(value), "{text}");
        }
        assert_eq!((number("12,189", true), number("12,189", false)), (Some(12.189), None));
        for wrong in ["", "nan", "inf", "east", "1.2.3", "-", "1,2,3"] {
            assert_eq!(number(wrong, true), None, "{wrong}");
        }
    }

    #[test]
    fn angles_are_read_in_every_notation() {
        let degrees = 25.0 + 39.0 / 60.0 + 11.6906 / 3600.0;
        for text in [
            "25°39′11.6906″N",
            "25°39'11.6906\"",
            "25 39 11.6906",
            "N25:39:11.6906",
            "北纬25度39分11.6906秒",
            "２５°３９′１１．６９０６″",
            "25º39’11.6906”",
            "25-39-11.6906",
            "25d39m11.6906s",
            "25d 39m 11.6906s N",
            "25 deg 39 min 11.6906 sec",
            "25∘39ʹ11.6906ʺ",
            "25°39'11.6906''N",
        ] {
            assert!((angle_deg(text, false).unwrap() - degrees).abs() < 1e-12, "{text}");
        }
        assert_eq!(angle_deg("106.856667", false), Some(106.856667));
        assert_eq!(angle_deg("12°30′S", false), Some(-12.5));
        assert_eq!(angle_deg("-0°30′", false), Some(-0.5));
        assert_eq!(angle_deg("12,5°W", true), Some(-12.5));
        assert_eq!(
            (angle_deg("-12-30-00", false), angle_deg("12d30m00s S", false)),
            (Some(-12.5), Some(-12.5))
        );
        for (packed, value) in [
            (Packed::DegreesPointMinutesSeconds, 25.391_169_06),
            (Packed::DegreesMinutesSeconds, 253_911.690_6),
            (Packed::DegreesMinutes, 2_539.194_843_333),
        ] {
            assert!((packed.degrees(value).unwrap() - degrees).abs() < 1e-9, "{packed:?}");
            assert!((packed.degrees(-value).unwrap() + degrees).abs() < 1e-9, "{packed:?}");
        }
        assert_eq!(Packed::DegreesMinutes.degrees(2_570.0), None);
        for wrong in ["", "25°60′1″", "25 39 11 4", "north", "25°x"] {
            assert_eq!(angle_deg(wrong, false), None, "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_text_never_panics(text in "\\PC{0,30}", near in "[0-9 .,°′″NSEW:-]{0,20}", comma: bool) {
            let _ = (number(&text, comma), angle_deg(&text, comma), number(&near, comma), angle_deg(&near, comma));
        }
    }
}

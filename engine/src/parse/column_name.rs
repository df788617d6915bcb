//! The name of a column taken apart: what it is called, and in which unit, whatever brackets, blanks and marks are used.

use crate::parse::surveyed::narrow;

/// A column's name and unit, spelt alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ColumnName {
    /// Lower case, without unit, brackets, accents and what parts words.
    pub(super) name: String,
    /// `deg/s`, `m/s2`, `ut`; empty where none is said.
    pub(super) unit: String,
}

const OPENING: [char; 5] = ['(', '[', '（', '【', '{'];
const CLOSING: [char; 5] = [')', ']', '）', '】', '}'];
/// What parts words.
const PARTING: &[char] = &['_', '-', '.', '/', ':', ' ', '\u{a0}', '#'];
/// Units as the last words of a name have them, longest first.
const LAST_WORDS: &[(&str, &str)] = &[
    ("m s 2", "m/s2"),
    ("m s2", "m/s2"),
    ("m s^2", "m/s2"),
    ("in ms", "ms"),
    ("in us", "us"),
    ("in s", "s"),
    ("rad s", "rad/s"),
    ("deg s", "deg/s"),
    ("mdeg s", "mdeg/s"),
    ("ms2", "m/s2"),
    ("mps2", "m/s2"),
    ("mdps", "mdeg/s"),
    ("dps", "deg/s"),
    ("rps", "rad/s"),
    ("rads", "rad/s"),
    ("mg", "mg"),
    ("g", "g"),
    ("ut", "ut"),
    ("nt", "nt"),
    ("mgauss", "mgauss"),
    ("gauss", "gauss"),
    ("hpa", "hpa"),
    ("mbar", "hpa"),
    ("kpa", "kpa"),
    ("pa", "pa"),
    ("ms", "ms"),
    ("us", "us"),
    ("ns", "ns"),
    ("s", "s"),
    ("sec", "s"),
];

impl ColumnName {
    /// Of a name, with the unit that a row below it says, if any.
    pub(super) fn of(column: &str, below: &str) -> ColumnName {
        let narrow = narrow(column).replace('Â', "");
        let lower: String = narrow.to_lowercase().chars().map(plain).collect();
        let (mut name, mut unit) = (String::new(), String::new());
        let mut rest = lower.as_str();
        while let Some(at) = rest.find(OPENING) {
            let (before, inside) = rest.split_at(at);
            name.push_str(before);
            let inside = &inside[inside.chars().next().map_or(0, char::len_utf8)..];
            let end = inside.find(CLOSING).unwrap_or(inside.len());
            let said = inside[..end].trim();
            let bare = said.trim_end_matches("轴").trim_end_matches("axis").trim_end_matches(['-', ' ']);
            if matches!(bare, "x" | "y" | "z" | "0" | "1" | "2" | "3") {
                name.push_str(bare);
            } else if unit.is_empty() {
                unit = said.to_owned();
            }
            rest = &inside[end..];
            rest = &rest[rest.chars().next().map_or(0, char::len_utf8)..];
        }
        name.push_str(rest);
        if unit.is_empty() {
            let words: Vec<&str> = name.split(PARTING).filter(|word| !word.is_empty()).collect();
            let last = LAST_WORDS.iter().find_map(|(spelt, unit)| {
                let of: Vec<&str> = spelt.split(' ').collect();
                (words.len() > of.len() && words.ends_with(&of)).then_some((of.len(), *unit))
            });
            if let Some((count, said)) = last {
                unit = said.to_owned();
                name = words[..words.len() - count].concat();
            }
        }
        let unit = if unit.is_empty() { below.to_lowercase().chars().map(plain).collect() } else { unit };
        let name: String =
            name.chars().filter(|c| !c.is_whitespace() && !PARTING.contains(c) && *c != '"').collect();
        let name = ["axis", "achse", "轴", "軸"].iter().fold(name, |name, word| name.replace(word, ""));
        ColumnName { name, unit: alike_unit(&unit) }
    }

    /// Whether it is this axis of a quantity with one of these names, or a letter and the axis alone.
    pub(super) fn is_axis(&self, words: &[&str], short: &[char], axis: char) -> bool {
        let letters: Vec<char> = self.name.chars().collect();
        if let [quantity, last] = letters[..] {
            return short.contains(&quantity) && last == axis;
        }
        words.iter().any(|word| {
            self.name.find(word).is_some_and(|at| {
                let (before, behind) = (&self.name[..at], &self.name[at + word.len()..]);
                behind.ends_with(axis)
                    || before.ends_with(axis)
                    || axis.is_alphabetic()
                        && behind.chars().find(|c| "xyz".contains(*c)) == Some(axis)
                        && behind.len() < 14
            })
        })
    }
}

/// A letter without its accent; every degree and micro as one.
fn plain(letter: char) -> char {
    match letter {
        'à' | 'á' | 'â' | 'ã' | 'ä' => 'a',
        'è' | 'é' | 'ê' | 'ë' => 'e',
        'ì' | 'í' | 'î' | 'ï' => 'i',
        'ò' | 'ó' | 'ô' | 'õ' | 'ö' => 'o',
        'ù' | 'ú' | 'û' | 'ü' => 'u',
        'ç' => 'c',
        'ñ' => 'n',
        'µ' | 'μ' => 'u',
        '²' | '２' => '2',
        'º' | '˚' | '∘' | '\u{fffd}' => '°',
        '／' => '/',
        '⁻' => '-',
        other => other,
    }
}

/// A unit in one spelling.
fn alike_unit(unit: &str) -> String {
    let mut unit: String =
        unit.chars().filter(|c| !c.is_whitespace() && !OPENING.contains(c) && !CLOSING.contains(c)).collect();
    for (from, to) in [
        ("^", ""),
        ("**", ""),
        ("*", ""),
        ("/second", "/s"),
        ("/sec", "/s"),
        ("/秒", "/s"),
        ("度/s", "deg/s"),
        ("per", "/"),
        ("degrees", "deg"),
        ("degree", "deg"),
        ("radians", "rad"),
        ("°", "deg"),
        ("mdps", "mdeg/s"),
        ("dps", "deg/s"),
        ("m/s/s", "m/s2"),
        ("m·s-2", "m/s2"),
        ("m.s-2", "m/s2"),
        ("ms-2", "m/s2"),
        ("microtesla", "ut"),
        ("milligauss", "mgauss"),
    ] {
        if unit.contains(from) {
            unit = unit.replace(from, to);
        }
    }
    unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_are_told_apart() {
        for (column, name, unit) in [
            ("Acc X (g)", "accx", "g"),
            ("acc_x_m_s2", "accx", "m/s2"),
            ("ACCELEROMETER X (m/s²)", "accelerometerx", "m/s2"),
            ("Gyro[0]", "gyro0", ""),
            ("角速度(X)(°/s)", "角速度x", "deg/s"),
            ("X轴加速度【g】", "x加速度", "g"),
            ("Time since start in ms ", "timesincestart", "ms"),
            ("Accélération Y [m·s⁻²]", "accelerationy", "m/s2"),
            ("gyr.x (deg/sec)", "gyrx", "deg/s"),
            ("ＡｃｃＸ（ｇ）", "accx", "g"),
            ("s", "s", ""),
        ] {
            assert_eq!(
                ColumnName::of(column, ""),
                ColumnName { name: name.to_owned(), unit: unit.to_owned() },
                "{column}"
            );
        }
        assert_eq!(ColumnName::of("Foot/Acceleration/X", "m/s^2").unit, "m/s2");
    }

    proptest::proptest! {
        #[test]
        fn arbitrary_names_never_panic(name in "\\PC{0,30}", near in "[a-z_()\\[\\] /]{0,20}", below in "\\PC{0,10}") {
            let _ = (ColumnName::of(&name, &below), ColumnName::of(&near, ""));
        }
    }
}

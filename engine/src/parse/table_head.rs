//! The beginning of a text table, looked at before it is known how to read it.

use crate::parse::clock_text;
use crate::parse::mapped_csv::name_of;
use crate::parse::mapping::{Axes, Delimiter, Scalar};
use crate::parse::surveyed::narrow;

/// Lines of the beginning that are looked at.
const MOST_LINES: usize = 200;
/// Columns that a table of samples has at least: three rates and three forces.
const FEWEST_COLUMNS: usize = 6;
/// Rows that are shown of a table.
const ROWS_SHOWN: usize = 8;
/// Columns of which anything is shown.
const COLUMNS_SHOWN: usize = 256;

/// Lines of text, whatever they turn out to be.
#[derive(Debug)]
pub(super) struct TextHead {
    lines: Vec<String>,
}

/// A line taken for the header of a table.
#[derive(Debug)]
pub(super) struct Candidate<'a> {
    /// Which line it is, from 0.
    pub(super) line: usize,
    pub(super) delimiter: Delimiter,
    pub(super) names: Names<'a>,
}

/// The names in a header.
#[derive(Debug)]
pub(super) struct Names<'a> {
    pub(super) all: Vec<&'a str>,
    /// The same, spelt alike: lower case, no blanks, one spelling of every unit.
    alike: Vec<String>,
}

/// The header and the first rows of a table, as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableHead {
    /// What stands between the fields.
    pub delimiter: Delimiter,
    /// The names in the header.
    pub columns: Vec<String>,
    /// The first rows below it.
    pub rows: Vec<Vec<String>>,
}

impl TextHead {
    /// Takes the first bytes of a file apart; `None` when they are no text. Unless they are the `whole`
    /// file, the last line may be half a line and is left out.
    pub(super) fn read(bytes: &[u8], whole: bool) -> Option<TextHead> {
        // Filling behind the text is no part of it.
        let end = bytes.iter().rposition(|byte| !matches!(byte, 0 | 0x1A)).map_or(0, |last| last + 1);
        let bytes = if end == 0 { bytes } else { &bytes[..end] };
        if bytes.contains(&0) {
            return None;
        }
        let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').take(MOST_LINES + 1).collect();
        if !whole || lines.len() > MOST_LINES {
            lines.pop();
        }
        Some(TextHead { lines: lines.into_iter().map(|line| name_of(line).into_owned()).collect() })
    }

    /// Every line, parted in every way that gives enough columns.
    pub(super) fn candidates(&self) -> impl Iterator<Item = Candidate<'_>> {
        self.candidates_of(FEWEST_COLUMNS)
    }

    fn candidates_of(&self, fewest: usize) -> impl Iterator<Item = Candidate<'_>> {
        self.lines.iter().enumerate().flat_map(move |(line, text)| {
            Delimiter::ALL.into_iter().filter_map(move |delimiter| {
                // What other delimiters part is not parted by the blanks in it.
                if delimiter == Delimiter::Blanks && text.contains([',', ';', '\t', '|']) {
                    return None;
                }
                let all: Vec<&str> = fields(text, delimiter).collect();
                (all.len() >= fewest).then(|| Candidate {
                    line,
                    delimiter,
                    names: Names { alike: all.iter().map(|name| alike(name)).collect(), all },
                })
            })
        })
    }

    /// The fields of the first row below a header.
    pub(super) fn row_below(&self, header: &Candidate<'_>) -> Vec<&str> {
        let below = self.lines[header.line + 1..].iter().find(|line| !line.trim().is_empty());
        below.map_or_else(Vec::new, |line| fields(line, header.delimiter).collect())
    }

    /// The lines before a header.
    pub(super) fn before(&self, header: &Candidate<'_>) -> &[String] {
        &self.lines[..header.line]
    }

    /// The table that these lines look most like: names above numbers.
    pub(super) fn table(&self) -> Option<TableHead> {
        self.table_of(FEWEST_COLUMNS)
    }

    /// The same where a table may have as few columns as that.
    pub(super) fn table_of(&self, fewest: usize) -> Option<TableHead> {
        let numeric = |field: &&str| field.replace(',', ".").parse::<f64>().is_ok();
        let timed = |field: &&str| clock_text::is_time(field.as_bytes());
        self.candidates_of(fewest)
            .filter(|header| {
                // A row of decimal commas, cut at its commas, is no row of names either.
                let nameless = |name: &&&str| !name.is_empty() && !name.chars().any(char::is_alphabetic);
                let no_names = header.names.all.iter().filter(|name| numeric(name) || nameless(name)).count();
                no_names * 2 < header.names.all.len()
            })
            .filter(|header| {
                // A row of units may stand between the names and the numbers.
                let below =
                    self.lines[header.line + 1..].iter().filter(|line| !line.trim().is_empty()).take(2);
                below.map(|line| fields(line, header.delimiter).collect::<Vec<_>>()).any(|row| {
                    row.len() >= fewest && row.iter().filter(|f| numeric(f) || timed(f)).count() >= fewest
                })
            })
            .max_by_key(|header| (header.names.all.len(), std::cmp::Reverse(header.line)))
            .map(|header| self.shown(&header))
    }

    /// A table of numbers without names: its columns are called by their numbers, from 1; and all of its rows that are here.
    pub(super) fn headless(&self) -> Option<(TableHead, Vec<Vec<f64>>)> {
        /// A time, rates and forces.
        const FEWEST: usize = 7;
        Delimiter::ALL.into_iter().find_map(|delimiter| {
            let decimal_comma = delimiter != Delimiter::Comma;
            let value = |field: &str| match decimal_comma {
                true => field.replace(',', ".").parse::<f64>().ok(),
                false => field.parse::<f64>().ok(),
            };
            let lines: Vec<&String> = self.lines.iter().filter(|line| !line.trim().is_empty()).collect();
            let blanks = delimiter == Delimiter::Blanks;
            if blanks && lines.iter().any(|line| line.contains([',', ';', '\t', '|'])) {
                return None;
            }
            let cells = |line: &&String| fields(line, delimiter).map(str::to_owned).collect::<Vec<_>>();
            let width = lines.first().map_or(0, |line| fields(line, delimiter).count());
            let rows: Vec<Vec<f64>> = lines
                .iter()
                .map(|line| fields(line, delimiter).map(|field| value(field).unwrap_or(f64::NAN)).collect())
                .filter(|row: &Vec<f64>| row.len() == width)
                .collect();
            let numbers = |row: &Vec<f64>| row.iter().filter(|value| !value.is_nan()).count();
            let all = width >= FEWEST
                && rows.len() >= 2
                && rows.len() * 10 >= lines.len() * 9
                && rows.iter().all(|row| numbers(row) + 1 >= FEWEST);
            all.then(|| {
                let columns = (1..=width.min(COLUMNS_SHOWN)).map(|number| number.to_string()).collect();
                let shown = lines.iter().take(ROWS_SHOWN).map(cells).collect();
                (TableHead { delimiter, columns, rows: shown }, rows)
            })
        })
    }

    /// The header and what is below it, for people to see.
    pub(super) fn shown(&self, header: &Candidate<'_>) -> TableHead {
        let owned = |field: &str| -> String { field.chars().filter(|c| !c.is_control()).take(100).collect() };
        let below = self.lines[header.line + 1..].iter().filter(|line| !line.trim().is_empty());
        TableHead {
            delimiter: header.delimiter,
            columns: header.names.all.iter().take(COLUMNS_SHOWN).map(|name| owned(name)).collect(),
            rows: below
                .take(ROWS_SHOWN)
                .map(|line| fields(line, header.delimiter).take(COLUMNS_SHOWN).map(owned).collect())
                .collect(),
        }
    }
}

impl Names<'_> {
    /// Where the first of these names stands; the patterns are spelt as [`alike`] spells.
    pub(super) fn find(&self, pattern: &str) -> Option<usize> {
        let pattern = alike(pattern);
        self.alike.iter().position(|name| *name == pattern)
    }

    /// The three columns of the first pattern that is there; `{}` stands for the axis.
    pub(super) fn axes<U: Copy>(&self, patterns: &[(&str, U)]) -> Option<Axes<U>> {
        patterns.iter().find_map(|(pattern, unit)| {
            let column = |axis| {
                let index = self.find(&pattern.replace("{}", axis))?;
                Some(self.all[index].to_owned())
            };
            Some(Axes::of([column("x")?, column("y")?, column("z")?], *unit))
        })
    }

    /// The first of these columns that is there.
    pub(super) fn one<U: Copy>(&self, patterns: &[(&str, U)]) -> Option<Scalar<U>> {
        patterns.iter().find_map(|(pattern, unit)| {
            self.find(pattern).map(|index| Scalar { column: self.all[index].to_owned(), unit: *unit })
        })
    }

    /// The same names, each shortened so.
    pub(super) fn shortened(&self, shorten: impl Fn(&str) -> &str) -> Names<'_> {
        let alike = self.alike.iter().map(|name| shorten(name).to_owned()).collect();
        Names { all: self.all.clone(), alike }
    }

    /// The same names, each without what stands before its last colon: the device, in some exports.
    pub(super) fn without_devices(&self) -> Names<'_> {
        let short = |name: &String| name.rsplit(':').next().unwrap_or_default().to_owned();
        Names { all: self.all.clone(), alike: self.alike.iter().map(short).collect() }
    }
}

fn fields(line: &str, delimiter: Delimiter) -> impl Iterator<Item = &str> {
    line.split(char::from(delimiter.byte()))
        .map(|field| field.trim().trim_matches('"').trim())
        .filter(move |field| delimiter != Delimiter::Blanks || !field.is_empty())
}

/// A name in one spelling: lower case, no blanks, `deg/s`, `ut`, `m/s2`.
pub(super) fn alike(name: &str) -> String {
    let mut out: String = narrow(name)
        .chars()
        .filter(|c| !c.is_whitespace() && *c != 'Â')
        .flat_map(char::to_lowercase)
        .map(|c| match c {
            '\u{b5}' | '\u{3bc}' => 'u',
            '²' => '2',
            '（' | '[' | '【' => '(',
            '）' | ']' | '】' => ')',
            '／' => '/',
            'º' | '˚' | '∘' => '°',
            other => other,
        })
        .collect();
    for (from, to) in [
        ("/second", "/s"),
        ("/sec", "/s"),
        ("/秒", "/s"),
        ("度/s", "deg/s"),
        ("degrees/s", "deg/s"),
        ("radians/s", "rad/s"),
        ("°/s", "deg/s"),
        // A degree of another encoding.
        ("(\u{fffd}/s", "(deg/s"),
        ("mdps", "mdeg/s"),
        ("dps", "deg/s"),
        ("m/s^2", "m/s2"),
        ("m/s/s", "m/s2"),
        ("m/s\u{fffd}", "m/s2"),
        ("m/s**2", "m/s2"),
        ("m.s-2", "m/s2"),
        ("m·s-2", "m/s2"),
        ("microtesla", "ut"),
    ] {
        if out.contains(from) {
            out = out.replace(from, to);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_found_below_whatever_stands_above_it() {
        let text = "Recorded by Ming\n\nsecs;wx;wy;wz;fx;fy;fz;\n0,01;1;2;3;4;5;6;\n\n0,02;1;2;3;4;5;7;\n";
        let table = TextHead::read(text.as_bytes(), true).unwrap().table().unwrap();
        assert_eq!(table.delimiter, Delimiter::Semicolon);
        assert_eq!(table.columns[..2], ["secs", "wx"]);
        assert_eq!((table.rows.len(), &*table.rows[1][6]), (2, "7"));
        assert!(TextHead::read(b"a,b\n1,2\n", true).unwrap().table().is_none());
        assert!(TextHead::read(b"\0", true).is_none());
    }

    #[test]
    fn a_cut_line_is_left_out() {
        let text = b"a,b,c,d,e,f\n1,2,3,4,5,6\n1,2,3,4,5";
        assert_eq!(TextHead::read(text, false).unwrap().table().unwrap().rows.len(), 1);
    }

    #[test]
    fn names_are_spelt_alike() {
        for name in ["AsX(°/s)", "asx (dps)", "AsX(Â°/s)", " ASX（deg/s）"] {
            assert_eq!(alike(name), "asx(deg/s)", "{name}");
        }
        assert_eq!(alike("Magnetic field X(µT)"), "magneticfieldx(ut)");
    }
}

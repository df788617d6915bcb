//! What can go wrong on a survey.

use std::str::FromStr;

/// One thing that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// Nothing.
    None,
    /// The tip slips by 10 cm during a landing in the gap.
    Slip,
    /// The tip slips by 10 cm while it is held on the point.
    SlipOnPoint,
    /// A landing in the gap is on something that rolls at 0.35 m/s.
    MovingGround,
    /// Half a minute of float solutions in the gap, 0.3 m off, that say so.
    Float,
    /// The same, saying 2.5 cm.
    FloatTold,
    /// The same as fixed solutions.
    WrongFix,
    /// A switch that opens and closes many times at each change.
    Chatter,
    /// The tip was measured 2 cm off.
    TipOff,
    /// No leaning at the start.
    NoManoeuvre,
}

const WORDS: [(&str, Trouble); 10] = [
    ("none", Trouble::None),
    ("slip", Trouble::Slip),
    ("slip-on-point", Trouble::SlipOnPoint),
    ("moving-ground", Trouble::MovingGround),
    ("float", Trouble::Float),
    ("float-told", Trouble::FloatTold),
    ("wrong-fix", Trouble::WrongFix),
    ("chatter", Trouble::Chatter),
    ("tip-off", Trouble::TipOff),
    ("no-manoeuvre", Trouble::NoManoeuvre),
];

impl FromStr for Trouble {
    type Err = String;

    fn from_str(text: &str) -> Result<Trouble, String> {
        WORDS.iter().find(|(word, _)| *word == text).map(|(_, trouble)| *trouble).ok_or_else(|| {
            let words: Vec<&str> = WORDS.iter().map(|(word, _)| *word).collect();
            format!("expected one of {}, found {text:?}", words.join(", "))
        })
    }
}

//! What goes wrong in a run.

use std::fmt;
use std::str::FromStr;

/// Something that goes wrong, from one time to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// What.
    pub kind: FaultKind,
    /// From when, s.
    pub from_s: f64,
    /// Until when, s.
    pub to_s: f64,
}

/// What can go wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// No station sees anything.
    Fog,
    /// No antenna has a fix.
    NoAntennas,
    /// One antenna, by its number, is 5 to 20 cm off and says that it is fixed.
    WrongFix(usize),
    /// All antennas of one make are 6 to 12 cm off: its base station.
    WrongMake(usize),
    /// One station, by its number, looks at the neighbour's prism and names its own.
    WrongPrism(usize),
    /// One station's distances are 15 to 34 mm wrong.
    WrongDistance(usize),
    /// The cabin's inertial sensor is silent, and has other biases afterwards.
    Restart,
    /// Rows of one make are 80 to 150 ms later than stated.
    LateMake(usize),
    /// The encoders write nothing.
    NoEncoders,
    /// One leg, by its number, reads 20 to 100 mm too much or too little.
    WrongLeg(usize),
}

/// A kind of fault of a device, by its number.
type OfDevice = fn(usize) -> FaultKind;

const NAMES: [(&str, OfDevice); 10] = [
    ("fog", |_| FaultKind::Fog),
    ("no_antennas", |_| FaultKind::NoAntennas),
    ("wrong_fix", FaultKind::WrongFix),
    ("wrong_make", FaultKind::WrongMake),
    ("wrong_prism", FaultKind::WrongPrism),
    ("wrong_distance", FaultKind::WrongDistance),
    ("restart", |_| FaultKind::Restart),
    ("late_make", FaultKind::LateMake),
    ("no_encoders", |_| FaultKind::NoEncoders),
    ("wrong_leg", FaultKind::WrongLeg),
];

impl Fault {
    pub(super) fn holds(&self, kind: FaultKind, t_s: f64) -> bool {
        self.kind == kind && (self.from_s..self.to_s).contains(&t_s)
    }
}

impl FromStr for Fault {
    type Err = String;

    /// `KIND[.NUMBER]@FROM..TO`, such as `wrong_fix.2@300..320`.
    fn from_str(text: &str) -> Result<Fault, String> {
        let wrong = || {
            let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
            format!(
                "expected a fault such as wrong_fix.2@300..320, of the kinds {}, found {text:?}",
                names.join(", ")
            )
        };
        let (what, when) = text.split_once('@').ok_or_else(wrong)?;
        let (name, number) = what.split_once('.').unwrap_or((what, "0"));
        let number = number.parse().map_err(|_| wrong())?;
        let (_, kind) = NAMES.iter().find(|(known, _)| *known == name).ok_or_else(wrong)?;
        let (from, to) = when.split_once("..").ok_or_else(wrong)?;
        let seconds = |text: &str| text.parse::<f64>().ok().filter(|s| s.is_finite()).ok_or_else(wrong);
        let (from_s, to_s) = (seconds(from)?, seconds(to)?);
        if from_s >= to_s { Err(wrong()) } else { Ok(Fault { kind: kind(number), from_s, to_s }) }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, number) = match self.kind {
            FaultKind::Fog => ("fog", None),
            FaultKind::NoAntennas => ("no_antennas", None),
            FaultKind::WrongFix(k) => ("wrong_fix", Some(k)),
            FaultKind::WrongMake(k) => ("wrong_make", Some(k)),
            FaultKind::WrongPrism(k) => ("wrong_prism", Some(k)),
            FaultKind::WrongDistance(k) => ("wrong_distance", Some(k)),
            FaultKind::Restart => ("restart", None),
            FaultKind::LateMake(k) => ("late_make", Some(k)),
            FaultKind::NoEncoders => ("no_encoders", None),
            FaultKind::WrongLeg(k) => ("wrong_leg", Some(k)),
        };
        let number = number.map(|k| format!(".{k}")).unwrap_or_default();
        write!(f, "{name}{number}@{}..{}", self.from_s, self.to_s)
    }
}

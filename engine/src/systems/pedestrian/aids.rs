//! The pedestrian's aids: what it measures beside the strapdown, and which of them a session uses.

use serde::{Deserialize, Serialize};

use crate::event::AidKind;
use crate::system::AidRule;
use crate::word::Word;

/// Zero velocity in stance.
pub const ZUPT: AidKind = AidKind(Word::declared("zupt", 0));
/// Magnetic heading.
pub const HEADING: AidKind = AidKind(Word::declared("heading", 1));
/// Magnetic angular rate.
pub const MARU: AidKind = AidKind(Word::declared("maru", 2));
/// Smallest separation of the feet.
pub const SEPARATION: AidKind = AidKind(Word::declared("separation", 3));
/// Height by the barometer.
pub const ALTIMETER: AidKind = AidKind(Word::declared("altimeter", 5));

/// What it declares of them.
pub(crate) const RULES: &[AidRule] = &[
    rule(ZUPT, 3, false, true, "A standing foot does not move."),
    rule(HEADING, 1, true, true, "The magnetic field of a stance shows the heading."),
    rule(MARU, 3, true, true, "The magnetic field of a stance turns as the gyro says."),
    rule(SEPARATION, 1, true, true, "A swinging foot passes the standing one at the usual distance."),
    rule(AidKind::MARKERS, 3, true, false, "An inspector who keys in a marker stands beside it."),
    rule(ALTIMETER, 1, true, true, "The pressure of the air shows how far the foot has climbed."),
];

const fn rule(
    kind: AidKind,
    degrees_of_freedom: usize,
    gated: bool,
    charted: bool,
    about: &'static str,
) -> AidRule {
    AidRule { kind, about, degrees_of_freedom, gated, charted }
}

/// Which aids to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Aids {
    /// Zero velocity in stance.
    pub zupt: bool,
    /// Magnetic heading.
    pub heading: bool,
    /// Magnetic angular rate.
    pub maru: bool,
    /// Smallest separation of the feet.
    pub separation: bool,
    /// Marker positions.
    pub markers: bool,
    /// Height by the barometer.
    pub altimeter: bool,
}

impl Default for Aids {
    fn default() -> Self {
        Aids { zupt: true, heading: true, maru: true, separation: true, markers: true, altimeter: true }
    }
}

impl Aids {
    /// These and no others.
    pub fn only(kinds: &[AidKind]) -> Aids {
        let has = |kind| kinds.contains(&kind);
        Aids {
            zupt: has(ZUPT),
            heading: has(HEADING),
            maru: has(MARU),
            separation: has(SEPARATION),
            markers: has(AidKind::MARKERS),
            altimeter: has(ALTIMETER),
        }
    }

    /// Those that are used.
    pub fn kinds(&self) -> Vec<AidKind> {
        let all = [
            (self.zupt, ZUPT),
            (self.heading, HEADING),
            (self.maru, MARU),
            (self.separation, SEPARATION),
            (self.markers, AidKind::MARKERS),
            (self.altimeter, ALTIMETER),
        ];
        all.into_iter().filter(|(used, _)| *used).map(|(_, kind)| kind).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_and_its_aids_say_the_same() {
        assert_eq!(Aids::only(&Aids::default().kinds()), Aids::default());
        let some = [HEADING, AidKind::MARKERS];
        assert_eq!(Aids::only(&some).kinds(), some);
        assert!(Aids::only(&[]).kinds().is_empty());
    }
}

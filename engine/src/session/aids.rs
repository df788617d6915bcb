//! Which aids a session uses beside the strapdown.

use serde::{Deserialize, Serialize};

use crate::event::AidKind;

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
            zupt: has(AidKind::Zupt),
            heading: has(AidKind::Heading),
            maru: has(AidKind::Maru),
            separation: has(AidKind::Separation),
            markers: has(AidKind::Markers),
            altimeter: has(AidKind::Altimeter),
        }
    }

    /// Those that are used.
    pub fn kinds(&self) -> Vec<AidKind> {
        let all = [
            (self.zupt, AidKind::Zupt),
            (self.heading, AidKind::Heading),
            (self.maru, AidKind::Maru),
            (self.separation, AidKind::Separation),
            (self.markers, AidKind::Markers),
            (self.altimeter, AidKind::Altimeter),
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
        let some = [AidKind::Heading, AidKind::Markers];
        assert_eq!(Aids::only(&some).kinds(), some);
        assert!(Aids::only(&[]).kinds().is_empty());
    }
}

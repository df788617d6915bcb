//! A track on the Earth: where its frame lies, and when it began.

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::geo::{Geodetic, LocalFrame};

/// What the formats for maps need beside the points.
#[derive(Clone, Debug)]
pub struct TrackPlace {
    /// What the track is called.
    pub name: String,
    /// The frame of its positions.
    pub frame: LocalFrame,
    /// UTC at the session's start, ns since 1970, where it is known.
    pub start_unix_ns: Option<i64>,
}

impl TrackPlace {
    /// Latitude and longitude, degrees to 0.1 mm, and height above the ellipsoid, m to 0.1 mm.
    pub(super) fn geodetic(&self, position_n_m: [f64; 3]) -> [String; 3] {
        let Geodetic { latitude_deg, longitude_deg, height_m } = self.frame.to_geodetic(position_n_m);
        [format!("{latitude_deg:.9}"), format!("{longitude_deg:.9}"), format!("{height_m:.4}")]
    }

    /// UTC at a moment of the session, RFC 3339.
    pub(super) fn utc(&self, t_ns: i64) -> Option<String> {
        let unix_ns = i128::from(self.start_unix_ns?) + i128::from(t_ns);
        OffsetDateTime::from_unix_timestamp_nanos(unix_ns).ok()?.format(&Rfc3339).ok()
    }

    /// The name without the characters that XML cannot hold.
    pub(super) fn xml_text(text: &str) -> String {
        text.chars().filter(|c| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')).collect()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geo::Site;

    pub(in crate::track) fn place(start_unix_ns: Option<i64>) -> TrackPlace {
        TrackPlace { name: "走 <1> & \u{1}co".into(), frame: Site::fast().local_frame(), start_unix_ns }
    }

    #[test]
    fn utc_is_the_start_and_the_time_since() {
        let place = place(Some(1_700_000_000_000_000_000));
        assert_eq!(place.utc(1_500_000_000).unwrap(), "2023-11-14T22:13:21.5Z");
        assert_eq!(TrackPlace { start_unix_ns: None, ..place }.utc(0), None);
    }
}

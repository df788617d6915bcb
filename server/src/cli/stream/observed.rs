//! What one source sends, as rows of a session's streams.

use lodestep_engine::gnss::rtcm::{Decoder, Message};
use lodestep_engine::gnss::time::GpsTime;
use lodestep_engine::parse::observation_rows::Station;
use lodestep_engine::parse::{navigation_rows, observation_rows};
use lodestep_engine::stream::Rows;

/// GPS time's zero, s since 1970.
const GPS_ZERO_S: i64 = 315_964_800;
/// GPS time was ahead of UTC by this when the last leap second was put in, s.
const LEAP_SECONDS: i64 = 18;

/// Now, by the computer's clock.
fn by_computer() -> GpsTime {
    let unix_ns = time::OffsetDateTime::now_utc().unix_timestamp_nanos();
    GpsTime { ns: unix_ns as i64 - (GPS_ZERO_S - LEAP_SECONDS) * 1_000_000_000 }
}

/// Which week it is: by the newest orbit that came, else by the computer's clock. Half a week is near enough.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Week(Option<GpsTime>);

impl Week {
    fn now(self) -> GpsTime {
        self.0.unwrap_or_else(by_computer)
    }
}

/// A source of observations, orbits and a station's place.
#[derive(Debug, Default)]
pub(super) struct Observed {
    decoder: Decoder,
    station: Station,
}

/// Rows that became complete.
#[derive(Debug)]
pub(super) enum Complete {
    /// One time tag.
    Epoch(Rows),
    /// One orbit.
    Orbit(Rows),
}

impl Observed {
    /// Takes bytes as they came. Rows' times count from the beginning of the week.
    pub(super) fn take(&mut self, bytes: &[u8], week: &mut Week) -> Vec<Complete> {
        let mut complete = Vec::new();
        for message in self.decoder.push(bytes, week.now()) {
            let zero = GpsTime::from_week(week.now().week(), 0.0);
            match message {
                Message::Epoch(epoch) => {
                    let mut rows = Rows::new(observation_rows::COLUMNS.len());
                    observation_rows::push(&epoch, &self.station, zero, &mut rows);
                    complete.push(Complete::Epoch(rows));
                }
                Message::Ephemeris(one) => {
                    week.0 = Some(one.toe);
                    let mut rows = Rows::new(navigation_rows::COLUMNS.len());
                    navigation_rows::push(&one, None, zero, &mut rows);
                    complete.push(Complete::Orbit(rows));
                }
                Message::Station(station) => {
                    self.station = Station {
                        position_m: Some(station.position_m),
                        antenna_delta_hen_m: [station.antenna_height_m, 0.0, 0.0],
                    };
                }
            }
        }
        complete
    }
}

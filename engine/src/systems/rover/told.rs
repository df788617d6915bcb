//! What a session tells of a run: points in the site's metres, what charts show, and what was odd.

use super::causes::RoverCause;
use super::computation::Done;
use super::recording::Recording;
use super::row::Row;
use super::run::AnchorOutcome;
use crate::anomaly::Cause as _;
use crate::event::{Event, TrackPoint};
use crate::geo::{Geodetic, LocalFrame};
use crate::gnss::ephemeris::Navigation;
use crate::gnss::geometry::{at_transmission, azimuth_elevation, sight};
use crate::gnss::observations::Epoch;
use crate::gnss::time::GpsTime;
use crate::rotation::azimuth;
use crate::sample::SurveyedAnchor;
use crate::system::ChartValue;

/// Where satellites stand is told this often, ns.
const SKY_EVERY_NS: i64 = 10_000_000_000;
/// A base that is farther from the site than this belongs to another one, m.
const FARTHEST_BASE_M: f64 = 50_000.0;
/// With less motion there is no direction, m.
const STEP_M: f64 = 0.05;
/// A ratio is shown up to here.
const MOST_RATIO: f64 = 1_000.0;

const QUALITY: &str = "quality";
const SATELLITES: &str = "satellites";
const ANCHORS: &str = "anchors";
const RATIO: &str = "ratio";
const BASE_AGE: &str = "base_age";
const ELEVATION: &str = "elevation";
const AZIMUTH: &str = "azimuth";
const ANCHOR_BIAS: &str = "anchor_bias";
const ANCHOR_BIAS_SIGMA: &str = "anchor_bias_sigma";
const ANCHOR_USED: &str = "anchor_used";
const ANCHOR_EAST: &str = "anchor_east";
const ANCHOR_NORTH: &str = "anchor_north";

/// How the base's plane becomes the site's.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// The frames of base and site; none where metres stay as they are.
    frames: Option<[LocalFrame; 2]>,
    /// How far the base is from a site that it does not belong to, m.
    away_m: Option<f64>,
}

impl Placement {
    /// Of a base, and the origin of a site. Over the few kilometres of a site the planes turn by less than a tenth of a degree, so
    /// that sigmas stay as they are.
    pub fn new(base: Option<Geodetic>, site: Option<Geodetic>) -> Placement {
        let mut placement = Placement { frames: None, away_m: None };
        let (Some(base), Some(site)) = (base, site) else { return placement };
        let [e, n, u] = LocalFrame::new(site).to_local_m(base);
        let away_m = libm::hypot(libm::hypot(e, n), u);
        if away_m > FARTHEST_BASE_M {
            placement.away_m = Some(away_m);
        } else if base != site {
            placement.frames = Some([LocalFrame::new(base), LocalFrame::new(site)]);
        }
        placement
    }

    /// A position in the site's metres.
    pub fn placed(&self, p_n_m: [f64; 3]) -> [f64; 3] {
        match &self.frames {
            Some([base, site]) => site.to_local_m(base.to_geodetic(p_n_m)),
            None => p_n_m,
        }
    }

    /// What is to be said of it.
    pub(super) fn doubt(&self) -> Option<RoverCause> {
        self.away_m.map(|away_m| RoverCause::FarFromSite { away_km: away_m / 1000.0 })
    }
}

/// Makes points of rows, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Points {
    placement: Placement,
    zero_ns: i64,
    /// The week that times count from.
    week: Option<i32>,
    heading_rad: f64,
    last_m: Option<[f64; 3]>,
    next_sky_ns: i64,
    /// Length of the way, m.
    pub(super) distance_m: f64,
}

impl Points {
    /// With the session's time less the rover's, ns.
    pub(super) fn new(placement: Placement, zero_ns: i64) -> Points {
        let next_sky_ns = i64::MIN;
        Points {
            placement,
            zero_ns,
            week: None,
            heading_rad: 0.0,
            last_m: None,
            next_sky_ns,
            distance_m: 0.0,
        }
    }

    /// When a row is on the session's clock, ns.
    fn t_ns(&mut self, row: &Row) -> i64 {
        let own_ns = match row.gps_time {
            Some((week, tow_s)) => {
                let zero = *self.week.get_or_insert(week);
                GpsTime::from_week(week, tow_s).ns - GpsTime::from_week(zero, 0.0).ns
            }
            None => libm::round(row.t_s * 1e9) as i64,
        };
        own_ns + self.zero_ns
    }

    /// The point of a row.
    pub(super) fn point(&mut self, row: &Row) -> TrackPoint {
        let position_n_m = self.placement.placed(row.p_n_m);
        let last_m = *self.last_m.get_or_insert(position_n_m);
        let [e, n, u] = std::array::from_fn(|axis| position_n_m[axis] - last_m[axis]);
        if libm::hypot(e, n) > STEP_M.max(2.0 * row.sigma_n_m[0].max(row.sigma_n_m[1])) {
            self.heading_rad = azimuth(e, n);
            self.distance_m += libm::hypot(libm::hypot(e, n), u);
            self.last_m = Some(position_n_m);
        }
        TrackPoint {
            t_ns: self.t_ns(row),
            position_n_m,
            heading_rad: self.heading_rad,
            // Where it goes is not where it looks.
            sigma_heading_rad: std::f64::consts::PI,
            sigma_n_m: row.sigma_n_m,
            covariance_en_m2: row.covariance_en_m2,
            tilt: None,
            parts: [None; 2],
        }
    }

    /// What charts show of a row.
    pub(super) fn values(row: &Row, t_ns: i64, values: &mut Vec<ChartValue>) {
        let mut tell = |chart, value| values.push(value_of(t_ns, chart, "main".to_owned(), value));
        tell(QUALITY, row.quality.number());
        tell(SATELLITES, row.satellites as f64);
        tell(ANCHORS, row.anchors as f64);
        if let Some(ratio) = row.ratio {
            tell(RATIO, ratio.min(MOST_RATIO));
        }
        if let Some(age_s) = row.base_age_s {
            tell(BASE_AGE, age_s);
        }
    }

    /// Where the satellites of an epoch stand, seen from the base, when it is time for that.
    pub(super) fn sky(
        &mut self,
        epoch: &Epoch,
        navigation: &Navigation,
        base: Geodetic,
        t_ns: i64,
        values: &mut Vec<ChartValue>,
    ) {
        if t_ns < self.next_sky_ns {
            return;
        }
        self.next_sky_ns = t_ns + SKY_EVERY_NS;
        let (c_ne, p_e) = (LocalFrame::new(base).c_ne(), base.to_ecef_m().into());
        for tracked in &epoch.satellites {
            let Some(ephemeris) = navigation.nearest(tracked.satellite, epoch.time) else { continue };
            let code = epoch.signals_of(tracked).iter().map(|signal| signal.code_m).find(|code| *code != 0.0);
            let Some(code_m) = code else { continue };
            let state = at_transmission(ephemeris, epoch.time, code_m);
            let line = sight(&state.p_e, &p_e);
            let (azimuth_rad, elevation_rad) = azimuth_elevation(&line.to_satellite_e, &c_ne);
            let name = tracked.satellite.to_string();
            values.push(value_of(t_ns, ELEVATION, name.clone(), elevation_rad.to_degrees()));
            values.push(value_of(t_ns, AZIMUTH, name, azimuth_rad.to_degrees().rem_euclid(360.0)));
        }
    }

    /// The anchors, and what is known of them now.
    pub(super) fn anchors(
        &self,
        surveyed: &[SurveyedAnchor],
        outcomes: &[AnchorOutcome],
        t_ns: i64,
        values: &mut Vec<ChartValue>,
    ) {
        for (anchor, outcome) in surveyed.iter().zip(outcomes) {
            let [e, n, _] = self.placement.placed(anchor.p_n);
            let ranges = (outcome.used + outcome.rejected).max(1);
            let known = [
                (ANCHOR_EAST, e),
                (ANCHOR_NORTH, n),
                (ANCHOR_BIAS, outcome.bias_m),
                (ANCHOR_BIAS_SIGMA, outcome.sigma_m),
                (ANCHOR_USED, outcome.used as f64 / ranges as f64),
            ];
            values.extend(known.map(|(chart, value)| value_of(t_ns, chart, anchor.name.clone(), value)));
        }
    }
}

fn value_of(t_ns: i64, chart: &'static str, series: String, value: f64) -> ChartValue {
    ChartValue { t_ns, chart, series, value }
}

/// The points of a run.
pub fn points(done: &Done, placement: Placement, zero_ns: i64) -> Vec<TrackPoint> {
    let mut points = Points::new(placement, zero_ns);
    done.rows.iter().map(|row| points.point(row)).collect()
}

/// What was odd about a run, at the time of the whole run.
pub fn anomalies(done: &Done, placement: Placement, zero_ns: i64) -> Vec<Event> {
    let mut points = Points::new(placement, zero_ns);
    let ends = [done.rows.first(), done.rows.last()];
    let t_ns = ends.map(|row| row.map_or(0, |row| points.t_ns(row)));
    let causes = done.anomalies.iter().cloned().chain(placement.doubt());
    causes.map(|cause| Event::Anomaly(cause.anomaly(None, t_ns, 0))).collect()
}

/// A run with its charts: points and values, in order of time.
pub(super) fn with_charts(
    done: &Done,
    recording: &Recording,
    surveyed: &[SurveyedAnchor],
    points: &mut Points,
    (events, values): (&mut Vec<Event>, &mut Vec<ChartValue>),
) {
    let mut epochs = recording.rover.epochs.iter().peekable();
    let mut last_ns = 0;
    for row in &done.rows {
        let point = points.point(row);
        last_ns = point.t_ns;
        events.push(Event::Point(point));
        Points::values(row, point.t_ns, values);
        let (Some((week, tow_s)), Some(base)) = (row.gps_time, done.base) else { continue };
        let time = GpsTime::from_week(week, tow_s);
        while epochs.next_if(|epoch| epoch.time < time).is_some() {}
        if let Some(epoch) = epochs.next_if(|epoch| epoch.time == time) {
            points.sky(epoch, &recording.navigation, base, point.t_ns, values);
        }
    }
    points.anchors(surveyed, &done.anchors, last_ns, values);
}

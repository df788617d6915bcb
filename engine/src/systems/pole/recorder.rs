//! Readings as they come, made into a recording: what is no reading is left out, and told.

use super::aids::{GNSS, IMU};
use super::gnss_rows;
use super::recording::{Recording, Stop};
use crate::anomaly::{Anomaly, Cause as _};
use crate::cause::SensorCause;
use crate::geo::{Geodetic, LocalFrame};
use crate::parse::gnss::{GnssQuality, GnssRow};
use crate::sample::ImuSample;
use crate::stream::StreamId;

/// All that was read so far.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    pub(super) imu: Vec<ImuSample>,
    pub(super) gnss: Vec<GnssRow>,
    pub(super) switch: Vec<(i64, bool)>,
    not_finite: [Option<LeftOut>; 2],
    late: Option<(LeftOut, i64)>,
}

/// Readings that were left out: from and until, ns, and how many.
#[derive(Clone, Copy, Debug)]
struct LeftOut {
    t_ns: [i64; 2],
    count: u64,
}

impl LeftOut {
    fn one_more(left_out: Option<LeftOut>, t_ns: i64) -> LeftOut {
        match left_out {
            None => LeftOut { t_ns: [t_ns; 2], count: 1 },
            Some(of) => LeftOut { t_ns: [of.t_ns[0], t_ns.max(of.t_ns[1])], count: of.count + 1 },
        }
    }
}

impl Recorder {
    /// Takes a sample; says whether it is one. One that is no number, or comes twice, or late, is left out: the filter
    /// bridges it.
    pub fn sample(&mut self, sample: &ImuSample) -> bool {
        if !sample.w_ib_b_rad_s.iter().chain(&sample.f_b_m_s2).all(|x| x.is_finite()) {
            self.not_finite[0] = Some(LeftOut::one_more(self.not_finite[0], sample.t_ns));
            return false;
        }
        if let Some(last) = self.imu.last().filter(|last| sample.t_ns <= last.t_ns) {
            let (left_out, back_ns) = self.late.map_or((None, 0), |(of, back_ns)| (Some(of), back_ns));
            let back_ns = back_ns.max(last.t_ns - sample.t_ns);
            self.late = Some((LeftOut::one_more(left_out, sample.t_ns), back_ns));
            return false;
        }
        self.imu.push(*sample);
        true
    }

    /// Takes a position; says whether it is one.
    pub fn position(&mut self, row: GnssRow) -> bool {
        let Geodetic { latitude_deg, longitude_deg, height_m } = row.place;
        let fine = latitude_deg.abs() <= 90.0
            && longitude_deg.abs() <= 360.0
            && height_m.is_finite()
            && row.sigma_n_m.iter().flatten().all(|sigma| sigma.is_finite() && *sigma > 0.0);
        if fine {
            self.gnss.push(row);
        } else {
            self.not_finite[1] = Some(LeftOut::one_more(self.not_finite[1], row.t_ns));
        }
        fine
    }

    /// Takes a row of the stream of positions: latitude and longitude, degrees, height above the ellipsoid, m, sigmas east,
    /// north and up, m, and quality as RTKLIB numbers it.
    pub(super) fn position_row(&mut self, t_ns: i64, values: &[f64; 7]) -> bool {
        let [latitude_deg, longitude_deg, height_m, e, n, u, quality] = *values;
        let said = [e, n, u].iter().all(|sigma| !sigma.is_nan());
        self.position(GnssRow {
            t_ns,
            place: Geodetic { latitude_deg, longitude_deg, height_m },
            sigma_n_m: said.then_some([e, n, u]),
            quality: GnssQuality::numbered(quality),
        })
    }

    /// Takes a change of the switch in the tip; one that comes late is left out.
    pub fn contact(&mut self, t_ns: i64, closed: bool) {
        if self.switch.last().is_none_or(|(last_ns, _)| *last_ns <= t_ns) {
            self.switch.push((t_ns, closed));
        }
    }

    /// What was left out.
    pub(super) fn left_out(&self) -> Vec<Anomaly> {
        let mut found = Vec::new();
        let mut told = |cause: SensorCause, stream: StreamId, of: LeftOut| {
            found.push(cause.anomaly(Some(stream), of.t_ns, of.count));
        };
        for (of, stream) in self.not_finite.iter().zip([IMU, GNSS]) {
            of.iter().for_each(|of| told(SensorCause::NotFinite, stream, *of));
        }
        match self.late {
            Some((of, 0)) => told(SensorCause::RepeatedTime, IMU, of),
            Some((of, back_ns)) => {
                told(SensorCause::TimeGoesBack { back_by_s: back_ns as f64 * 1e-9 }, IMU, of);
            }
            None => {}
        }
        found
    }

    /// The recording, in the plane of a site, with the stops that were told.
    pub fn recording(&self, frame: &LocalFrame, stops: Vec<Stop>) -> Recording {
        let ends = [self.imu.first(), self.imu.last()].map(|sample| sample.map_or(0, |sample| sample.t_ns));
        Recording {
            imu: self.imu.clone(),
            fixes: gnss_rows::fixes(&self.gnss, frame, ends),
            switch: (!self.switch.is_empty()).then(|| self.switch.clone()),
            stops,
            left_out: self.left_out(),
        }
    }
}

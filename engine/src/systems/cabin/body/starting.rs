//! How a body's filter starts: first sightings gathered into a pose, and gravity's word on it.

use nalgebra::Vector3;

use super::Body;
use super::weighing::{along, believable};
use crate::systems::cabin::aids::Aids;
use crate::systems::cabin::causes::CabinCause;
use crate::systems::cabin::filter::{Filter, Start};
use crate::systems::cabin::rig::Target;
use crate::systems::cabin::rows::AidRow;
use crate::systems::cabin::session::CabinError;
use crate::systems::cabin::start::{self, Sighting};
use crate::systems::cabin::watch::Watch;

/// First sightings are gathered for so long, ns.
const GATHER_NS: i64 = 600_000_000;
/// Sightings of so long count as one moment, ns.
const ONE_MOMENT_NS: i64 = 400_000_000;
/// An inertial sensor's axes are wrong where gravity says the level or the yaw otherwise by more, rad: told, and refused. On a
/// cabin that swings half a minute of gravity leaves ten degrees of yaw.
const MISMOUNTED_RAD: [f64; 2] = [0.02, 0.6];
const REFUSED_RAD: [f64; 2] = [0.06, 0.9];
/// Yaw is compared on a body that has stayed within so much, m.
const STAYED_M: f64 = 0.3;
const CHECKED_AFTER_S: f64 = 30.0;

impl Body {
    /// Once, after half a minute: gravity, followed in the inertial frame, says level and yaw by itself.
    pub(super) fn check_mounting(&mut self, watch: &mut Watch) -> Result<(), CabinError> {
        let (Some(filter), Some(gravity)) = (&self.filter, &self.gravity) else { return Ok(()) };
        if gravity.time_s() < CHECKED_AFTER_S {
            return Ok(());
        }
        let (nav, found) = (filter.nav(), gravity.attitude(&self.rig.earth, &filter.nav().p_n));
        let off = found.map(|found| {
            nalgebra::Rotation3::from_matrix_unchecked(found * nav.c_nb.transpose()).scaled_axis()
        });
        self.gravity = None;
        let Some(off) = off else { return Ok(()) };
        let stayed = self.is_cabin && (nav.p_n - self.begun_n).norm() < STAYED_M;
        let (level, yaw) = (off.xy().norm(), if stayed { off.z.abs() } else { 0.0 });
        if level < MISMOUNTED_RAD[0] && yaw < MISMOUNTED_RAD[1] {
            return Ok(());
        }
        let cause =
            CabinCause::Mounting { level_deg: off.xy().norm().to_degrees(), yaw_deg: off.z.to_degrees() };
        if level < REFUSED_RAD[0] && yaw < REFUSED_RAD[1] {
            // It may have been moved meanwhile.
            watch.wrong(if self.is_cabin { "imu" } else { "platform_imu" }, cause, filter.t_ns, 1);
            return Ok(());
        }
        Err(CabinError(cause.sentence()))
    }

    /// Before the start: sightings, until a rigid body goes through them.
    pub(super) fn gather(&mut self, t_ns: i64, rows: &[AidRow], aids: &mut Aids, watch: &mut Watch) {
        for row in rows {
            match row {
                AidRow::Antenna(row) if believable(row) && !self.rig.antennas.is_empty() => {
                    let place_b = self.rig.antennas[row.antenna].position_b;
                    let aid = aids.antenna(row.antenna);
                    self.sightings.insert(
                        aid,
                        Sighting { t_ns: row.t_ns, aid, place_b, p_n: Vector3::from(row.position_n) },
                    );
                    self.velocities.extend(row.velocity_n.map(Vector3::from));
                    let [e, n, u] = row.sigma_n;
                    self.stated.push([libm::hypot(e, n) / std::f64::consts::SQRT_2, u]);
                }
                AidRow::Ray(row)
                    if self.rig.antennas.is_empty()
                        || t_ns - self.first_ns.unwrap_or(t_ns) > 5_000_000_000 =>
                {
                    if let Some(Target::Body(place_b)) = self.rig.targets.get(row.target) {
                        let aid = aids.station(row.station);
                        let p_n = self.rig.stations_n[row.station] + along(row) * row.slant_m;
                        self.sightings.insert(aid, Sighting { t_ns: row.t_ns, aid, place_b: *place_b, p_n });
                    }
                }
                _ => {}
            }
        }
        let imu_ns = if self.rig.has_imu { self.last_imu_ns } else { Some(t_ns) };
        let Some(imu_ns) = imu_ns else { return };
        let fresh: Vec<Sighting> =
            self.sightings.values().filter(|s| t_ns - s.t_ns < ONE_MOMENT_NS).copied().collect();
        let since_ns = t_ns - self.first_ns.unwrap_or(t_ns);
        if since_ns < GATHER_NS || fresh.len() < 3 || t_ns - imu_ns > 100_000_000 {
            return;
        }
        let Some(fit) = start::fit(&fresh) else {
            let names: Vec<&str> = fresh.iter().map(|s| aids.name(s.aid)).collect();
            self.misfit = Some(format!(
                "expected {} where the instrument has them, found no rigid body through more than half of them: check which is which, and the unit of the positions",
                names.join(", ")
            ));
            return;
        };
        for (k, out) in fit.left_out.iter().enumerate() {
            let exchanged = fit
                .left_out
                .iter()
                .enumerate()
                .find(|(other, with)| *other != k && fit.are_exchanged(&fresh[*out], &fresh[**with]));
            let name = aids.name(fresh[*out].aid).to_owned();
            match exchanged {
                Some((_, with)) => {
                    let with = aids.name(fresh[*with].aid).to_owned();
                    watch.wrong(&name, CabinCause::Exchanged { with }, t_ns, 1);
                }
                None => watch.wrong(&name, CabinCause::Misplaced, t_ns, 1),
            }
        }
        let v_n = if self.velocities.is_empty() {
            Vector3::zeros()
        } else {
            let recent = &self.velocities[self.velocities.len().saturating_sub(24)..];
            recent.iter().sum::<Vector3<f64>>() / recent.len() as f64
        };
        let begin = Start {
            t_ns: imu_ns,
            p_n: fit.p_n,
            v_n,
            c_nb: fit.c_nb,
            sigma_p_m: 0.05,
            sigma_v_m_s: if self.velocities.is_empty() { 0.3 } else { 0.03 },
            sigma_attitude_rad: 3e-3,
        };
        let recording = self.config.smoothed;
        self.filter =
            Some(Filter::new(self.rig.clone(), self.tuning, self.stated_sigma_m(), &begin, recording));
        self.started_ns = t_ns.max(1);
        self.begun_n = fit.p_n;
        self.taken_ns = t_ns;
    }

    /// What the antennas' rows state, in plan and in height, m: the median.
    pub(super) fn stated_sigma_m(&self) -> [f64; 2] {
        [0, 1].map(|axis| {
            let mut all: Vec<f64> = self.stated.iter().map(|stated| stated[axis]).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or([0.006, 0.008][axis])
        })
    }
}

//! Epoch by epoch: the truth of both feet, and what their sensors say.

use nalgebra::UnitQuaternion;

use super::plan::{Plan, plan};
use super::sensors::{SensorModel, ShoeSensor};
use super::walk::{WalkKind, Walker};
use crate::geo::Site;
use crate::sample::ImuSample;
use crate::sim::earth::Earth;
use crate::sim::magnetism::Magnetism;
use crate::sim::motion::Motion;

/// How one sensor truly was at one epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootTruth {
    /// The sensor's position, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Its velocity, m/s.
    pub velocity_n_m_s: [f64; 3],
    /// Its attitude: turns b into n.
    pub q_nb: UnitQuaternion<f64>,
    /// Whether the foot stands flat on the ground.
    pub stance: bool,
    /// Heading of the sensor's x axis, clockwise from true north, rad in (−π, π].
    pub heading_rad: f64,
}

/// One epoch of a walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Epoch {
    /// Time since the walk's start, ns.
    pub t_ns: i64,
    /// The truth, left foot first.
    pub truth: [FootTruth; 2],
    /// The readings, left foot first.
    pub samples: [ImuSample; 2],
}

/// A stop beside a marker.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerVisit {
    /// The marker's name.
    pub marker: String,
    /// The marker's surveyed position, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Both feet stand from here on, ns.
    pub t_start_ns: i64,
    /// The first foot lifts after this, ns.
    pub t_end_ns: i64,
}

/// A whole walk in memory.
#[derive(Clone, Debug)]
pub struct Walk {
    /// The truth of each epoch, left foot first.
    pub truth: Vec<[FootTruth; 2]>,
    /// Stops beside markers, in their order.
    pub visits: Vec<MarkerVisit>,
    /// The left foot's log.
    pub left: Vec<ImuSample>,
    /// The right foot's log.
    pub right: Vec<ImuSample>,
    /// Length of the path, m.
    pub distance_m: f64,
}

impl Walk {
    /// The middle of the two sensors at the first epoch, east-north-up, m.
    pub fn start_n_m(&self) -> [f64; 3] {
        self.truth.first().map_or([0.0; 3], middle_n_m)
    }
}

/// The middle of both feet.
fn middle_n_m(truth: &[FootTruth; 2]) -> [f64; 3] {
    std::array::from_fn(|axis| 0.5 * (truth[0].position_n_m[axis] + truth[1].position_n_m[axis]))
}

/// A walk that is made as it is asked for.
#[derive(Clone, Debug)]
pub struct Simulator {
    plan: Plan,
    visits: Vec<MarkerVisit>,
    magnetism: Magnetism,
    sensors: [ShoeSensor; 2],
    epoch: i64,
    epochs: i64,
    period_ns: i64,
    site_height_m: f64,
}

/// Makes a whole walk.
pub fn simulate(kind: &WalkKind, seed: u64, site: &Site, model: &SensorModel) -> Walk {
    Simulator::new(kind, seed, site, model).into_walk()
}

impl Simulator {
    /// A walk by a usual walker.
    pub fn new(kind: &WalkKind, seed: u64, site: &Site, model: &SensorModel) -> Simulator {
        Simulator::with_walker(kind, seed, site, model, Walker::default())
    }

    /// A walk by this walker.
    pub fn with_walker(
        kind: &WalkKind,
        seed: u64,
        site: &Site,
        model: &SensorModel,
        mut walker: Walker,
    ) -> Simulator {
        let course = kind.course(seed, site, &mut walker);
        let plan = plan(course, &walker, seed);
        let period_ns = model.imu.period_ns();
        let ns = |t_s: f64| libm::round(t_s * 1e9) as i64;
        let visits = plan
            .visits
            .iter()
            .map(|visit| MarkerVisit {
                marker: visit.marker.name.clone(),
                position_n_m: visit.marker.position_n_m,
                t_start_ns: ns(visit.t_from_s),
                t_end_ns: ns(visit.t_to_s),
            })
            .collect();
        let earth = Earth::new(site, model.earth_rotation);
        Simulator {
            epochs: ns(plan.end_s) / period_ns,
            epoch: 0,
            magnetism: Magnetism::along(
                plan.path.length_m(),
                |along_m| plan.path.at(along_m).position_n_m,
                site.magnetic_field(),
                &model.field_anomalies,
                seed,
            ),
            sensors: [0, 1].map(|foot| ShoeSensor::new(model, earth, seed, foot)),
            plan,
            visits,
            period_ns,
            site_height_m: site.height_m,
        }
    }

    /// Stops beside markers, known beforehand.
    pub fn visits(&self) -> &[MarkerVisit] {
        &self.visits
    }

    /// How many epochs the walk has.
    pub fn epochs(&self) -> usize {
        self.epochs as usize
    }

    /// How long it lasts, s.
    pub fn duration_s(&self) -> f64 {
        self.plan.end_s
    }

    /// Length of the path, m.
    pub fn distance_m(&self) -> f64 {
        self.plan.path.length_m()
    }

    /// The middle of the two sensors at the start, east-north-up, m.
    pub fn start_n_m(&self) -> [f64; 3] {
        let at = |foot: usize| self.plan.feet[foot].at(0.0).position_n_m;
        (0.5 * (at(0) + at(1))).into()
    }

    /// The next epoch; `None` after the last.
    pub fn next_epoch(&mut self) -> Option<Epoch> {
        if self.epoch >= self.epochs {
            return None;
        }
        let t_ns = self.epoch * self.period_ns;
        self.epoch += 1;
        let (left, right) = (self.foot(0, t_ns), self.foot(1, t_ns));
        Some(Epoch { t_ns, truth: [left.0, right.0], samples: [left.1, right.1] })
    }

    /// All that is left of the walk.
    pub fn into_walk(mut self) -> Walk {
        let count = (self.epochs - self.epoch) as usize;
        let mut walk = Walk {
            truth: Vec::with_capacity(count),
            visits: self.visits.clone(),
            left: Vec::with_capacity(count),
            right: Vec::with_capacity(count),
            distance_m: self.distance_m(),
        };
        while let Some(epoch) = self.next_epoch() {
            let [left, right] = epoch.samples;
            walk.truth.push(epoch.truth);
            walk.left.push(left);
            walk.right.push(right);
        }
        walk
    }

    fn foot(&mut self, foot: usize, t_ns: i64) -> (FootTruth, ImuSample) {
        let motion = &self.plan.feet[foot];
        let ShoeSensor { imu, magnetometer, barometer } = &mut self.sensors[foot];
        let (sensor, reading) = imu.sample(motion, t_ns);
        let field_b_ut = sensor.c_nb.tr_mul(&self.magnetism.at_n_ut(&sensor.position_n_m));
        let height_m = self.site_height_m + sensor.position_n_m.z;
        let truth = FootTruth {
            position_n_m: sensor.position_n_m.into(),
            velocity_n_m_s: sensor.velocity_n_m_s.into(),
            q_nb: sensor.q_nb(),
            stance: motion.is_stance(t_ns as f64 * 1e-9),
            heading_rad: sensor.heading_rad(),
        };
        let sample = ImuSample {
            t_ns,
            w_ib_b_rad_s: reading.w_is_s_rad_s,
            f_b_m_s2: reading.f_s_m_s2,
            mag_b_ut: magnetometer.as_mut().map(|magnetometer| magnetometer.read(&field_b_ut)),
            pressure_hpa: barometer.as_mut().map(|barometer| barometer.read(height_m)),
        };
        (truth, sample)
    }
}

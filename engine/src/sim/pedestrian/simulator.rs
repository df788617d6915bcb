//! Epoch by epoch: the truth of both feet, and what their sensors say.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::gait::Kinematics;
use super::plan::{Phase, Plan, plan};
use super::walk::{WalkKind, Walker};
use crate::geo::Site;
use crate::geo::ellipsoid::EARTH_RATE_RAD_S;
use crate::sample::ImuSample;
use crate::sim::magnetism::Magnetism;
use crate::sim::sensors::{Sensor, SensorModel, Stimulus};

/// How one sensor truly was at one epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootTruth {
    /// The sensor's position, east-north-up, m.
    pub position_n_m: [f64; 3],
    /// Its velocity, m/s.
    pub velocity_n_m_s: [f64; 3],
    /// Its attitude, from b to n.
    pub q_b_n: UnitQuaternion<f64>,
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

/// Nodes and weights of Gauss and Legendre's quadrature on [0, 1]: exact for polynomials of degree 5.
const QUADRATURE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// One foot and its sensor.
#[derive(Clone, Debug)]
struct FootSimulator {
    /// The phase in which the last instant lay.
    phase: usize,
    sensor: Sensor,
    /// Rate and specific force at the last epoch, in b.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
}

/// A walk that is made as it is asked for.
#[derive(Clone, Debug)]
pub struct Simulator {
    plan: Plan,
    visits: Vec<MarkerVisit>,
    magnetism: Magnetism,
    feet: [FootSimulator; 2],
    epoch: i64,
    epochs: i64,
    period_ns: i64,
    averaging: bool,
    gravity_n_m_s2: Vector3<f64>,
    earth_rate_n_rad_s: Vector3<f64>,
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
        let period_ns = model.period_ns();
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
        let (sin_lat, cos_lat) = libm::sincos(site.latitude_deg.to_radians());
        let earth_rate = if model.earth_rotation { EARTH_RATE_RAD_S } else { 0.0 };
        Simulator {
            epochs: ns(plan.end_s) / period_ns,
            epoch: 0,
            magnetism: Magnetism::along(
                plan.path.length_m(),
                |along_m| plan.path.at(along_m).position_n_m,
                site.magnetic_field(),
                model,
                seed,
            ),
            feet: [0, 1].map(|foot| FootSimulator {
                phase: 0,
                sensor: Sensor::new(model, seed, foot),
                last: None,
            }),
            plan,
            visits,
            period_ns,
            averaging: model.averaging,
            gravity_n_m_s2: Vector3::new(0.0, 0.0, -site.gravity_m_s2),
            earth_rate_n_rad_s: earth_rate * Vector3::new(0.0, cos_lat, sin_lat),
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
        let at = |foot: usize| self.plan.phases[foot][0].at(0.0).position_n_m;
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
        let t_s = t_ns as f64 * 1e-9;
        let interval_s = self.period_ns as f64 * 1e-9;
        let phases = &self.plan.phases[foot];
        let simulator = &mut self.feet[foot];
        let c_b_f = simulator.sensor.c_b_f;
        let inertial = |kinematics: &Kinematics| {
            inertial_b(kinematics, &c_b_f, &self.gravity_n_m_s2, &self.earth_rate_n_rad_s)
        };

        let was_in = simulator.phase;
        let node_s = |node: f64| t_s - (1.0 - node) * interval_s;
        let mut mean = (Vector3::zeros(), Vector3::zeros());
        let moved = {
            let phase = phase_at(phases, was_in, t_s);
            phase != was_in || !phases[phase].is_stance()
        };
        if moved && self.averaging && simulator.last.is_some() {
            for (node, weight) in QUADRATURE {
                simulator.phase = phase_at(phases, simulator.phase, node_s(node));
                let (w, f) = inertial(&phases[simulator.phase].at(node_s(node)));
                mean.0 += w * weight;
                mean.1 += f * weight;
            }
        }
        simulator.phase = phase_at(phases, simulator.phase, t_s);
        let phase = &phases[simulator.phase];
        let kinematics = phase.at(t_s);
        let now = inertial(&kinematics);
        match simulator.last {
            // The slow motion of a standing foot needs no nodes between.
            Some(last) if self.averaging && !moved => {
                mean = ((last.0 + now.0) * 0.5, (last.1 + now.1) * 0.5);
            }
            Some(_) if self.averaging => {}
            _ => mean = now,
        }
        simulator.last = Some(now);

        let c_b_n: Matrix3<f64> = kinematics.c_f_n * c_b_f;
        let field_n_ut = self.magnetism.at_n_ut(&kinematics.position_n_m);
        let reading = simulator.sensor.read(&Stimulus {
            w_ib_b_rad_s: mean.0,
            f_b_m_s2: mean.1,
            field_b_ut: c_b_n.tr_mul(&field_n_ut),
            height_m: self.site_height_m + kinematics.position_n_m.z,
        });
        let truth = FootTruth {
            position_n_m: kinematics.position_n_m.into(),
            velocity_n_m_s: kinematics.velocity_n_m_s.into(),
            q_b_n: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(c_b_n)),
            stance: phase.is_stance(),
            heading_rad: libm::atan2(c_b_n[(0, 0)], c_b_n[(1, 0)]),
        };
        let sample = ImuSample {
            t_ns,
            w_ib_b_rad_s: reading.w_ib_b_rad_s,
            f_b_m_s2: reading.f_b_m_s2,
            mag_b_ut: reading.mag_b_ut,
            pressure_hpa: reading.pressure_hpa,
        };
        (truth, sample)
    }
}

/// The phase in which a time lies, looked for from an earlier one on.
fn phase_at(phases: &[Phase], from: usize, t_s: f64) -> usize {
    let mut at = from;
    while at + 1 < phases.len() && phases[at].t_to_s() <= t_s {
        at += 1;
    }
    at
}

/// Rate against inertial space and specific force, in b.
fn inertial_b(
    kinematics: &Kinematics,
    c_b_f: &Matrix3<f64>,
    gravity_n: &Vector3<f64>,
    earth_rate_n: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let w_f = kinematics.w_nf_f_rad_s + kinematics.c_f_n.tr_mul(earth_rate_n);
    let f_n =
        kinematics.acceleration_n_m_s2 + 2.0 * earth_rate_n.cross(&kinematics.velocity_n_m_s) - gravity_n;
    (c_b_f.tr_mul(&w_f), c_b_f.tr_mul(&kinematics.c_f_n.tr_mul(&f_n)))
}

//! Logs that are not as they should be, a row a kind: each is refused in a sentence or named with its device, and no pose is told to
//! be surer than it is.

use lodestep_engine::event::Event;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::sim::cabin::{self, RunPlan, SimulatedRun};
use lodestep_engine::system::PoseState;

use super::session::{Row, by_device, magnitude, session};

/// What a kind of trouble does to a run.
type Change = fn(&mut SimulatedRun);

/// A kind of trouble, and the beginnings of what has to be told: of one of them at least.
struct Case {
    what: &'static str,
    change: Change,
    told: &'static [&'static str],
}

const fn case(what: &'static str, change: Change, told: &'static [&'static str]) -> Case {
    Case { what, change, told }
}

fn each(samples: &mut [ImuSample], change: impl Fn(&mut ImuSample)) {
    samples.iter_mut().for_each(change);
}

/// A clock that is off by so much, s, from 16 s on.
fn stepped(t_ns: i64, by_s: f64) -> i64 {
    if t_ns > 16_000_000_000 { t_ns + (by_s * 1e9) as i64 } else { t_ns }
}

/// What came of it: what was told, poses told, and those farther off than their protection level, of both bodies.
struct Outcome {
    told: Vec<String>,
    poses: usize,
    beyond: [usize; 2],
    largest_m: [f64; 2],
}

fn outcome(run: &SimulatedRun, truth: &SimulatedRun, late: bool) -> Outcome {
    let (mut session, mut events) = (session(run, true), Vec::new());
    let mut found = Outcome { told: Vec::new(), poses: 0, beyond: [0; 2], largest_m: [0.0; 2] };
    let mut true_rows = truth.truth.iter().peekable();
    // As they come: a clock that steps changes tags, not when a row is there.
    let mut come: Vec<_> = by_device(truth).iter().map(Row::t_ns).zip(by_device(run)).collect();
    come.sort_by_key(|(came_ns, row)| if late { row.t_ns() } else { *came_ns });
    for (_, row) in come {
        session.push(row.stream(), row.reading(), &mut events);
        for event in events.drain(..) {
            if let Event::Anomaly(anomaly) = event {
                found.told.push(format!("{} {}", anomaly.kind.as_str(), anomaly.detail));
            }
        }
        let Some(pose) = session.pose().filter(|_| row.stream().name() == "imu") else { continue };
        while true_rows.next_if(|truth| truth.t_ns < pose.t_ns).is_some() {}
        let known = true_rows.peek().filter(|truth| truth.t_ns == pose.t_ns);
        // While it is being found a pose is told as such.
        let Some(truth) = known.filter(|_| pose.state != PoseState::Aligning) else { continue };
        found.poses += 1;
        for (k, body) in pose.bodies.iter().enumerate() {
            let Some(body) = body.filter(|body| k == 0 || body.is_measured) else { continue };
            let of = if k == 0 { &truth.cabin } else { &truth.platform };
            let off_m = magnitude(&[0, 1, 2].map(|axis| body.position_n_m[axis] - of[axis]));
            found.largest_m[k] = found.largest_m[k].max(off_m);
            found.beyond[k] += usize::from(off_m > body.protection_level_m);
        }
    }
    found
}

fn assert_each_is_told(cases: &[Case]) {
    let plan = RunPlan { hold_s: 10.0, slew_s: 14.0, track_s: 6.0, ..RunPlan::default() };
    let run = cabin::simulate(&plan, 0);
    for Case { what, change, told } in cases {
        let mut changed = run.clone();
        change(&mut changed);
        let found = outcome(&changed, &run, what.ends_with("late"));
        let is_told = told.iter().any(|told| found.told.iter().any(|one| one.starts_with(told)));
        assert!(is_told, "{what}: expected one of {told:?}, found {:?}", found.told);
        assert!(
            found.beyond.iter().all(|beyond| beyond * 20 <= found.poses),
            "{what}: {:?} of {} poses are farther off than their protection level, up to {:?} m",
            found.beyond,
            found.poses,
            found.largest_m
        );
    }
}

#[test]
fn antennas_that_are_not_as_they_should_be() {
    assert_each_is_told(&[
        case(
            "two antennas exchanged",
            |run| {
                for row in &mut run.antennas {
                    row.antenna = [3, 1, 2, 0, 4, 5][row.antenna];
                }
            },
            &["exchanged A1"],
        ),
        case(
            "east and north exchanged",
            |run| run.antennas.iter_mut().for_each(|row| row.position_n_m.swap(0, 1)),
            &["no_start antennas"],
        ),
        case(
            "positions in millimetres",
            |run| {
                run.antennas.iter_mut().for_each(|row| row.position_n_m = row.position_n_m.map(|x| 1e3 * x))
            },
            &["no_cabin"],
        ),
        case(
            "heights of another origin",
            |run| run.antennas.iter_mut().for_each(|row| row.position_n_m[2] += 30.0),
            &["contradiction stations"],
        ),
        case(
            "sigmas in millimetres",
            |run| run.antennas.iter_mut().for_each(|row| row.sigma_n_m = row.sigma_n_m.map(|x| 1e3 * x)),
            &["bad_rows antennas", "no_cabin"],
        ),
        case(
            "fixes 2 s late",
            |run| run.antennas.iter_mut().for_each(|row| row.t_ns += 2_000_000_000),
            &["late ", "wrong_make"],
        ),
        case(
            "a clock 1 s on",
            |run| run.antennas.iter_mut().for_each(|row| row.t_ns = stepped(row.t_ns, 1.0)),
            &["contradiction antennas", "wrong_make"],
        ),
        case(
            "a clock 1 s back",
            |run| run.antennas.iter_mut().for_each(|row| row.t_ns = stepped(row.t_ns, -1.0)),
            &["unordered antennas"],
        ),
        case(
            "all fixes float",
            |run| run.antennas.iter_mut().for_each(|row| row.quality = 5),
            &["no_start antennas"],
        ),
    ]);
}

#[test]
fn stations_that_are_not_as_they_should_be() {
    assert_each_is_told(&[
        case(
            "angles in gon",
            |run| {
                for ray in &mut run.stations {
                    ray.azimuth_rad *= 200.0 / std::f64::consts::PI;
                    ray.zenith_rad *= 200.0 / std::f64::consts::PI;
                }
            },
            &["no_cabin stations, column azimuth_rad"],
        ),
        case(
            "zenith angles in degrees",
            |run| run.stations.iter_mut().for_each(|ray| ray.zenith_rad = ray.zenith_rad.to_degrees()),
            &["no_cabin stations, column zenith_rad"],
        ),
        case(
            "elevations for zenith angles",
            |run| {
                run.stations
                    .iter_mut()
                    .for_each(|ray| ray.zenith_rad = std::f64::consts::FRAC_PI_2 - ray.zenith_rad)
            },
            &["contradiction stations"],
        ),
        case(
            "azimuths anticlockwise",
            |run| {
                run.stations
                    .iter_mut()
                    .for_each(|ray| ray.azimuth_rad = std::f64::consts::TAU - ray.azimuth_rad)
            },
            &["contradiction stations"],
        ),
        case(
            "distances in millimetres",
            |run| run.stations.iter_mut().for_each(|ray| ray.slant_m *= 1e3),
            &["no_cabin stations, column slant_m"],
        ),
        case(
            "distances in feet",
            |run| run.stations.iter_mut().for_each(|ray| ray.slant_m /= 0.3048),
            &["contradiction stations"],
        ),
        case(
            "two stations exchanged",
            |run| run.stations.iter_mut().for_each(|ray| ray.station = [2, 1, 0, 3, 4, 5][ray.station]),
            &["wrong_prism S1"],
        ),
        case(
            "two prisms exchanged",
            |run| {
                let first = run.stations.iter().map(|ray| ray.target).min().unwrap_or(0);
                for ray in &mut run.stations {
                    ray.target = first + [1, 0, 2][ray.target - first];
                }
            },
            &["contradiction stations"],
        ),
        case(
            "rays 2 s late",
            |run| run.stations.iter_mut().for_each(|ray| ray.t_ns += 2_000_000_000),
            &["contradiction stations"],
        ),
        case(
            "a clock 1 s on",
            |run| run.stations.iter_mut().for_each(|ray| ray.t_ns = stepped(ray.t_ns, 1.0)),
            &["contradiction stations"],
        ),
        case(
            "a clock 1 s back",
            |run| run.stations.iter_mut().for_each(|ray| ray.t_ns = stepped(ray.t_ns, -1.0)),
            &["unordered stations", "contradiction stations"],
        ),
    ]);
}

#[test]
fn encoders_that_are_not_as_they_should_be() {
    assert_each_is_told(&[
        case(
            "a leg in millimetres",
            |run| run.encoders.iter_mut().for_each(|row| row.legs_m[2] *= 1e3),
            &["no_cabin encoders, column leg_3_m"],
        ),
        case(
            "a leg 80 mm off",
            |run| run.encoders.iter_mut().for_each(|row| row.legs_m[2] += 0.08),
            &["wrong_length leg_3"],
        ),
        case(
            "a leg 80 mm off from 16 s on",
            |run| {
                run.encoders
                    .iter_mut()
                    .filter(|row| row.t_ns > 16_000_000_000)
                    .for_each(|row| row.legs_m[4] -= 0.08)
            },
            &["wrong_length leg_5"],
        ),
        case(
            "a leg 15 mm off",
            |run| run.encoders.iter_mut().for_each(|row| row.legs_m[0] += 0.015),
            &["wrong_length leg_1"],
        ),
        case(
            "two legs exchanged",
            |run| run.encoders.iter_mut().for_each(|row| row.legs_m.swap(0, 2)),
            &["contradiction stations", "no_pose encoders", "no_cabin"],
        ),
        case(
            "angles in degrees",
            |run| {
                run.encoders.iter_mut().for_each(|row| row.angles_rad = row.angles_rad.map(f64::to_degrees))
            },
            &["contradiction stations", "no_cabin", "bad_rows encoders"],
        ),
        case(
            "angles exchanged",
            |run| run.encoders.iter_mut().for_each(|row| row.angles_rad.swap(0, 1)),
            &["contradiction stations"],
        ),
        case(
            "readings 2 s late",
            |run| run.encoders.iter_mut().for_each(|row| row.t_ns += 2_000_000_000),
            &["contradiction stations"],
        ),
        case(
            "a clock 1 s back",
            |run| run.encoders.iter_mut().for_each(|row| row.t_ns = stepped(row.t_ns, -1.0)),
            &["unordered encoders"],
        ),
        case(
            "readings that never change",
            |run| {
                let first = run.encoders[0];
                run.encoders
                    .iter_mut()
                    .for_each(|row| (row.angles_rad, row.legs_m) = (first.angles_rad, first.legs_m));
            },
            &["contradiction stations"],
        ),
    ]);
}

#[test]
fn inertial_sensors_that_are_not_as_they_should_be() {
    assert_each_is_told(&[
        case(
            "forces in g",
            |run| each(&mut run.imu, |s| s.f_b_m_s2 = s.f_b_m_s2.map(|x| x / 9.8)),
            &["out_of_range imu"],
        ),
        case(
            "rates in degrees",
            |run| each(&mut run.imu, |s| s.w_ib_b_rad_s = s.w_ib_b_rad_s.map(f64::to_degrees)),
            &["lost imu", "contradiction", "mounting imu", "no_cabin"],
        ),
        case(
            "axes exchanged",
            |run| {
                each(&mut run.imu, |s| {
                    s.f_b_m_s2.swap(0, 2);
                    s.w_ib_b_rad_s.swap(0, 2);
                })
            },
            &["lost imu", "contradiction", "mounting imu", "no_cabin"],
        ),
        case("a clock 2 s on", |run| each(&mut run.imu, |s| s.t_ns = stepped(s.t_ns, 2.0)), &["silent imu"]),
        case(
            "a clock 2 s back",
            |run| each(&mut run.imu, |s| s.t_ns = stepped(s.t_ns, -2.0)),
            &["time_repeats imu"],
        ),
        case(
            "samples that never change",
            |run| {
                let first = run.imu[0];
                each(&mut run.imu, |s| (s.w_ib_b_rad_s, s.f_b_m_s2) = (first.w_ib_b_rad_s, first.f_b_m_s2));
            },
            &["lost imu", "contradiction", "stuck imu"],
        ),
    ]);
}

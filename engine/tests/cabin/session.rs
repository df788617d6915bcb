//! The cabin as a system of a session: what a control loop is told, and logs that are not as they should be.

use lodestep_engine::event::Event;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::cabin::{self, Fault, RunPlan, SimulatedRun};
use lodestep_engine::stream::{Reading, StreamId};
use lodestep_engine::system::PoseState;
use lodestep_engine::systems::cabin::DECLARATION;
use lodestep_engine::track::Track;

pub(crate) fn magnitude(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A row of any stream.
pub(crate) enum Row<'a> {
    Imu(StreamId, &'a ImuSample),
    Values(StreamId, i64, Vec<f64>),
}

impl Row<'_> {
    pub(crate) fn t_ns(&self) -> i64 {
        match self {
            Row::Imu(_, sample) => sample.t_ns,
            Row::Values(_, t_ns, _) => *t_ns,
        }
    }

    pub(crate) fn stream(&self) -> StreamId {
        match self {
            Row::Imu(stream, _) | Row::Values(stream, _, _) => *stream,
        }
    }

    pub(crate) fn reading(&self) -> Reading<'_> {
        match self {
            Row::Imu(_, sample) => Reading::Imu(sample),
            Row::Values(_, t_ns, values) => Reading::Values { t_ns: *t_ns, values },
        }
    }
}

fn simulated(faults: &[&str]) -> SimulatedRun {
    let faults: Vec<Fault> = faults.iter().map(|fault| fault.parse().expect("a fault")).collect();
    let plan = RunPlan { hold_s: 6.0, slew_s: 4.0, track_s: 8.0, faults, ..RunPlan::default() };
    cabin::simulate(&plan, 0)
}

/// All rows of a run in the order of their tags.
pub(crate) fn rows(run: &SimulatedRun) -> Vec<Row<'_>> {
    let mut rows = by_device(run);
    rows.sort_by_key(Row::t_ns);
    rows
}

/// All rows of a run, device by device.
pub(crate) fn by_device(run: &SimulatedRun) -> Vec<Row<'_>> {
    let id = |name| StreamId::read(name).expect("a name");
    let mut rows: Vec<Row<'_>> = run.imu.iter().map(|sample| Row::Imu(id("imu"), sample)).collect();
    rows.extend(run.antennas.iter().map(|row| {
        let [e, n, u] = row.position_n_m;
        let [se, sn, su] = row.sigma_n_m;
        let [ve, vn, vu] = row.velocity_n_m_s;
        let values = vec![row.antenna as f64 + 1.0, e, n, u, se, sn, su, f64::from(row.quality), ve, vn, vu];
        Row::Values(id("gnss"), row.t_ns, values)
    }));
    rows.extend(run.stations.iter().map(|ray| {
        let places = [ray.station as f64 + 1.0, ray.target as f64 + 1.0];
        let values = [&places[..], &[ray.azimuth_rad, ray.zenith_rad, ray.slant_m]].concat();
        Row::Values(id("stations"), ray.t_ns, values)
    }));
    rows.extend(
        run.encoders
            .iter()
            .map(|row| Row::Values(id("encoders"), row.t_ns, [&row.angles_rad[..], &row.legs_m].concat())),
    );
    rows.extend(
        run.plan.iter().map(|row| Row::Values(id("plan"), row.t_ns, [row.cabin, row.platform].concat())),
    );
    rows
}

pub(crate) fn session(run: &SimulatedRun, live: bool) -> Session {
    let mut config = SessionConfig::by_default(&DECLARATION);
    config.streams.retain(|stream| stream.id.name() != "platform_imu");
    config.instrument = Some(run.instrument.clone());
    config.max_lead_ns = live.then_some(1_000_000_000);
    Session::new(config).expect("the streams are those of a cabin")
}

fn finished(run: &SimulatedRun, rows: &[Row<'_>]) -> Track {
    let (mut session, mut events) = (session(run, false), Vec::new());
    for row in rows {
        session.push(row.stream(), row.reading(), &mut events);
    }
    session.finish(&mut events);
    let mut track = Track::default();
    events.into_iter().for_each(|event| track.take(event));
    track
}

#[test]
fn a_pose_is_told_at_every_sample_with_both_bodies_close_to_the_truth_and_the_plan() {
    let run = simulated(&[]);
    let (mut session, mut events) = (session(&run, true), Vec::new());
    let (mut poses, mut compared, mut worst_m) = (0, 0, [0.0_f64; 2]);
    let mut last = None;
    for row in rows(&run) {
        session.push(row.stream(), row.reading(), &mut events);
        if row.stream().name() != "imu" {
            continue;
        }
        let Some(pose) = session.pose() else { continue };
        assert_eq!(pose.t_ns, row.t_ns(), "it is of this very sample");
        poses += 1;
        if pose.t_ns < 12_000_000_000 {
            continue;
        }
        let bodies = pose.bodies.map(|body| body.expect("both are known"));
        let names = session.aid_names();
        let aids: Vec<&str> = names
            .iter()
            .enumerate()
            .filter(|(bit, _)| pose.aids >> bit & 1 == 1)
            .map(|(_, name)| &name[..])
            .collect();
        assert!(aids.starts_with(&["imu", "A1"]) && aids.ends_with(&["S6", "encoders"]), "{aids:?}");
        for (k, body) in bodies.iter().enumerate() {
            assert!(body.off_plan_n_m.iter().all(|off_m| off_m.abs() < 0.2), "{body:?}");
            assert!(body.off_plan_rad.iter().all(|off_rad| off_rad.abs() < 0.05), "{body:?}");
            assert!(
                body.is_measured
                    && body.protection_level_m > 0.0
                    && body.rate_n_rad_s.iter().all(|w| w.abs() < 0.2)
            );
            if let Some(truth) = run.truth.iter().find(|truth| truth.t_ns == pose.t_ns) {
                let of = if k == 0 { &truth.cabin } else { &truth.platform };
                let off = [0, 1, 2].map(|axis| body.position_n_m[axis] - of[axis]);
                worst_m[k] = worst_m[k].max(magnitude(&off));
                compared += 1;
            }
        }
        // A position goes on as its velocity says, from sample to sample.
        if let Some((then_ns, then)) = last.replace((pose.t_ns, bodies[0])) {
            let dt_s = (pose.t_ns - then_ns) as f64 * 1e-9;
            let step = [0, 1, 2].map(|axis| {
                bodies[0].position_n_m[axis] - then.position_n_m[axis] - dt_s * bodies[0].velocity_n_m_s[axis]
            });
            assert!(magnitude(&step) < 0.002, "a leap of {step:?} m at {} ns", pose.t_ns);
        }
        assert_ne!(pose.state, PoseState::Coasting);
    }
    assert!(poses > 3000 && compared > 100, "{poses} poses, {compared} compared");
    assert!(worst_m[0] < 0.02 && worst_m[1] < 0.01, "{worst_m:?} m");
}

#[test]
fn rows_out_of_order_give_the_same_track_but_for_the_word_that_they_were() {
    let run = simulated(&[]);
    let in_order = rows(&run);
    let expected = finished(&run, &in_order);
    let mut shuffled = rows(&run);
    // Two rays that a logger wrote one after the other, the later first.
    let rays: Vec<usize> =
        (0..shuffled.len()).filter(|k| shuffled[*k].stream().name() == "stations").collect();
    shuffled.swap(rays[40], rays[43]);
    let found = finished(&run, &shuffled);
    assert_eq!(found.points, expected.points);
    assert!(expected.points.len() > 200);
    let told: Vec<&str> = found.anomalies.iter().map(|anomaly| anomaly.kind.as_str()).collect();
    assert!(
        told.contains(&"unordered") && !expected.anomalies.iter().any(|a| a.kind.as_str() == "unordered"),
        "{told:?}"
    );
}

#[test]
fn a_wrong_fix_is_told_live_with_its_antenna_within_a_second() {
    let run = simulated(&["wrong_fix.2@13..16"]);
    let (mut session, mut events) = (session(&run, true), Vec::new());
    let mut told_ns = None;
    for row in rows(&run) {
        session.push(row.stream(), row.reading(), &mut events);
        if row.stream().name() == "imu" && row.t_ns() == 15_000_000_000 {
            let pose = session.pose().expect("a pose is known");
            let of = |name: &str| {
                let bit = session.aid_names().iter().position(|known| known == name).expect("an aid");
                (pose.aids >> bit & 1 == 1, pose.aid_states[bit])
            };
            let ((is_in, state), (other_is_in, other)) = (of("A3"), of("A5"));
            assert!(!is_in && (state.since_s - 2.0).abs() < 0.2, "{state:?}");
            assert_eq!(state.trouble.expect("it is said why").as_str(), "wrong_fix");
            assert!(other_is_in && other.since_s < 0.1 && other.trouble.is_none(), "{other:?}");
        }
        for event in events.drain(..) {
            if let Event::Anomaly(anomaly) = event
                && anomaly.kind.as_str() == "wrong_fix"
            {
                assert!(anomaly.detail.starts_with("A3: "), "{anomaly:?}");
                told_ns.get_or_insert(row.t_ns());
            }
        }
    }
    let told_s = told_ns.expect("it is told") as f64 * 1e-9;
    assert!((13.0..14.0).contains(&told_s), "told at {told_s} s");
}

#[test]
fn logs_in_other_units_and_devices_that_nobody_knows_are_refused_and_give_no_point() {
    let run = simulated(&[]);
    for (stream, column, change, said) in [
        ("stations", 2, (|x| x * 200.0 / std::f64::consts::PI) as fn(f64) -> f64, "an azimuth in radians"),
        ("encoders", 4, |x| 1e3 * x, "leg_3_m"),
        ("gnss", 0, |_| 9.0, "antenna 9"),
        ("stations", 1, |x| x + 20.0, "target"),
    ] {
        let mut wrong = rows(&run);
        for row in &mut wrong {
            if let Row::Values(of, _, values) = row
                && of.name() == stream
            {
                values[column] = change(values[column]);
            }
        }
        let track = finished(&run, &wrong);
        assert!(track.points.is_empty(), "{said}: {} points", track.points.len());
        let why = &track.anomalies.last().expect("it says why").detail;
        assert!(why.contains(said), "{why}");
    }
}

/// The same rows, those of a stream with another tag.
fn tagged<'a>(
    run: &'a SimulatedRun,
    stream: &str,
    tag_s: impl Fn(f64) -> f64,
    imu: &'a mut Vec<ImuSample>,
) -> Vec<Row<'a>> {
    let shifted = |t_ns: i64| (tag_s(t_ns as f64 * 1e-9) * 1e9).round() as i64;
    imu.extend(run.imu.iter().map(|sample| ImuSample { t_ns: shifted(sample.t_ns), ..*sample }));
    let mut all = rows(run);
    if stream == "imu" {
        all.retain(|row| row.stream().name() != "imu");
        let id = StreamId::read("imu").expect("a name");
        all.extend(imu.iter().map(|sample| Row::Imu(id, sample)));
    }
    for row in &mut all {
        if let Row::Values(of, t_ns, _) = row
            && of.name() == stream
        {
            *t_ns = shifted(*t_ns);
        }
    }
    all
}

#[test]
fn clocks_that_step_and_rows_that_are_late_are_named_and_no_pose_is_told_to_be_surer_than_it_is() {
    let plan = RunPlan { hold_s: 10.0, slew_s: 16.0, track_s: 6.0, ..RunPlan::default() };
    let run = cabin::simulate(&plan, 0);
    let step = |by_s: f64| move |t_s: f64| if t_s > 16.0 { t_s + by_s } else { t_s };
    let late = |by_s: f64| move |t_s: f64| t_s + by_s;
    type Case<'a> = (&'a str, &'a str, Box<dyn Fn(f64) -> f64>, &'a [&'a str]);
    let cases: [Case<'_>; 7] = [
        ("stations 2 s late", "stations", Box::new(late(2.0)), &["contradiction"]),
        ("encoders 2 s late", "encoders", Box::new(late(2.0)), &["contradiction"]),
        ("antennas 2 s late", "gnss", Box::new(late(2.0)), &["wrong_make", "late"]),
        ("the sensor's clock 2 s on", "imu", Box::new(step(2.0)), &["silent", "contradiction"]),
        ("the sensor's clock 2 s back", "imu", Box::new(step(-2.0)), &["time_repeats", "contradiction"]),
        ("the stations' clock 1 s on", "stations", Box::new(step(1.0)), &["contradiction"]),
        ("the encoders' clock 1 s back", "encoders", Box::new(step(-1.0)), &["unordered", "contradiction"]),
    ];
    for (what, stream, tag_s, named) in cases {
        let mut imu = Vec::new();
        let track = finished(&run, &tagged(&run, stream, tag_s, &mut imu));
        let told: Vec<&str> = track.anomalies.iter().map(|anomaly| anomaly.kind.as_str()).collect();
        assert!(named.iter().any(|kind| told.contains(kind)), "{what}: {told:?}");
        let (mut beyond, mut all) = (0, 0);
        for point in &track.points {
            let Some(truth) = run.truth.iter().find(|truth| truth.t_ns == point.t_ns) else { continue };
            let off = [0, 1, 2].map(|axis| point.position_n_m[axis] - truth.cabin[axis]);
            let sigma = point.sigma_n_m.iter().fold(0.0_f64, |most, sigma| most.max(*sigma));
            beyond += usize::from(magnitude(&off) > 5.1 * sigma);
            all += 1;
        }
        assert!(
            beyond * 20 <= all,
            "{what}: {beyond} of {all} poses are farther off than their protection level"
        );
    }
}

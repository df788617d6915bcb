//! What is known while the pole is on its way: the tip and how sure it is, at once.
//!
//! Fixes come some tenths of a second after their time, so there are two filters: one that has seen everything up to
//! [`LAG_NS`] before the newest sample, and, for each point that is told, a copy of it that goes on to the newest sample.

use nalgebra::Matrix4;

use super::alignment::Search;
use super::contact::{self, Interval};
use super::gnss_rows;
use super::outcome;
use super::pass::{LONG_GAP_NS, Runner, Setting, Wanted};
use super::recorder::Recorder;
use super::recording::{Fix, Recording};
use super::system::{Means, RATE_HZ, track_point};
use super::{checks, start};
use crate::anomaly::Cause as _;
use crate::event::{AidOutcome, Event, TrackPoint};
use crate::ins::earth::Earth;
use crate::sample::ImuSample;
use crate::stream::StreamId;

use super::aids::{IMU, SWITCH};

/// A fix that comes later than this is left out of what is told live, ns. Longer than what a landing is felt by.
const LAG_NS: i64 = 400_000_000;
/// Landings are looked for this often, over so much, ns.
const FELT_EVERY_NS: i64 = 100_000_000;
const FELT_OVER_NS: i64 = 1_200_000_000;
/// A contact that lasts has no end yet.
const OPEN_NS: i64 = i64::MAX / 4;
/// A receiver whose clock is farther from the sensor's has another zero, ns.
const SAME_CLOCK_NS: i64 = 600_000_000_000;
/// So long after a gap what lies in it is smoothed, ns: as soon as its end is there, and once more when more of the sky is.
const SMOOTHED_AFTER_NS: [i64; 2] = [0, 3_000_000_000];

/// A pole on its way.
#[derive(Debug, Default)]
pub(super) struct Live {
    search: Search,
    fixes: Vec<Fix>,
    /// How many rows of the receiver are among these.
    rows: usize,
    shift_ns: Option<i64>,
    contacts: Vec<Interval>,
    felt_ns: i64,
    gyro_bias_b: nalgebra::Vector3<f64>,
    /// What the sensor reads up the pole when the tip stands, m/s².
    at_rest_m_s2: f64,
    running: Option<Running>,
    /// What belongs to no such survey: nothing more is told.
    refused: bool,
    /// When what lies in the newest gap is smoothed, in order of time, ns.
    smoothed_at_ns: Vec<i64>,
    to_be_smoothed: bool,
}

#[derive(Debug)]
struct Running {
    runner: Runner,
    earth: Earth,
    /// The sample that comes next.
    next: usize,
    next_point_ns: i64,
    /// Landings that were told.
    told: usize,
}

const fn every_ns() -> i64 {
    (1e9 / RATE_HZ) as i64
}

fn next_ns(t_ns: i64) -> i64 {
    (t_ns + every_ns() - 1).div_euclid(every_ns()) * every_ns()
}

impl Live {
    /// Goes on by what the recorder has got of this stream.
    pub(super) fn go_on(
        &mut self,
        means: &Means,
        recorder: &Recorder,
        stream: StreamId,
        events: &mut Vec<Event>,
    ) {
        if self.refused {
            return;
        }
        self.place(means, recorder);
        if stream == SWITCH {
            self.contacts = contact::by_switch(&recorder.switch, OPEN_NS);
            self.contacts_changed(means, recorder);
        }
        if stream != IMU {
            return;
        }
        if self.running.is_none() {
            self.begin(means, recorder, events);
        }
        if recorder.switch.is_empty() {
            self.feel(means, recorder);
        }
        self.settle(means, recorder, events);
        self.tell(means, recorder, events);
    }

    /// Whether there is a gap to be smoothed now; asked once.
    pub(super) fn wants_to_be_smoothed(&mut self) -> bool {
        std::mem::take(&mut self.to_be_smoothed)
    }

    /// Puts the receiver's rows on the sensor's clock.
    fn place(&mut self, means: &Means, recorder: &Recorder) {
        let (Some(row), Some(newest)) = (recorder.gnss.get(self.rows), recorder.imu.last()) else { return };
        let near = |zero: i64| (row.t_ns - zero - newest.t_ns).abs() < SAME_CLOCK_NS;
        let shift_ns = *self.shift_ns.get_or_insert_with(|| gnss_rows::zero_ns(row.t_ns, near));
        let first_ns = recorder.imu[0].t_ns;
        for row in &recorder.gnss[self.rows..] {
            let fix = gnss_rows::fix(row, shift_ns, &means.frame);
            let last_ns = self.fixes.last().map(|last| last.t_ns);
            if fix.t_ns < first_ns || last_ns.is_some_and(|last_ns| fix.t_ns <= last_ns) {
                continue;
            }
            if last_ns.is_some_and(|last_ns| fix.t_ns - last_ns > LONG_GAP_NS) {
                self.smoothed_at_ns = SMOOTHED_AFTER_NS.map(|after_ns| fix.t_ns + after_ns).into();
            }
            self.fixes.push(fix);
        }
        self.rows = recorder.gnss.len();
    }

    /// Finds the first attitude, and goes over what was recorded up to it.
    fn begin(&mut self, means: &Means, recorder: &Recorder, events: &mut Vec<Event>) {
        let Some(newest) = recorder.imu.last() else { return };
        let inside = self.fixes.partition_point(|fix| fix.t_ns <= newest.t_ns);
        let earth = Earth::turning(&means.frame);
        let arm = &means.instrument.antenna_b_m;
        let Some(aligned) = self.search.go_on(&recorder.imu, &self.fixes[..inside], arm, &earth) else {
            return;
        };
        let recording = Recording {
            imu: recorder.imu.clone(),
            fixes: self.fixes[..inside].to_vec(),
            switch: (!recorder.switch.is_empty()).then(|| recorder.switch.clone()),
            stops: Vec::new(),
            left_out: Vec::new(),
        };
        if let Err(cause) = checks::check(&recording, &means.instrument, &means.frame) {
            events.push(Event::Anomaly(cause.anomaly(None, aligned.window_ns, 0)));
            self.refused = true;
            return;
        }
        self.gyro_bias_b = aligned.gyro_bias_b;
        if recorder.switch.is_empty() {
            self.at_rest_m_s2 = start::at_rest(&recording, &means.instrument, &earth, &aligned);
            self.contacts = start::contacts(&recording, &means.instrument, &earth, &aligned);
        }
        self.felt_ns = newest.t_ns;
        let tuning = &means.options.tuning;
        let filter = start::begin(&recording, &means.instrument, &earth, tuning, &aligned, &self.contacts);
        let restless = vec![false; self.contacts.len()];
        let setting = self.setting(means, recorder, &earth, &restless);
        let runner = Runner::new(&setting, &filter, aligned.sample, Wanted::Live);
        let next_point_ns = next_ns(recorder.imu[aligned.sample].t_ns);
        self.running = Some(Running { runner, earth, next: aligned.sample + 1, next_point_ns, told: 0 });
    }

    fn setting<'a>(
        &'a self,
        means: &'a Means,
        recorder: &'a Recorder,
        earth: &'a Earth,
        restless: &'a [bool],
    ) -> Setting<'a> {
        Setting {
            tuning: &means.options.tuning,
            earth,
            imu: &recorder.imu,
            fixes: &self.fixes,
            islands: &[],
            contacts: if means.options.lands { &self.contacts } else { &[] },
            restless,
            felt: recorder.switch.is_empty(),
            still: None,
        }
    }

    /// Landings by what the sensor feels.
    fn feel(&mut self, means: &Means, recorder: &Recorder) {
        let (Some(newest), Some(_)) = (recorder.imu.last(), &self.running) else { return };
        if newest.t_ns - self.felt_ns < FELT_EVERY_NS {
            return;
        }
        self.felt_ns = newest.t_ns;
        let from = recorder.imu.partition_point(|sample| sample.t_ns < newest.t_ns - FELT_OVER_NS);
        let felt =
            contact::by_feel(&recorder.imu[from..], &means.instrument, self.at_rest_m_s2, &self.gyro_bias_b);
        for new in felt {
            match self.contacts.last_mut() {
                Some(last) if new.from_ns <= last.to_ns => last.to_ns = last.to_ns.max(new.to_ns),
                _ => self.contacts.push(new),
            }
        }
        self.contacts_changed(means, recorder);
    }

    fn contacts_changed(&mut self, means: &Means, recorder: &Recorder) {
        let Some(mut running) = self.running.take() else { return };
        let restless = vec![false; self.contacts.len()];
        running.runner.contacts_changed(&self.setting(means, recorder, &running.earth, &restless));
        self.running = Some(running);
    }

    /// Goes on to what is old enough that nothing earlier will come.
    fn settle(&mut self, means: &Means, recorder: &Recorder, events: &mut Vec<Event>) {
        let (Some(mut running), Some(newest)) = (self.running.take(), recorder.imu.last()) else { return };
        let restless = vec![false; self.contacts.len()];
        let setting = self.setting(means, recorder, &running.earth, &restless);
        while let Some(sample) = recorder.imu.get(running.next).filter(|to| to.t_ns + LAG_NS <= newest.t_ns) {
            running.runner.interval(&setting, &recorder.imu[running.next - 1], sample);
            running.next += 1;
            if sample.t_ns >= running.next_point_ns {
                running.next_point_ns = next_ns(sample.t_ns + 1);
                events.push(Event::Point(running.point(means, &[])));
            }
        }
        let settled_ns = running.runner.t_ns;
        events.extend(running.runner.pass.weighed.drain(..).map(|fix| Event::Aid(fix.outcome())));
        running.runner.pass.headings.clear();
        while let Some(contact) = self.contacts.get(running.told).filter(|contact| contact.to_ns < settled_ns)
        {
            let landing = running.runner.pass.landings.get(running.told);
            let outcome = landing.and_then(|landing| landing.outcome());
            events.extend(outcome.map(|aid| Event::Aid(AidOutcome { t_ns: contact.from_ns, ..aid })));
            running.told += 1;
        }
        let due = self.smoothed_at_ns.partition_point(|at_ns| *at_ns < settled_ns);
        self.to_be_smoothed |= due > 0;
        self.smoothed_at_ns.drain(..due);
        self.running = Some(running);
    }

    /// Tells the newest point where it is time for one.
    fn tell(&mut self, means: &Means, recorder: &Recorder, events: &mut Vec<Event>) {
        let (Some(running), Some(newest)) = (&mut self.running, recorder.imu.last()) else { return };
        if newest.t_ns < running.next_point_ns {
            return;
        }
        // What the beginning has left out is told from its samples.
        while let Some(k) =
            (running.next..recorder.imu.len()).find(|k| recorder.imu[*k].t_ns >= running.next_point_ns)
        {
            running.next_point_ns = next_ns(recorder.imu[k].t_ns + 1);
            events.push(Event::Point(running.point(means, &recorder.imu[running.next..=k])));
        }
    }
}

impl Running {
    /// Where the pole is after these samples, which the filter has not seen yet.
    fn point(&self, means: &Means, ahead: &[ImuSample]) -> TrackPoint {
        let (filter, pose) = self.runner.ahead(&means.options.tuning, &self.earth, ahead);
        let shows = filter.shows();
        let rows = filter.eskf.covariance.seen_by(&shows);
        let covariance: Matrix4<f64> =
            shows.iter().map(|(block, jacobian)| jacobian * rows.block(*block).transpose()).sum();
        track_point(&outcome::row(&pose, &[pose.t_ns, pose.t_ns], &[covariance, covariance]))
    }
}

//! The end of a session: what waits is told, logs that end early are noticed, and the walk is smoothed.

use super::{Session, Walk, foot_missing, seconds};
use crate::event::Event;
use crate::systems::pedestrian::line::FootLine;
use crate::trouble::Trouble;

/// A foot whose log begins or ends so much apart from the other's is told, ns.
const MISSING_NS: i64 = 1_000_000_000;

impl Session {
    /// No more samples will come: what waits is processed and told, and the walk is smoothed if that was
    /// asked for.
    pub fn finish(&mut self, events: &mut Vec<Event>) {
        self.finish_filter(events);
        while self.smooth_next(events) {}
    }

    /// Smooths the next piece of the walk, after [`Self::finish_filter`]; says whether there was one. A
    /// piece is a minute, told as one revision, the last of the walk first: who takes it away at once
    /// never holds the walk twice.
    pub fn smooth_next(&mut self, events: &mut Vec<Event>) -> bool {
        match &mut self.walk {
            Walk::Waiting => false,
            Walk::OneFoot(history) => history.smooth_next(events),
            Walk::TwoFeet(history) => history.smooth_next(events),
        }
    }

    /// The first part of [`Self::finish`]: all but the smoothing.
    pub fn finish_filter(&mut self, events: &mut Vec<Event>) {
        let known = events.len();
        for line in &mut self.lines {
            line.end(events);
        }
        self.go_on(events);
        self.notice_early_end(events);
        match &mut self.walk {
            Walk::Waiting => {}
            Walk::OneFoot(history) => history.finish(events),
            Walk::TwoFeet(history) => history.finish(events),
        }
        self.identify(known, events);
        if let Some(stands) = &mut self.stands {
            stands.finish(events);
        }
        self.sum_up(&events[known..]);
    }

    /// A foot whose log begins or ends well before the other's.
    fn notice_early_end(&self, events: &mut Vec<Event>) {
        let newest_ns = self.lines.iter().filter_map(FootLine::newest_ns).max().unwrap_or(0);
        let oldest_ns = self.lines.iter().map(FootLine::first_ns).min().unwrap_or(0);
        for line in &self.lines {
            let foot = line.foot();
            let (first_ns, last_ns) = (line.first_ns(), line.newest_ns().unwrap_or(0));
            if first_ns - oldest_ns > MISSING_NS {
                let late_s = seconds(first_ns - oldest_ns);
                events.push(foot_missing(foot, first_ns, &Trouble::FootLate { foot, late_s }));
            }
            if newest_ns - last_ns > MISSING_NS {
                let early_s = seconds(newest_ns - last_ns);
                events.push(foot_missing(foot, last_ns, &Trouble::FootEarly { foot, early_s }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Site;
    use crate::sample::Foot;
    use crate::session::{SessionConfig, Solution, Visit};
    use crate::sim::{SensorModel, WalkKind, simulate};
    use crate::track::Track;

    /// Three minutes of the spiral, smoothed; with one of its visits told 20 s late.
    fn smoothed(run_again: bool) -> Track {
        let site = Site::fast();
        let walk = simulate(&WalkKind::Spiral, 1, &site, &SensorModel::cmp10a());
        let config = SessionConfig {
            initial_position_n_m: walk.start_n_m(),
            declination_rad: site.declination_deg.to_radians(),
            gravity_m_s2: site.gravity_m_s2,
            solution: Solution::Smoothed,
            ..SessionConfig::default()
        };
        let (mut session, mut events) = (Session::new(config), Vec::new());
        let mut visits = walk.visits.iter();
        let mut next = visits.next();
        for (left, right) in walk.left.iter().zip(&walk.right).take(26_000) {
            session.push(Foot::Left, left, &mut events);
            session.push(Foot::Right, right, &mut events);
            if let Some(visit) = next.filter(|visit| left.t_ns > visit.t_end_ns + 20_000_000_000) {
                let [e, n, u] = visit.position_n_m;
                session.visit(
                    Visit {
                        marker: visit.marker.clone(),
                        t_start_ns: visit.t_start_ns,
                        t_end_ns: visit.t_end_ns,
                        position_n_m: (e, n, Some(u)),
                    },
                    &mut events,
                );
                next = visits.next();
            }
        }
        session.finish_filter(&mut events);
        if run_again && let Walk::TwoFeet(history) = &mut session.walk {
            history.forget_recordings();
        }
        while session.smooth_next(&mut events) {}
        let mut track = Track::default();
        events.into_iter().for_each(|event| track.take(event));
        assert!(track.visits.iter().any(|visit| visit.accepted));
        assert!(track.revised_points >= track.points.len() as u64);
        track
    }

    #[test]
    fn stretches_that_are_run_again_give_the_same_smoothed_track_to_the_bit() {
        assert_eq!(smoothed(false).sha256(), smoothed(true).sha256());
    }
}

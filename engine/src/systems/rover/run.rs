//! A whole run: rover, base and navigation in, rows and a report out.

use nalgebra::Vector3;

use super::arcs::Losses;
use super::differences::{Base, Pair, age_s};
use super::filter::Filter;
use super::instrument::Instrument;
use super::row::{Quality, Row};
use crate::geo::Geodetic;
use crate::gnss::ephemeris::Navigation;
use crate::gnss::observations::{Epoch, Observations};
use crate::gnss::satellite::Constellation;
use crate::gnss::single_point::{SinglePoint, locate};

/// The oldest base epoch that is used, s.
const OLDEST_BASE_S: f64 = 30.0;
/// Time tags that differ by less are the same, s.
const SAME_TAG_S: f64 = 0.01;

/// What a run takes.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The rover's observations.
    pub rover: &'a Observations,
    /// The base's.
    pub base: &'a Observations,
    /// Orbits and clocks.
    pub navigation: &'a Navigation,
    /// The base's antenna.
    pub base_place: Geodetic,
    /// What is known beforehand.
    pub instrument: &'a Instrument,
    /// Systems to use.
    pub systems: &'a [Constellation],
    /// Where the rover begins, e n u, m.
    pub initial_position_m: Option<[f64; 3]>,
}

/// What a run gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One for each epoch.
    pub rows: Vec<Row>,
    /// Slips, told and found.
    pub slips: usize,
    /// What was odd, a sentence each.
    pub anomalies: Vec<String>,
}

/// The base's epochs in their order, with what the base lost in between.
struct BaseEpochs<'a> {
    epochs: &'a [Epoch],
    next: usize,
    losses: Losses,
}

impl<'a> BaseEpochs<'a> {
    /// The base's epoch of a time tag, or the last before it.
    fn at(&mut self, rover: &Epoch) -> Option<&'a Epoch> {
        while let Some(epoch) = self.epochs.get(self.next) {
            if age_s(rover.time, epoch.time) < -SAME_TAG_S {
                break;
            }
            self.losses.take(epoch);
            self.next += 1;
        }
        let last = self.epochs.get(self.next.checked_sub(1)?)?;
        (age_s(rover.time, last.time) <= OLDEST_BASE_S).then_some(last)
    }
}

/// Works a run out.
pub fn run(inputs: &Inputs<'_>) -> Outcome {
    let mut outcome = Outcome::default();
    let base = Base::new(inputs.base_place);
    let interval_s = inputs.rover.interval_s().unwrap_or(1.0);
    let two_bands = inputs.rover.has_two_bands() && inputs.base.has_two_bands();
    let mut bases = BaseEpochs { epochs: &inputs.base.epochs, next: 0, losses: Losses::default() };
    let mut rover_losses = Losses::default();
    let mut filter: Option<Filter> = None;
    for epoch in &inputs.rover.epochs {
        rover_losses.take(epoch);
        let from_base = bases.at(epoch);
        if filter.as_ref().is_none_or(|filter| filter.plan_sigma_m() > 100.0) {
            let near = inputs.initial_position_m.map(|p| base.to_e(&Vector3::from(p)));
            let start = match locate(epoch, inputs.navigation, near.or(Some(base.p_e))) {
                Some(point) => base.c_ne * (point.p_e - base.p_e),
                None => continue,
            };
            let sigma = [30.0; 3];
            filter = Some(Filter::new(
                epoch.time,
                start.into(),
                sigma,
                inputs.instrument,
                two_bands,
                interval_s,
                inputs.systems,
                0,
            ));
        }
        let Some(filter) = &mut filter else { continue };
        filter.move_to(epoch.time);
        let fixed = from_base.and_then(|from_base| {
            let pair = Pair { rover: epoch, base: from_base };
            let position = filter.satellites(pair, &base, inputs.navigation, [&rover_losses, &bases.losses]);
            rover_losses.clear();
            bases.losses.clear();
            position
        });
        let position = fixed.unwrap_or_else(|| filter.position(&filter.state, Quality::Predicted, None, 0));
        outcome.rows.push(row(epoch, &position, &base, &inputs.rover.epochs[0]));
    }
    if let Some(filter) = filter {
        outcome.slips = filter.arcs.slips_told + filter.arcs.slips_found;
        if filter.releases > 0 {
            outcome.anomalies.push(format!(
                "whole cycles were given up {} times, as they no longer fitted",
                filter.releases
            ));
        }
    }
    outcome
}

fn row(epoch: &Epoch, position: &super::filter::Position, base: &Base, first: &Epoch) -> Row {
    let place = base.frame.to_geodetic(position.p_n);
    Row {
        t_s: epoch.time.since(first.time),
        gps_time: Some((epoch.time.week(), epoch.time.tow_s())),
        p_n_m: position.p_n,
        geodetic: Some([place.latitude_deg, place.longitude_deg, place.height_m]),
        sigma_n_m: position.sigma_n,
        quality: position.quality,
        ratio: position.ratio,
        satellites: position.satellites,
        anchors: 0,
    }
}

/// A single point in n.
pub fn in_n(point: &SinglePoint, base: &Base) -> [f64; 3] {
    (base.c_ne * (point.p_e - base.p_e)).into()
}

//! What is odd about a rover's files or about what it met, and why it has no position: each with its figures and its sentence.

use crate::anomaly::{AnomalyKind, Cause};
use crate::figures::{Figure, Figures, figures};
use crate::gnss::time::GpsTime;
use crate::word::Word;

const fn kind(word: &str, order: u8) -> AnomalyKind {
    AnomalyKind(Word::declared(word, order))
}

const NO_ORBITS: AnomalyKind = kind("no_orbits", 50);
const NO_COMMON_TIME: AnomalyKind = kind("no_common_time", 51);
const BASE_PLACE: AnomalyKind = kind("base_place", 52);
const TIME_TAGS: AnomalyKind = kind("time_tags", 53);
const ANCHORS_SWAPPED: AnomalyKind = kind("anchors_swapped", 54);
const RANGES_CLOCK: AnomalyKind = kind("ranges_clock", 55);
const RANGES_OFF: AnomalyKind = kind("ranges_off", 56);
const WRONG_UNIT: AnomalyKind = kind("wrong_unit", 57);
const UNKNOWN_ANCHOR: AnomalyKind = kind("unknown_anchor", 58);
const CYCLES_GIVEN_UP: AnomalyKind = kind("cycles_given_up", 59);
const RANGES_REJECTED: AnomalyKind = kind("ranges_rejected", 60);
const TAG_LOST: AnomalyKind = kind("tag_lost", 61);
const NO_POSITION: AnomalyKind = kind("no_position", 62);
const FAR_FROM_SITE: AnomalyKind = kind("far_from_site", 63);
const BASE_MOVED: AnomalyKind = kind("base_moved", 64);

/// What is wrong, and by how much.
#[derive(Clone, Debug, PartialEq)]
pub enum RoverCause {
    /// No orbit is known at the rover's time: when it observed, and from when to when there are orbits.
    NoOrbits {
        /// The rover's first and last time tag.
        rover: [GpsTime; 2],
        /// The first and last reference time; none where there is no orbit at all.
        orbits: Option<[GpsTime; 2]>,
    },
    /// Rover and base did not observe at one time.
    NoCommonTime {
        /// The rover's first and last time tag.
        rover: [GpsTime; 2],
        /// The base's.
        base: [GpsTime; 2],
    },
    /// The base's own observations put it elsewhere.
    BasePlace {
        /// So far in plan, m.
        plan_m: f64,
        /// So far in height, m.
        height_m: f64,
    },
    /// A receiver's clock is off by whole seconds.
    TimeTags {
        /// `rover` or `base`.
        who: &'static str,
        /// By so much, s.
        off_s: f64,
    },
    /// Two anchors have each other's place.
    AnchorsSwapped {
        /// One.
        first: String,
        /// The other.
        second: String,
    },
    /// The ranges' clock is off.
    RangesClock {
        /// By so much, s.
        off_s: f64,
    },
    /// Ranges do not fit what satellites fixed.
    RangesOff {
        /// By so much in the middle, m.
        off_m: f64,
    },
    /// Ranges are in another unit than metres.
    WrongUnit {
        /// In this one, as it seems.
        unit: &'static str,
    },
    /// No anchor of the ranges is surveyed.
    NoKnownAnchor {
        /// Names among the ranges.
        ranged: String,
        /// Names in the survey.
        surveyed: String,
    },
    /// Some anchors of the ranges are not surveyed.
    UnknownAnchor {
        /// So many ranges were left out.
        ranges: usize,
        /// To these.
        anchors: String,
    },
    /// Held whole cycles were wrong.
    CyclesGivenUp {
        /// So often.
        times: usize,
    },
    /// Most ranges to an anchor were rejected.
    RangesRejected {
        /// The anchor.
        anchor: String,
        /// So many.
        rejected: usize,
        /// Of so many.
        ranges: usize,
    },
    /// Too few anchors agree for a first position.
    TagNotFound {
        /// So many surveyed anchors answered.
        answered: usize,
    },
    /// Fewer than three anchors agree.
    FewAnchors {
        /// So many do.
        agree: usize,
    },
    /// The tag was lost and found anew.
    TagLost {
        /// So often.
        times: usize,
    },
    /// No epoch has enough satellites.
    NoPosition {
        /// Epochs there were.
        epochs: usize,
    },
    /// A stream of the session is empty.
    NotStored {
        /// Its name.
        stream: String,
    },
    /// The base's file does not say where it is.
    NoBasePlace,
    /// There are ranges and no survey of the anchors.
    NoAnchors {
        /// So many ranges.
        ranges: usize,
    },
    /// The base is far from the site.
    FarFromSite {
        /// So far, km.
        away_km: f64,
    },
    /// The base says that it is somewhere else than before.
    BaseMoved {
        /// So far from where it was, m.
        moved_m: f64,
    },
}

impl Cause for RoverCause {
    fn kind(&self) -> AnomalyKind {
        use RoverCause as C;
        match self {
            C::NoOrbits { .. } => NO_ORBITS,
            C::NoCommonTime { .. } => NO_COMMON_TIME,
            C::BasePlace { .. } | C::NoBasePlace => BASE_PLACE,
            C::TimeTags { .. } => TIME_TAGS,
            C::AnchorsSwapped { .. } => ANCHORS_SWAPPED,
            C::RangesClock { .. } => RANGES_CLOCK,
            C::RangesOff { .. } => RANGES_OFF,
            C::WrongUnit { .. } => WRONG_UNIT,
            C::NoKnownAnchor { .. } | C::UnknownAnchor { .. } | C::NoAnchors { .. } => UNKNOWN_ANCHOR,
            C::CyclesGivenUp { .. } => CYCLES_GIVEN_UP,
            C::RangesRejected { .. } => RANGES_REJECTED,
            C::TagNotFound { .. } | C::FewAnchors { .. } | C::TagLost { .. } => TAG_LOST,
            C::NoPosition { .. } => NO_POSITION,
            C::NotStored { .. } => AnomalyKind::STREAM_MISSING,
            C::FarFromSite { .. } => FAR_FROM_SITE,
            C::BaseMoved { .. } => BASE_MOVED,
        }
    }

    fn sentence(&self) -> String {
        use RoverCause as C;
        match self {
            C::NoOrbits { rover, orbits } => {
                let theirs = match orbits {
                    Some(orbits) => format!("they hold orbits from {}", from_to(orbits)),
                    None => "they hold no orbit".to_owned(),
                };
                format!(
                    "the navigation files have no orbit for the rover's time, {}: {theirs}; give the navigation file of that day",
                    from_to(rover)
                )
            }
            C::NoCommonTime { rover, base } => format!(
                "rover and base have no time in common: the rover observed from {}, the base from {}; give the base file of that time",
                from_to(rover),
                from_to(base)
            ),
            C::BasePlace { plan_m, height_m } => format!(
                "the base's position is {plan_m:.0} m in plan and {height_m:.0} m in height away from where its own observations put it; correct --base-position, [base] of rover.toml or the base file's APPROX POSITION XYZ"
            ),
            C::TimeTags { who, off_s } => format!(
                "the {who}'s time tags seem to be {off_s} s off: its observations fit the satellites' orbits only so; set the receiver's clock, or correct the file's times"
            ),
            C::AnchorsSwapped { first, second } => format!(
                "anchors {first} and {second} seem to be swapped in the survey: the ranges fit only when they change places; correct the anchors"
            ),
            C::RangesClock { off_s } => format!(
                "the ranges' clock seems to be {off_s:.1} s off GPS time: ranges fit the fixed positions only so; set the clock of the UWB computer"
            ),
            C::RangesOff { off_m } => format!(
                "ranges are {off_m:.1} m off the fixed positions in the middle: check the anchors' coordinates and names"
            ),
            C::WrongUnit { unit } => {
                format!("ranges do not fit the anchors in metres, but in {unit}; give range_m in metres")
            }
            C::NoKnownAnchor { ranged, surveyed } => format!(
                "none of the anchors of the ranges ({ranged}) is among the surveyed ones ({surveyed}); correct the names in one of the two files"
            ),
            C::UnknownAnchor { ranges, anchors } => {
                format!("{ranges} ranges to {anchors} were left out: no such anchor is surveyed")
            }
            C::CyclesGivenUp { times } => {
                format!("whole cycles were given up {times} times, as they no longer fitted")
            }
            C::RangesRejected { anchor, rejected, ranges } => format!(
                "{rejected} of {ranges} ranges to anchor {anchor} fit nothing else and were rejected; check its place in the survey and what stands in between"
            ),
            C::TagNotFound { answered } => format!(
                "the tag was not found: a position needs three anchors that agree, and {answered} answered"
            ),
            C::FewAnchors { agree } => format!(
                "fewer than three anchors agree ({agree} do): positions are not to be relied on"
            ),
            C::TagLost { times } => format!("the tag was lost and found anew {times} times"),
            C::NoPosition { epochs } => format!(
                "none of {epochs} epochs has enough satellites with known orbits for a position; give the navigation file of that day, and one of every system that is used"
            ),
            C::NotStored { stream } => {
                format!("nothing is stored of the stream {stream}: upload its log, then process again")
            }
            C::NoBasePlace => "the base's file has no APPROX POSITION XYZ; give the base's place by --base-position LAT,LON,H or as [base] of rover.toml".to_owned(),
            C::NoAnchors { ranges } => format!(
                "expected the anchors of {ranges} ranges, found none: list them as [[anchors]] with name, e_m, n_m, u_m in rover.toml, or give --anchors"
            ),
            C::FarFromSite { away_km } => format!(
                "the base is {away_km:.0} km from the site: the track is drawn around the base, as if the site were there; correct the site, or [base] of rover.toml"
            ),
            C::BaseMoved { moved_m } => format!(
                "the base says that it is {moved_m:.3} m from where it said first: nothing is called fixed; put it back, or begin a new session"
            ),
        }
    }

    fn figures(&self) -> Figures {
        use RoverCause as C;
        let count = |n: &usize| Figure::Number(*n as f64);
        let name = |text: &String| Figure::Name(text.clone());
        let span = |from: &str, to: &str, [first, last]: &[GpsTime; 2]| {
            [
                (from.to_owned(), Figure::Name(first.calendar())),
                (to.to_owned(), Figure::Name(last.calendar())),
            ]
        };
        match self {
            C::NoOrbits { rover, orbits } => {
                let orbits = orbits.iter().flat_map(|orbits| span("orbits_from", "orbits_to", orbits));
                span("from", "to", rover).into_iter().chain(orbits).collect()
            }
            C::NoCommonTime { rover, base } => {
                span("from", "to", rover).into_iter().chain(span("base_from", "base_to", base)).collect()
            }
            C::BasePlace { plan_m, height_m } => {
                figures([("plan_m", (*plan_m).into()), ("height_m", (*height_m).into())])
            }
            C::TimeTags { who, off_s } => figures([("who", (*who).into()), ("off_s", (*off_s).into())]),
            C::AnchorsSwapped { first, second } => {
                figures([("first", name(first)), ("second", name(second))])
            }
            C::RangesClock { off_s } => figures([("off_s", (*off_s).into())]),
            C::RangesOff { off_m } => figures([("off_m", (*off_m).into())]),
            C::WrongUnit { unit } => figures([("unit", (*unit).into())]),
            C::NoKnownAnchor { ranged, surveyed } => {
                figures([("ranged", name(ranged)), ("surveyed", name(surveyed))])
            }
            C::UnknownAnchor { ranges, anchors } => {
                figures([("ranges", count(ranges)), ("anchors", name(anchors))])
            }
            C::CyclesGivenUp { times } | C::TagLost { times } => figures([("times", count(times))]),
            C::RangesRejected { anchor, rejected, ranges } => {
                figures([("anchor", name(anchor)), ("rejected", count(rejected)), ("ranges", count(ranges))])
            }
            C::TagNotFound { answered } => figures([("answered", count(answered))]),
            C::FewAnchors { agree } => figures([("agree", count(agree))]),
            C::NoPosition { epochs } => figures([("epochs", count(epochs))]),
            C::NotStored { stream } => figures([("stream", name(stream))]),
            C::NoBasePlace => figures([]),
            C::NoAnchors { ranges } => figures([("ranges", count(ranges))]),
            C::FarFromSite { away_km } => figures([("away_km", (*away_km).into())]),
            C::BaseMoved { moved_m } => figures([("moved_m", (*moved_m).into())]),
        }
    }
}

fn from_to([first, last]: &[GpsTime; 2]) -> String {
    format!("{} to {}", first.calendar(), last.calendar())
}

/// One of each, with figures as they may be.
pub(super) fn examples() -> Vec<RoverCause> {
    use RoverCause as C;
    let day = |week| [GpsTime::from_week(week, 116_400.0), GpsTime::from_week(week, 117_000.0)];
    let name = |text: &str| text.to_owned();
    vec![
        C::NoOrbits { rover: day(2320), orbits: Some(day(2319)) },
        C::NoOrbits { rover: day(2320), orbits: None },
        C::NoCommonTime { rover: day(2320), base: day(2319) },
        C::BasePlace { plan_m: 100.0, height_m: 3.0 },
        C::NoBasePlace,
        C::TimeTags { who: "rover", off_s: 10.0 },
        C::AnchorsSwapped { first: name("A1"), second: name("A3") },
        C::RangesClock { off_s: 10.0 },
        C::RangesOff { off_m: 4.0 },
        C::WrongUnit { unit: "millimetres" },
        C::NoKnownAnchor { ranged: name("1, 2"), surveyed: name("A1, A2") },
        C::UnknownAnchor { ranges: 300, anchors: name("A9") },
        C::NoAnchors { ranges: 300 },
        C::CyclesGivenUp { times: 2 },
        C::RangesRejected { anchor: name("A1"), rejected: 120, ranges: 150 },
        C::TagNotFound { answered: 2 },
        C::FewAnchors { agree: 2 },
        C::TagLost { times: 1 },
        C::NoPosition { epochs: 120 },
        C::NotStored { stream: name("base") },
        C::FarFromSite { away_km: 1234.0 },
        C::BaseMoved { moved_m: 12.5 },
    ]
}

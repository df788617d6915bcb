//! What a surveyor has to know of a survey, and why one cannot be computed: each with its figures and its sentence.

use crate::anomaly::{AnomalyKind, Cause};
use crate::figures::{Figure, Figures, figures};
use crate::word::Word;

const fn kind(word: &str, order: u8) -> AnomalyKind {
    AnomalyKind(Word::declared(word, order))
}

const MOVING_GROUND: AnomalyKind = kind("moving_ground", 30);
const SLIP: AnomalyKind = kind("slip", 31);
const FIX_JUMP: AnomalyKind = kind("fix_jump", 32);
const DOUBTFUL_FIXES: AnomalyKind = kind("doubtful_fixes", 33);
const NOT_FIXED: AnomalyKind = kind("not_fixed", 34);
const SAMPLE_GAP: AnomalyKind = kind("sample_gap", 35);
const CHATTER: AnomalyKind = kind("chatter", 36);
const LEVER_ARM: AnomalyKind = kind("lever_arm", 37);
const NOT_STANDING: AnomalyKind = kind("not_standing", 38);
const VISITS_APART: AnomalyKind = kind("visits_apart", 39);
const NO_POSITION: AnomalyKind = kind("no_position", 40);
const NO_HEADING: AnomalyKind = kind("no_heading", 41);
const WRONG_ARMS: AnomalyKind = kind("wrong_arms", 42);
const OTHER_SURVEY: AnomalyKind = kind("other_survey", 43);
const FAR_FROM_SITE: AnomalyKind = kind("far_from_site", 44);
const MISCLOSURE: AnomalyKind = kind("misclosure", 45);
const MOVED_ON_POINT: AnomalyKind = kind("moved_on_point", 46);
const UNCERTAIN_POINT: AnomalyKind = kind("uncertain_point", 47);

/// What is wrong, and by how much. Times are seconds of the session.
#[derive(Clone, Debug, PartialEq)]
pub enum SurveyCause {
    /// A landing on ground that moved.
    MovingGround {
        /// When, s.
        at_s: f64,
    },
    /// The tip slipped while it stood.
    Slip {
        /// When, s.
        at_s: f64,
        /// How far it was seen to move, m.
        moved_m: f64,
    },
    /// Fixes that jumped.
    FixJump {
        /// When, s.
        at_s: f64,
    },
    /// Fixes in the middle of a gap that do not agree with everything else.
    DoubtfulFixes {
        /// From, s.
        from_s: f64,
        /// Until, s.
        to_s: f64,
    },
    /// Solutions that are not fixed.
    NotFixed {
        /// From, s.
        from_s: f64,
        /// Until, s.
        to_s: f64,
    },
    /// Missing samples.
    SampleGap {
        /// When they come again, s.
        until_s: f64,
        /// For how long, s.
        missing_s: f64,
    },
    /// A switch that chatters.
    Chatter {
        /// How many.
        changes: usize,
    },
    /// A lever arm that is not as it was told.
    LeverArm {
        /// Which.
        arm: &'static str,
        /// Along which axis.
        axis: &'static str,
        /// As it was told, m.
        told_m: f64,
        /// As it is estimated, m.
        estimated_m: f64,
    },
    /// A point on which the tip did not stand.
    NotStanding {
        /// Its name.
        point: String,
    },
    /// A point that is hardly known.
    Adrift {
        /// Its name.
        point: String,
        /// Its largest sigma, m.
        sigma_m: f64,
    },
    /// A tip that did not stay where it was held on a point.
    MovedOnPoint {
        /// Its name.
        point: String,
        /// By how much it moved, m.
        moved_m: f64,
    },
    /// A gap at whose end the fixes are elsewhere than where the way through it has led.
    Misclosure {
        /// When the fixes came back, s.
        at_s: f64,
        /// How far apart, m.
        off_m: f64,
        /// The same in sigmas.
        sigmas: f64,
    },
    /// Visits of a point that contradict each other.
    VisitsApart {
        /// Its name.
        point: String,
        /// How far from each other, m.
        apart_m: f64,
        /// The same in sigmas.
        sigmas: f64,
    },
    /// A point at a time that the track does not cover.
    NotCovered {
        /// Its name.
        point: String,
    },
    /// A point of an instrument without a tip.
    WithoutTip {
        /// Its name.
        point: String,
    },
    /// A stream that is not there.
    NotStored {
        /// Its name.
        stream: String,
    },
    /// No sample of the sensor.
    NoSamples,
    /// A pole that is longer than any, m.
    PoleTooLong {
        /// From tip to antenna, m.
        length_m: f64,
        /// The longest that is believed, m.
        longest_m: f64,
    },
    /// An antenna that is too far from a sensor in the hand, m.
    AntennaTooFar {
        /// How far, m.
        antenna_m: f64,
        /// The longest that is believed, m.
        longest_m: f64,
    },
    /// A pole that lies, or stands on its head.
    UpsideDown {
        /// How it leans, degrees.
        lean_deg: f64,
    },
    /// Fixes at other times than the samples.
    OtherTimes {
        /// From and until, s.
        samples_s: [f64; 2],
        /// The same of the fixes, where there are any, s.
        fixes_s: Option<[f64; 2]>,
    },
    /// Fixes far from the site.
    FarFromSite {
        /// In plan, m.
        plan_m: f64,
        /// In height, m.
        height_m: f64,
    },
    /// Heights in feet.
    HeightsInFeet {
        /// What was found, in the unit that it is in.
        found: f64,
        /// The site's height, m.
        height_m: f64,
    },
    /// No fix while the sensor ran.
    NoFixes,
    /// Fixes that do not move as the sensor feels.
    OtherMotion {
        /// By how much, m/s².
        apart_m_s2: f64,
        /// The best sigma of the heading, degrees.
        heading_deg: f64,
    },
    /// Fixes and samples that do not say where north is.
    NoManoeuvre {
        /// The best sigma of the heading, degrees.
        heading_deg: f64,
    },
    /// A pole that was held still.
    HeldStill {
        /// How it leans, degrees.
        lean_deg: f64,
        /// When the sky is lost, s.
        lost_s: f64,
    },
    /// A heading that is not known when the sky is lost.
    HeadingLost {
        /// Its sigma, degrees.
        sigma_deg: f64,
        /// When the sky is lost, s.
        lost_s: f64,
    },
    /// Fixes that fit in places only.
    DoNotFit {
        /// How many do not fit.
        refused: usize,
        /// Of so many.
        fixes: usize,
        /// How the others fit, by degree of freedom.
        nis: f64,
    },
    /// A tip that hardly ever stands where it lands.
    NeverStands {
        /// In how many it moves.
        moved: usize,
        /// Of so many.
        landings: usize,
    },
    /// Numbers that are none on the way back.
    NotFinite,
}

impl Cause for SurveyCause {
    fn kind(&self) -> AnomalyKind {
        use SurveyCause as C;
        match self {
            C::MovingGround { .. } => MOVING_GROUND,
            C::Slip { .. } => SLIP,
            C::FixJump { .. } => FIX_JUMP,
            C::DoubtfulFixes { .. } => DOUBTFUL_FIXES,
            C::NotFixed { .. } => NOT_FIXED,
            C::SampleGap { .. } => SAMPLE_GAP,
            C::Chatter { .. } => CHATTER,
            C::LeverArm { .. } => LEVER_ARM,
            C::NotStanding { .. } => NOT_STANDING,
            C::Adrift { .. } => UNCERTAIN_POINT,
            C::VisitsApart { .. } => VISITS_APART,
            C::MovedOnPoint { .. } => MOVED_ON_POINT,
            C::Misclosure { .. } => MISCLOSURE,
            C::NotCovered { .. } | C::WithoutTip { .. } => NO_POSITION,
            C::NotStored { .. } | C::NoSamples => AnomalyKind::STREAM_MISSING,
            C::NoManoeuvre { .. } | C::HeldStill { .. } | C::HeadingLost { .. } => NO_HEADING,
            C::PoleTooLong { .. }
            | C::AntennaTooFar { .. }
            | C::UpsideDown { .. }
            | C::NeverStands { .. } => WRONG_ARMS,
            C::OtherTimes { .. } | C::NoFixes | C::OtherMotion { .. } | C::DoNotFit { .. } | C::NotFinite => {
                OTHER_SURVEY
            }
            C::FarFromSite { .. } | C::HeightsInFeet { .. } => FAR_FROM_SITE,
        }
    }

    fn sentence(&self) -> String {
        use SurveyCause as C;
        match self {
            C::MovingGround { at_s } => {
                format!("the ground under the tip moved at {at_s:.1} s: this landing was left out")
            }
            C::Slip { at_s, moved_m } => format!(
                "the tip slipped by {moved_m:.3} m while it stood at {at_s:.1} s: it was taken to stand anew"
            ),
            C::FixJump { at_s } => format!(
                "the fixes jumped at {at_s:.1} s, more than what they say of themselves allows: from there on they were believed to half a metre"
            ),
            C::DoubtfulFixes { from_s, to_s } => format!(
                "the fixes from {from_s:.1} to {to_s:.1} s, in the middle of a gap, do not agree with the way there and back, or cannot be held against it: they were believed to half a metre"
            ),
            C::NotFixed { from_s, to_s } => format!(
                "the solutions from {from_s:.1} to {to_s:.1} s are not fixed: they were believed to half a metre at best, as one"
            ),
            C::SampleGap { until_s, missing_s } => {
                format!("samples are missing for {missing_s:.2} s until {until_s:.1} s")
            }
            C::Chatter { changes } => {
                format!("the switch chattered: {changes} changes within 50 ms of the one before")
            }
            C::LeverArm { arm, axis, told_m, estimated_m } => format!(
                "{arm} was told as {told_m:.3} m along {axis} and is estimated as {estimated_m:.3} m: measure it again"
            ),
            C::NotStanding { point } => {
                format!("the tip was not found standing on the point {point}: do not trust it")
            }
            C::Adrift { point, sigma_m } => format!(
                "the point {point} is known to {sigma_m:.2} m (1σ) only: too few landings were found on the way to it, or north was not well known"
            ),
            C::MovedOnPoint { point, moved_m } => format!(
                "the tip moved by {moved_m:.3} m while it was held on the point {point}: the point is where it stood first, with sigmas enlarged by that"
            ),
            C::Misclosure { at_s, off_m, sigmas } => format!(
                "the fixes came back at {at_s:.1} s {off_m:.3} m from where the way through the gap had led, {sigmas:.1} times what its sigmas allow: do not trust the points in it"
            ),
            C::VisitsApart { point, apart_m, sigmas } => format!(
                "the visits of the point {point} are {apart_m:.3} m apart, {sigmas:.1} times what their sigmas allow"
            ),
            C::NotCovered { point } => {
                format!("the point {point} has no position: the track does not cover its time")
            }
            C::WithoutTip { point } => {
                format!("the point {point} has no position: without tip_b_m there is no tip")
            }
            C::NotStored { stream } => {
                format!("nothing is stored of the stream {stream}: upload its log, then process again")
            }
            C::NoSamples => {
                "expected samples of the inertial sensor, found none: check the log".to_owned()
            }
            C::PoleTooLong { length_m, longest_m } => format!(
                "expected a pole of at most {longest_m} m, found {length_m:.2} m from tip to antenna: give antenna_b_m and tip_b_m in metres, not in feet"
            ),
            C::AntennaTooFar { antenna_m, longest_m } => format!(
                "expected an antenna within {longest_m} m of the sensor, found {antenna_m:.2} m: give antenna_b_m in metres, not in feet"
            ),
            C::UpsideDown { lean_deg } => format!(
                "expected the antenna above the tip, found the pole lying or upside down by {lean_deg:.0}° on the mean of the survey: antenna_b_m and tip_b_m are swapped, or not in the sensor's axes"
            ),
            C::OtherTimes { samples_s: [first_s, last_s], fixes_s } => {
                let fixes = match fixes_s {
                    Some([from_s, to_s]) => format!("{from_s:.1} to {to_s:.1} s"),
                    None => "no time at all".to_owned(),
                };
                format!(
                    "expected positions from {first_s:.1} to {last_s:.1} s, when the sensor's samples are, found them at {fixes}: the positions are of another day or another clock"
                )
            }
            C::FarFromSite { plan_m, height_m } => format!(
                "expected positions near the site, found them {plan_m:.0} m away in plan and {height_m:.0} m in height: check the site, and that heights are in metres, not in feet"
            ),
            C::HeightsInFeet { found, height_m } => format!(
                "expected heights near the site's {height_m:.0} m, found {found:.0}: give heights in metres, not in feet"
            ),
            C::NoFixes => "expected positions while the sensor ran, found none: check both logs".to_owned(),
            C::OtherMotion { apart_m_s2, heading_deg } => format!(
                "expected positions that move as the sensor feels, found them {apart_m_s2:.1} m/s² apart (heading sigma {heading_deg:.0}°): the positions are of another day, of another pole, or antenna_b_m is wrong"
            ),
            C::NoManoeuvre { heading_deg } => format!(
                "expected a manoeuvre under open sky that says where north is, found none (heading sigma {heading_deg:.0}°): lean the pole about its tip in all directions for a minute before the sky is lost"
            ),
            C::HeldStill { lean_deg, lost_s } => format!(
                "expected a manoeuvre under open sky, found the pole held still (it leans by {lean_deg:.1}°, root mean square) before the sky is lost at {lost_s:.1} s: lean it about its tip in all directions for a minute before"
            ),
            C::HeadingLost { sigma_deg, lost_s } => format!(
                "expected a manoeuvre under open sky that says where north is, found a heading of {sigma_deg:.1}° (1σ) when the sky is lost at {lost_s:.1} s: lean the pole about its tip in all directions for a minute before"
            ),
            C::DoNotFit { refused, fixes, nis } => format!(
                "expected positions that move as the sensor feels, found {refused} of {fixes} that do not (normalised innovation squared {nis:.1} where 1 is right): check that both are of one survey, and antenna_b_m and tip_b_m, in metres"
            ),
            C::NeverStands { moved, landings } => format!(
                "expected a tip that stands where it lands, found it moving in {moved} of {landings} landings: check tip_b_m, in metres and not in feet, and that the switch is of this survey"
            ),
            C::NotFinite => "expected errors that stay finite on the way back, found others: the inputs do not belong together".to_owned(),
        }
    }

    fn figures(&self) -> Figures {
        use SurveyCause as C;
        let count = |n: &usize| Figure::Number(*n as f64);
        let name = |point: &String| Figure::Name(point.clone());
        match self {
            C::MovingGround { at_s } | C::FixJump { at_s } => figures([("at_s", (*at_s).into())]),
            C::Slip { at_s, moved_m } => figures([("at_s", (*at_s).into()), ("moved_m", (*moved_m).into())]),
            C::DoubtfulFixes { from_s, to_s } | C::NotFixed { from_s, to_s } => {
                figures([("from_s", (*from_s).into()), ("to_s", (*to_s).into())])
            }
            C::SampleGap { until_s, missing_s } => {
                figures([("until_s", (*until_s).into()), ("missing_s", (*missing_s).into())])
            }
            C::Chatter { changes } => figures([("changes", count(changes))]),
            C::LeverArm { arm, axis, told_m, estimated_m } => figures([
                ("arm", (*arm).into()),
                ("axis", (*axis).into()),
                ("told_m", (*told_m).into()),
                ("estimated_m", (*estimated_m).into()),
            ]),
            C::NotStanding { point } | C::NotCovered { point } => figures([("point", name(point))]),
            C::Adrift { point, sigma_m } => figures([("point", name(point)), ("sigma_m", (*sigma_m).into())]),
            C::MovedOnPoint { point, moved_m } => {
                figures([("point", name(point)), ("moved_m", (*moved_m).into())])
            }
            C::Misclosure { at_s, off_m, sigmas } => {
                figures([("at_s", (*at_s).into()), ("off_m", (*off_m).into()), ("sigmas", (*sigmas).into())])
            }
            C::WithoutTip { point } => figures([("point", name(point)), ("missing", "tip_b_m".into())]),
            C::VisitsApart { point, apart_m, sigmas } => figures([
                ("point", name(point)),
                ("apart_m", (*apart_m).into()),
                ("sigmas", (*sigmas).into()),
            ]),
            C::NotStored { stream } => figures([("stream", name(stream))]),
            C::NoSamples | C::NoFixes => figures([]),
            C::PoleTooLong { length_m, longest_m } => {
                figures([("length_m", (*length_m).into()), ("longest_m", (*longest_m).into())])
            }
            C::AntennaTooFar { antenna_m, longest_m } => {
                figures([("antenna_m", (*antenna_m).into()), ("longest_m", (*longest_m).into())])
            }
            C::UpsideDown { lean_deg } => figures([("lean_deg", (*lean_deg).into())]),
            C::OtherTimes { samples_s: [first_s, last_s], fixes_s } => {
                let samples = figures([("first_s", (*first_s).into()), ("last_s", (*last_s).into())]);
                let of_fixes =
                    fixes_s.map(|[from_s, to_s]| figures([("from_s", from_s.into()), ("to_s", to_s.into())]));
                samples.into_iter().chain(of_fixes.into_iter().flatten()).collect()
            }
            C::FarFromSite { plan_m, height_m } => {
                figures([("plan_m", (*plan_m).into()), ("height_m", (*height_m).into())])
            }
            C::HeightsInFeet { found, height_m } => {
                figures([("found", (*found).into()), ("height_m", (*height_m).into())])
            }
            C::OtherMotion { apart_m_s2, heading_deg } => {
                figures([("apart_m_s2", (*apart_m_s2).into()), ("heading_deg", (*heading_deg).into())])
            }
            C::NoManoeuvre { heading_deg } => figures([("heading_deg", (*heading_deg).into())]),
            C::HeldStill { lean_deg, lost_s } => {
                figures([("lean_deg", (*lean_deg).into()), ("lost_s", (*lost_s).into())])
            }
            C::HeadingLost { sigma_deg, lost_s } => {
                figures([("sigma_deg", (*sigma_deg).into()), ("lost_s", (*lost_s).into())])
            }
            C::DoNotFit { refused, fixes, nis } => {
                figures([("refused", count(refused)), ("fixes", count(fixes)), ("nis", (*nis).into())])
            }
            C::NeverStands { moved, landings } => {
                figures([("moved", count(moved)), ("landings", count(landings))])
            }
            C::NotFinite => figures([("errors", "not finite".into())]),
        }
    }
}

/// One of each, with figures as they may be.
pub(super) fn examples() -> Vec<SurveyCause> {
    use SurveyCause as C;
    let point = || "A17".to_owned();
    vec![
        C::MovingGround { at_s: 95.1 },
        C::Slip { at_s: 95.1, moved_m: 0.1 },
        C::FixJump { at_s: 95.1 },
        C::DoubtfulFixes { from_s: 95.1, to_s: 99.0 },
        C::NotFixed { from_s: 95.1, to_s: 99.0 },
        C::SampleGap { until_s: 95.1, missing_s: 0.3 },
        C::Chatter { changes: 120 },
        C::LeverArm { arm: "tip_b_m", axis: "z", told_m: -1.0, estimated_m: -1.02 },
        C::NotStanding { point: point() },
        C::VisitsApart { point: point(), apart_m: 0.2, sigmas: 4.0 },
        C::MovedOnPoint { point: point(), moved_m: 0.1 },
        C::Adrift { point: point(), sigma_m: 0.6 },
        C::Misclosure { at_s: 132.0, off_m: 0.4, sigmas: 4.1 },
        C::NotCovered { point: point() },
        C::WithoutTip { point: point() },
        C::NotStored { stream: "gnss".to_owned() },
        C::NoSamples,
        C::PoleTooLong { length_m: 6.56, longest_m: 4.5 },
        C::AntennaTooFar { antenna_m: 6.56, longest_m: 4.5 },
        C::UpsideDown { lean_deg: 178.0 },
        C::OtherTimes { samples_s: [0.0, 250.0], fixes_s: Some([86_400.0, 86_650.0]) },
        C::OtherTimes { samples_s: [0.0, 250.0], fixes_s: None },
        C::FarFromSite { plan_m: 12_000.0, height_m: 3.0 },
        C::HeightsInFeet { found: 656.0, height_m: 200.0 },
        C::NoFixes,
        C::OtherMotion { apart_m_s2: 2.0, heading_deg: 40.0 },
        C::NoManoeuvre { heading_deg: 90.0 },
        C::HeldStill { lean_deg: 0.3, lost_s: 81.0 },
        C::HeadingLost { sigma_deg: 12.0, lost_s: 81.0 },
        C::DoNotFit { refused: 246, fixes: 779, nis: 3.3 },
        C::NeverStands { moved: 40, landings: 41 },
        C::NotFinite,
    ]
}

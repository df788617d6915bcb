//! What a survey makes of the markers that it visited: of a session whose system places itself, so that its visits do not
//! correct it but are held against it. Its points are compared with the table as a file of markers is, and the file says where
//! it comes from.

use lodestep_engine::event::TrackPoint;
use schemars::JsonSchema;
use serde::Serialize;
use uuid::Uuid;

use super::imports::{ImportView, create};
use super::survey_file::{FilePoint, Form, write_points};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::charts::{self, Series};
use crate::store::marker_residuals;
use crate::store::markers::Place;
use crate::store::sessions;
use crate::store::track::{self, TrackKind};

/// The chart of how sure surveyed points are, by all visits of each: lines `east`, `north` and `up`, m.
const POINT_SIGMA: &str = "point_sigma";

/// A point as a session has surveyed it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct SurveyedPoint {
    /// The marker that it is said to be.
    #[schemars(example = &"A17")]
    pub(crate) marker: String,
    /// Where it was found, in the site's frame, m.
    pub(crate) place: Place,
    /// Latitude, degrees.
    pub(crate) latitude_deg: f64,
    /// Longitude, degrees.
    pub(crate) longitude_deg: f64,
    /// Height above the ellipsoid, m.
    pub(crate) height_m: f64,
    /// How sure that is, east, north and up, m, by all visits together and what they err alike in.
    pub(crate) sigma_m: [f64; 3],
    /// How often it was visited.
    pub(crate) visits: u64,
    /// How far its visits are apart, m; 0 for one.
    pub(crate) visits_apart_m: f64,
    /// Where it was found minus where the marker stands, east, north and up, m; up is 0 where the marker has no height. `null` for
    /// a point that is no marker yet.
    pub(crate) off_m: Option<[f64; 3]>,
}

/// The points of a session, in the order in which they were visited first.
pub(crate) async fn surveyed_points(app: &App, session_id: Uuid) -> Result<Vec<SurveyedPoint>> {
    let db = app.store.read();
    let session = sessions::get(db, session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    if !session.declaration().places_itself {
        return Err(Error::conflict(
            "not_a_survey",
            "expected a session whose own streams say where it is, found one that its visits correct: it says nothing of markers",
        ));
    }
    let visits = marker_residuals::held_against(db, session_id).await?;
    let sigmas = charts::of_chart(db, session_id, POINT_SIGMA).await?;
    let frame = app.site.local_frame();
    let mut points: Vec<(SurveyedPoint, Vec<[f64; 3]>)> = Vec::new();
    for visit in &visits {
        let ends = (visit.t_start_ns, visit.t_end_ns);
        let of_stop = track::thinned(db, session_id, TrackKind::Main, ends, (1, 0)).await?;
        let Some(seen) = seen(&of_stop) else { continue };
        let known = points.iter_mut().find(|(point, _)| point.marker == visit.marker);
        if let Some((point, alone)) = known {
            point.visits += 1;
            alone.push(visit.alone_m);
            continue;
        }
        let [e_m, n_m, found_u_m] = visit.together_m;
        // A marker without a height says nothing of it, and so nothing was held against it.
        let u_m = visit.marker_u_m.map_or(seen.u_m, |_| found_u_m);
        let place = frame.to_geodetic([e_m, n_m, u_m]);
        let point = SurveyedPoint {
            marker: visit.marker.clone(),
            place: Place { e_m, n_m, u_m: Some(u_m) },
            latitude_deg: place.latitude_deg,
            longitude_deg: place.longitude_deg,
            height_m: place.height_m,
            sigma_m: together(&sigmas, visit.t_applied_ns).unwrap_or(seen.sigma_m),
            visits: 1,
            visits_apart_m: 0.0,
            off_m: visit.stands_m.map(|[stands_e_m, stands_n_m]| {
                let up_m = visit.stands_u_m.map_or(0.0, |stands_u_m| u_m - stands_u_m);
                [e_m - stands_e_m, n_m - stands_n_m, up_m]
            }),
        };
        points.push((point, vec![visit.alone_m]));
    }
    let apart = |alone: &[[f64; 3]]| {
        let pairs = alone.iter().flat_map(|a| alone.iter().map(move |b| distance_m(a, b)));
        pairs.fold(0.0, f64::max)
    };
    Ok(points
        .into_iter()
        .map(|(point, alone)| SurveyedPoint { visits_apart_m: apart(&alone), ..point })
        .collect())
}

fn distance_m([ae, an, au]: &[f64; 3], [be, bn, bu]: &[f64; 3]) -> f64 {
    (ae - be).hypot(an - bn).hypot(au - bu)
}

/// How sure a point is by all visits together; `None` for a session that was processed before that was kept.
fn together(sigmas: &[Series], t_ns: i64) -> Option<[f64; 3]> {
    let of = |line: &str| sigmas.iter().find(|series| series.name == line)?.high_at(t_ns);
    Some([of("east")?, of("north")?, of("up")?])
}

/// What the track has of a stop.
struct Seen {
    u_m: f64,
    sigma_m: [f64; 3],
}

/// On the mean, of those points at which it stood; of all where it never did.
fn seen(points: &[TrackPoint]) -> Option<Seen> {
    let stands = |point: &&TrackPoint| point.parts.iter().flatten().any(|part| part.stance);
    let stood: Vec<&TrackPoint> = points.iter().filter(stands).collect();
    let of = if stood.is_empty() { points.iter().collect() } else { stood };
    let count = of.len() as f64;
    let mean = |value: &dyn Fn(&TrackPoint) -> f64| of.iter().map(|point| value(point)).sum::<f64>() / count;
    (!of.is_empty()).then(|| Seen {
        u_m: mean(&|point| point.position_n_m[2]),
        sigma_m: [0, 1, 2].map(|axis| mean(&|point| point.sigma_n_m[axis])),
    })
}

impl From<&SurveyedPoint> for FilePoint {
    fn from(point: &SurveyedPoint) -> FilePoint {
        let Place { e_m, n_m, u_m } = point.place;
        FilePoint {
            name: point.marker.clone(),
            code: String::new(),
            wgs84: [point.latitude_deg, point.longitude_deg, point.height_m],
            place_m: [e_m, n_m, u_m.unwrap_or_default()],
            sigma_m: point.sigma_m,
        }
    }
}

/// Compares what a session has surveyed with the table, as a file that is called by the session; the table stays as it is.
pub(crate) async fn import_of_survey(app: &App, caller: Caller, session_id: Uuid) -> Result<ImportView> {
    let points = surveyed_points(app, session_id).await?;
    if points.is_empty() {
        return Err(Error::conflict(
            "nothing_surveyed",
            "expected points that the session has surveyed, found none: tell at which marker the tip stood and when, and process it",
        ));
    }
    let points: Vec<FilePoint> = points.iter().map(FilePoint::from).collect();
    let file = write_points(Form::Csv, &points).into_bytes();
    create(app, caller, Some(file_name(session_id)), file).await
}

/// What the points of a session are called where they come from.
fn file_name(session_id: Uuid) -> String {
    format!("survey-{session_id}.csv")
}

//! Tracks: for the page as JSON, for others as files.

use axum::body::Body;
use axum::extract::State;
use lodestep_engine::event::{TrackPoint, VisitOutcome};
use schemars::JsonSchema;
use serde::Deserialize;
use tokio::runtime::Handle;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::media::{Csv, GeoJson, Gpx, Kml, Media};
use crate::http::{Attachment, File, Path, Query, Routes, With, WrittenJson};
use crate::rights::Right;
use crate::sessions::body_writer::body_writer;
use crate::sessions::process;
use crate::sessions::thinning::{SLACK_NS, Thinning, cell_ns};
use crate::sessions::track_file::{self, Format, TrackPoints};
use crate::state::App;
use crate::store::jobs::JobState;
use crate::store::sessions::{self, Session};
use crate::store::track::{self, TrackKind};
use crate::store::{inspectors, lab_runs, lab_tracks, visits};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/track", Right::Read, json)
        .about("get_track", "The track of a run as rows")
        .get("/sessions/{id}/track.csv", Right::Read, csv)
        .about("export_track_csv", "The track as CSV")
        .get("/sessions/{id}/track.geojson", Right::Read, geojson)
        .about("export_track_geojson", "The track as GeoJSON")
        .get("/sessions/{id}/track.gpx", Right::Read, gpx)
        .about("export_track_gpx", "The track as GPX")
        .get("/sessions/{id}/track.kml", Right::Read, kml)
        .about("export_track_kml", "The track as KML")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TrackQuery {
    /// `main`, `filtered`, `without_markers` or the id of a lab run.
    run: Option<String>,
    /// At most so many points a second, or `full` for every epoch.
    rate_hz: Option<String>,
    /// From when until when, s.
    from_s: Option<f64>,
    to_s: Option<f64>,
}

/// Which track is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WantedRun {
    /// One that belongs to the walk.
    Own(TrackKind),
    /// A lab run.
    Lab(Uuid),
}

impl WantedRun {
    fn name(self) -> String {
        match self {
            WantedRun::Own(run) => run.name().to_owned(),
            WantedRun::Lab(id) => id.to_string(),
        }
    }
}

impl TrackQuery {
    /// The main run, unless another is named.
    fn run(&self) -> Result<WantedRun> {
        let Some(text) = self.run.as_deref() else { return Ok(WantedRun::Own(TrackKind::Main)) };
        let own = [TrackKind::Main, TrackKind::Filtered, TrackKind::WithoutMarkers]
            .into_iter()
            .find(|run| run.name() == text);
        match (own, Uuid::parse_str(text)) {
            (Some(run), _) => Ok(WantedRun::Own(run)),
            (None, Ok(id)) => Ok(WantedRun::Lab(id)),
            (None, Err(_)) => Err(Error::invalid(
                "wrong_run",
                format!(
                    "expected main, filtered, without_markers or the id of a lab run in run, found {text:?}: leave it out for main"
                ),
            )),
        }
    }

    /// From when until when, ns.
    fn stretch_ns(&self) -> Result<(i64, i64)> {
        let from_s = self.from_s.unwrap_or(f64::NEG_INFINITY);
        let to_s = self.to_s.unwrap_or(f64::INFINITY);
        if from_s > to_s || from_s.is_nan() || to_s.is_nan() {
            return Err(Error::invalid(
                "wrong_stretch",
                format!(
                    "expected from_s before to_s, in seconds since the session's start, found {from_s} to {to_s}: leave both out for the whole track"
                ),
            ));
        }
        // Beyond what an integer holds it is the end of all time.
        Ok(((from_s * 1e9) as i64, (to_s * 1e9) as i64))
    }
}

async fn json(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<TrackQuery>,
) -> Result<WrittenJson<TrackPoints>> {
    Ok(WrittenJson::new(send(&app, id, asked, Format::Json).await?.1))
}

async fn csv(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<TrackQuery>,
) -> Result<TrackFile<Csv>> {
    file(app, id, asked, Format::Csv).await
}

async fn geojson(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<TrackQuery>,
) -> Result<TrackFile<GeoJson>> {
    file(app, id, asked, Format::GeoJson).await
}

async fn gpx(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<TrackQuery>,
) -> Result<TrackFile<Gpx>> {
    file(app, id, asked, Format::Gpx).await
}

async fn kml(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(asked): Query<TrackQuery>,
) -> Result<TrackFile<Kml>> {
    file(app, id, asked, Format::Kml).await
}

/// A track as a file of its own.
type TrackFile<M> = With<Attachment, File<M>>;

async fn file<M: Media>(app: App, id: Uuid, asked: TrackQuery, format: Format) -> Result<TrackFile<M>> {
    let (name, body) = send(&app, id, asked, format).await?;
    Ok(With(Attachment(name), File::new(body)))
}

/// How many points are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rate {
    /// Those that are stored.
    Stored,
    /// At most so many a second of those.
    AtMostHz(f64),
    /// Every epoch, computed again from the raw samples.
    Full,
}

impl Rate {
    /// The cells of a lab run's track, which is stored in one piece; `None` keeps all of its points.
    fn cell_ns(self) -> Result<Option<i64>> {
        match self {
            Rate::Stored => Ok(None),
            Rate::AtMostHz(rate_hz) => Ok(Some(cell_ns(rate_hz))),
            Rate::Full => Err(Error::invalid(
                "wrong_rate",
                "expected a number or nothing in rate_hz, found full: of a lab run the points are kept that are stored of a track; for every epoch run lodestep process with the same --parameters",
            )),
        }
    }

    fn parse(asked: Option<&str>) -> Result<Rate> {
        match asked {
            None => Ok(Rate::Stored),
            Some("full") => Ok(Rate::Full),
            Some(text) => match text.parse() {
                Ok(rate_hz) if rate_hz > 0.0 && f64::is_finite(rate_hz) => Ok(Rate::AtMostHz(rate_hz)),
                _ => Err(Error::invalid(
                    "wrong_rate",
                    format!(
                        "expected rate_hz as a number above 0 or as the word full, found {text:?}: leave it out for every point that is stored"
                    ),
                )),
            },
        }
    }
}

/// The name of the file, and what is in it.
async fn send(app: &App, session_id: Uuid, asked: TrackQuery, format: Format) -> Result<(String, Body)> {
    let session = sessions::get(app.store.read(), session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    let inspector = inspectors::get(app.store.read(), session.inspector_id).await?;
    let inspector = inspector.map(|inspector| inspector.name).unwrap_or_default();
    let place = track_file::place(&app.site, &session, &inspector);
    let system = session.declaration();
    let run = asked.run()?;
    let stretch = asked.stretch_ns()?;
    let (points, visits) = match (run, Rate::parse(asked.rate_hz.as_deref())?) {
        (WantedRun::Own(run), Rate::Full) => {
            cut(process::full_track(app, session_id, run).await?, stretch, None)
        }
        (WantedRun::Own(run), rate) => stored(app, session_id, run, stretch, rate).await?,
        (WantedRun::Lab(id), rate) => {
            let computed = (lab_points(app, session_id, id).await?, Vec::new());
            cut(computed, stretch, rate.cell_ns()?)
        }
    };
    let name = run.name();
    let (mut writer, body) = body_writer(Handle::current());
    tokio::task::spawn_blocking(move || {
        let written = track_file::write(format, system, &name, &points, &visits, &place, &mut writer);
        writer.end(written);
    });
    Ok((file_name(&session, run, format), body))
}

/// The points of a lab run of this walk.
async fn lab_points(app: &App, session_id: Uuid, id: Uuid) -> Result<Vec<TrackPoint>> {
    let run = lab_runs::get(app.store.read(), id).await?.filter(|run| run.session_id == session_id);
    let run = run.ok_or_else(|| Error::not_found("lab run", id))?;
    if run.state != JobState::Finished {
        return Err(Error::conflict(
            "run_not_finished",
            "expected a lab run that has been computed, found one that is waiting, under way, failed or given up: see its job",
        ));
    }
    Ok(lab_tracks::get(app.store.read(), id).await?)
}

/// What is stored of a run in a stretch of time.
async fn stored(
    app: &App,
    session_id: Uuid,
    run: TrackKind,
    stretch_ns: (i64, i64),
    rate: Rate,
) -> Result<(Vec<TrackPoint>, Vec<VisitOutcome>)> {
    let cell_ns = match rate {
        Rate::AtMostHz(rate_hz) => cell_ns(rate_hz),
        // Every one is the first of its own cell.
        Rate::Stored | Rate::Full => 1,
    };
    let thinning = (cell_ns, SLACK_NS);
    let points = track::thinned(app.store.read(), session_id, run, stretch_ns, thinning).await?;
    let visits = match run {
        TrackKind::Main | TrackKind::Filtered => {
            track_file::outcomes(visits::of_session(app.store.read(), session_id).await?)
        }
        TrackKind::WithoutMarkers => Vec::new(),
    };
    Ok((points, visits))
}

/// The points of a stretch, of each cell of a thinning the first.
fn cut(
    (mut points, visits): (Vec<TrackPoint>, Vec<VisitOutcome>),
    (from_ns, to_ns): (i64, i64),
    cell_ns: Option<i64>,
) -> (Vec<TrackPoint>, Vec<VisitOutcome>) {
    let mut thinning = cell_ns.map(Thinning::new);
    points.retain(|point| {
        (from_ns..=to_ns).contains(&point.t_ns)
            && thinning.as_mut().is_none_or(|thinning| thinning.takes(point.t_ns))
    });
    (points, visits)
}

/// A name made of nothing but the session's own start and id: safe in every shell and header.
fn file_name(session: &Session, run: WantedRun, format: Format) -> String {
    let started = session.started_at;
    let day = format!("{:04}-{:02}-{:02}", started.year(), u8::from(started.month()), started.day());
    let run = match run {
        WantedRun::Own(TrackKind::Main) => String::new(),
        WantedRun::Own(TrackKind::Filtered) => "-filtered".to_owned(),
        WantedRun::Own(TrackKind::WithoutMarkers) => "-without-markers".to_owned(),
        WantedRun::Lab(id) => format!("-lab-{id}"),
    };
    format!("track-{day}-{}{run}.{}", session.id, format.extension())
}

//! Tracks: for the page as JSON, for others as files.

use axum::extract::State;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use lodestep_engine::event::{TrackPoint, VisitOutcome};
use lodestep_engine::session::Aids;
use serde::Deserialize;
use serde_json::Value;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::Routes;
use super::extract::{Path, Query};
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::sessions::body_writer::body_writer;
use crate::sessions::process;
use crate::sessions::stored_grid::{Grid, SLACK_NS, cell_ns};
use crate::sessions::track_file::{self, Format};
use crate::state::App;
use crate::store::sessions::{self, Session};
use crate::store::track::{self, Run};
use crate::store::{inspectors, visits};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/track", Right::Read, json)
        .about("The track of a run as rows")
        .gives::<Value>()
        .get("/sessions/{id}/track.csv", Right::Read, csv)
        .about("The track as CSV")
        .gives_bytes("text/csv")
        .get("/sessions/{id}/track.geojson", Right::Read, geojson)
        .about("The track as GeoJSON")
        .gives_bytes("application/geo+json")
        .get("/sessions/{id}/track.gpx", Right::Read, gpx)
        .about("The track as GPX")
        .gives_bytes("application/gpx+xml")
        .get("/sessions/{id}/track.kml", Right::Read, kml)
        .about("The track as KML")
        .gives_bytes("application/vnd.google-earth.kml+xml")
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    #[serde(default)]
    run: Run,
    rate_hz: Option<String>,
    /// Aids to compute another run with, in the place of the stored ones.
    aids: Option<String>,
    /// From when until when, s.
    from_s: Option<f64>,
    to_s: Option<f64>,
}

impl Asked {
    /// The aids that are named, and no others.
    fn aids(&self) -> Result<Option<Aids>> {
        let Some(text) = &self.aids else { return Ok(None) };
        let mut aids = Aids {
            zupt: false,
            heading: false,
            maru: false,
            separation: false,
            markers: false,
            altimeter: false,
        };
        for name in text.split([',', '+', ' ']) {
            let aid = match name {
                "zupt" => &mut aids.zupt,
                "heading" => &mut aids.heading,
                "maru" => &mut aids.maru,
                "separation" => &mut aids.separation,
                "markers" => &mut aids.markers,
                "altimeter" => &mut aids.altimeter,
                other => {
                    return Err(Error::invalid(
                        "wrong_aids",
                        format!(
                            "expected aids from zupt, heading, maru, separation, altimeter and markers with commas in between, found {other:?}"
                        ),
                    ));
                }
            };
            *aid = true;
        }
        Ok(Some(aids))
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

type TrackRequest = (State<App>, Path<Uuid>, Query<Asked>);

async fn json((State(app), Path(id), Query(asked)): TrackRequest) -> Result<Response> {
    send(app, id, asked, Format::Json).await
}

async fn csv((State(app), Path(id), Query(asked)): TrackRequest) -> Result<Response> {
    send(app, id, asked, Format::Csv).await
}

async fn geojson((State(app), Path(id), Query(asked)): TrackRequest) -> Result<Response> {
    send(app, id, asked, Format::GeoJson).await
}

async fn gpx((State(app), Path(id), Query(asked)): TrackRequest) -> Result<Response> {
    send(app, id, asked, Format::Gpx).await
}

async fn kml((State(app), Path(id), Query(asked)): TrackRequest) -> Result<Response> {
    send(app, id, asked, Format::Kml).await
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
    /// The cells of a computed track; `None` keeps every epoch.
    fn cell_ns(self, stored_hz: f64) -> Option<i64> {
        match self {
            Rate::Full => None,
            Rate::Stored => Some(cell_ns(stored_hz)),
            Rate::AtMostHz(rate_hz) => Some(cell_ns(rate_hz)),
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

async fn send(app: App, session_id: Uuid, asked: Asked, format: Format) -> Result<Response> {
    let session = sessions::get(app.store.read(), session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    let inspector = inspectors::get(app.store.read(), session.inspector_id).await?;
    let inspector = inspector.map(|inspector| inspector.name).unwrap_or_default();
    let place = track_file::place(&app.site, &session, &inspector);
    let run = asked.run;
    let stretch = asked.stretch_ns()?;
    let (points, visits) = match (asked.aids()?, Rate::parse(asked.rate_hz.as_deref())?) {
        (None, Rate::Full) => cut(process::full_track(&app, session_id, run).await?, stretch, None),
        (Some(aids), rate) => {
            let computed = process::track_by_aids(&app, session_id, aids).await?;
            cut(computed, stretch, rate.cell_ns(app.config.track_rate_hz))
        }
        (None, rate) => stored(&app, session_id, run, stretch, rate).await?,
    };
    let (mut writer, body) = body_writer(Handle::current());
    tokio::task::spawn_blocking(move || {
        let written = track_file::write(format, run, &points, &visits, &place, &mut writer);
        writer.end(written);
    });
    let mut response = body.into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(format.content_type()));
    if format != Format::Json {
        headers.insert(header::CONTENT_DISPOSITION, disposition(&session, run, format));
    }
    Ok(response)
}

/// What is stored of a run in a stretch of time.
async fn stored(
    app: &App,
    session_id: Uuid,
    run: Run,
    stretch_ns: (i64, i64),
    rate: Rate,
) -> Result<(Vec<TrackPoint>, Vec<VisitOutcome>)> {
    let cell_ns = match rate {
        Rate::AtMostHz(rate_hz) => cell_ns(rate_hz),
        // Every one is the first of its own cell.
        Rate::Stored | Rate::Full => 1,
    };
    let grid = (cell_ns, SLACK_NS);
    let points = track::thinned(app.store.read(), session_id, run, stretch_ns, grid).await?;
    let visits = match run {
        Run::Main | Run::Filtered => {
            track_file::outcomes(visits::of_session(app.store.read(), session_id).await?)
        }
        Run::WithoutMarkers => Vec::new(),
    };
    Ok((points, visits))
}

/// The points of a stretch, of each cell of a grid the first.
fn cut(
    (mut points, visits): (Vec<TrackPoint>, Vec<VisitOutcome>),
    (from_ns, to_ns): (i64, i64),
    cell_ns: Option<i64>,
) -> (Vec<TrackPoint>, Vec<VisitOutcome>) {
    let mut grid = cell_ns.map(Grid::new);
    points.retain(|point| {
        (from_ns..=to_ns).contains(&point.t_ns) && grid.as_mut().is_none_or(|grid| grid.takes(point.t_ns))
    });
    (points, visits)
}

/// A name made of nothing but the session's own start and id: safe in every shell and header.
fn disposition(session: &Session, run: Run, format: Format) -> HeaderValue {
    let started = session.started_at;
    let day = format!("{:04}-{:02}-{:02}", started.year(), u8::from(started.month()), started.day());
    let run = match run {
        Run::Main => "",
        Run::Filtered => "-filtered",
        Run::WithoutMarkers => "-without-markers",
    };
    let name = format!("track-{day}-{}{run}.{}", session.id, format.extension());
    HeaderValue::try_from(format!("attachment; filename=\"{name}\""))
        .expect("digits, letters and hyphens are allowed in a header")
}

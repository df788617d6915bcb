//! One marker at a time.

use axum::http::StatusCode;
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::markers_csv::MarkerPlace;
use lodestep_engine::parse::names;
use schemars::JsonSchema;
use serde::Deserialize;

use super::write::{Cause, MarkerEdit, write};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::markers::{self, Marker, Place};
use crate::wire::Change;

/// Letters in a name.
pub(super) const NAME_LENGTH: usize = 100;
/// Letters in a reason.
const REASON_LENGTH: usize = 500;
/// Farther from the site's origin than this, the flat frame is no place to survey in, m.
pub(super) const FARTHEST_M: f64 = 100_000.0;

/// A marker as it is told: in the site's frame, or on the ellipsoid.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(example = serde_json::json!({"name": "A17", "e_m": 1.5, "n_m": -2.25, "u_m": 3.0, "reason": "survey of November"}))]
pub(crate) struct NewMarker {
    /// Its name; may be left out where the path has it.
    pub(crate) name: Option<String>,
    e_m: Option<f64>,
    n_m: Option<f64>,
    u_m: Option<f64>,
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    height_m: Option<f64>,
    /// Why it is changed.
    reason: Option<String>,
    /// The version that was seen.
    version: Option<i64>,
    /// Whether to overwrite whatever stands there.
    #[serde(default)]
    force: bool,
}

impl NewMarker {
    /// East, north and, where it was surveyed, up in the site's frame, m.
    fn place_m(&self, frame: &LocalFrame) -> Result<Place> {
        let place = match *self {
            NewMarker {
                e_m: Some(e_m),
                n_m: Some(n_m),
                u_m,
                latitude_deg: None,
                longitude_deg: None,
                height_m: None,
                ..
            } => MarkerPlace::Local { e_m, n_m, u_m },
            NewMarker {
                latitude_deg: Some(latitude_deg),
                longitude_deg: Some(longitude_deg),
                height_m,
                e_m: None,
                n_m: None,
                u_m: None,
                ..
            } if latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 180.0 => {
                MarkerPlace::Geodetic { latitude_deg, longitude_deg, height_m }
            }
            _ => {
                return Err(Error::invalid(
                    "wrong_place",
                    "expected e_m and n_m (with u_m, where it was surveyed), or latitude_deg within ±90 and longitude_deg within ±180 (with height_m, where it was surveyed): give one of the two, whole",
                ));
            }
        };
        let (e_m, n_m, u_m) = place.to_local_m(frame);
        if [e_m, n_m, u_m.unwrap_or(0.0)].iter().any(|metres| metres.abs() > FARTHEST_M) {
            return Err(Error::invalid(
                "wrong_place",
                format!(
                    "expected a place within {FARTHEST_M} m of the site's origin, found {e_m:.0} m east and {n_m:.0} m north of it: check the frame, the unit and the order"
                ),
            ));
        }
        Ok(Place { e_m, n_m, u_m })
    }
}

/// A name that can stand in a table, a path and a spreadsheet.
pub(crate) fn checked_name(name: &str) -> Result<String> {
    // Looked for before cleaning, which would make a blank of a line break.
    let has_control = name.trim().chars().any(char::is_control);
    let name = names::cleaned(name);
    let length = name.chars().count();
    // A leading apostrophe is how spreadsheets guard a formula: it would not survive its export.
    if length == 0 || length > NAME_LENGTH || name.starts_with('\'') || has_control || names::is_dots(&name) {
        return Err(Error::invalid(
            "wrong_name",
            format!(
                "expected a name of 1 to {NAME_LENGTH} letters that can be seen, without line breaks and without an apostrophe in front, found {name:?}"
            ),
        ));
    }
    Ok(name)
}

/// Why, in the words of the one who changes a marker.
pub(super) fn checked_reason(reason: Option<&str>) -> Result<String> {
    let reason = reason.unwrap_or_default().trim();
    let length = reason.chars().count();
    if length > REASON_LENGTH {
        return Err(Error::invalid(
            "wrong_reason",
            format!("expected a reason of at most {REASON_LENGTH} letters, found {length}: write it shorter"),
        ));
    }
    Ok(reason.to_owned())
}

/// What the one who changes a marker has seen of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    /// The version in the request's body or query.
    pub(crate) version: Option<i64>,
    /// The version in the header `If-Match`.
    pub(crate) if_match: Option<i64>,
    /// Whether to overwrite whatever stands there.
    pub(crate) force: bool,
}

impl Seen {
    /// Refuses a change of a marker that is not what was seen; without a version nothing is known of that.
    fn check(&self, name: &str, standing: Option<&Marker>) -> Result<()> {
        let (status, expected) = match (self.if_match, self.version) {
            (Some(version), _) => (StatusCode::PRECONDITION_FAILED, version),
            (None, Some(version)) => (StatusCode::CONFLICT, version),
            (None, None) => return Ok(()),
        };
        if self.force || standing.is_some_and(|standing| standing.version == expected) {
            return Ok(());
        }
        let found = match standing {
            Some(standing) => format!("version {}", standing.version),
            None => "no such marker any more".to_owned(),
        };
        Err(Error::changed(
            status,
            "marker_changed",
            format!(
                "expected marker {name:?} as it was in version {expected}, found {found}: somebody has changed it meanwhile; look at what it is now, then send the change again with its version"
            ),
            standing,
        ))
    }

    /// Refuses to move a marker of which the caller has not said what was seen.
    fn check_given(&self, standing: &Marker) -> Result<()> {
        if self.force || self.version.is_some() || self.if_match.is_some() {
            return Ok(());
        }
        Err(Error::changed(
            StatusCode::PRECONDITION_REQUIRED,
            "version_missing",
            format!(
                "expected the version of marker {:?} that was seen, found none: send it as If-Match or as version (it is {} now), or force:true to overwrite whatever stands there",
                standing.name, standing.version
            ),
            standing,
        ))
    }
}

/// Adds one that is not there yet.
pub(crate) async fn add(app: &App, caller: Caller, new: NewMarker) -> Result<Marker> {
    let name = checked_name(new.name.as_deref().unwrap_or_default())?;
    let place = new.place_m(&app.site.local_frame())?;
    let cause = Cause { caller, reason: checked_reason(new.reason.as_deref())?, import: None };
    let (_, marker) = change(app, name, cause, move |standing| match standing {
        None => Ok(Next::Stand(place)),
        Some(standing) => Err(Error::changed(
            StatusCode::CONFLICT,
            "marker_exists",
            format!("there is already a marker {:?}: PUT it, with its version, to move it", standing.name),
            standing,
        )),
    })
    .await?;
    marker.ok_or_else(|| anyhow::anyhow!("a marker that was just added is not there").into())
}

/// Makes the marker of this name stand here, whether it was there or not; `true` when it is new.
pub(crate) async fn put(
    app: &App,
    caller: Caller,
    name: &str,
    seen: Seen,
    new: NewMarker,
) -> Result<(Marker, bool)> {
    let name = checked_name(name)?;
    if new.name.as_ref().is_some_and(|other| *other != name) {
        return Err(Error::invalid(
            "wrong_name",
            format!(
                "expected the name {name:?} of the path, found {:?}: to rename a marker, delete it and add it anew",
                new.name.unwrap_or_default()
            ),
        ));
    }
    let place = new.place_m(&app.site.local_frame())?;
    let cause = Cause { caller, reason: checked_reason(new.reason.as_deref())?, import: None };
    let seen = Seen { version: seen.version.or(new.version), force: seen.force || new.force, ..seen };
    let (before, marker) = change(app, name.clone(), cause, move |standing| {
        match standing {
            // It stands there already: the same request again has what it asked for.
            Some(standing) if standing.place() == place => return Ok(Next::Leave),
            Some(standing) => seen.check_given(standing)?,
            None => {}
        }
        seen.check(&name, standing)?;
        Ok(Next::Stand(place))
    })
    .await?;
    let marker = marker.ok_or_else(|| anyhow::anyhow!("a marker that was just put is not there"))?;
    Ok((marker, before.is_none()))
}

/// Removes one. Visits and faults keep its name: they say what was said then.
pub(crate) async fn remove(
    app: &App,
    caller: Caller,
    name: String,
    seen: Seen,
    reason: Option<&str>,
) -> Result<()> {
    let cause = Cause { caller, reason: checked_reason(reason)?, import: None };
    change(app, name.clone(), cause, move |standing| {
        if standing.is_none() {
            return Err(Error::not_found("marker", name));
        }
        seen.check(&name, standing)?;
        Ok(Next::Remove)
    })
    .await?;
    Ok(())
}

/// What becomes of a marker.
enum Next {
    Leave,
    Stand(Place),
    Remove,
}

/// Changes one marker as `decide` says on seeing it; what it was, and what it is now.
async fn change(
    app: &App,
    name: String,
    cause: Cause,
    decide: impl FnOnce(Option<&Marker>) -> Result<Next> + Send + 'static,
) -> Result<(Option<Marker>, Option<Marker>)> {
    let (before, after, revision) = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let standing = markers::get(&mut *db, &name).await?;
                let after = match decide(standing.as_ref())? {
                    Next::Leave => return Ok((standing.clone(), standing, None)),
                    Next::Stand(place) => Some(place),
                    Next::Remove => None,
                };
                let before = standing.as_ref().map(Marker::place);
                let step = MarkerEdit { name: name.clone(), before, after };
                let revision = write(&mut *db, &[step], &cause).await?;
                Ok::<_, Error>((standing, markers::get(&mut *db, &name).await?, revision))
            })
        })
        .await?;
    if let Some(revision) = revision {
        app.hub.publish(Change::Markers { revision });
    }
    Ok((before, after))
}

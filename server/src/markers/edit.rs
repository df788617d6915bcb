//! One marker at a time.

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::markers_csv::MarkerPlace;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::state::App;
use crate::store::markers::{self, Marker};
use crate::utc;
use crate::wire::Change;

/// Letters in a name.
const NAME_LENGTH: usize = 100;
/// Farther from the site's origin than this, the flat frame is no place to survey in, m.
const FARTHEST_M: f64 = 100_000.0;

/// A marker as it is told: in the site's frame, or on the ellipsoid.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewMarker {
    /// Its name; may be left out where the path has it.
    pub(crate) name: Option<String>,
    e_m: Option<f64>,
    n_m: Option<f64>,
    u_m: Option<f64>,
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    height_m: Option<f64>,
}

impl NewMarker {
    /// East, north and, where it was surveyed, up in the site's frame, m.
    fn place_m(&self, frame: &LocalFrame) -> Result<(f64, f64, Option<f64>)> {
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
        Ok((e_m, n_m, u_m))
    }
}

/// A name that can stand in a table, a path and a spreadsheet.
fn checked_name(name: &str) -> Result<String> {
    let name = name.trim();
    let length = name.chars().count();
    // A leading apostrophe is how spreadsheets guard a formula: it would not survive its export.
    if length == 0 || length > NAME_LENGTH || name.starts_with('\'') || name.chars().any(char::is_control) {
        return Err(Error::invalid(
            "wrong_name",
            format!(
                "expected a name of 1 to {NAME_LENGTH} letters without line breaks and without an apostrophe in front, found {name:?}"
            ),
        ));
    }
    Ok(name.to_owned())
}

/// Adds one that is not there yet.
pub(crate) async fn add(app: &App, new: NewMarker) -> Result<Marker> {
    let name = checked_name(new.name.as_deref().unwrap_or_default())?;
    let (e_m, n_m, u_m) = new.place_m(&app.site.local_frame())?;
    let now = utc::now();
    let marker = Marker { name, e_m, n_m, u_m, created_at: now, updated_at: now };
    let row = marker.clone();
    let revision = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                markers::insert(&mut *db, &row).await.map_err(|error| match error.is_duplicate() {
                    true => Error::conflict(
                        "marker_exists",
                        format!("there is already a marker {:?}: PUT it to move it", row.name),
                    ),
                    false => error.into(),
                })?;
                Ok::<_, Error>(markers::bump_revision(db).await?)
            })
        })
        .await?;
    app.hub.publish(Change::Markers { revision });
    Ok(marker)
}

/// Makes the marker of this name stand here, whether it was there or not; `true` when it is new.
pub(crate) async fn put(app: &App, name: &str, new: NewMarker) -> Result<(Marker, bool)> {
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
    let (e_m, n_m, u_m) = new.place_m(&app.site.local_frame())?;
    let (marker, is_new, revision) = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let now = utc::now();
                let marker = Marker { name, e_m, n_m, u_m, created_at: now, updated_at: now };
                match markers::get(&mut *db, &marker.name).await? {
                    None => {
                        markers::insert(&mut *db, &marker).await?;
                        Ok((marker, true, Some(markers::bump_revision(db).await?)))
                    }
                    Some(old) if (old.e_m, old.n_m, old.u_m) == (e_m, n_m, u_m) => Ok((old, false, None)),
                    Some(old) => {
                        let marker = Marker { created_at: old.created_at, ..marker };
                        markers::update(&mut *db, &marker).await?;
                        Ok::<_, Error>((marker, false, Some(markers::bump_revision(db).await?)))
                    }
                }
            })
        })
        .await?;
    if let Some(revision) = revision {
        app.hub.publish(Change::Markers { revision });
    }
    Ok((marker, is_new))
}

/// Removes one. Visits and faults keep its name: they say what was said then.
pub(crate) async fn remove(app: &App, name: String) -> Result<()> {
    let revision = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                if !markers::delete(&mut *db, &name).await? {
                    return Err(Error::not_found("marker", name));
                }
                Ok(markers::bump_revision(db).await?)
            })
        })
        .await?;
    app.hub.publish(Change::Markers { revision });
    Ok(())
}

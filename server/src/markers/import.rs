//! A file of markers: taken whole or not at all.

use std::collections::HashMap;

use lodestep_engine::geo::LocalFrame;
use lodestep_engine::parse::markers_csv;
use serde::{Deserialize, Serialize};
use sqlx::SqliteConnection;

use crate::error::Result;
use crate::state::App;
use crate::store::StoreError;
use crate::store::markers::{self, Marker};
use crate::utc;
use crate::wire::Change;

/// What a file changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Imported {
    /// Markers that were not there.
    pub(crate) added: u64,
    /// Markers that moved.
    pub(crate) changed: u64,
    /// Markers that stood there already.
    pub(crate) unchanged: u64,
}

/// Reads a file (UTF-8 or GBK) and puts its markers into the table, in one transaction. Markers that the
/// file does not name stay.
pub(crate) async fn import(app: &App, file: &[u8]) -> Result<Imported> {
    let frame = app.site.local_frame();
    let rows = markers_csv::read(file)?;
    let (imported, revision) =
        app.store.writer().run(move |db| Box::pin(async move { merge(db, &frame, rows).await })).await?;
    if let Some(revision) = revision {
        app.hub.publish(Change::Markers { revision });
    }
    Ok(imported)
}

/// Merges rows into the table; the new revision, when anything changed.
pub(super) async fn merge(
    db: &mut SqliteConnection,
    frame: &LocalFrame,
    rows: Vec<markers_csv::MarkerRow>,
) -> Result<(Imported, Option<i64>), StoreError> {
    let now = utc::now();
    let mut standing: HashMap<String, Marker> =
        markers::list(&mut *db).await?.into_iter().map(|marker| (marker.name.clone(), marker)).collect();
    let mut imported = Imported::default();
    for row in rows {
        let (e_m, n_m, u_m) = row.place.to_local_m(frame);
        match standing.remove(&row.name) {
            None => {
                let marker = Marker { name: row.name, e_m, n_m, u_m, created_at: now, updated_at: now };
                markers::insert(&mut *db, &marker).await?;
                imported.added += 1;
            }
            Some(old) => {
                // An empty height leaves the height alone.
                let u_m = u_m.or(old.u_m);
                if (old.e_m, old.n_m, old.u_m) == (e_m, n_m, u_m) {
                    imported.unchanged += 1;
                } else {
                    markers::update(&mut *db, &Marker { e_m, n_m, u_m, updated_at: now, ..old }).await?;
                    imported.changed += 1;
                }
            }
        }
    }
    let revision = match imported {
        Imported { added: 0, changed: 0, .. } => None,
        _ => Some(markers::bump_revision(db).await?),
    };
    Ok((imported, revision))
}

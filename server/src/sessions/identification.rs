//! What the engine is told so that it names the markers at which an inspector stands.

use std::sync::{Arc, Mutex, PoisonError};

use lodestep_engine::identify::{Identification, Marker, Markers};

use crate::state::State;
use crate::store::sessions::Session;
use crate::store::{StoreError, markers, stands};

/// The marker database as the engine wants it, made once for each of its revisions: every session of a site looks at
/// the same.
#[derive(Debug, Default)]
pub(crate) struct SharedMarkers(Mutex<Option<(i64, Arc<Markers>)>>);

impl SharedMarkers {
    async fn now(&self, app: &State) -> Result<Arc<Markers>, StoreError> {
        let revision = markers::revision(app.store.read()).await?;
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((known_revision, markers)) = known
            && known_revision == revision
        {
            return Ok(markers);
        }
        let rows = markers::list(app.store.read()).await?.into_iter();
        let all: Vec<_> =
            rows.map(|row| Marker { name: row.name, position_n_m: (row.e_m, row.n_m, row.u_m) }).collect();
        let made = Arc::new(Markers::from(all));
        // Where a change came in between, what was read is newer than its number: the next who asks reads again.
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some((revision, Arc::clone(&made)));
        Ok(made)
    }
}

/// The marker database and what people decided on this session; `None` while there are no markers.
pub(crate) async fn identification(
    app: &State,
    session: &Session,
) -> Result<Option<Identification>, StoreError> {
    let markers = app.shared_markers.now(app).await?;
    if markers.all().is_empty() {
        return Ok(None);
    }
    Ok(Some(Identification {
        markers,
        automatic: session.automatic_visits,
        undone_ns: stands::undone(app.store.read(), session.id).await?,
        ..Identification::default()
    }))
}

//! What the engine is told so that it names the markers at which an inspector stands.

use lodestep_engine::identify::{Identification, Marker};

use crate::store::sessions::Session;
use crate::store::{Store, StoreError, markers, stands};

/// The marker database and what people decided on this session; `None` while there are no markers.
pub(crate) async fn identification(
    store: &Store,
    session: &Session,
) -> Result<Option<Identification>, StoreError> {
    let rows = markers::list(store.read()).await?;
    if rows.is_empty() {
        return Ok(None);
    }
    let markers =
        rows.into_iter().map(|row| Marker { name: row.name, position_n_m: (row.e_m, row.n_m, row.u_m) });
    Ok(Some(Identification {
        markers: markers.collect(),
        automatic: session.automatic_visits,
        undone_ns: stands::undone(store.read(), session.id).await?,
        ..Identification::default()
    }))
}

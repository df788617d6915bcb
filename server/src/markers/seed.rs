//! The markers of a site whose table is still empty.

use lodestep_engine::geo::terrain;

use super::write::{Cause, MarkerEdit, write};
use crate::auth::Caller;
use crate::error::Result;
use crate::state::App;
use crate::store::markers::{self, Place};
use crate::wire::Change;

/// Puts the reflector's 2,226 ground anchors into an empty marker table; says how many. A table with
/// markers is left as it is.
pub async fn seed(app: &App) -> Result<u64> {
    if !markers::list(app.store.read()).await?.is_empty() {
        return Ok(0);
    }
    // To the millimetre, as a survey would give them.
    let millimetres = |metres: f64| (metres * 1e3).round() / 1e3;
    let steps: Vec<MarkerEdit> = terrain::anchors(&app.site)
        .into_iter()
        .map(|anchor| {
            let [e_m, n_m, u_m] = anchor.position_n_m.map(millimetres);
            MarkerEdit { name: anchor.name, before: None, after: Some(Place { e_m, n_m, u_m: Some(u_m) }) }
        })
        .collect();
    let added = steps.len() as u64;
    let cause =
        Cause { caller: Caller::itself("demo"), reason: "the reflector's anchors".to_owned(), import: None };
    let revision =
        app.store.writer().run(move |db| Box::pin(async move { write(db, &steps, &cause).await })).await?;
    if let Some(revision) = revision {
        app.hub.publish(Change::Markers { revision });
    }
    Ok(added)
}

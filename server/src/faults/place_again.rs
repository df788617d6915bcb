//! Places the faults of a walk anew once its track has been worked out: where radio is banned they are keyed in long
//! before anybody knows the track.

use serde_json::json;
use uuid::Uuid;

use super::clock::clock;
use super::place::{candidates_at, place};
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::state::App;
use crate::store::fault_changes::{self, FaultChange, What};
use crate::store::faults::{self, Fault};
use crate::store::webhooks::EventKind;
use crate::store::{audit, sessions, webhook_deliveries};
use crate::utc;
use crate::wire::Change;

/// Places a session's faults by its track, where it is known what their times are on the track's clock. The former places
/// are in their histories.
pub(crate) async fn place_again(app: &App, session_id: Uuid) -> Result<()> {
    let db = app.store.read();
    let Some(session) = sessions::get(db, session_id).await? else { return Ok(()) };
    for fault in faults::of_session(db, session_id).await? {
        let moment = clock(app, &session, fault.created_at).await?.moment(&session, fault.reported_at);
        // Where the track says nothing of that time, the former place is the best that there is.
        if moment.sigma_s.is_none() {
            continue;
        }
        let Some(place) = place(app, &session, moment).await? else { continue };
        let next = Fault {
            t_ns: Some(moment.t_ns),
            position_m: Some(place.position_m),
            sigma_m: Some(place.sigma_m),
            covariance_en_m2: Some(place.covariance_en_m2),
            candidates: candidates_at(app, &place).await?,
            ..fault.clone()
        };
        if next != fault {
            write(app, next).await?;
        }
    }
    Ok(())
}

/// Stores a fault's new place beside what people have changed of it meanwhile, and tells it.
async fn write(app: &App, placed: Fault) -> Result<()> {
    let stored = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let Some(fault) = faults::get(&mut *db, placed.id).await? else { return Ok(None) };
                let next = Fault {
                    t_ns: placed.t_ns,
                    position_m: placed.position_m,
                    sigma_m: placed.sigma_m,
                    covariance_en_m2: placed.covariance_en_m2,
                    candidates: placed.candidates,
                    version: fault.version + 1,
                    updated_at: utc::now(),
                    ..fault.clone()
                };
                faults::set_place(&mut *db, &next).await?;
                let by = Caller::itself("server");
                let entry = by.did("fault.placed", next.id, Some(told(&fault)), Some(told(&next)));
                let change = FaultChange {
                    fault_id: next.id,
                    changed_at: next.updated_at,
                    changed_by: Some(by.who),
                    what: What::Place,
                    before: in_words(&fault),
                    after: in_words(&next),
                    comment: String::new(),
                };
                fault_changes::insert(&mut *db, &change).await?;
                audit::insert(&mut *db, &entry).await?;
                let changed = json!({ "before": entry.before, "after": entry.after });
                let told = json!({ "fault": next, "changed": changed, "by": entry.who });
                webhook_deliveries::announce(&mut *db, EventKind::FaultChanged, &told).await?;
                Ok::<_, Error>(Some(next))
            })
        })
        .await?;
    if let Some(fault) = stored {
        app.hub.publish(Change::Fault { fault });
    }
    Ok(())
}

/// A fault's place, as it is told in the log of changes.
fn told(fault: &Fault) -> serde_json::Value {
    json!({
        "t_ns": fault.t_ns,
        "position_m": fault.position_m,
        "sigma_m": fault.sigma_m,
        "covariance_en_m2": fault.covariance_en_m2,
        "candidates": fault.candidates,
    })
}

/// A place and how sure it is, for a fault's history; `None` where there is none.
fn in_words(fault: &Fault) -> Option<String> {
    let ([e, n, _], [sigma_e, sigma_n, _]) = (fault.position_m?, fault.sigma_m?);
    Some(format!("E {e:.1} N {n:.1} m ± {:.1} m", sigma_e.max(sigma_n)))
}

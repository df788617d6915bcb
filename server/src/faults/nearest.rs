//! Who could go: everybody who walks now, the nearest of those with nothing in work first.

use schemars::JsonSchema;
use serde::Serialize;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::state::App;
use crate::store::faults::{self, Fault, FaultState};
use crate::store::{inspectors, markers};
use crate::utc;
use crate::wire::Motion;

/// Somebody who could go.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "NearbyInspector")]
pub(crate) struct Helper {
    /// Who.
    pub(crate) inspector_id: Uuid,
    /// As the inspector is called.
    #[schemars(example = &"Li Na")]
    pub(crate) name: String,
    /// The walk.
    pub(crate) session_id: Uuid,
    /// From where the inspector is to the fault, in plan, m.
    pub(crate) distance_m: f64,
    /// How sure that position is, the larger of both sigmas in plan, m.
    pub(crate) sigma_m: f64,
    /// How old it is, s.
    pub(crate) position_age_s: f64,
    /// What the inspector does.
    pub(crate) state: Motion,
    /// Faults that the inspector has in work.
    pub(crate) in_work: u64,
    /// Whether that is none.
    pub(crate) free: bool,
}

/// Those who walk now, free ones first, then by distance. A fault without any place has nobody near.
pub(crate) async fn nearest(app: &App, id: Uuid) -> Result<Vec<Helper>> {
    let db = app.store.read();
    let fault = faults::get(db, id).await?.ok_or_else(|| Error::not_found("fault", id))?;
    let Some([e_m, n_m]) = place(app, &fault).await? else { return Ok(Vec::new()) };
    let busy = faults::list(db, Some(FaultState::InWork)).await?;
    let names = inspectors::list(db).await?;
    let now = utc::now();
    let mut all: Vec<Helper> = app
        .hub
        .live_positions()
        .into_iter()
        .filter_map(|position| {
            let inspector = names.iter().find(|inspector| inspector.id == position.inspector_id)?;
            // The fault itself keeps nobody from going on with it.
            let in_work =
                busy.iter().filter(|other| other.id != id && other.assignee_id == Some(inspector.id)).count()
                    as u64;
            let [east_m, north_m, _] = position.position_m;
            Some(Helper {
                inspector_id: inspector.id,
                name: inspector.name.clone(),
                session_id: position.session_id,
                distance_m: (east_m - e_m).hypot(north_m - n_m),
                sigma_m: position.sigma_m[0].max(position.sigma_m[1]),
                position_age_s: (now - position.received_at).as_seconds_f64().max(0.0),
                state: position.state,
                in_work,
                free: in_work == 0,
            })
        })
        .collect();
    all.sort_by(|a, b| b.free.cmp(&a.free).then_with(|| a.distance_m.total_cmp(&b.distance_m)));
    Ok(all)
}

/// Where to go: to the actuator that was named, else to where it was reported.
async fn place(app: &App, fault: &Fault) -> Result<Option<[f64; 2]>> {
    if let Some(name) = &fault.marker
        && let Some(marker) = markers::get(app.store.read(), name).await?
    {
        return Ok(Some([marker.e_m, marker.n_m]));
    }
    Ok(fault.position_m.map(|[e_m, n_m, _]| [e_m, n_m]))
}

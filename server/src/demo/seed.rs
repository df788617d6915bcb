//! What the demo finds in place: markers at all actuators' anchors, and the inspectors.

use anyhow::Result;
use uuid::Uuid;

use super::ROLES;
use crate::state::App;
use crate::store::inspectors::{self, Inspector};
use crate::utc;
use crate::wire::Change;

/// Fills what is empty and gives the ids of the demo's inspectors, in the order of their roles.
pub(super) async fn seed(app: &App) -> Result<Vec<Uuid>> {
    crate::markers::seed(app).await?;
    let mut ids = Vec::new();
    for role in ROLES {
        ids.push(find_or_add(app, role.name).await?.id);
    }
    Ok(ids)
}

/// The inspector of this name; one that is new is told to the dashboards.
pub(super) async fn find_or_add(app: &App, name: &str) -> Result<Inspector> {
    if let Some(known) = inspectors::by_name(app.store.read(), name).await? {
        return Ok(known);
    }
    let inspector = Inspector {
        id: Uuid::now_v7(),
        name: name.to_owned(),
        kind: inspectors::person(),
        created_at: utc::now(),
    };
    let row = inspector.clone();
    app.store.writer().run(move |db| Box::pin(async move { inspectors::insert(db, &row).await })).await?;
    let inspectors = inspectors::list(app.store.read()).await?;
    app.hub.publish(Change::Inspectors { inspectors });
    Ok(inspector)
}

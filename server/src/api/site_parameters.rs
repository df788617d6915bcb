//! The parameters that walks are computed with: a set is made the site's, or the defaults are taken again.

use std::collections::BTreeMap;

use axum::extract::State;
use axum::http::StatusCode;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use super::lab::checked;
use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::{Attachment, Json, Routes, With};
use crate::rights::Right;
use crate::state::App;
use crate::store::site_parameters::{self, SetVersion, SiteParameters};
use crate::store::{audit, parameter_sets};
use crate::utc;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/lab/site-parameters", Right::Read, show)
        .about("get_site_parameters", "What walks are computed with: the set of parameters that was made the site's, or the defaults")
        .put("/lab/site-parameters", Right::Engineer, choose)
        .about("choose_site_parameters", "Makes a set of parameters the site's, for all that is computed from now on; or takes the defaults again")
        .get("/lab/site-parameters.json", Right::Read, file)
        .about("export_site_parameters", "The same values as a file, as `lodestep process --parameters` takes it")
}

/// What is to hold.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SiteParametersChoice {
    /// The set; null: every parameter as it is by default.
    parameter_set_id: Option<Uuid>,
    /// The version of the set that was seen.
    version: Option<i64>,
}

async fn show(State(app): State<App>) -> Result<Json<SiteParameters>> {
    Ok(Json(site_parameters::newest(app.store.read()).await?))
}

async fn file(State(app): State<App>) -> Result<With<Attachment, Json<BTreeMap<String, f64>>>> {
    let held = site_parameters::newest(app.store.read()).await?;
    Ok(With(Attachment("site-parameters.json".to_owned()), Json(held.parameters)))
}

/// What holds already is not written once more.
async fn choose(
    State(app): State<App>,
    caller: Caller,
    Json(choice): Json<SiteParametersChoice>,
) -> Result<Json<SiteParameters>> {
    let chosen = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let before = site_parameters::newest(&mut *db).await?;
                let (set, parameters) = match choice.parameter_set_id {
                    None => (None, Default::default()),
                    Some(id) => {
                        let set = parameter_sets::get(&mut *db, id).await?;
                        let set = set.ok_or_else(|| Error::not_found("parameter set", id))?;
                        if choice.version != Some(set.version) {
                            return Err(Error::changed(
                                StatusCode::CONFLICT,
                                "set_changed",
                                format!(
                                    "expected version {} of this set of parameters, found {}: somebody else has changed it meanwhile; look at it, then make it the site's",
                                    set.version,
                                    choice.version.map_or("none".to_owned(), |seen| seen.to_string())
                                ),
                                set,
                            ));
                        }
                        // A newer engine may know a parameter no longer, or in another range.
                        let parameters = checked(set.parameters)?;
                        (Some(SetVersion { id, name: set.name, version: set.version }), parameters)
                    }
                };
                if before.set == set && before.parameters == parameters {
                    return Ok(before);
                }
                let chosen = SiteParameters {
                    id: 0,
                    set,
                    parameters,
                    chosen_at: Some(utc::now()),
                    chosen_by: caller.account.map(|_| caller.who.clone()),
                };
                let chosen = site_parameters::insert(&mut *db, chosen).await?;
                let [was, is] = [&before, &chosen].map(|held| serde_json::to_value(held).ok());
                audit::insert(db, &caller.did("site_parameters.chosen", chosen.id, was, is)).await?;
                Ok::<_, Error>(chosen)
            })
        })
        .await?;
    Ok(Json(chosen))
}

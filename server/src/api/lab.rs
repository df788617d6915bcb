//! The laboratory: the parameters that there are, walks worked out with others, and how these compare.

use std::collections::BTreeMap;

use axum::extract::State;
use lodestep_engine::event::AidKind;
use lodestep_engine::parameters::Parameters;
use lodestep_engine::session::Solution;
use lodestep_engine::systems::catalogue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Result};
use crate::http::media::Csv;
use crate::http::{Accepted, Attachment, File, Json, NoContent, Path, Query, Routes, With};
use crate::rights::Right;
use crate::sessions::comparison::{self, Comparison};
use crate::sessions::provenance::{ENGINE_SHA256, ENGINE_VERSION};
use crate::state::App;
use crate::store::jobs::{self, Job, JobState};
use crate::store::lab_runs::{self, LabRun};
use crate::store::sessions::{self, SessionState};
use crate::store::{audit, parameter_sets};
use crate::utc;
use crate::wire::Change;

/// Sessions in one request.
const MOST_SESSIONS: usize = 500;
/// Runs in one list.
const MOST_RUNS: u32 = 5_000;
/// Letters in a name.
const NAME_LENGTH: usize = 80;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/lab/parameters", Right::Read, parameters)
        .about("list_parameters", "The parameters of the engine, with unit, range and default")
        .get("/lab/runs", Right::Read, list)
        .about("list_lab_runs", "Lab runs, the oldest first")
        .post("/lab/runs", Right::Engineer, ask)
        .about(
            "create_lab_runs",
            "Works walks out with chosen parameters or aids, beside their own tracks; each is a job",
        )
        .get("/lab/runs/{id}", Right::Read, show)
        .about("get_lab_run", "One lab run; its points are at /sessions/{id}/track?run= with its id")
        .delete("/lab/runs/{id}", Right::Engineer, remove)
        .about("delete_lab_run", "Removes a lab run with its track; gives it up, where it is not done")
        .post("/lab/runs/{id}/cancel", Right::Engineer, cancel)
        .about("cancel_lab_run", "Gives a lab run up that is not done")
        .get("/lab/comparison", Right::Read, compare)
        .about(
            "compare_lab_runs",
            "Walks with their lab runs side by side, with differences to the walks' own tracks",
        )
        .get("/lab/comparison.csv", Right::Read, compare_csv)
        .about("export_lab_comparison", "The same as a file")
}

/// What may be turned.
#[derive(Serialize, JsonSchema)]
struct EngineParameters {
    #[schemars(example = &"0.1.0")]
    engine_version: &'static str,
    /// Over the engine's source.
    #[schemars(example = crate::examples::SHA256)]
    engine_sha256: &'static str,
    parameters: Vec<EngineParameter>,
}

/// One parameter.
#[derive(Serialize, JsonSchema)]
struct EngineParameter {
    /// Its path in the configuration, with the unit at its end.
    #[schemars(example = &"tuning.zupt_sigma_m_s")]
    key: &'static str,
    /// `1` for a number without one.
    #[schemars(example = &"m/s")]
    unit: &'static str,
    /// The part of the system.
    #[schemars(example = &"zupt")]
    group: &'static str,
    /// What it means.
    #[schemars(example = &"Sigma of the velocity at a standstill")]
    about: &'static str,
    /// The smallest value that is taken.
    least: f64,
    /// The largest.
    most: f64,
    /// What it is without being set.
    default: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ParametersQuery {
    /// Of this system; of walks, when it is left out.
    system: Option<String>,
}

async fn parameters(Query(query): Query<ParametersQuery>) -> Result<Json<EngineParameters>> {
    let system = match &query.system {
        None => catalogue::usual(),
        Some(name) => catalogue::named(name).ok_or_else(|| Error::not_found("system", name))?,
    };
    let parameters = system.parameters.iter().map(|known| EngineParameter {
        key: known.key,
        unit: known.unit,
        group: known.group,
        about: known.about,
        least: known.least,
        most: known.most,
        default: known.default_of(system),
    });
    Ok(Json(EngineParameters {
        engine_version: ENGINE_VERSION,
        engine_sha256: ENGINE_SHA256,
        parameters: parameters.collect(),
    }))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    /// Those of this walk; all, when it is left out.
    session_id: Option<Uuid>,
}

/// Aids as their system declares them, each once, in its order.
fn declared(aids: Vec<AidKind>) -> Result<Vec<AidKind>> {
    let known = |aid: AidKind| {
        catalogue::aid_named(aid.as_str()).ok_or_else(|| {
            let all = catalogue::SYSTEMS.iter().flat_map(|system| system.aids);
            let all: Vec<&str> = all.map(|aid| aid.kind.as_str()).collect();
            let detail = format!(
                "expected aids out of {}, found {:?}: name those to use",
                all.join(", "),
                aid.as_str()
            );
            Error::invalid("wrong_field", detail)
        })
    };
    let mut aids = aids.into_iter().map(known).collect::<Result<Vec<_>>>()?;
    aids.sort_unstable();
    aids.dedup();
    Ok(aids)
}

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<Json<Vec<LabRun>>> {
    let sessions: Vec<Uuid> = query.session_id.into_iter().collect();
    Ok(Json(lab_runs::list(app.store.read(), &sessions, MOST_RUNS).await?))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<LabRun>> {
    let run = lab_runs::get(app.store.read(), id).await?;
    Ok(Json(run.ok_or_else(|| Error::not_found("lab run", id))?))
}

/// What is to be worked out.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct NewLabRuns {
    /// The walks.
    session_ids: Vec<Uuid>,
    /// As the runs are to be shown; the name of the set of parameters or the aids, when it is left out.
    #[serde(default)]
    #[schemars(example = &"less noise")]
    name: String,
    /// A set of parameters that was kept.
    parameter_set_id: Option<Uuid>,
    /// Values by key, on top of those of the set.
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
    /// The aids to use; all that the data allow, when it is left out.
    #[schemars(with = "Option<Vec<String>>", example = ["zupt", "heading"])]
    aids: Option<Vec<AidKind>>,
    /// `filtered` or `smoothed`; smoothed as a walk's own track is, when it is left out.
    #[schemars(with = "Option<String>", example = &"smoothed")]
    solution: Option<Solution>,
}

async fn ask(
    State(app): State<App>,
    caller: Caller,
    Json(new): Json<NewLabRuns>,
) -> Result<Accepted<Json<Vec<LabRun>>>> {
    let mut session_ids = new.session_ids;
    session_ids.sort_unstable();
    session_ids.dedup();
    if session_ids.is_empty() || session_ids.len() > MOST_SESSIONS {
        return Err(Error::invalid(
            "wrong_sessions",
            format!(
                "expected 1 to {MOST_SESSIONS} walks in session_ids, found {}: choose walks",
                session_ids.len()
            ),
        ));
    }
    let solution = match new.solution.unwrap_or(Solution::Smoothed) {
        Solution::Trail => {
            return Err(Error::invalid(
                "wrong_solution",
                "expected filtered or smoothed in solution, found trail, which is for walks that go on: choose one of the two",
            ));
        }
        solution => solution,
    };
    let db = app.store.read();
    let set = match new.parameter_set_id {
        Some(id) => {
            Some(parameter_sets::get(db, id).await?.ok_or_else(|| Error::not_found("parameter set", id))?)
        }
        None => None,
    };
    let kept = set.as_ref().map(|set| set.parameters.clone()).unwrap_or_default();
    let parameters = checked(kept.into_iter().chain(new.parameters))?;
    let aids = new.aids.map(declared).transpose()?;
    let name = match (new.name.trim(), &set, &aids) {
        ("", Some(set), _) => set.name.clone(),
        ("", None, Some(aids)) => aids.iter().map(crate::store::columns_word).collect::<Vec<_>>().join(" + "),
        ("", None, None) => "default".to_owned(),
        (name, ..) => name_of(name)?,
    };
    for &id in &session_ids {
        let session = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
        if session.state == SessionState::Live {
            return Err(Error::conflict(
                "session_live",
                format!("a device still streams the walk {id}: wait for its end"),
            ));
        }
    }
    let mut runs = Vec::with_capacity(session_ids.len());
    for session_id in session_ids {
        let run_id = Uuid::now_v7();
        let job = Job::new(session_id, Some(run_id));
        let run = LabRun {
            id: run_id,
            session_id,
            name: name.clone(),
            parameter_set_id: new.parameter_set_id,
            parameters: parameters.clone(),
            aids: aids.clone(),
            solution,
            created_at: job.created_at,
            created_by: caller.account.map(|_| caller.who.clone()),
            job_id: job.id,
            state: job.state,
            error: None,
            figures: None,
            provenance: None,
        };
        runs.push((run, job));
    }
    let rows = runs.clone();
    let entries: Vec<_> = runs
        .iter()
        .map(|(run, _)| {
            let asked = serde_json::json!({"session_id": run.session_id, "name": run.name, "parameters": run.parameters, "aids": run.aids});
            caller.did("lab_run.added", run.id, None, Some(asked))
        })
        .collect();
    app.store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                for ((run, job), entry) in rows.iter().zip(&entries) {
                    lab_runs::insert(&mut *db, run).await?;
                    jobs::insert(&mut *db, job).await?;
                    audit::insert(&mut *db, entry).await?;
                }
                Ok::<_, Error>(())
            })
        })
        .await?;
    let (runs, jobs): (Vec<_>, Vec<_>) = runs.into_iter().unzip();
    app.hub.publish_all(jobs.into_iter().map(|job| Change::Job { job }));
    app.jobs.asked.notify_one();
    Ok(Accepted(Json(runs)))
}

/// Values that the engine takes, without those that are the default.
pub(super) fn checked(given: impl IntoIterator<Item = (String, f64)>) -> Result<BTreeMap<String, f64>> {
    let parameters =
        Parameters::new(given).map_err(|error| Error::invalid("wrong_parameter", error.to_string()))?;
    Ok(parameters.into())
}

/// A name without spaces around it, or why it cannot be one.
pub(super) fn name_of(text: &str) -> Result<String> {
    let (name, length) = (text.trim(), text.trim().chars().count());
    if length == 0 || length > NAME_LENGTH || name.chars().any(char::is_control) {
        return Err(Error::invalid(
            "wrong_name",
            format!(
                "expected a name of 1 to {NAME_LENGTH} letters without line breaks, found {length}: give it one by which others will know it"
            ),
        ));
    }
    Ok(name.to_owned())
}

async fn cancel(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<Json<LabRun>> {
    let job = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let run =
                    lab_runs::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("lab run", id))?;
                let job = jobs::get(&mut *db, run.job_id).await?;
                let job = job.ok_or_else(|| Error::not_found("job", run.job_id))?;
                let job = Job {
                    state: JobState::Cancelled,
                    stage: String::new(),
                    finished_at: Some(utc::now()),
                    ..job
                };
                if !jobs::update(&mut *db, &job).await? {
                    return Err(Error::conflict(
                        "run_ended",
                        "expected a run that is waiting or under way, found one that has ended: remove it, if it is of no use",
                    ));
                }
                let told = serde_json::json!({"name": run.name, "session_id": run.session_id});
                audit::insert(db, &caller.did("lab_run.cancelled", id, Some(told), None)).await?;
                Ok::<_, Error>(job)
            })
        })
        .await?;
    app.jobs.give_up(job.id);
    app.hub.publish(Change::Job { job });
    show(State(app), Path(id)).await
}

async fn remove(State(app): State<App>, caller: Caller, Path(id): Path<Uuid>) -> Result<NoContent> {
    let job_id = app
        .store
        .writer()
        .run(move |db| {
            Box::pin(async move {
                let run =
                    lab_runs::get(&mut *db, id).await?.ok_or_else(|| Error::not_found("lab run", id))?;
                lab_runs::delete(&mut *db, id).await?;
                let told = serde_json::json!({"name": run.name, "session_id": run.session_id, "parameters": run.parameters});
                audit::insert(db, &caller.did("lab_run.removed", id, Some(told), None)).await?;
                Ok::<_, Error>(run.job_id)
            })
        })
        .await?;
    app.jobs.give_up(job_id);
    Ok(NoContent)
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CompareQuery {
    /// Ids with commas in between.
    session_ids: String,
}

impl CompareQuery {
    fn ids(&self) -> Result<Vec<Uuid>> {
        let mut ids = Vec::new();
        for text in self.session_ids.split(',').map(str::trim).filter(|text| !text.is_empty()) {
            let id = Uuid::parse_str(text).map_err(|error| {
                Error::invalid(
                    "wrong_sessions",
                    format!("expected ids of walks with commas in between in session_ids, found {text:?} ({error}): check it"),
                )
            })?;
            if !ids.contains(&id) {
                ids.push(id);
            }
        }
        if ids.is_empty() || ids.len() > MOST_SESSIONS {
            return Err(Error::invalid(
                "wrong_sessions",
                format!(
                    "expected 1 to {MOST_SESSIONS} walks in session_ids, found {}: choose walks",
                    ids.len()
                ),
            ));
        }
        Ok(ids)
    }
}

async fn compare(State(app): State<App>, Query(query): Query<CompareQuery>) -> Result<Json<Comparison>> {
    Ok(Json(comparison::compare(&app.store, &query.ids()?).await?))
}

async fn compare_csv(
    State(app): State<App>,
    Query(query): Query<CompareQuery>,
) -> Result<With<Attachment, File<Csv>>> {
    let text = comparison::compare(&app.store, &query.ids()?).await?.to_csv()?;
    Ok(With(Attachment("lab-comparison.csv".to_owned()), File::new(text)))
}

//! Files of markers, step by step: compared, looked at, applied, reverted.

use axum::body::Body;
use axum::extract::State;
use schemars::JsonSchema;
use serde::Deserialize;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::Result;
use crate::http::media::{Csv, LandXml, Media, PlainText};
use crate::http::{Attachment, Created, CsvBody, File, Json, NoContent, Path, Query, Routes, With};
use crate::markers::{self, Apply, FilePoint, Form, ImportView, ReadOptions, Revert, SurveyedPoint};
use crate::rights::Right;
use crate::state::App;
use crate::store::marker_imports::{self, MarkerImport};

/// Imports that are listed.
const LISTED: u32 = 100;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/markers/imports", Right::Read, list)
        .about("list_marker_imports", "Files of markers, newest first")
        .post("/markers/imports", Right::Survey, create)
        .about("create_marker_import", "Compare a file of markers with the table; nothing is changed")
        .get("/markers/imports/{id}", Right::Read, show)
        .about("get_marker_import", "A file of markers with its exact difference")
        .delete("/markers/imports/{id}", Right::Survey, give_up)
        .about("abandon_marker_import", "Give up a file that was not applied")
        .put("/markers/imports/{id}/reading", Right::Survey, read_again)
        .about(
            "reread_marker_import",
            "Compare it again, by another mapping of its columns or as the whole table",
        )
        .post("/markers/imports/{id}/apply", Right::Survey, apply)
        .about("apply_marker_import", "Make its difference, against the table that it was compared with")
        .post("/markers/imports/{id}/revert", Right::Survey, revert)
        .about("revert_marker_import", "Take back exactly what it changed")
        .post("/sessions/{id}/marker-import", Right::Survey, of_survey)
        .about(
            "create_marker_import_of_survey",
            "Compare what a session has surveyed with the table; nothing is changed",
        )
        .get("/sessions/{id}/surveyed-points", Right::Read, surveyed)
        .about("list_surveyed_points", "What a session has surveyed, held against the table")
        .get("/sessions/{id}/surveyed-points.csv", Right::Read, csv)
        .about("export_surveyed_points_csv", "What a session has surveyed as a file that an import takes")
        .get("/sessions/{id}/surveyed-points.txt", Right::Read, pnezd)
        .about("export_surveyed_points_pnezd", "The same as point, northing, easting, elevation, description")
        .get("/sessions/{id}/surveyed-points.xml", Right::Read, land_xml)
        .about("export_surveyed_points_landxml", "The same as LandXML")
}

async fn of_survey(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
) -> Result<Created<Json<ImportView>>> {
    Ok(Created(Json(markers::import_of_survey(&app, caller, id).await?)))
}

async fn surveyed(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<Vec<SurveyedPoint>>> {
    Ok(Json(markers::surveyed_points(&app, id).await?))
}

async fn csv(State(app): State<App>, Path(id): Path<Uuid>) -> Result<PointsFile<Csv>> {
    file(&app, id, Form::Csv).await
}

async fn pnezd(State(app): State<App>, Path(id): Path<Uuid>) -> Result<PointsFile<PlainText>> {
    file(&app, id, Form::Pnezd).await
}

async fn land_xml(State(app): State<App>, Path(id): Path<Uuid>) -> Result<PointsFile<LandXml>> {
    file(&app, id, Form::LandXml).await
}

/// A file with a name of its own.
type PointsFile<M> = With<Attachment, File<M>>;

async fn file<M: Media>(app: &App, id: Uuid, form: Form) -> Result<PointsFile<M>> {
    let points = markers::surveyed_points(app, id).await?;
    let points: Vec<_> = points.iter().map(FilePoint::from).collect();
    let name = format!("survey-{id}.{}", form.extension());
    Ok(With(Attachment(name), File::new(Body::from(markers::write_points(form, &points)))))
}

async fn list(State(app): State<App>) -> Result<Json<Vec<MarkerImport>>> {
    Ok(Json(marker_imports::list(app.store.read(), LISTED).await?))
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CreateQuery {
    #[schemars(example = &"left.csv")]
    file_name: Option<String>,
}

async fn create(
    State(app): State<App>,
    caller: Caller,
    Query(query): Query<CreateQuery>,
    CsvBody(file): CsvBody,
) -> Result<Created<Json<ImportView>>> {
    let view = markers::create(&app, caller, query.file_name, file.into()).await?;
    Ok(Created(Json(view)))
}

async fn show(State(app): State<App>, Path(id): Path<Uuid>) -> Result<Json<ImportView>> {
    Ok(Json(markers::view(&app, id).await?))
}

async fn give_up(State(app): State<App>, Path(id): Path<Uuid>) -> Result<NoContent> {
    markers::give_up(&app, id).await?;
    Ok(NoContent)
}

async fn read_again(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Json(reading): Json<ReadOptions>,
) -> Result<Json<ImportView>> {
    Ok(Json(markers::read_again(&app, id, reading).await?))
}

async fn apply(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(asked): Json<Apply>,
) -> Result<Json<MarkerImport>> {
    Ok(Json(markers::apply(&app, caller, id, asked).await?))
}

async fn revert(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    Json(asked): Json<Revert>,
) -> Result<Json<MarkerImport>> {
    Ok(Json(markers::revert(&app, caller, id, asked).await?))
}

//! The description of the API, as a file.

use std::sync::LazyLock;

use axum::extract::State;
use serde_json::{Map, Value};

use crate::http::operation_list::OperationList;
use crate::http::{Routes, WrittenJson, openapi};
use crate::rights::Right;
use crate::state::App;

pub(super) fn routes() -> Routes {
    Routes::new().get("/openapi.json", Right::Open, show).about("get_api_description", "This description")
}

async fn show(State(app): State<App>) -> WrittenJson<Map<String, Value>> {
    WrittenJson::new(app.openapi.clone())
}

/// The OpenAPI document of these routes.
pub fn description(routes: &Routes) -> Value {
    openapi::document(routes.declared(), operation_list())
}

/// The operations and the problems that each may answer, as the source was last searched for them.
pub fn operation_list() -> &'static OperationList {
    static LIST: LazyLock<OperationList> = LazyLock::new(|| {
        OperationList::read(include_str!("operations.json"))
            .expect("a test compares this list with what is written")
    });
    &LIST
}

//! Who changed what, for administrators.

use axum::extract::State;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::csv_cell::harmless;
use crate::error::{Error, Result};
use crate::http::media::Csv;
use crate::http::{Attachment, File, Json, Query, Routes, With};
use crate::rights::Right;
use crate::state::App;
use crate::store::audit::{self, Entry, Wanted};

/// Entries in one answer, unless fewer are asked for.
const MOST: u32 = 1_000;
const USUAL: u32 = 100;
/// Entries in a file.
const MOST_IN_A_FILE: u32 = 1_000_000;

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/audit", Right::Administer, list)
        .about("list_audit_entries", "Who changed what, the newest first")
        .get("/audit.csv", Right::Administer, export)
        .about("export_audit", "The same as a file")
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ListQuery {
    #[schemars(example = &"li wei")]
    who: Option<String>,
    action: Option<String>,
    subject: Option<String>,
    before_id: Option<i64>,
    limit: Option<u32>,
}

impl ListQuery {
    fn wanted(self, usual: u32, most: u32) -> Wanted {
        let told =
            |text: Option<String>| text.map(|text| text.trim().to_owned()).filter(|text| !text.is_empty());
        Wanted {
            who: told(self.who),
            action: told(self.action),
            subject: told(self.subject),
            before_id: self.before_id,
            limit: self.limit.unwrap_or(usual).clamp(1, most),
        }
    }
}

async fn list(State(app): State<App>, Query(query): Query<ListQuery>) -> Result<Json<Vec<Entry>>> {
    Ok(Json(audit::list(app.store.read(), &query.wanted(USUAL, MOST)).await?))
}

async fn export(
    State(app): State<App>,
    Query(query): Query<ListQuery>,
) -> Result<With<Attachment, File<Csv>>> {
    let entries = audit::list(app.store.read(), &query.wanted(MOST_IN_A_FILE, MOST_IN_A_FILE)).await?;
    // By its mark a spreadsheet knows UTF-8.
    let mut text = String::from("\u{feff}id,at,who,address,action,subject,before,after\n");
    for entry in entries {
        let at = entry.at.format(&time::format_description::well_known::Rfc3339);
        let at = at.map_err(|error| Error::Internal(error.into()))?;
        let json =
            |value: Option<serde_json::Value>| value.map(|value| value.to_string()).unwrap_or_default();
        let cells = [
            entry.id.to_string(),
            at,
            entry.who,
            entry.address,
            entry.action,
            entry.subject,
            json(entry.before),
            json(entry.after),
        ];
        text.push_str(&cells.map(|cell| harmless(&cell)).join(","));
        text.push('\n');
    }
    Ok(With(Attachment("audit.csv".to_owned()), File::new(text)))
}

//! The list of operations: each by its name with its route and those problems that no type of its handler tells. Clients
//! know an operation by its name and a problem by its code: a change that renames or moves an operation, or lets it answer
//! something new, changes the list, too. Tests hold the list against the routes and the source, and every answer of a
//! test server against the description that it is part of.

use std::collections::{BTreeMap, BTreeSet};

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};

/// Codes of problems by HTTP status.
pub type Codes = BTreeMap<u16, BTreeSet<String>>;

/// The operations of an API.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperationList {
    /// The problems that any request may meet, before or beside its handler.
    pub every: Codes,
    /// The operations by their names.
    pub operations: BTreeMap<String, ListedOperation>,
}

/// An operation in the list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListedOperation {
    /// Method and path, such as `GET /api/v1/markers/{name}`.
    pub route: String,
    /// The problems of its own.
    #[serde(default, skip_serializing_if = "Codes::is_empty")]
    pub problems: Codes,
}

impl OperationList {
    /// Reads a list.
    ///
    /// # Errors
    ///
    /// Text that is not a list of operations in JSON.
    pub fn read(text: &str) -> serde_json::Result<OperationList> {
        serde_json::from_str(text)
    }

    /// All problems that an operation may answer, with those that its types tell.
    pub fn problems<'t>(
        &self,
        id: &str,
        told: impl IntoIterator<Item = &'t (StatusCode, &'static str)>,
    ) -> Codes {
        let mut all = self.every.clone();
        for (status, codes) in self.operations.get(id).into_iter().flat_map(|operation| &operation.problems) {
            all.entry(*status).or_default().extend(codes.iter().cloned());
        }
        for (status, code) in told {
            all.entry(status.as_u16()).or_default().insert((*code).to_owned());
        }
        all
    }
}

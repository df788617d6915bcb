//! Walks as they happen: the device socket in, the feed out.

use axum::Router;

use crate::state::App;

pub mod hub;

/// The routes below `/api/v1`.
pub(crate) fn routes() -> Router<App> {
    Router::new()
}

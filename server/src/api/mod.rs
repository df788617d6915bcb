//! The routes, one file a noun; here they are merged and given their layers.

use std::any::Any;
use std::time::Duration;

use axum::extract::{DefaultBodyLimit, Request};
use axum::http::{HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Router, middleware};
use tower::ServiceBuilder;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::TimeoutLayer;
use tower_http::trace::{DefaultOnResponse, TraceLayer};
use tracing::Level;

use crate::config::Config;
use crate::http::Routes;
use crate::state::App;
use crate::{assets, auth, figures, headers, live, origin};

mod account;
mod accounts;
mod alarms;
mod anomalies;
mod audit;
mod charts;
mod description;
mod dock;
mod fault_photos;
pub(crate) mod faults;
mod health;
mod inspectors;
mod jobs;
mod lab;
mod mappings;
mod marker_imports;
mod markers;
mod moment;
mod parameter_sets;
mod reports;
mod samples;
mod server;
mod session_change;
mod session_search;
pub mod sessions;
mod site;
mod site_parameters;
mod stands;
mod systems;
mod tokens;
mod tracks;
mod uploads;
mod visits;
mod webhooks;

/// The header that names a request in the answer and in the log.
const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

pub use description::{description, operation_list};

/// Every route with what it asks of its caller.
pub fn routes(config: &Config) -> Routes {
    let timeout = TimeoutLayer::with_status_code(
        StatusCode::SERVICE_UNAVAILABLE,
        Duration::from_secs(config.request_s),
    );
    let quick = Routes::new()
        .merge(description::routes())
        .merge(account::routes())
        .merge(accounts::routes())
        .merge(tokens::routes())
        .merge(audit::routes())
        .merge(webhooks::routes())
        .merge(server::routes())
        .merge(site::routes())
        .merge(systems::routes())
        .merge(inspectors::routes())
        .merge(sessions::routes())
        .merge(session_search::routes())
        .merge(dock::routes())
        .merge(moment::routes())
        .merge(faults::routes())
        .merge(alarms::routes())
        .merge(fault_photos::routes())
        .merge(markers::routes())
        .merge(marker_imports::routes())
        .merge(uploads::routes())
        .merge(mappings::routes())
        .merge(jobs::routes())
        .merge(lab::routes())
        .merge(parameter_sets::routes())
        .merge(site_parameters::routes())
        .merge(tracks::routes())
        .merge(visits::routes())
        .merge(stands::routes())
        .merge(reports::routes())
        .merge(charts::routes())
        .merge(samples::routes())
        .merge(anomalies::routes())
        .merge(live::routes())
        .with(|router| router.layer(timeout));
    quick
        .merge(uploads::long_routes())
        .merge(server::long_routes())
        .below("/api/v1")
        .merge(health::routes().with(|router| router.layer(timeout)))
}

/// Everything that this server answers.
pub fn router(app: App) -> Router {
    let layers = ServiceBuilder::new()
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(
            TraceLayer::new_for_http()
                .make_span_with(span)
                .on_response(DefaultOnResponse::new().level(Level::INFO))
                // Why it failed is logged once, where it happened.
                .on_failure(()),
        )
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(middleware::from_fn(figures::requests))
        .layer(middleware::from_fn(headers::secure))
        .layer(CompressionLayer::new())
        .layer(middleware::from_fn(headers::problems))
        .layer(CatchPanicLayer::custom(panicked))
        .layer(middleware::from_fn_with_state(app.clone(), origin::guard))
        .layer(middleware::from_fn_with_state(app.clone(), auth::guard))
        .layer(DefaultBodyLimit::max(app.config.body_bytes));
    routes(&app.config).into_router().fallback(assets::serve).layer(layers).with_state(app)
}

/// The access log's span: identifiers as fields, no bodies, no query (it may name people).
fn span(request: &Request) -> tracing::Span {
    let id = request.headers().get(REQUEST_ID).and_then(|id| id.to_str().ok()).unwrap_or_default();
    tracing::info_span!("request", id, method = %request.method(), path = request.uri().path())
}

/// A handler panicked: the log has the message, the client is told that it is not its fault.
fn panicked(panic: Box<dyn Any + Send>) -> Response {
    let why = panic
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    crate::error::Error::Internal(anyhow::anyhow!("a handler panicked: {why}")).into_response()
}

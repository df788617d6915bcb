//! What comes after the question mark, for every route that looks at it.

use std::path::Path;
use std::sync::LazyLock;

use lodestep_server::api;
use lodestep_server::config::Config;
use lodestep_server::http::ReadsQuery;

static READERS: LazyLock<Vec<ReadsQuery>> = LazyLock::new(|| {
    let routes = api::routes(&Config::for_testing(Path::new("nowhere")));
    routes.declared().iter().filter_map(|route| route.query_reader()).collect()
});

/// The first byte says whose query the rest is.
pub(crate) fn run(bytes: &[u8]) {
    let Some((whose, query)) = bytes.split_first() else { return };
    let Ok(query) = std::str::from_utf8(query) else { return };
    let reads = READERS[usize::from(*whose) % READERS.len()];
    if let Err(error) = reads(query) {
        let problem = error.into_problem();
        assert!(problem.status == 400 || problem.status == 422, "{problem:?}");
        assert!(!problem.detail.is_empty() && problem.detail.chars().count() <= 2_000, "{problem:?}");
        assert!(!problem.detail.chars().any(char::is_control), "{problem:?}");
    }
}

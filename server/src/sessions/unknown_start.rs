//! A walk whose start nobody gave: it is somewhere on the site, until a marker says where.

use lodestep_engine::session::SessionConfig;

use crate::store::sessions::Start;

/// Sigma of such a start on each axis, m: the dish is 500 m wide.
const ANYWHERE_SIGMA_M: f64 = 250.0;
/// A position that is less sure than this says nothing, m.
const UNKNOWN_SIGMA_M: f64 = 100.0;

/// Tells the engine that it does not know where the walk starts, where that is so.
pub(super) fn apply(start: &Start, config: &mut SessionConfig) {
    if start.known {
        return;
    }
    // Beyond what people may choose for a start that they know; a system without this parameter asks for no start.
    if let Some(sigma) = config.system.declaration().parameter("first_position_sigma_m") {
        (sigma.write)(config, ANYWHERE_SIGMA_M);
    }
}

/// Whether a position with these sigmas, east-north-up, m, is none.
pub(crate) fn is_unknown(sigma_m: [f64; 3]) -> bool {
    sigma_m[0].max(sigma_m[1]) > UNKNOWN_SIGMA_M
}

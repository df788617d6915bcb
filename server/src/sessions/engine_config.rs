//! What the engine is told before a session's first sample: the same for an upload and a stream.

use lodestep_engine::session::SessionConfig;
use lodestep_engine::stream::StreamId;

use super::unknown_start;
use crate::site::Site;
use crate::store::sessions::Session;

/// The engine's configuration for a session on this site with readings of these streams.
pub(crate) fn engine_config(site: &Site, session: &Session, streams: &[StreamId]) -> SessionConfig {
    let system = session.declaration();
    let mut config = SessionConfig {
        streams: streams.iter().filter_map(|id| system.stream(*id)).collect(),
        // Stored samples are complete: a stream waits for the other as long as it takes.
        max_lead_ns: None,
        initial_position_n_m: session.start.position_m,
        initial_heading_rad: session.initial_heading_deg.map(f64::to_radians),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        origin: Some(site.local_frame().origin()),
        instrument: session.instrument.clone(),
        ..SessionConfig::by_default(system)
    };
    unknown_start::apply(&session.start, &mut config);
    config
}

//! What a tag's ranges and motion may be like: a small bank of models, of which the ranges themselves choose.

/// Horizontal velocities fade with this time, s: a tag does not go on for ever.
pub(super) const VELOCITY_TIME_S: f64 = 10.0;
/// The same upwards, where the tag flies, s.
pub(super) const CLIMB_TIME_S: f64 = 2.0;
/// An unknown height wanders with this time about that of the anchors, s.
pub(super) const HEIGHT_TIME_S: f64 = 300.0;
/// A known height: trolleys and floors are not quite level, s.
pub(super) const KNOWN_HEIGHT_TIME_S: f64 = 30.0;
/// Way after which one anchor's quick bias is another, m: what surrounds a path changes with the way.
pub(super) const QUICK_WAY_M: f64 = 0.15;
/// The same while the tag stands, s.
pub(super) const QUICK_TIME_S: f64 = 1.0;
/// What all anchors' ranges have too much in common, such as the tag's delay as it turns, lasts so much longer.
pub(super) const COMMON_LASTS: f64 = 4.0;
/// Slow biases hold for this time, s.
pub(super) const SLOW_TIME_S: f64 = 900.0;

/// One model of ranges and motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Model {
    /// Logarithm of how likely it is before any range.
    pub(super) log_prior: f64,
    /// White noise of a range, m.
    pub(super) white_m: f64,
    /// Quick bias of one anchor, m.
    pub(super) quick_m: f64,
    /// Quick bias of all anchors together, m.
    pub(super) common_m: f64,
    /// Slow bias of one anchor beside the tag's own, m.
    pub(super) slow_m: f64,
    /// Slow bias of the tag against what is expected of it, m.
    pub(super) tag_m: f64,
    /// Error of the scale of all ranges.
    pub(super) scale: f64,
    /// How much less the carrier accelerates across its way than along it.
    pub(super) turning: f64,
    /// Spectral density of the horizontal acceleration, m/s²/√Hz.
    pub(super) acceleration: f64,
    /// The same upwards; zero on the ground.
    pub(super) climb: f64,
}

/// The models that are tried beside each other; `height_known` leaves out those that fly.
///
/// The lowest level is that of a tag of 2019 in the open, the highest that of a radio of 2009. White noise is only a
/// beginning: each filter learns it for each anchor.
pub(super) fn bank(height_known: bool, range_sigma_m: Option<f64>) -> Vec<Model> {
    const WHITE_M: f64 = 0.02;
    const LEVELS: [Level; 5] = [
        Level { log_prior: 0.0, quick_m: 0.07, common_m: 0.15, slow_m: 0.02, tag_m: 0.07 },
        Level { log_prior: -40.0, quick_m: 0.07, common_m: 0.15, slow_m: 0.06, tag_m: 0.1 },
        Level { log_prior: 0.0, quick_m: 0.12, common_m: 0.12, slow_m: 0.06, tag_m: 0.1 },
        Level { log_prior: 0.0, quick_m: 0.3, common_m: 0.3, slow_m: 0.1, tag_m: 0.2 },
        Level { log_prior: 0.0, quick_m: 0.7, common_m: 0.5, slow_m: 0.3, tag_m: 0.5 },
    ];
    const SCALES: [f64; 2] = [0.003, 0.05];
    const ACCELERATIONS: [f64; 2] = [0.7, 1.5];
    const TURNINGS: [f64; 2] = [0.3, 1.0];
    const CLIMBS: [f64; 2] = [0.0, 0.6];
    let mut models = Vec::new();
    for (number, level) in LEVELS.iter().enumerate() {
        // Only coarse radios have a scale that is off by percents.
        let scales = if number < 3 { &SCALES[..1] } else { &SCALES };
        let climbs = if height_known { &CLIMBS[..1] } else { &CLIMBS };
        for acceleration in ACCELERATIONS {
            for turning in TURNINGS {
                for climb in climbs {
                    for scale in scales {
                        models.push(Model {
                            log_prior: level.log_prior,
                            white_m: range_sigma_m.unwrap_or(WHITE_M),
                            quick_m: level.quick_m,
                            common_m: level.common_m,
                            slow_m: level.slow_m,
                            tag_m: level.tag_m,
                            scale: *scale,
                            turning,
                            acceleration,
                            climb: *climb,
                        });
                    }
                }
            }
        }
    }
    models
}

/// How large the parts of a range's error are, m.
struct Level {
    log_prior: f64,
    quick_m: f64,
    common_m: f64,
    slow_m: f64,
    tag_m: f64,
}

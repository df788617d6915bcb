//! What identification is told, and its parameters.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::markers::Markers;
use crate::visit::Visit;

/// What a session needs to name the markers at which its inspector stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Identification {
    /// The whole marker database, which the sessions of a site share.
    #[serde(with = "shared")]
    pub markers: Arc<Markers>,
    /// Whether what is nearly certain is taken for a visit.
    pub automatic: bool,
    /// Stands whose automatic visit was undone, by their `t_start_ns`: they are left to people.
    pub undone_ns: Vec<i64>,
    /// Visits that automatic mode made of this walk's stands in an earlier run: they correct the track,
    /// but are no evidence of which marker it was.
    pub automatic_visits: Vec<Visit>,
    /// The parameters.
    pub tuning: IdentificationTuning,
}

/// The parameters. Those of the track's error were fitted to simulated spirals with the CMP10A's figures,
/// of other seeds than `lodestep evaluate markers` begins with; `inflation` is the one to turn when the
/// filter has become better or worse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct IdentificationTuning {
    /// All sigmas of the track's error below are taken times this.
    pub inflation: f64,
    /// Error of the track's heading as it persists over a stretch, sigma, rad; where the filter says
    /// more, that is believed.
    pub heading_sigma_rad: f64,
    /// Length over which it persists, m.
    pub heading_length_m: f64,
    /// Error of the track's length as a share, sigma.
    pub scale_sigma: f64,
    /// Length over which it persists, m.
    pub scale_length_m: f64,
    /// What grows without memory in each direction of the plan, m/√m.
    pub walk_sigma_m_rtm: f64,
    /// The same of the height, m/√m.
    pub height_walk_sigma_m_rtm: f64,
    /// Where the session starts, sigma on each axis, m.
    pub start_sigma_m: f64,
    /// Where an inspector stands beside a marker, sigma on each axis, m.
    pub beside_sigma_m: f64,
    /// Stands at no marker, before the walk has shown any: so many in `none_of` stands.
    pub none_stands: f64,
    /// How many stands' worth that first guess is.
    pub none_of: f64,
    /// A marker that was keyed in, and not turned down, is another one so often.
    pub slip: f64,
    /// A candidate as probable as this is taken for a visit in automatic mode.
    pub automatic_probability: f64,
}

impl Default for IdentificationTuning {
    fn default() -> Self {
        IdentificationTuning {
            inflation: 1.0,
            heading_sigma_rad: 0.008,
            heading_length_m: 800.0,
            scale_sigma: 0.004,
            scale_length_m: 1000.0,
            walk_sigma_m_rtm: 0.03,
            height_walk_sigma_m_rtm: 0.02,
            start_sigma_m: 0.3,
            beside_sigma_m: 1.0,
            none_stands: 0.3,
            none_of: 2.0,
            slip: 0.01,
            automatic_probability: 0.99,
        }
    }
}

/// A shared value is written as the value.
mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<T: Serialize, S: Serializer>(value: &Arc<T>, to: S) -> Result<S::Ok, S::Error> {
        value.as_ref().serialize(to)
    }

    pub(super) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Arc<T>, D::Error> {
        T::deserialize(from).map(Arc::new)
    }
}

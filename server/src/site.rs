//! The site that this server serves, one, and the plan that maps are drawn on.

use std::path::Path;

use anyhow::{Context, Result};
use lodestep_engine::geo::{dome, terrain};
use schemars::JsonSchema;
use serde::Serialize;

pub use lodestep_engine::geo::Site;

/// A point of the road every so many metres: a smooth line on any screen.
const ROAD_SPACING_M: f64 = 5.0;

/// The site of a file, or FAST without one.
pub(crate) fn read(file: Option<&Path>) -> Result<Site> {
    let Some(file) = file else { return Ok(Site::fast()) };
    let text = std::fs::read_to_string(file)
        .with_context(|| format!("could not read the site file {}", file.display()))?;
    Site::from_toml(&text).with_context(|| file.display().to_string())
}

/// What stands still on the site, east-north-up in metres from its origin: `GET /site/plan`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "SitePlan")]
pub struct Plan {
    /// The nodes of the reflector's cable net.
    pub nodes: Vec<Node>,
    /// Radius of the ring beam, m.
    pub ring_radius_m: f64,
    /// The inspection road's centre line, `[e_m, n_m]`.
    pub road: Vec<[f64; 2]>,
    /// Where the sectors begin.
    pub sectors: Vec<Sector>,
    /// The towers around the reflector.
    pub towers: Vec<Tower>,
}

/// A node of the cable net.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "PlanNode")]
pub struct Node {
    /// Such as `A17`.
    #[schemars(example = &"A17")]
    pub name: String,
    /// Its sector's letter.
    #[schemars(example = &'A')]
    pub sector: char,
    /// East, m.
    pub e_m: f64,
    /// North, m.
    pub n_m: f64,
    /// Up, m.
    pub u_m: f64,
}

/// A sector of the reflector; it reaches from its own axis to the next sector's.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "PlanSector")]
pub struct Sector {
    /// Its letter.
    #[schemars(example = &'A')]
    pub name: char,
    /// Azimuth of its axis, clockwise from true north, degrees in [0, 360).
    pub azimuth_deg: f64,
}

/// A tower.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "PlanTower")]
pub struct Tower {
    /// Its name.
    #[schemars(example = &"1H")]
    pub name: String,
    /// East, m.
    pub e_m: f64,
    /// North, m.
    pub n_m: f64,
}

impl Plan {
    /// The plan of a site. It holds still: to the millimetre is plenty, and a third of the bytes.
    pub fn of(site: &Site) -> Plan {
        let millimetres = |metres: f64| (metres * 1e3).round() / 1e3;
        let nodes = dome::nodes(site).into_iter().map(|node| {
            let [e_m, n_m, u_m] = node.position_n_m.map(millimetres);
            Node { name: node.name, sector: node.sector, e_m, n_m, u_m }
        });
        let sectors = dome::SECTOR_AXES_DEG.into_iter().map(|(name, axis_deg)| Sector {
            name,
            azimuth_deg: (axis_deg + site.azimuth_of_plan_deg).rem_euclid(360.0),
        });
        let towers = terrain::towers(site).into_iter().map(|tower| {
            let [e_m, n_m] = tower.position_n_m.map(millimetres);
            Tower { name: tower.name, e_m, n_m }
        });
        Plan {
            nodes: nodes.collect(),
            ring_radius_m: dome::RING_RADIUS_M,
            road: terrain::road(site, ROAD_SPACING_M)
                .into_iter()
                .map(|[e, n, _]| [millimetres(e), millimetres(n)])
                .collect(),
            sectors: sectors.collect(),
            towers: towers.collect(),
        }
    }
}

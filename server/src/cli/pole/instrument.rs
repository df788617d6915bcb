//! The pole's file: its site, and its lever arms.

use std::path::Path;

use anyhow::Result;
use lodestep_engine::geo::Site;
use lodestep_engine::systems::pole::recording::Instrument;
use serde::Deserialize;

use crate::cli::failure::Failure;
use crate::cli::log_file::read_small;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PoleFile {
    site: Option<toml::Table>,
    pole: Arms,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Arms {
    antenna_b_m: [f64; 3],
    tip_b_m: Option<[f64; 3]>,
}

/// The longest lever arm that is taken for one, m; what is wrong below that is for the survey's own checks to say.
const LONGEST_M: f64 = 100.0;

/// Reads a pole's file: the instrument, and the site where the file names one.
pub(super) fn read(path: &Path) -> Result<(Instrument, Option<Site>)> {
    let bytes = read_small(path)?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Failure::bad_input(
            path,
            "expected a pole as TOML in UTF-8, found other bytes; choose the pole's file",
        )
    })?;
    let file: PoleFile = toml::from_str(&text).map_err(|error| {
        Failure::bad_input(
            path,
            format!(
                "the pole's file does not read: {}. Tables: [site] with name, latitude_deg, longitude_deg, height_m; \
                 [pole] with antenna_b_m = [x, y, z] and, where there is a tip, tip_b_m = [x, y, z], in metres from the sensor in its axes",
                error.to_string().trim()
            ),
        )
    })?;
    let arms = [Some(file.pole.antenna_b_m), file.pole.tip_b_m];
    for arm in arms.into_iter().flatten().flatten() {
        if arm.is_nan() || arm.abs() > LONGEST_M {
            return Err(Failure::bad_input(
                path,
                format!("expected lever arms in metres, found {arm}; measure from the sensor, in its axes"),
            ));
        }
    }
    let site = file.site.map(|site| Site::from_toml(&site.to_string()));
    let site = site.transpose().map_err(|error| Failure::bad_input(path, error))?;
    let instrument =
        Instrument { antenna_b_m: file.pole.antenna_b_m.into(), tip_b_m: file.pole.tip_b_m.map(Into::into) };
    Ok((instrument, site))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_has_lever_arms_and_may_have_a_site_and_a_tip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pole.toml");
        let arms = "[pole]\nantenna_b_m = [0.01, -0.01, 1.0]\n";
        std::fs::write(&path, arms).unwrap();
        let (instrument, site) = read(&path).unwrap();
        assert!(instrument.tip_b_m.is_none() && site.is_none());
        let site = "[site]\nname = \"s\"\nlatitude_deg = 25.0\nlongitude_deg = 106.0\nheight_m = 455.0\n";
        std::fs::write(&path, format!("{site}{arms}tip_b_m = [0.0, 0.0, -1.0]\n")).unwrap();
        let (instrument, site) = read(&path).unwrap();
        assert!(instrument.tip_b_m.is_some() && site.unwrap().height_m == 455.0);
        for wrong in ["[pole]\n", "[pole]\nantenna_b_m = [1, 2]\n", "[pole]\nantenna_b_m = [0, 0, 1e9]\n"] {
            std::fs::write(&path, wrong).unwrap();
            assert!(read(&path).unwrap_err().to_string().contains("metres"), "{wrong}");
        }
    }
}

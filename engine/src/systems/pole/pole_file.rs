//! The pole's file: its lever arms, and its site where it names one.

use serde::Deserialize;

use super::recording::Instrument;
use crate::geo::Site;

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

/// A pole's file that is complete.
pub(super) const EXAMPLE: &str = "[site]
name = \"FAST\"
latitude_deg = 25.652944
longitude_deg = 106.856667
height_m = 1110.0

[pole]
antenna_b_m = [0.010, -0.012, 1.021]
tip_b_m = [0.008, -0.020, -0.987]
";

/// Reads a pole's file: the instrument, and the site where the file names one.
///
/// # Errors
///
/// In a sentence, where the text is no such file.
pub fn read(text: &str) -> Result<(Instrument, Option<Site>), String> {
    let file: PoleFile = toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let line = line.map_or_else(String::new, |line| format!(" in line {line}"));
        let what = error.message().lines().collect::<Vec<_>>().join(", ");
        format!(
            "expected a pole as TOML, with the tables [site] (name, latitude_deg, longitude_deg, height_m) and [pole] \
             (antenna_b_m = [x, y, z] and, where there is a tip, tip_b_m = [x, y, z], in metres from the sensor in its \
             axes), found{line}: {what}"
        )
    })?;
    let arms = [Some(file.pole.antenna_b_m), file.pole.tip_b_m];
    for arm in arms.into_iter().flatten().flatten() {
        if arm.is_nan() || arm.abs() > LONGEST_M {
            return Err(format!(
                "expected lever arms in metres, found {arm}: measure from the sensor, in its axes"
            ));
        }
    }
    if file.pole.tip_b_m == Some(file.pole.antenna_b_m) {
        return Err("expected the antenna and the tip at the two ends of the pole, found both at one place: measure both from the sensor".to_owned());
    }
    let site = file.site.map(|site| Site::from_toml(&site.to_string()));
    let site = site.transpose().map_err(|error| error.to_string())?;
    let instrument =
        Instrument { antenna_b_m: file.pole.antenna_b_m.into(), tip_b_m: file.pole.tip_b_m.map(Into::into) };
    Ok((instrument, site))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_has_lever_arms_and_may_have_a_site_and_a_tip() {
        let (instrument, site) = read("[pole]\nantenna_b_m = [0.01, -0.01, 1.0]\n").unwrap();
        assert!(instrument.tip_b_m.is_none() && site.is_none());
        let (instrument, site) = read(EXAMPLE).unwrap();
        assert!(instrument.tip_b_m.is_some() && site.unwrap().height_m == 1110.0);
        for wrong in [
            "[pole]\n",
            "[pole]\nantenna_b_m = [1, 2]\n",
            "[pole]\nantenna_b_m = [0, 0, 1e9]\n",
            "[pole]\nantenna_b_m = [0, 0, 1]\nantenna_m = 3\n",
        ] {
            let said = read(wrong).unwrap_err();
            assert!(said.contains("metres") && !said.contains('\n'), "{said}");
        }
        assert!(read("[pole]\nantenna_b_m = 1 2\n").unwrap_err().contains("in line 2"));
    }
}

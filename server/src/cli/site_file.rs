//! The site on the command line: its frame, its gravity, and its declination on the day of the walk.

use std::path::Path;

use anyhow::Result;
use lodestep_engine::geo::Site;
use time::OffsetDateTime;

use crate::cli::failure::Failure;
use crate::cli::log_file::read_small;

/// Reads a site's file. The declination is the file's own, or else the model's for the day of the
/// walk when that is known.
pub(super) fn read(path: &Path, started_at: Option<OffsetDateTime>) -> Result<Site> {
    let bytes = read_small(path)?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Failure::bad_input(
            path,
            "expected a site as TOML in UTF-8, found other bytes; choose the site's file",
        )
    })?;
    let mut site = Site::from_toml(&text).map_err(|error| Failure::bad_input(path, error))?;
    let surveyed = text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("declination_deg"));
    if let (Some(start), false) = (started_at, surveyed) {
        site.declination_deg = site.declination_in_deg(decimal_year(start));
    }
    Ok(site)
}

fn decimal_year(instant: OffsetDateTime) -> f64 {
    let days = f64::from(time::util::days_in_year(instant.year()));
    f64::from(instant.year()) + (f64::from(instant.ordinal()) - 0.5) / days
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_declination_is_that_of_the_day_unless_it_was_surveyed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("site.toml");
        let place =
            "name = \"FAST\"\nlatitude_deg = 25.652944\nlongitude_deg = 106.856667\nheight_m = 1110\n";
        std::fs::write(&path, place).unwrap();
        let day = |unix| Some(OffsetDateTime::from_unix_timestamp(unix).unwrap());
        let (at_2025, at_2029) = (day(1_736_000_000), day(1_862_000_000));
        let early = read(&path, at_2025).unwrap().declination_deg;
        let late = read(&path, at_2029).unwrap().declination_deg;
        assert!((early - late).abs() > 0.01 && (early + 2.45).abs() < 0.2, "{early} {late}");
        std::fs::write(&path, format!("{place}declination_deg = 5.0\n")).unwrap();
        assert_eq!(read(&path, at_2029).unwrap().declination_deg, 5.0);
    }
}

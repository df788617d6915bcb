//! A track as the file that its name asks for.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::system::Declaration;
use lodestep_engine::track::{Track, TrackPlace, csv, decimate, geojson, gpx, kml};

use crate::cli::failure::Failure;
use crate::cli::output_file;

/// Where a track goes, and how it is written there.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TrackOutput {
    /// CSV to standard output.
    Stdout,
    Csv(PathBuf),
    GeoJson(PathBuf),
    Gpx(PathBuf),
    Kml(PathBuf),
}

impl TrackOutput {
    /// By the name's ending; `-` is standard output.
    pub(super) fn by_name(name: &str) -> Result<TrackOutput, String> {
        if name == "-" {
            return Ok(TrackOutput::Stdout);
        }
        let path = PathBuf::from(name);
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match ending.as_str() {
            "csv" => Ok(TrackOutput::Csv(path)),
            "geojson" | "json" => Ok(TrackOutput::GeoJson(path)),
            "gpx" => Ok(TrackOutput::Gpx(path)),
            "kml" => Ok(TrackOutput::Kml(path)),
            _ => Err(format!(
                "expected a name that ends in .csv, .geojson, .gpx or .kml, or - for standard output, found {name:?}"
            )),
        }
    }

    /// Whether it needs the site's place on the Earth.
    pub(super) fn needs_site(&self) -> bool {
        matches!(self, TrackOutput::GeoJson(_) | TrackOutput::Gpx(_) | TrackOutput::Kml(_))
    }

    /// Writes the track, with a point each `1/rate_hz` s when a rate is given.
    pub(super) fn write(
        &self,
        system: &Declaration,
        track: &Track,
        rate_hz: Option<f64>,
        frame: Option<LocalFrame>,
        start_unix_ns: Option<i64>,
    ) -> Result<()> {
        let points = || decimate(&track.points, rate_hz.unwrap_or(1e9));
        let points = Again(&points);
        let place = |path: &Path| {
            let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            let frame =
                frame.ok_or_else(|| Failure::usage("this format needs the site: add --site SITE.toml"))?;
            anyhow::Ok(TrackPlace { name, frame, start_unix_ns })
        };
        match self {
            TrackOutput::Stdout => match csv::write(system, points, &mut io::stdout().lock()) {
                // The reader has had enough, as `head` does.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
                written => written.context("standard output cannot be written"),
            },
            TrackOutput::Csv(path) => output_file::write(path, |out| csv::write(system, points, out)),
            TrackOutput::GeoJson(path) => {
                let place = place(path)?;
                output_file::write(path, |out| geojson::write(points, &track.visits, &place, out))
            }
            TrackOutput::Gpx(path) => {
                let place = place(path)?;
                output_file::write(path, |out| gpx::write(points, &place, out))
            }
            TrackOutput::Kml(path) => {
                let place = place(path)?;
                output_file::write(path, |out| kml::write(points, &place, out))
            }
        }
    }
}

/// Points that can be gone through more than once.
struct Again<'a, F>(&'a F);

impl<F> Clone for Again<'_, F> {
    fn clone(&self) -> Self {
        Again(self.0)
    }
}

impl<F: Fn() -> I, I: Iterator> IntoIterator for Again<'_, F> {
    type Item = I::Item;
    type IntoIter = I;

    fn into_iter(self) -> I {
        (self.0)()
    }
}

/// Writes a text to a file, whole or not at all.
pub(super) fn write_text(path: &Path, text: &str) -> Result<()> {
    output_file::write(path, |out| out.write_all(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_says_how() {
        assert_eq!(TrackOutput::by_name("-").unwrap(), TrackOutput::Stdout);
        assert_eq!(TrackOutput::by_name("a/b.GPX").unwrap(), TrackOutput::Gpx("a/b.GPX".into()));
        assert!(TrackOutput::by_name("track.xlsx").unwrap_err().contains("found \"track.xlsx\""));
        assert!(TrackOutput::by_name("a.kml").unwrap().needs_site());
        assert!(!TrackOutput::by_name("a.csv").unwrap().needs_site());
    }
}

//! The points of a survey as CSV: one row a name, with the columns that surveyors know behind.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use lodestep_engine::geo::LocalFrame;
use lodestep_engine::systems::pole::points::Point;

use super::files::StopWithCode;
use crate::cli::output_file;
use crate::cli::track_output::write_text;
use crate::markers::{FilePoint, Form, cell, write_points};

const HEADER: &str = "name,lat_deg,lon_deg,height_m,e_m,n_m,u_m,sigma_e_m,sigma_n_m,sigma_u_m,\
    Code,Description,Lateral RMS,Solution status,Averaging start,Averaging end,visits,since_fix_s,tilt_deg,\
    visits_apart_m\n";

/// Writes the points, in the form that the file's name ends with.
pub(super) fn write(path: &Path, points: &[Point], stops: &[StopWithCode], frame: &LocalFrame) -> Result<()> {
    let form = Form::of_extension(path.extension().and_then(|ending| ending.to_str()).unwrap_or_default());
    if form != Form::Csv {
        let points: Vec<FilePoint> = points.iter().map(|point| file_point(point, stops, frame)).collect();
        return write_text(path, &write_points(form, &points));
    }
    output_file::write(path, |out| {
        out.write_all(HEADER.as_bytes())?;
        for point in points {
            out.write_all(row(point, stops, frame).as_bytes())?;
        }
        Ok(())
    })
}

fn row(point: &Point, stops: &[StopWithCode], frame: &LocalFrame) -> String {
    let [e, n, u]: [f64; 3] = point.p_n_m.into();
    let place = frame.to_geodetic([e, n, u]);
    let sigma = |axis: usize| point.covariance_n_m2[(axis, axis)].max(0.0).sqrt();
    let first = stops.iter().find(|stop| stop.stop.name == point.name);
    let (code, description) = first.map_or(("", ""), |stop| (&stop.code, &stop.description));
    let status = match (point.stood, point.since_fix_s > 0.0) {
        (false, _) => "not standing",
        (true, true) => "inertial",
        (true, false) => "GNSS",
    };
    let [start_ns, _] = point.visits[0];
    let [_, end_ns] = point.visits[point.visits.len() - 1];
    let mut line = cell(&point.name);
    // A string takes whatever is written to it.
    let _ = writeln!(
        line,
        ",{:.10},{:.10},{:.4},{e:.4},{n:.4},{u:.4},{:.4},{:.4},{:.4},{},{},{:.4},{status},{:.3},{:.3},{},{:.1},{:.1},{:.4}",
        place.latitude_deg,
        place.longitude_deg,
        place.height_m,
        sigma(0),
        sigma(1),
        sigma(2),
        cell(code),
        cell(description),
        sigma(0).hypot(sigma(1)),
        start_ns as f64 * 1e-9,
        end_ns as f64 * 1e-9,
        point.visits.len(),
        point.since_fix_s,
        point.tilt_rad.to_degrees(),
        point.apart_m,
    );
    line
}

fn file_point(point: &Point, stops: &[StopWithCode], frame: &LocalFrame) -> FilePoint {
    let place = frame.to_geodetic(point.p_n_m.into());
    let code = stops.iter().find(|stop| stop.stop.name == point.name).map(|stop| stop.code.clone());
    FilePoint {
        name: point.name.clone(),
        code: code.unwrap_or_default(),
        wgs84: [place.latitude_deg, place.longitude_deg, place.height_m],
        place_m: point.p_n_m.into(),
        sigma_m: [0, 1, 2].map(|axis| point.covariance_n_m2[(axis, axis)].max(0.0).sqrt()),
    }
}

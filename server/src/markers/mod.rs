//! The marker table: changed one by one, or by a file that is compared, applied and taken back; with the
//! history of every marker, and what the walks say about its survey.

mod checks;
mod defect;
mod difference;
mod edit;
mod finding;
mod frame_fit;
mod grid;
mod import;
mod imports;
mod mapping;
mod plan;
mod residuals;
mod rows;
mod seed;
mod staged;
mod survey;
mod survey_file;
mod write;

pub(crate) use edit::{NewMarker, Seen, add, checked_name, put, remove};
pub(crate) use import::{Imported, import, places_of_file};
pub(crate) use imports::{
    Apply, ImportView, ReadOptions, Revert, apply, create, give_up, read_again, revert, view,
};
pub(crate) use residuals::{Residuals, residuals};
pub use seed::seed;
pub(crate) use survey::{SurveyedPoint, import_of_survey, surveyed_points};
pub(crate) use survey_file::{FilePoint, Form, cell, write_points};

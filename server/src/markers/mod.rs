//! The marker table: changed one by one, or by a file that is taken whole or not at all.

mod edit;
mod import;
mod seed;

pub(crate) use edit::{NewMarker, add, put, remove};
pub(crate) use import::{Imported, import};
pub use seed::seed;

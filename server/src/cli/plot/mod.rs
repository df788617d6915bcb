//! Small plots, to a file or to the terminal: one chart, two ways to draw it.

mod axis;
mod chart;
mod svg;
mod terminal;

pub(super) use axis::Axis;
pub(super) use chart::{Chart, Mark, Series};
pub(super) use svg::svg;
pub(super) use terminal::terminal;

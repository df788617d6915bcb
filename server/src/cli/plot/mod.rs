//! Small plots, to a file or to the terminal: one chart, two ways to draw it; and ways in plan, as panels.

mod axis;
mod chart;
mod panels;
mod svg;
mod terminal;

pub(super) use axis::Axis;
pub(super) use chart::{Chart, Mark, Series};
pub(super) use panels::{Panel, Way, panels};
pub(super) use svg::svg;
pub(super) use terminal::terminal;

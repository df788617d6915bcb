//! What the charts of a session are drawn from.
//!
//! Every line of a chart is the smallest and largest value in each cell of a grid in time ([`cells`]). While
//! a session is processed a [`recorder`] looks on: at every sample, at what the filter says of its aids and,
//! twice a second, at what it believes of its sensors. The track itself is cut into cells by [`of_points()`].
//! All that is stored; [`answer`] merges cells to as many as a page has room for, and where it wants to see
//! more than a cell tells, goes to the samples themselves ([`of_samples`]).

pub(crate) mod answer;
mod cells;
mod limits;
mod of_points;
mod of_samples;
mod recorder;

pub(crate) use of_points::of_points;
pub(crate) use recorder::Recorder;

use crate::store::StoreError;
use crate::store::charts::{Packed, Series};

/// Packs series for the store.
pub(crate) fn pack(series: &[Series]) -> Result<Vec<Packed>, StoreError> {
    series.iter().map(Packed::new).collect()
}

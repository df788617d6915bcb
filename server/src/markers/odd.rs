//! What can be odd about a file of markers: each kind with its code, its figures and its sentence.

use lodestep_engine::figures::{Figures, figures};

/// What the places of a file were held against, and how many of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Against {
    /// Markers of the table with the same names.
    Table(usize),
    /// Nodes of the site's plan with the same names.
    Plan(usize),
}

impl Against {
    fn whose(self) -> &'static str {
        match self {
            Against::Table(_) => "the table's",
            Against::Plan(_) => "the plan's",
        }
    }

    fn and(self, mut others: Figures) -> Figures {
        let (name, places) = match self {
            Against::Table(places) => ("compared_markers", places),
            Against::Plan(places) => ("compared_nodes", places),
        };
        others.insert(name.to_owned(), (places as f64).into());
        others
    }
}

/// One thing that is odd.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Odd {
    /// A file without rows.
    NoRows,
    /// A name that no marker can have.
    WrongName { found: String, longest_letters: usize, sentence: String },
    /// A name that an earlier line has.
    RepeatedName { first_line: u64 },
    /// A cell that should be a number.
    NotANumber { column: String, found: String },
    /// A number that no coordinate can be.
    ValueOutOfRange { column: String, found: String, most: f64 },
    /// A place far from the site.
    PlaceOutOfRange { e_m: f64, n_m: f64, farthest_m: f64 },
    /// Latitudes in the column of longitudes.
    SwappedLatLon { latitude_deg: f64, longitude_deg: f64 },
    /// Metres where degrees should be.
    LooksLocal,
    /// Degrees where metres should be.
    LooksGeographic,
    /// Degrees of another place.
    OtherSite { latitude_deg: f64, longitude_deg: f64 },
    /// Metres of another grid.
    OtherGrid { farthest_m: f64 },
    /// Coordinates of a national grid, which are read by it where it puts them at the site.
    NationalGrid { grid: String, central_meridian_deg: f64, distance_m: f64 },
    /// X and Y in a table of Chinese surveyors: X is taken to go north.
    AxesByCustom,
    /// Heights above the sea where those above the ellipsoid are needed.
    HeightsAboveTheSea { column: String },
    /// Heights above the sea or the ellipsoid where those above the site's origin are needed.
    AbsoluteHeights { typical_m: f64, origin_m: f64 },
    /// Angles written as one number that is no decimal of degrees, read as what they are.
    PackedAngles { found: String, degrees: f64 },
    /// A line that is no marker: a title, a sum, who made the table.
    NoMarker { found: String },
    /// A name with letters that cannot be seen, or in another form of its letters.
    CleanedName { letters: usize, kept_letters: usize },
    /// Columns whose names say nothing.
    ColumnsUnknown,
    /// A row whose east and north are changed over.
    SwappedRow { largest_move_m: f64, moved_m: f64, swapped_m: f64 },
    /// A marker that moves far.
    FarMove { largest_move_m: f64, moved_m: f64 },
    /// A new name that reads like one there is.
    SimilarName { like: String },
    /// A name that the site's plan does not have.
    NotInPlan,
    /// A place beyond the reflector's ring.
    OffSite { distance_m: f64, ring_radius_m: f64 },
    /// A marker too near to another.
    TooClose { least_apart_m: f64, other: String, distance_m: f64 },
    /// A height that is not the ground's around it.
    OffTerrain { ground_m: f64, height_m: f64 },
    /// All places with east and north changed over.
    SwappedAxes { against: Against },
    /// All places mirrored.
    Mirrored { against: Against, turn_deg: f64 },
    /// All places on another scale.
    OtherUnit { against: Against, scale: f64 },
    /// All places turned.
    Turned { against: Against, turn_deg: f64 },
    /// All places shifted.
    Shifted { against: Against, east_m: f64, north_m: f64 },
    /// All heights shifted.
    ShiftedHeights { off_by_m: f64 },
    /// Markers that a whole table leaves out.
    Removes { missing: u64 },
}

impl Odd {
    /// One word for programs and for the page's own words.
    pub(super) fn code(&self) -> &'static str {
        match self {
            Odd::NoRows => "no_rows",
            Odd::WrongName { .. } => "wrong_name",
            Odd::RepeatedName { .. } => "repeated_name",
            Odd::NotANumber { .. } => "not_a_number",
            Odd::ValueOutOfRange { .. } | Odd::PlaceOutOfRange { .. } => "out_of_range",
            Odd::SwappedLatLon { .. } => "swapped_lat_lon",
            Odd::LooksLocal => "looks_local",
            Odd::LooksGeographic => "looks_geographic",
            Odd::OtherSite { .. } | Odd::OtherGrid { .. } => "wrong_frame",
            Odd::NationalGrid { .. } => "national_grid",
            Odd::AxesByCustom => "axes_by_custom",
            Odd::HeightsAboveTheSea { .. } => "heights_above_the_sea",
            Odd::AbsoluteHeights { .. } => "absolute_heights",
            Odd::PackedAngles { .. } => "packed_angles",
            Odd::NoMarker { .. } => "no_marker",
            Odd::CleanedName { .. } => "cleaned_name",
            Odd::ColumnsUnknown => "columns_unknown",
            Odd::SwappedRow { .. } => "swapped_row",
            Odd::FarMove { .. } => "far_move",
            Odd::SimilarName { .. } => "similar_name",
            Odd::NotInPlan => "not_in_plan",
            Odd::OffSite { .. } => "off_site",
            Odd::TooClose { .. } => "too_close",
            Odd::OffTerrain { .. } => "off_terrain",
            Odd::SwappedAxes { .. } => "swapped_axes",
            Odd::Mirrored { .. } => "mirrored",
            Odd::OtherUnit { .. } => "other_unit",
            Odd::Turned { .. } => "turned",
            Odd::Shifted { .. } => "shifted",
            Odd::ShiftedHeights { .. } => "shifted_heights",
            Odd::Removes { .. } => "removes",
        }
    }

    /// Its figures and the names in its sentence.
    pub(super) fn figures(&self) -> Figures {
        match self {
            Odd::NoRows
            | Odd::LooksLocal
            | Odd::LooksGeographic
            | Odd::AxesByCustom
            | Odd::ColumnsUnknown
            | Odd::NotInPlan => Figures::new(),
            Odd::NationalGrid { grid, central_meridian_deg, distance_m } => figures([
                ("grid", grid.as_str().into()),
                ("central_meridian_deg", (*central_meridian_deg).into()),
                ("distance_m", (*distance_m).into()),
            ]),
            Odd::HeightsAboveTheSea { column } => figures([("column", column.as_str().into())]),
            Odd::AbsoluteHeights { typical_m, origin_m } => {
                figures([("typical_m", (*typical_m).into()), ("origin_m", (*origin_m).into())])
            }
            Odd::PackedAngles { found, degrees } => {
                figures([("found", found.as_str().into()), ("degrees", (*degrees).into())])
            }
            Odd::NoMarker { found } => figures([("found", found.as_str().into())]),
            Odd::CleanedName { letters, kept_letters } => figures([
                ("letters", (*letters as f64).into()),
                ("kept_letters", (*kept_letters as f64).into()),
            ]),
            Odd::WrongName { found, longest_letters, .. } => figures([
                ("found", found.as_str().into()),
                ("longest_letters", (*longest_letters as f64).into()),
            ]),
            Odd::RepeatedName { first_line } => figures([("first_line", (*first_line as f64).into())]),
            Odd::NotANumber { column, found } => {
                figures([("column", column.as_str().into()), ("found", found.as_str().into())])
            }
            Odd::ValueOutOfRange { column, found, most } => figures([
                ("column", column.as_str().into()),
                ("found", found.as_str().into()),
                ("most", (*most).into()),
            ]),
            Odd::PlaceOutOfRange { e_m, n_m, farthest_m } => figures([
                ("east_m", (*e_m).into()),
                ("north_m", (*n_m).into()),
                ("farthest_m", (*farthest_m).into()),
            ]),
            Odd::SwappedLatLon { latitude_deg, longitude_deg }
            | Odd::OtherSite { latitude_deg, longitude_deg } => figures([
                ("latitude_deg", (*latitude_deg).into()),
                ("longitude_deg", (*longitude_deg).into()),
            ]),
            Odd::OtherGrid { farthest_m } => figures([("farthest_m", (*farthest_m).into())]),
            Odd::SwappedRow { largest_move_m, moved_m, swapped_m } => figures([
                ("largest_move_m", (*largest_move_m).into()),
                ("moved_m", (*moved_m).into()),
                ("swapped_m", (*swapped_m).into()),
            ]),
            Odd::FarMove { largest_move_m, moved_m } => {
                figures([("largest_move_m", (*largest_move_m).into()), ("moved_m", (*moved_m).into())])
            }
            Odd::SimilarName { like } => figures([("like", like.as_str().into())]),
            Odd::OffSite { distance_m, ring_radius_m } => {
                figures([("distance_m", (*distance_m).into()), ("ring_radius_m", (*ring_radius_m).into())])
            }
            Odd::TooClose { least_apart_m, other, distance_m } => figures([
                ("least_apart_m", (*least_apart_m).into()),
                ("other", other.as_str().into()),
                ("distance_m", (*distance_m).into()),
            ]),
            Odd::OffTerrain { ground_m, height_m } => {
                figures([("ground_m", (*ground_m).into()), ("height_m", (*height_m).into())])
            }
            Odd::SwappedAxes { against } => against.and(Figures::new()),
            Odd::Mirrored { against, turn_deg } | Odd::Turned { against, turn_deg } => {
                against.and(figures([("turn_deg", (*turn_deg).into())]))
            }
            Odd::OtherUnit { against, scale } => against.and(figures([("scale", (*scale).into())])),
            Odd::Shifted { against, east_m, north_m } => {
                against.and(figures([("east_m", (*east_m).into()), ("north_m", (*north_m).into())]))
            }
            Odd::ShiftedHeights { off_by_m } => figures([("off_by_m", (*off_by_m).into())]),
            Odd::Removes { missing } => figures([("missing", (*missing as f64).into())]),
        }
    }

    /// Expected, found, what to do.
    pub(super) fn sentence(&self) -> String {
        match self {
            Odd::NoRows => {
                "expected a row for each marker, found none: check that this is the file you meant".to_owned()
            }
            Odd::WrongName { sentence, .. } => sentence.clone(),
            Odd::RepeatedName { first_line } => format!(
                "expected every marker once, found it in line {first_line} already: remove one of the two"
            ),
            Odd::NotANumber { column, found } => format!(
                "expected a number with a point before its decimals in column {column:?}, found {found:?}: correct it, or choose another column"
            ),
            Odd::ValueOutOfRange { column, found, most } => format!(
                "expected a value from −{most} to {most} in column {column:?}, found {found:?}: correct it, or choose another column"
            ),
            Odd::PlaceOutOfRange { e_m, n_m, farthest_m } => format!(
                "expected a place within {farthest_m} m of the site's origin, found {e_m:.0} m east and {n_m:.0} m north of it: check frame and columns"
            ),
            Odd::SwappedLatLon { latitude_deg, longitude_deg } => format!(
                "expected latitudes near {latitude_deg:.2}° and longitudes near {longitude_deg:.2}°, found the one in the other's column: change the two columns over"
            ),
            Odd::LooksLocal => {
                "expected degrees, found values that can only be metres: choose the site's frame".to_owned()
            }
            Odd::LooksGeographic => {
                "expected metres from the site's origin, found degrees of latitude and longitude: choose the geographic frame".to_owned()
            }
            Odd::OtherSite { latitude_deg, longitude_deg } => format!(
                "expected places near {latitude_deg:.2}° N {longitude_deg:.2}° E, found others: check that this is the file of this site and that the degrees are decimal and on WGS84"
            ),
            Odd::OtherGrid { farthest_m } => format!(
                "expected metres from the site's origin, found coordinates farther than {farthest_m} m, such as those of a projected national grid: give them in the site's frame or as latitude and longitude"
            ),
            Odd::NationalGrid { grid, central_meridian_deg, distance_m } => format!(
                "expected metres from the site's origin, found coordinates of a national grid, {grid} with central meridian {central_meridian_deg}°, which puts them {distance_m:.0} m from the site: check that this is the grid; they are read by it where that is near enough"
            ),
            Odd::AxesByCustom => {
                "expected to be told which axis goes north, found X and Y alone: read with X to the north, as surveyors in China have it; change the two columns over where it is not so".to_owned()
            }
            Odd::HeightsAboveTheSea { column } => format!(
                "expected heights above the ellipsoid, found column {column:?}, which says that they are above the sea: the two differ by tens of metres; take a column of ellipsoidal heights, or leave the heights out"
            ),
            Odd::AbsoluteHeights { typical_m, origin_m } => format!(
                "expected heights above the site's origin, found some about {typical_m:.0} m, near the {origin_m:.0} m of the origin itself: subtract the origin's height in the same datum, or leave the heights out"
            ),
            Odd::PackedAngles { found, degrees } => format!(
                "expected degrees with decimals, found angles such as {found:?}, which puts nothing at the site; read as degrees, minutes and seconds, {degrees:.6}°: check one of them"
            ),
            Odd::NoMarker { found } => format!(
                "expected a name and its place, found {found:?} alone in the line: it was left out"
            ),
            Odd::CleanedName { letters, kept_letters } => format!(
                "expected a name of letters that can be seen, found one of {letters} of which {kept_letters} are kept: check that it still says what it should"
            ),
            Odd::ColumnsUnknown => {
                "expected columns for name, east and north or for name, latitude and longitude, found none by these names: say which is which".to_owned()
            }
            Odd::SwappedRow { largest_move_m, moved_m, swapped_m } => format!(
                "expected a move of at most {largest_move_m} m, found {moved_m:.1} m, and {swapped_m:.1} m with east and north changed over: correct the row"
            ),
            Odd::FarMove { largest_move_m, moved_m } => format!(
                "expected a move of at most {largest_move_m} m, found {moved_m:.1} m: check the survey"
            ),
            Odd::SimilarName { like } => format!(
                "expected a new name, found one that reads like {like:?}: is it the same marker?"
            ),
            Odd::NotInPlan => {
                "expected the name of a node, as most of the file has, found another: check the name".to_owned()
            }
            Odd::OffSite { distance_m, ring_radius_m } => format!(
                "expected a place beneath the reflector, found one {distance_m:.0} m from its middle, beyond its ring of {ring_radius_m:.0} m: check frame and columns"
            ),
            Odd::TooClose { least_apart_m, other, distance_m } => format!(
                "expected markers at least {least_apart_m} m apart, found {other:?} at {distance_m:.2} m: is it the same marker?"
            ),
            Odd::OffTerrain { ground_m, height_m } => format!(
                "expected a height near the {ground_m:.1} m that the markers around it say, found {height_m:.1} m: check the height and its datum"
            ),
            Odd::SwappedAxes { against } => format!(
                "expected {} places, found them with east and north changed over: change the two columns over",
                against.whose()
            ),
            Odd::Mirrored { against, turn_deg } => format!(
                "expected {} places, found them mirrored and turned by {turn_deg:.1}°: check the signs and the order of the axes",
                against.whose()
            ),
            Odd::OtherUnit { against, scale } => format!(
                "expected {} places, found them on another scale, {scale:.4} of a metre for one: check the unit",
                against.whose()
            ),
            Odd::Turned { against, turn_deg } => format!(
                "expected {} places, found them turned by {turn_deg:.2}°: check which north the file has",
                against.whose()
            ),
            Odd::Shifted { against, east_m, north_m } => format!(
                "expected {} places, found them all shifted by {east_m:.2} m east and {north_m:.2} m north: check origin and datum",
                against.whose()
            ),
            Odd::ShiftedHeights { off_by_m } => format!(
                "expected the table's heights, found them all off by {off_by_m:.2} m: check the heights' datum and the site's origin"
            ),
            Odd::Removes { missing } => format!(
                "expected every marker in a file that is the whole table, found {missing} missing: they will be removed"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page_words::assert_words;

    /// One of each. Which comes after which is asked of every kind, so that the compiler asks for a new one.
    fn one_of_each() -> impl Iterator<Item = Odd> {
        let text = || "text".to_owned();
        let next = move |odd: &Odd| {
            Some(match odd {
                Odd::NoRows => Odd::WrongName { found: text(), longest_letters: 40, sentence: text() },
                Odd::WrongName { .. } => Odd::RepeatedName { first_line: 2 },
                Odd::RepeatedName { .. } => Odd::NotANumber { column: text(), found: text() },
                Odd::NotANumber { .. } => Odd::ValueOutOfRange { column: text(), found: text(), most: 90.0 },
                Odd::ValueOutOfRange { .. } => Odd::PlaceOutOfRange { e_m: 1e6, n_m: 2.0, farthest_m: 1e5 },
                Odd::PlaceOutOfRange { .. } => {
                    Odd::SwappedLatLon { latitude_deg: 25.0, longitude_deg: 106.0 }
                }
                Odd::SwappedLatLon { .. } => Odd::LooksLocal,
                Odd::LooksLocal => Odd::LooksGeographic,
                Odd::LooksGeographic => Odd::OtherSite { latitude_deg: 25.0, longitude_deg: 106.0 },
                Odd::OtherSite { .. } => Odd::OtherGrid { farthest_m: 1e5 },
                Odd::OtherGrid { .. } => {
                    Odd::NationalGrid { grid: text(), central_meridian_deg: 108.0, distance_m: 12.0 }
                }
                Odd::NationalGrid { .. } => Odd::AxesByCustom,
                Odd::AxesByCustom => Odd::HeightsAboveTheSea { column: text() },
                Odd::HeightsAboveTheSea { .. } => {
                    Odd::AbsoluteHeights { typical_m: 1112.0, origin_m: 1110.0 }
                }
                Odd::AbsoluteHeights { .. } => Odd::PackedAngles { found: text(), degrees: 25.653_247 },
                Odd::PackedAngles { .. } => Odd::NoMarker { found: text() },
                Odd::NoMarker { .. } => Odd::CleanedName { letters: 4, kept_letters: 3 },
                Odd::CleanedName { .. } => Odd::ColumnsUnknown,
                Odd::ColumnsUnknown => Odd::SwappedRow { largest_move_m: 1.0, moved_m: 90.0, swapped_m: 0.1 },
                Odd::SwappedRow { .. } => Odd::FarMove { largest_move_m: 1.0, moved_m: 1.5 },
                Odd::FarMove { .. } => Odd::SimilarName { like: text() },
                Odd::SimilarName { .. } => Odd::NotInPlan,
                Odd::NotInPlan => Odd::OffSite { distance_m: 400.0, ring_radius_m: 250.0 },
                Odd::OffSite { .. } => Odd::TooClose { least_apart_m: 1.0, other: text(), distance_m: 0.2 },
                Odd::TooClose { .. } => Odd::OffTerrain { ground_m: 3.0, height_m: 12.0 },
                Odd::OffTerrain { .. } => Odd::SwappedAxes { against: Against::Table(9) },
                Odd::SwappedAxes { against: Against::Table(_) } => {
                    Odd::SwappedAxes { against: Against::Plan(9) }
                }
                Odd::SwappedAxes { against: Against::Plan(_) } => {
                    Odd::Mirrored { against: Against::Table(9), turn_deg: 30.0 }
                }
                Odd::Mirrored { against: Against::Table(_), .. } => {
                    Odd::Mirrored { against: Against::Plan(9), turn_deg: 30.0 }
                }
                Odd::Mirrored { against: Against::Plan(_), .. } => {
                    Odd::OtherUnit { against: Against::Table(9), scale: 0.001 }
                }
                Odd::OtherUnit { against: Against::Table(_), .. } => {
                    Odd::OtherUnit { against: Against::Plan(9), scale: 0.001 }
                }
                Odd::OtherUnit { against: Against::Plan(_), .. } => {
                    Odd::Turned { against: Against::Table(9), turn_deg: 2.0 }
                }
                Odd::Turned { against: Against::Table(_), .. } => {
                    Odd::Turned { against: Against::Plan(9), turn_deg: 2.0 }
                }
                Odd::Turned { against: Against::Plan(_), .. } => {
                    Odd::Shifted { against: Against::Table(9), east_m: 470.0, north_m: -230.0 }
                }
                Odd::Shifted { against: Against::Table(_), .. } => {
                    Odd::Shifted { against: Against::Plan(9), east_m: 470.0, north_m: -230.0 }
                }
                Odd::Shifted { against: Against::Plan(_), .. } => Odd::ShiftedHeights { off_by_m: 30.0 },
                Odd::ShiftedHeights { .. } => Odd::Removes { missing: 12 },
                Odd::Removes { .. } => return None,
            })
        };
        std::iter::successors(Some(Odd::NoRows), next)
    }

    #[test]
    fn the_page_has_words_for_each_in_both_languages() {
        for odd in one_of_each() {
            assert_words("", "markers.told", odd.code(), &odd.figures());
            for general in ["markers.finding", "markers.todo"] {
                assert_words("", general, odd.code(), &Figures::new());
            }
        }
    }
}

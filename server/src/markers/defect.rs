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
pub(super) enum Defect {
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

impl Defect {
    /// One word for programs and for the page's own words.
    pub(super) fn code(&self) -> &'static str {
        match self {
            Defect::NoRows => "no_rows",
            Defect::WrongName { .. } => "wrong_name",
            Defect::RepeatedName { .. } => "repeated_name",
            Defect::NotANumber { .. } => "not_a_number",
            Defect::ValueOutOfRange { .. } | Defect::PlaceOutOfRange { .. } => "out_of_range",
            Defect::SwappedLatLon { .. } => "swapped_lat_lon",
            Defect::LooksLocal => "looks_local",
            Defect::LooksGeographic => "looks_geographic",
            Defect::OtherSite { .. } | Defect::OtherGrid { .. } => "wrong_frame",
            Defect::NationalGrid { .. } => "national_grid",
            Defect::AxesByCustom => "axes_by_custom",
            Defect::HeightsAboveTheSea { .. } => "heights_above_the_sea",
            Defect::AbsoluteHeights { .. } => "absolute_heights",
            Defect::PackedAngles { .. } => "packed_angles",
            Defect::NoMarker { .. } => "no_marker",
            Defect::CleanedName { .. } => "cleaned_name",
            Defect::ColumnsUnknown => "columns_unknown",
            Defect::SwappedRow { .. } => "swapped_row",
            Defect::FarMove { .. } => "far_move",
            Defect::SimilarName { .. } => "similar_name",
            Defect::NotInPlan => "not_in_plan",
            Defect::OffSite { .. } => "off_site",
            Defect::TooClose { .. } => "too_close",
            Defect::OffTerrain { .. } => "off_terrain",
            Defect::SwappedAxes { .. } => "swapped_axes",
            Defect::Mirrored { .. } => "mirrored",
            Defect::OtherUnit { .. } => "other_unit",
            Defect::Turned { .. } => "turned",
            Defect::Shifted { .. } => "shifted",
            Defect::ShiftedHeights { .. } => "shifted_heights",
            Defect::Removes { .. } => "removes",
        }
    }

    /// Its figures and the names in its sentence.
    pub(super) fn figures(&self) -> Figures {
        match self {
            Defect::NoRows
            | Defect::LooksLocal
            | Defect::LooksGeographic
            | Defect::AxesByCustom
            | Defect::ColumnsUnknown
            | Defect::NotInPlan => Figures::new(),
            Defect::NationalGrid { grid, central_meridian_deg, distance_m } => figures([
                ("grid", grid.as_str().into()),
                ("central_meridian_deg", (*central_meridian_deg).into()),
                ("distance_m", (*distance_m).into()),
            ]),
            Defect::HeightsAboveTheSea { column } => figures([("column", column.as_str().into())]),
            Defect::AbsoluteHeights { typical_m, origin_m } => {
                figures([("typical_m", (*typical_m).into()), ("origin_m", (*origin_m).into())])
            }
            Defect::PackedAngles { found, degrees } => {
                figures([("found", found.as_str().into()), ("degrees", (*degrees).into())])
            }
            Defect::NoMarker { found } => figures([("found", found.as_str().into())]),
            Defect::CleanedName { letters, kept_letters } => figures([
                ("letters", (*letters as f64).into()),
                ("kept_letters", (*kept_letters as f64).into()),
            ]),
            Defect::WrongName { found, longest_letters, .. } => figures([
                ("found", found.as_str().into()),
                ("longest_letters", (*longest_letters as f64).into()),
            ]),
            Defect::RepeatedName { first_line } => figures([("first_line", (*first_line as f64).into())]),
            Defect::NotANumber { column, found } => {
                figures([("column", column.as_str().into()), ("found", found.as_str().into())])
            }
            Defect::ValueOutOfRange { column, found, most } => figures([
                ("column", column.as_str().into()),
                ("found", found.as_str().into()),
                ("most", (*most).into()),
            ]),
            Defect::PlaceOutOfRange { e_m, n_m, farthest_m } => figures([
                ("east_m", (*e_m).into()),
                ("north_m", (*n_m).into()),
                ("farthest_m", (*farthest_m).into()),
            ]),
            Defect::SwappedLatLon { latitude_deg, longitude_deg }
            | Defect::OtherSite { latitude_deg, longitude_deg } => figures([
                ("latitude_deg", (*latitude_deg).into()),
                ("longitude_deg", (*longitude_deg).into()),
            ]),
            Defect::OtherGrid { farthest_m } => figures([("farthest_m", (*farthest_m).into())]),
            Defect::SwappedRow { largest_move_m, moved_m, swapped_m } => figures([
                ("largest_move_m", (*largest_move_m).into()),
                ("moved_m", (*moved_m).into()),
                ("swapped_m", (*swapped_m).into()),
            ]),
            Defect::FarMove { largest_move_m, moved_m } => {
                figures([("largest_move_m", (*largest_move_m).into()), ("moved_m", (*moved_m).into())])
            }
            Defect::SimilarName { like } => figures([("like", like.as_str().into())]),
            Defect::OffSite { distance_m, ring_radius_m } => {
                figures([("distance_m", (*distance_m).into()), ("ring_radius_m", (*ring_radius_m).into())])
            }
            Defect::TooClose { least_apart_m, other, distance_m } => figures([
                ("least_apart_m", (*least_apart_m).into()),
                ("other", other.as_str().into()),
                ("distance_m", (*distance_m).into()),
            ]),
            Defect::OffTerrain { ground_m, height_m } => {
                figures([("ground_m", (*ground_m).into()), ("height_m", (*height_m).into())])
            }
            Defect::SwappedAxes { against } => against.and(Figures::new()),
            Defect::Mirrored { against, turn_deg } | Defect::Turned { against, turn_deg } => {
                against.and(figures([("turn_deg", (*turn_deg).into())]))
            }
            Defect::OtherUnit { against, scale } => against.and(figures([("scale", (*scale).into())])),
            Defect::Shifted { against, east_m, north_m } => {
                against.and(figures([("east_m", (*east_m).into()), ("north_m", (*north_m).into())]))
            }
            Defect::ShiftedHeights { off_by_m } => figures([("off_by_m", (*off_by_m).into())]),
            Defect::Removes { missing } => figures([("missing", (*missing as f64).into())]),
        }
    }

    /// Expected, found, what to do.
    pub(super) fn sentence(&self) -> String {
        match self {
            Defect::NoRows => {
                "expected a row for each marker, found none: check that this is the file you meant".to_owned()
            }
            Defect::WrongName { sentence, .. } => sentence.clone(),
            Defect::RepeatedName { first_line } => format!(
                "expected every marker once, found it in line {first_line} already: remove one of the two"
            ),
            Defect::NotANumber { column, found } => format!(
                "expected a number with a point before its decimals in column {column:?}, found {found:?}: correct it, or choose another column"
            ),
            Defect::ValueOutOfRange { column, found, most } => format!(
                "expected a value from −{most} to {most} in column {column:?}, found {found:?}: correct it, or choose another column"
            ),
            Defect::PlaceOutOfRange { e_m, n_m, farthest_m } => format!(
                "expected a place within {farthest_m} m of the site's origin, found {e_m:.0} m east and {n_m:.0} m north of it: check frame and columns"
            ),
            Defect::SwappedLatLon { latitude_deg, longitude_deg } => format!(
                "expected latitudes near {latitude_deg:.2}° and longitudes near {longitude_deg:.2}°, found the one in the other's column: change the two columns over"
            ),
            Defect::LooksLocal => {
                "expected degrees, found values that can only be metres: choose the site's frame".to_owned()
            }
            Defect::LooksGeographic => {
                "expected metres from the site's origin, found degrees of latitude and longitude: choose the geographic frame".to_owned()
            }
            Defect::OtherSite { latitude_deg, longitude_deg } => format!(
                "expected places near {latitude_deg:.2}° N {longitude_deg:.2}° E, found others: check that this is the file of this site and that the degrees are decimal and on WGS84"
            ),
            Defect::OtherGrid { farthest_m } => format!(
                "expected metres from the site's origin, found coordinates farther than {farthest_m} m, such as those of a projected national grid: give them in the site's frame or as latitude and longitude"
            ),
            Defect::NationalGrid { grid, central_meridian_deg, distance_m } => format!(
                "expected metres from the site's origin, found coordinates of a national grid, {grid} with central meridian {central_meridian_deg}°, which puts them {distance_m:.0} m from the site: check that this is the grid; they are read by it where that is near enough"
            ),
            Defect::AxesByCustom => {
                "expected to be told which axis goes north, found X and Y alone: read with X to the north, as surveyors in China have it; change the two columns over where it is not so".to_owned()
            }
            Defect::HeightsAboveTheSea { column } => format!(
                "expected heights above the ellipsoid, found column {column:?}, which says that they are above the sea: the two differ by tens of metres; take a column of ellipsoidal heights, or leave the heights out"
            ),
            Defect::AbsoluteHeights { typical_m, origin_m } => format!(
                "expected heights above the site's origin, found some about {typical_m:.0} m, near the {origin_m:.0} m of the origin itself: subtract the origin's height in the same datum, or leave the heights out"
            ),
            Defect::PackedAngles { found, degrees } => format!(
                "expected degrees with decimals, found angles such as {found:?}, which puts nothing at the site; read as degrees, minutes and seconds, {degrees:.6}°: check one of them"
            ),
            Defect::NoMarker { found } => format!(
                "expected a name and its place, found {found:?} alone in the line: it was left out"
            ),
            Defect::CleanedName { letters, kept_letters } => format!(
                "expected a name of letters that can be seen, found one of {letters} of which {kept_letters} are kept: check that it still says what it should"
            ),
            Defect::ColumnsUnknown => {
                "expected columns for name, east and north or for name, latitude and longitude, found none by these names: say which is which".to_owned()
            }
            Defect::SwappedRow { largest_move_m, moved_m, swapped_m } => format!(
                "expected a move of at most {largest_move_m} m, found {moved_m:.1} m, and {swapped_m:.1} m with east and north changed over: correct the row"
            ),
            Defect::FarMove { largest_move_m, moved_m } => format!(
                "expected a move of at most {largest_move_m} m, found {moved_m:.1} m: check the survey"
            ),
            Defect::SimilarName { like } => format!(
                "expected a new name, found one that reads like {like:?}: is it the same marker?"
            ),
            Defect::NotInPlan => {
                "expected the name of a node, as most of the file has, found another: check the name".to_owned()
            }
            Defect::OffSite { distance_m, ring_radius_m } => format!(
                "expected a place beneath the reflector, found one {distance_m:.0} m from its middle, beyond its ring of {ring_radius_m:.0} m: check frame and columns"
            ),
            Defect::TooClose { least_apart_m, other, distance_m } => format!(
                "expected markers at least {least_apart_m} m apart, found {other:?} at {distance_m:.2} m: is it the same marker?"
            ),
            Defect::OffTerrain { ground_m, height_m } => format!(
                "expected a height near the {ground_m:.1} m that the markers around it say, found {height_m:.1} m: check the height and its datum"
            ),
            Defect::SwappedAxes { against } => format!(
                "expected {} places, found them with east and north changed over: change the two columns over",
                against.whose()
            ),
            Defect::Mirrored { against, turn_deg } => format!(
                "expected {} places, found them mirrored and turned by {turn_deg:.1}°: check the signs and the order of the axes",
                against.whose()
            ),
            Defect::OtherUnit { against, scale } => format!(
                "expected {} places, found them on another scale, {scale:.4} of a metre for one: check the unit",
                against.whose()
            ),
            Defect::Turned { against, turn_deg } => format!(
                "expected {} places, found them turned by {turn_deg:.2}°: check which north the file has",
                against.whose()
            ),
            Defect::Shifted { against, east_m, north_m } => format!(
                "expected {} places, found them all shifted by {east_m:.2} m east and {north_m:.2} m north: check origin and datum",
                against.whose()
            ),
            Defect::ShiftedHeights { off_by_m } => format!(
                "expected the table's heights, found them all off by {off_by_m:.2} m: check the heights' datum and the site's origin"
            ),
            Defect::Removes { missing } => format!(
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
    fn one_of_each() -> impl Iterator<Item = Defect> {
        let text = || "text".to_owned();
        let next = move |odd: &Defect| {
            Some(match odd {
                Defect::NoRows => Defect::WrongName { found: text(), longest_letters: 40, sentence: text() },
                Defect::WrongName { .. } => Defect::RepeatedName { first_line: 2 },
                Defect::RepeatedName { .. } => Defect::NotANumber { column: text(), found: text() },
                Defect::NotANumber { .. } => {
                    Defect::ValueOutOfRange { column: text(), found: text(), most: 90.0 }
                }
                Defect::ValueOutOfRange { .. } => {
                    Defect::PlaceOutOfRange { e_m: 1e6, n_m: 2.0, farthest_m: 1e5 }
                }
                Defect::PlaceOutOfRange { .. } => {
                    Defect::SwappedLatLon { latitude_deg: 25.0, longitude_deg: 106.0 }
                }
                Defect::SwappedLatLon { .. } => Defect::LooksLocal,
                Defect::LooksLocal => Defect::LooksGeographic,
                Defect::LooksGeographic => Defect::OtherSite { latitude_deg: 25.0, longitude_deg: 106.0 },
                Defect::OtherSite { .. } => Defect::OtherGrid { farthest_m: 1e5 },
                Defect::OtherGrid { .. } => {
                    Defect::NationalGrid { grid: text(), central_meridian_deg: 108.0, distance_m: 12.0 }
                }
                Defect::NationalGrid { .. } => Defect::AxesByCustom,
                Defect::AxesByCustom => Defect::HeightsAboveTheSea { column: text() },
                Defect::HeightsAboveTheSea { .. } => {
                    Defect::AbsoluteHeights { typical_m: 1112.0, origin_m: 1110.0 }
                }
                Defect::AbsoluteHeights { .. } => Defect::PackedAngles { found: text(), degrees: 25.653_247 },
                Defect::PackedAngles { .. } => Defect::NoMarker { found: text() },
                Defect::NoMarker { .. } => Defect::CleanedName { letters: 4, kept_letters: 3 },
                Defect::CleanedName { .. } => Defect::ColumnsUnknown,
                Defect::ColumnsUnknown => {
                    Defect::SwappedRow { largest_move_m: 1.0, moved_m: 90.0, swapped_m: 0.1 }
                }
                Defect::SwappedRow { .. } => Defect::FarMove { largest_move_m: 1.0, moved_m: 1.5 },
                Defect::FarMove { .. } => Defect::SimilarName { like: text() },
                Defect::SimilarName { .. } => Defect::NotInPlan,
                Defect::NotInPlan => Defect::OffSite { distance_m: 400.0, ring_radius_m: 250.0 },
                Defect::OffSite { .. } => {
                    Defect::TooClose { least_apart_m: 1.0, other: text(), distance_m: 0.2 }
                }
                Defect::TooClose { .. } => Defect::OffTerrain { ground_m: 3.0, height_m: 12.0 },
                Defect::OffTerrain { .. } => Defect::SwappedAxes { against: Against::Table(9) },
                Defect::SwappedAxes { against: Against::Table(_) } => {
                    Defect::SwappedAxes { against: Against::Plan(9) }
                }
                Defect::SwappedAxes { against: Against::Plan(_) } => {
                    Defect::Mirrored { against: Against::Table(9), turn_deg: 30.0 }
                }
                Defect::Mirrored { against: Against::Table(_), .. } => {
                    Defect::Mirrored { against: Against::Plan(9), turn_deg: 30.0 }
                }
                Defect::Mirrored { against: Against::Plan(_), .. } => {
                    Defect::OtherUnit { against: Against::Table(9), scale: 0.001 }
                }
                Defect::OtherUnit { against: Against::Table(_), .. } => {
                    Defect::OtherUnit { against: Against::Plan(9), scale: 0.001 }
                }
                Defect::OtherUnit { against: Against::Plan(_), .. } => {
                    Defect::Turned { against: Against::Table(9), turn_deg: 2.0 }
                }
                Defect::Turned { against: Against::Table(_), .. } => {
                    Defect::Turned { against: Against::Plan(9), turn_deg: 2.0 }
                }
                Defect::Turned { against: Against::Plan(_), .. } => {
                    Defect::Shifted { against: Against::Table(9), east_m: 470.0, north_m: -230.0 }
                }
                Defect::Shifted { against: Against::Table(_), .. } => {
                    Defect::Shifted { against: Against::Plan(9), east_m: 470.0, north_m: -230.0 }
                }
                Defect::Shifted { against: Against::Plan(_), .. } => {
                    Defect::ShiftedHeights { off_by_m: 30.0 }
                }
                Defect::ShiftedHeights { .. } => Defect::Removes { missing: 12 },
                Defect::Removes { .. } => return None,
            })
        };
        std::iter::successors(Some(Defect::NoRows), next)
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

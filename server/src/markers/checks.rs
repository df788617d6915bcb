//! What is odd about rows that can be read: held against the table, the plan and each other.

use std::collections::HashMap;

use lodestep_engine::parse::names;

use super::defect::{Against, Defect};
use super::finding::{Findings, Level};
use super::frame_fit::{Fit, explain, median};
use super::mapping::Mapping;
use super::rows::Row;
use crate::site::Plan;
use crate::store::markers::Place;

/// A marker that moves farther than this is pointed out, m.
const FAR_MOVE_M: f64 = 1.0;
/// Two markers nearer to each other than this are one, under two names, m.
const TOO_CLOSE_M: f64 = 1.0;
/// Markers whose heights speak for one between them are nearer than this, m.
const NEIGHBOUR_M: f64 = 25.0;
/// Neighbours that tell how the ground lies between them.
const LEAST_NEIGHBOURS: usize = 5;
/// The ground is no rougher: a marker farther than this from the plane through its neighbours is off it, m. The
/// demo's anchors are within 1.7 m of theirs.
const OFF_TERRAIN_M: f64 = 6.0;
/// Anchors stand outside the ring where the tie-downs are long, but not farther than this share of its radius.
const OFF_SITE: f64 = 1.3;
/// The plan's nodes stand this far from their anchors, near the rim, m.
const PLAN_TOLERANCE_M: f64 = 45.0;
/// Heights that are all off by more than this are of another datum, m.
const SHIFTED_HEIGHT_M: f64 = 1.0;

/// Looks at rows that add or change markers, among all that will stand then.
pub(super) fn check(
    rows: &[Row],
    mapping: Mapping,
    standing: &HashMap<String, Place>,
    plan: &Plan,
    findings: &mut Findings,
) {
    of_all(rows, mapping, standing, plan, findings);
    let mut then: HashMap<&str, Place> =
        standing.iter().map(|(name, place)| (name.as_str(), *place)).collect();
    then.extend(rows.iter().map(|row| (row.name.as_str(), row.place)));
    let neighbours = Neighbours::of(&then);
    let plain_names: HashMap<String, &str> =
        standing.keys().map(|name| (names::look(name), name.as_str())).collect();
    let plan_names: HashMap<&str, ()> = plan.nodes.iter().map(|node| (node.name.as_str(), ())).collect();
    let in_plan = rows.iter().filter(|row| plan_names.contains_key(row.name.as_str())).count();
    for row in rows {
        let old = standing.get(&row.name);
        // An empty height leaves the height alone.
        if old.is_some_and(|old| {
            old.e_m == row.place.e_m
                && old.n_m == row.place.n_m
                && row.place.u_m.is_none_or(|u_m| Some(u_m) == old.u_m)
        }) {
            continue;
        }
        let Row { line, name, place, .. } = row;
        let mut warn = |odd: Defect| findings.of_line(Level::Warning, *line, name, &odd);
        if let Some(old) = old {
            let moved_m = old.plan_distance_m(place);
            let swapped_m = old.plan_distance_m(&Place { e_m: place.n_m, n_m: place.e_m, u_m: None });
            if moved_m > FAR_MOVE_M && swapped_m < FAR_MOVE_M {
                warn(Defect::SwappedRow { largest_move_m: FAR_MOVE_M, moved_m, swapped_m });
            } else if moved_m > FAR_MOVE_M {
                warn(Defect::FarMove { largest_move_m: FAR_MOVE_M, moved_m });
            }
        } else {
            if let Some(like) = plain_names.get(&names::look(name)) {
                warn(Defect::SimilarName { like: (*like).to_owned() });
            }
            if in_plan * 2 > rows.len() && !plan_names.contains_key(name.as_str()) {
                warn(Defect::NotInPlan);
            }
        }
        let radius_m = place.e_m.hypot(place.n_m);
        if radius_m > OFF_SITE * plan.ring_radius_m {
            warn(Defect::OffSite { distance_m: radius_m, ring_radius_m: plan.ring_radius_m });
        }
        let mut around = Vec::new();
        for (other, there) in neighbours.near(place) {
            if other == name {
                continue;
            }
            let distance_m = place.plan_distance_m(&there);
            if distance_m < TOO_CLOSE_M {
                warn(Defect::TooClose { least_apart_m: TOO_CLOSE_M, other: other.to_owned(), distance_m });
            }
            if let (true, Some(u_m)) = (distance_m < NEIGHBOUR_M, there.u_m) {
                around.push([there.e_m - place.e_m, there.n_m - place.n_m, u_m]);
            }
        }
        if let (Some(u_m), Some(ground_m)) = (place.u_m, ground_m(&around))
            && (u_m - ground_m).abs() > OFF_TERRAIN_M
        {
            warn(Defect::OffTerrain { ground_m, height_m: u_m });
        }
    }
}

/// The height of the plane through the neighbours, at the place that they are around; `None` of too few, or of
/// such as lie in a row.
fn ground_m(around: &[[f64; 3]]) -> Option<f64> {
    if around.len() < LEAST_NEIGHBOURS {
        return None;
    }
    let count = around.len() as f64;
    let mean = |axis: usize| around.iter().map(|point| point[axis]).sum::<f64>() / count;
    let [e_m, n_m, u_m] = [mean(0), mean(1), mean(2)];
    let (mut ee, mut en, mut nn, mut eu, mut nu) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for [e, n, u] in around {
        let [e, n, u] = [e - e_m, n - n_m, u - u_m];
        ee += e * e;
        en += e * n;
        nn += n * n;
        eu += e * u;
        nu += n * u;
    }
    let det = ee * nn - en * en;
    if det <= 1e-3 * ee * nn {
        return None;
    }
    let slope_e = (eu * nn - nu * en) / det;
    let slope_n = (nu * ee - eu * en) / det;
    Some(u_m - slope_e * e_m - slope_n * n_m)
}

/// What all rows have in common.
fn of_all(
    rows: &[Row],
    mapping: Mapping,
    standing: &HashMap<String, Place>,
    plan: &Plan,
    findings: &mut Findings,
) {
    let known: Vec<_> = rows.iter().filter_map(|row| Some((row.place, *standing.get(&row.name)?))).collect();
    let fit = if known.len() >= 4 {
        explain(&known, FAR_MOVE_M).map(|fit| (fit, Against::Table(known.len())))
    } else {
        let nodes: HashMap<&str, Place> = plan
            .nodes
            .iter()
            .map(|node| (node.name.as_str(), Place { e_m: node.e_m, n_m: node.n_m, u_m: None }))
            .collect();
        let pairs: Vec<_> =
            rows.iter().filter_map(|row| Some((row.place, *nodes.get(row.name.as_str())?))).collect();
        explain(&pairs, PLAN_TOLERANCE_M).map(|fit| (fit, Against::Plan(pairs.len())))
    };
    if let Some((fit, against)) = fit {
        let odd = told(&fit, against);
        let suggested = matches!(odd, Defect::SwappedAxes { .. }).then(|| mapping.swapped());
        findings.of_file(Level::Warning, &odd, suggested);
    }
    let raised: Vec<f64> = known.iter().filter_map(|(file, table)| Some(file.u_m? - table.u_m?)).collect();
    let typical_m = median(raised.clone());
    let spread_m = median(raised.iter().map(|raise| (raise - typical_m).abs()).collect());
    if raised.len() >= 4 && typical_m.abs() > SHIFTED_HEIGHT_M && spread_m < 0.2 * typical_m.abs() {
        findings.of_file(Level::Warning, &Defect::ShiftedHeights { off_by_m: typical_m }, None);
    }
}

fn told(fit: &Fit, against: Against) -> Defect {
    let turn_deg = fit.turn_deg;
    if fit.mirrored && (turn_deg - 90.0).abs() < 5.0 && (fit.scale - 1.0).abs() < 0.05 {
        return Defect::SwappedAxes { against };
    }
    if fit.mirrored {
        return Defect::Mirrored { against, turn_deg };
    }
    if (fit.scale - 1.0).abs() > 0.005 {
        return Defect::OtherUnit { against, scale: fit.scale };
    }
    if turn_deg.abs() > 0.05 {
        return Defect::Turned { against, turn_deg };
    }
    let [east_m, north_m] = fit.shift_m;
    Defect::Shifted { against, east_m, north_m }
}

/// Which markers are near a place, by cells.
struct Neighbours<'a> {
    cells: HashMap<(i64, i64), Vec<(&'a str, Place)>>,
}

impl<'a> Neighbours<'a> {
    fn of(all: &HashMap<&'a str, Place>) -> Neighbours<'a> {
        let mut cells: HashMap<_, Vec<_>> = HashMap::new();
        for (name, place) in all {
            cells.entry(cell(place)).or_default().push((*name, *place));
        }
        // The same file gives the same findings every time.
        for names in cells.values_mut() {
            names.sort_by_key(|(name, _)| *name);
        }
        Neighbours { cells }
    }

    fn near(&self, place: &Place) -> impl Iterator<Item = (&'a str, Place)> {
        let (column, row) = cell(place);
        (-1..=1)
            .flat_map(move |i| (-1..=1).map(move |j| (column + i, row + j)))
            .filter_map(|key| self.cells.get(&key))
            .flatten()
            .copied()
    }
}

fn cell(place: &Place) -> (i64, i64) {
    ((place.e_m / NEIGHBOUR_M).floor() as i64, (place.n_m / NEIGHBOUR_M).floor() as i64)
}

#[cfg(test)]
mod tests {
    use lodestep_engine::geo::{Site, terrain};

    use super::*;

    fn anchors() -> (Plan, HashMap<String, Place>) {
        let site = Site::fast();
        let standing = terrain::anchors(&site)
            .into_iter()
            .map(|anchor| {
                let [e_m, n_m, u_m] = anchor.position_n_m;
                (anchor.name, Place { e_m, n_m, u_m: Some(u_m) })
            })
            .collect();
        (Plan::of(&site), standing)
    }

    /// The codes of all findings about these markers, changed like this, against the table.
    fn codes(
        standing: &HashMap<String, Place>,
        plan: &Plan,
        change: impl Fn(&str, Place) -> Option<(String, Place)>,
    ) -> Vec<(String, u64)> {
        let (_, all) = anchors();
        let mut names: Vec<_> = all.keys().cloned().collect();
        names.sort();
        let rows: Vec<Row> = names
            .iter()
            .zip(2..)
            .filter_map(|(name, line)| {
                let (name, place) = change(name, all[name])?;
                Some(Row { line, name, place, sigma_m: None })
            })
            .collect();
        let mut findings = Findings::default();
        let mapping = Mapping::Local { name: 0, e_m: 1, n_m: 2, u_m: Some(3) };
        check(&rows, mapping, standing, plan, &mut findings);
        findings.finding_counts.into_iter().collect()
    }

    fn same(name: &str, place: Place) -> Option<(String, Place)> {
        Some((name.to_owned(), place))
    }

    #[test]
    fn the_anchors_themselves_are_fine_known_or_not() {
        let (plan, standing) = anchors();
        assert_eq!(codes(&standing, &plan, same), []);
        assert_eq!(codes(&HashMap::new(), &plan, same), []);
    }

    #[test]
    fn swapped_axes_are_seen_by_the_table_and_by_the_plan() {
        let (plan, standing) = anchors();
        let swap =
            |name: &str, place: Place| same(name, Place { e_m: place.n_m, n_m: place.e_m, u_m: place.u_m });
        let told = codes(&standing, &plan, swap);
        assert!(told.iter().any(|(code, _)| code == "swapped_axes"), "{told:?}");
        let told = codes(&HashMap::new(), &plan, swap);
        assert!(told.iter().any(|(code, _)| code == "swapped_axes"), "{told:?}");
    }

    #[test]
    fn single_rows_that_are_off_are_told() {
        let (plan, standing) = anchors();
        let told = codes(&standing, &plan, |name, place| match name {
            "A100" => same(name, Place { e_m: place.n_m, n_m: place.e_m, ..place }),
            "B200" => same(name, Place { e_m: place.e_m + 1.5, ..place }),
            "B201" => same(name, Place { e_m: place.e_m + 0.5, ..place }),
            "C50" => same(name, Place { u_m: Some(place.u_m? + 9.0), ..place }),
            "D12" => same(" d-012", Place { e_m: place.e_m + 2.0, ..place }),
            "D300" => same(name, Place { e_m: 400.0, n_m: 0.0, u_m: None }),
            "E7" => same("东七", place),
            _ => None,
        });
        let expected = [
            ("far_move", 2),
            ("not_in_plan", 2),
            ("off_site", 1),
            ("off_terrain", 1),
            ("similar_name", 1),
            ("swapped_row", 1),
            ("too_close", 1),
        ];
        assert_eq!(told, expected.map(|(code, count)| (code.to_owned(), count)));
    }

    #[test]
    fn another_datum_is_seen_in_plan_and_height() {
        let (plan, standing) = anchors();
        let told = codes(&standing, &plan, |name, place| {
            same(name, Place { e_m: place.e_m + 470.0, n_m: place.n_m - 230.0, u_m: Some(place.u_m? + 30.0) })
        });
        for code in ["shifted", "shifted_heights"] {
            assert!(told.contains(&(code.to_owned(), 1)), "{told:?}");
        }
    }

    #[test]
    fn names_that_read_alike() {
        assert_eq!(names::look("Ａ０17"), names::look("a-17"));
        assert_ne!(names::look("A107"), names::look("A17"));
    }
}

//! Known answers on level rows of markers 10 m apart.

use super::*;
use crate::identify::Marker;

/// Rows of markers 10 m apart in a square, level, named by column and row.
fn lattice() -> Markers {
    let mut all = Vec::new();
    for row in -20..=20 {
        for column in -20..=20 {
            let (e, n) = (10.0 * f64::from(column), 10.0 * f64::from(row));
            all.push(Marker { name: format!("{column},{row}"), position_n_m: (e, n, Some(0.0)) });
        }
    }
    Markers::new(all)
}

fn seen(from: [f64; 2], to: [f64; 2]) -> Seen {
    let displacement = Vector3::new(to[0] - from[0], to[1] - from[1], 0.0);
    let stretch = Stretch {
        displacement_n_m: displacement,
        length_m: displacement.norm(),
        heading_sigma_rad: 0.0,
        jump_n_m: Vector3::zeros(),
        jump_heading_rad: 0.0,
    };
    Seen { stretches: vec![stretch], position_n_m: Vector3::new(to[0], to[1], 0.0), keyed: None }
}

/// Walks from place to place and stands at each but the first.
fn after(places: &[[f64; 2]], markers: &Markers) -> Hypotheses {
    let mut hypotheses = Hypotheses::new(IdentificationTuning::default());
    for pair in places.windows(2) {
        hypotheses.take(seen(pair[0], pair[1]), markers);
    }
    hypotheses
}

fn share_of(hypotheses: &Hypotheses, stand: usize, name: &str, markers: &Markers) -> f64 {
    let marks = &hypotheses.marks()[stand];
    let all: f64 = marks.values().sum();
    assert!((all - 1.0).abs() < 1e-9, "they add up to 1, none of them included: {all}");
    let mark = (name != "none").then(|| markers.find(name).expect("a marker of this name"));
    marks.get(&mark).copied().unwrap_or(0.0)
}

#[test]
fn in_the_middle_of_two_markers_either_is_as_likely() {
    let markers = lattice();
    // Walking north, what the heading errs by is across the way: towards either of them.
    let hypotheses = after(&[[5.0, 0.0], [5.0, 150.0]], &markers);
    let [left, right, none] = ["0,15", "1,15", "none"].map(|name| share_of(&hypotheses, 0, name, &markers));
    assert!((left - right).abs() < 1e-9, "{left} {right}");
    assert!(left + right + none > 0.98, "{left} {right} {none}");
}

#[test]
fn a_doubt_is_carried_and_resolved_by_a_later_stand() {
    let markers = lattice();
    let mut hypotheses = after(&[[5.0, 0.0], [5.0, 150.0], [5.0, 180.0]], &markers);
    let before = share_of(&hypotheses, 0, "1,15", &markers);
    assert!(before < 0.51, "a doubt: {before}");
    // At the next stop somebody keys in the marker to the right: the track is off to the left, and was
    // so at the stop before.
    hypotheses.key(1, "1,18", &markers);
    let later = share_of(&hypotheses, 0, "1,15", &markers);
    assert!(later > 0.9, "{before} {later}");
}

#[test]
fn hindsight_is_what_a_sum_over_all_sequences_gives() {
    let markers = Markers::new(
        [(-4.0, 100.0), (4.0, 100.0), (-5.0, 130.0), (4.0, 130.0)]
            .iter()
            .map(|&(e, n)| Marker { name: format!("{e},{n}"), position_n_m: (e, n, None) })
            .collect(),
    );
    let tuning = IdentificationTuning::default();
    let stands = [seen([0.0, 0.0], [0.5, 100.0]), seen([0.5, 100.0], [0.2, 130.0])];
    let hypotheses = after(&[[0.0, 0.0], [0.5, 100.0], [0.2, 130.0]], &markers);
    // The same by hand, without merging: the share of each pair of marks, weighed one after the other.
    let mut sums: BTreeMap<Mark, f64> = BTreeMap::new();
    let start = Hypotheses::new(tuning.clone()).thought[0].clone();
    for first in branch(&start, 0, &stands[0], &markers, &tuning) {
        let mut error = first.error.clone();
        stands[1].stretches.iter().for_each(|stretch| error.walk(stretch, &tuning));
        let place = stands[1].position_n_m - error.mean.fixed_rows::<3>(0);
        let covariance = error.covariance.fixed_view::<3, 3>(0, 0).into_owned();
        let weighed = weigh(&place, &covariance, tuning.beside_sigma_m, &markers);
        let none_share = (tuning.none_stands + first.none_stands) / (tuning.none_of + 1.0);
        let at_any: f64 = weighed.near.iter().map(|(_, density)| density).sum();
        let second = none_share * weighed.none + (1.0 - none_share) * at_any;
        *sums.entry(first.last[1].flatten()).or_insert(0.0) += first.weight * second;
    }
    let all: f64 = sums.values().sum();
    for (mark, share) in &hypotheses.marks()[0] {
        assert!((share - sums[mark] / all).abs() < 1e-6, "{mark:?} {share} {}", sums[mark] / all);
    }
}

#[test]
fn a_keyed_marker_is_believed_but_for_a_slip() {
    let markers = lattice();
    let mut hypotheses = after(&[[5.0, 0.0], [4.0, 150.0]], &markers);
    hypotheses.key(0, "1,15", &markers);
    let share = share_of(&hypotheses, 0, "1,15", &markers);
    assert!(share > 0.9 && share < 1.0, "{share}");
}

#[test]
fn a_keyed_marker_is_the_same_one_when_others_have_come_before_it() {
    let markers = lattice();
    let mut hypotheses = after(&[[5.0, 0.0], [4.0, 150.0]], &markers);
    hypotheses.key(0, "1,15", &markers);
    let before = share_of(&hypotheses, 0, "1,15", &markers);
    let far = Marker { name: "far".to_owned(), position_n_m: (5_000.0, 0.0, None) };
    let more = Markers::new([far].into_iter().chain(markers.all().iter().cloned()).collect());
    hypotheses.think_again(&more, hypotheses.tuning.clone());
    assert!((share_of(&hypotheses, 0, "1,15", &more) - before).abs() < 1e-12);
}

#[test]
fn stops_between_the_markers_teach_that_this_inspector_makes_such() {
    let markers = lattice();
    let alone = after(&[[0.0, 0.0], [3.0, 150.0]], &markers);
    let taught = after(&[[0.0, 0.0], [5.0, 35.0], [-5.0, 65.0], [5.0, 95.0], [3.0, 150.0]], &markers);
    assert!(share_of(&taught, 0, "none", &markers) > 0.9);
    let (before, later) = (share_of(&alone, 0, "none", &markers), share_of(&taught, 3, "none", &markers));
    assert!(later > 2.0 * before, "{before} {later}");
}

#[test]
fn far_from_every_marker_it_is_none_of_them() {
    let markers = lattice();
    let hypotheses = after(&[[900.0, 0.0], [900.0, 900.0]], &markers);
    assert!((share_of(&hypotheses, 0, "none", &markers) - 1.0).abs() < 1e-9);
}

//! What is told of a stand's marks: the likeliest markers by name, and the share of all the rest.

use nalgebra::Vector2;

use super::markers::Markers;
use crate::event::MarkerCandidate;

/// Candidates that are named; more help nobody to choose.
const NAMED: usize = 8;
/// Markers less likely than this are not named.
const LEAST: f64 = 0.005;

/// The likeliest by name, and the rest as one.
pub(super) fn named(
    shares: impl Iterator<Item = (usize, f64)>,
    place_m: &Vector2<f64>,
    markers: &Markers,
) -> Vec<MarkerCandidate> {
    let mut shares: Vec<(usize, f64)> = shares.filter(|(_, share)| *share >= LEAST).collect();
    // Equal weights keep the order of their names, so that the list is the same every time.
    shares.sort_by(|(a, first), (b, second)| {
        second.total_cmp(first).then_with(|| markers.get(*a).name.cmp(&markers.get(*b).name))
    });
    shares.truncate(NAMED);
    let rest = 1.0 - shares.iter().map(|(_, share)| share).sum::<f64>();
    let mut told: Vec<MarkerCandidate> = shares
        .into_iter()
        .map(|(number, probability)| {
            let marker = markers.get(number);
            let (e_m, n_m, _) = marker.position_n_m;
            MarkerCandidate {
                marker: Some(marker.name.clone()),
                probability,
                distance_m: Some(libm::hypot(e_m - place_m.x, n_m - place_m.y)),
            }
        })
        .collect();
    told.push(MarkerCandidate { marker: None, probability: rest.max(0.0), distance_m: None });
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::Marker;

    #[test]
    fn few_are_named_and_the_rest_is_told_as_one_so_that_all_add_up_to_one() {
        let marker = |k: usize| Marker { name: format!("A{k:02}"), position_n_m: (k as f64, 0.0, None) };
        let markers = Markers::new((0..20).map(marker).collect());
        let place = Vector2::new(1.0, 0.0);
        let told = named((0..20).map(|k| (k, 0.04)), &place, &markers);
        assert_eq!(told.len(), NAMED + 1);
        assert_eq!((told[0].marker.as_deref(), told[0].distance_m), (Some("A00"), Some(1.0)));
        assert!(told.iter().take(NAMED).is_sorted_by(|a, b| a.marker < b.marker));
        let (last, sum) = (&told[NAMED], told.iter().map(|candidate| candidate.probability).sum::<f64>());
        assert!(
            last.marker.is_none() && (last.probability - 0.68).abs() < 1e-12 && (sum - 1.0).abs() < 1e-12
        );

        let told = named([(3, 0.004), (5, 0.9)].into_iter(), &place, &markers);
        assert_eq!(told.len(), 2, "hardly likely ones are among the rest");
        assert_eq!(named(std::iter::empty(), &place, &markers)[0].probability, 1.0);
    }
}

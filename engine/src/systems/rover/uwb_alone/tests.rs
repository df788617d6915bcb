use super::*;
use crate::systems::rover::anchors::distance_m;

/// Normal numbers that are the same everywhere: a shift register and the sum of twelve.
struct Dice(u64);

impl Dice {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// How a made radio errs.
#[derive(Clone, Copy)]
struct Radio {
    white_m: f64,
    bias_spread_m: f64,
    scale: f64,
    gross: f64,
}

const GOOD: Radio = Radio { white_m: 0.05, bias_spread_m: 0.04, scale: 0.0, gross: 0.0 };

fn hall() -> Vec<SurveyedAnchor> {
    let places = [[0.0, 0.0, 2.0], [18.0, 1.0, 1.2], [17.0, 12.0, 2.2], [1.0, 13.0, 1.0], [9.0, 14.0, 2.5]];
    places.iter().enumerate().map(|(k, p)| SurveyedAnchor { name: format!("A{k}"), p_n: *p }).collect()
}

/// Rests for five seconds, then an eight at about 1 m/s.
fn truth(t_s: f64) -> [f64; 3] {
    let t = (t_s - 5.0).max(0.0);
    [9.0 + 5.0 * libm::sin(0.15 * t), 7.0 + 3.0 * libm::sin(0.3 * t), 1.0]
}

fn ranges(seed: u64, radio: Radio, seconds: f64, truth: impl Fn(f64) -> [f64; 3]) -> Vec<UwbRange> {
    let anchors = hall();
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15 ^ (seed + 1).wrapping_mul(0xD134_2543_DE82_EF95));
    let biases: Vec<f64> = anchors.iter().map(|_| 0.15 + radio.bias_spread_m * dice.normal()).collect();
    let mut out = Vec::new();
    let mut t_s = 0.0;
    while t_s < seconds {
        t_s += 0.04;
        let anchor = (dice.uniform() * anchors.len() as f64) as usize % anchors.len();
        let true_m = distance_m(&truth(t_s), &anchors[anchor].p_n);
        let mut range_m = true_m * (1.0 + radio.scale) + biases[anchor] + radio.white_m * dice.normal();
        if dice.uniform() < radio.gross {
            range_m = 267.0 * dice.uniform();
        }
        out.push(UwbRange { t_ns: (t_s * 1e9) as i64, anchor, range_m });
    }
    out
}

fn run(ranges: &[UwbRange], settings: UwbSettings) -> (UwbAlone, Vec<UwbPoint>) {
    let mut tag = UwbAlone::new(hall(), settings);
    let points = ranges.chunk_by(|a, b| a.t_ns == b.t_ns).filter_map(|now| tag.push(now)).collect();
    (tag, points)
}

/// Errors in plan, ascending, and the share inside the stated 95 % ellipses, from the tenth second on.
fn errors(points: &[UwbPoint], truth: impl Fn(f64) -> [f64; 3]) -> (Vec<f64>, f64) {
    let mut errors = Vec::new();
    let mut inside = 0_usize;
    for point in points.iter().filter(|point| point.t_ns > 10_000_000_000) {
        let p = truth(point.t_ns as f64 * 1e-9);
        let (e, n) = (point.p_n[0] - p[0], point.p_n[1] - p[1]);
        let c = point.covariance;
        let determinant = c[0][0] * c[1][1] - c[0][1] * c[0][1];
        let nis = (e * e * c[1][1] - 2.0 * e * n * c[0][1] + n * n * c[0][0]) / determinant;
        inside += usize::from(nis < 5.991);
        errors.push(e.hypot(n));
    }
    errors.sort_by(f64::total_cmp);
    let share = inside as f64 / errors.len() as f64;
    (errors, share)
}

fn p95(errors: &[f64]) -> f64 {
    errors[errors.len() * 95 / 100]
}

#[test]
fn a_tag_is_found_without_a_position_and_knows_how_wrong_it_is() {
    let mut shares = 0.0;
    const SEEDS: u64 = 6;
    for seed in 0..SEEDS {
        let (tag, points) = run(&ranges(seed, GOOD, 60.0, truth), UwbSettings::default());
        assert!(tag.started_ns().unwrap() < 2_000_000_000, "seed {seed}");
        let (errors, share) = errors(&points, truth);
        assert!(p95(&errors) < 0.3, "seed {seed}: {}", p95(&errors));
        shares += share;
    }
    let share = shares / SEEDS as f64;
    assert!(share > 0.85, "{share}");
}

#[test]
fn gross_errors_are_rejected_and_counted() {
    let radio = Radio { gross: 0.1, ..GOOD };
    for seed in 0..3 {
        let (tag, points) = run(&ranges(seed, radio, 60.0, truth), UwbSettings::default());
        let (errors, _) = errors(&points, truth);
        assert!(p95(&errors) < 0.35, "seed {seed}: {}", p95(&errors));
        let rejected: u64 = tag.anchors().iter().map(|anchor| anchor.rejected).sum();
        assert!((80..300).contains(&rejected), "{rejected}");
    }
}

#[test]
fn smoothing_is_nearer_to_the_truth_and_says_so() {
    let (tag, points) = run(&ranges(7, GOOD, 60.0, truth), UwbSettings::default());
    let smoothed = tag.smoothed();
    let (filtered_errors, _) = errors(&points, truth);
    let (smoothed_errors, share) = errors(&smoothed, truth);
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean(&smoothed_errors) < 0.9 * mean(&filtered_errors));
    assert!(share > 0.7, "{share}");
    // The last point has no future: but for the mixture of models it is the filter's own.
    let (last, own) = (smoothed.last().unwrap(), points.last().unwrap());
    assert!((last.p_n[0] - own.p_n[0]).abs() < 0.1);
    // From the first range on there is a point, though the filter needs a second to find the tag.
    assert!(smoothed.len() > points.len());
}

#[test]
fn a_coarse_radio_is_recognised_by_its_ranges() {
    let coarse = Radio { white_m: 0.5, bias_spread_m: 0.3, scale: 0.05, gross: 0.0 };
    let (_, fine_points) = run(&ranges(1, GOOD, 40.0, truth), UwbSettings::default());
    let (_, coarse_points) = run(&ranges(1, coarse, 40.0, truth), UwbSettings::default());
    let sigma = |points: &[UwbPoint]| points.last().unwrap().covariance[0][0].sqrt();
    assert!(sigma(&coarse_points) > 2.0 * sigma(&fine_points));
    let (errors, share) = errors(&coarse_points, truth);
    assert!(p95(&errors) < 1.8, "{}", p95(&errors));
    assert!(share > 0.8, "{share}");
}

#[test]
fn a_tag_that_was_carried_away_is_found_anew() {
    // Silent for a while, and then at another end of the hall.
    let elsewhere = |t_s: f64| if t_s < 20.0 { truth(t_s) } else { [2.0, 30.0, 1.0] };
    let all: Vec<UwbRange> = ranges(2, GOOD, 60.0, elsewhere)
        .into_iter()
        .filter(|range| !(20_000_000_000..20_500_000_000).contains(&range.t_ns))
        .collect();
    let (tag, points) = run(&all, UwbSettings::default());
    assert_eq!(tag.restarts(), 1);
    let last = points.last().unwrap();
    assert!((last.p_n[0] - 2.0).abs() < 0.5 && (last.p_n[1] - 30.0).abs() < 0.5, "{:?}", last.p_n);
    let smoothed = tag.smoothed();
    assert!(smoothed.iter().all(|point| point.p_n.iter().all(|x| x.is_finite())));
}

#[test]
fn a_known_height_is_kept_and_two_anchors_find_nobody() {
    let settings = UwbSettings {
        antenna_height_m: Some(1.0),
        antenna_height_sigma_m: Some(0.05),
        ..UwbSettings::default()
    };
    let all = ranges(3, GOOD, 30.0, truth);
    let (_, points) = run(&all, settings);
    assert!(points.iter().all(|point| (point.p_n[2] - 1.0).abs() < 0.2));
    let two: Vec<UwbRange> = all.into_iter().filter(|range| range.anchor < 2).collect();
    let (tag, points) = run(&two, settings);
    assert!(points.is_empty() && tag.started_ns().is_none());
}

#[test]
fn ranges_that_failed_are_no_ranges() {
    let mut all = ranges(4, GOOD, 20.0, truth);
    let clean = run(&all, UwbSettings::default()).1;
    let failed: Vec<UwbRange> =
        all.iter().flat_map(|range| [*range, UwbRange { range_m: f64::NAN, ..*range }]).collect();
    let (tag, points) = run(&failed, UwbSettings::default());
    assert_eq!(points, clean);
    assert!(tag.anchors().iter().map(|anchor| anchor.rejected).sum::<u64>() >= all.len() as u64);
    all.clear();
    assert!(run(&all, UwbSettings::default()).1.is_empty());
}

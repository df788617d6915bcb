use proptest::prelude::*;

use super::*;

/// A foot that stands and swings in turn, at so many rows a second.
fn walk(rows: usize, rate_hz: f64) -> Vec<ImuSample> {
    (0..rows)
        .map(|k| {
            let t_s = k as f64 / rate_hz;
            let swing =
                if t_s > 5.0 && t_s % 1.1 < 0.45 { (7.0 * (t_s % 1.1) / 0.45).sin() * 6.0 } else { 0.0 };
            let noise = ((k * 7919) % 1009) as f64 * 1e-5;
            ImuSample {
                t_ns: (t_s * 1e9).round() as i64,
                w_ib_b_rad_s: [noise, swing + noise, -noise],
                f_b_m_s2: [swing, noise, 9.8 + noise],
                mag_b_ut: None,
                pressure_hpa: None,
            }
        })
        .collect()
}

fn put_right(
    rows: &[ImuSample],
    rate_hz: Option<f64>,
    piece: usize,
) -> Result<(Vec<ImuSample>, Vec<Anomaly>), ParseError> {
    let mut times = Times::new(rate_hz);
    let mut all = Vec::new();
    for rows in rows.chunks(piece) {
        let from = all.len();
        all.extend_from_slice(rows);
        times.take(&mut all, from)?;
    }
    times.finish(&mut all)?;
    Ok((all, times.anomalies()))
}

fn kinds(anomalies: &[Anomaly]) -> Vec<&str> {
    anomalies.iter().map(|anomaly| anomaly.kind.as_str()).collect()
}

/// The largest difference of times beside the same for all, s.
fn off_s(found: &[ImuSample], truth: &[ImuSample]) -> f64 {
    assert_eq!(found.len(), truth.len());
    let mut off: Vec<f64> = found.iter().zip(truth).map(|(a, b)| (a.t_ns - b.t_ns) as f64 / 1e9).collect();
    let middle = fit::median(&mut off.clone()).unwrap();
    off.iter_mut().for_each(|off| *off = (*off - middle).abs());
    off.into_iter().fold(0.0, f64::max)
}

#[test]
fn regular_times_pass_to_the_bit_with_gaps_and_other_rates() {
    let mut rows = walk(6000, 100.0);
    rows.drain(2000..3400);
    for row in &mut rows[3000..] {
        row.t_ns *= 2;
    }
    let (found, anomalies) = put_right(&rows, None, 77).unwrap();
    assert_eq!(found, rows);
    assert_eq!(anomalies, []);
}

#[test]
fn times_of_arrival_are_spread_evenly() {
    let truth = walk(6000, 100.0);
    let mut rows = truth.clone();
    let mut k = 0;
    let mut random = 1_u64;
    while k < rows.len() {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let packet = 2 + (random >> 33) as usize % 4;
        let last = (k + packet).min(rows.len());
        let at_ns = truth[last - 1].t_ns + 4_000_000;
        for (n, row) in rows[k..last].iter_mut().enumerate() {
            row.t_ns = at_ns + n as i64 * 1_000_000;
        }
        k = last;
    }
    let (found, anomalies) = put_right(&rows, None, 500).unwrap();
    assert!(off_s(&found, &truth) < 0.012, "{}", off_s(&found, &truth));
    assert_eq!(kinds(&anomalies), ["times_put_right"]);
}

#[test]
fn coarse_times_are_spread_evenly_and_lost_ones_ask_for_the_rate() {
    let truth = walk(6000, 100.0);
    for step_ns in [15_625_000, 40_000_000, 100_000_000, 1_000_000_000_i64] {
        let mut rows = truth.clone();
        rows.iter_mut().for_each(|row| row.t_ns -= row.t_ns % step_ns);
        let (found, anomalies) = put_right(&rows, None, 1000).unwrap();
        assert!(off_s(&found, &truth) < 0.012, "{step_ns}: {}", off_s(&found, &truth));
        assert_eq!(kinds(&anomalies), ["times_put_right"]);
    }
    let mut rows = truth.clone();
    rows.iter_mut().for_each(|row| row.t_ns = 1_732_340_000_000_000_000);
    let error = put_right(&rows, None, 1000).unwrap_err();
    assert!(error.to_string().contains("lost their digits") && error.advice.contains("rate"), "{error}");
    let (found, anomalies) = put_right(&rows, Some(100.0), 1000).unwrap();
    assert!(off_s(&found, &truth) < 1e-6);
    assert_eq!(kinds(&anomalies), ["times_put_right"]);
}

#[test]
fn a_clock_that_was_set_is_bridged_and_no_row_is_lost() {
    let truth = walk(6000, 100.0);
    for set_ns in
        [-3_600_000_000_000, -37_000_000, 3_600_000_000_000, 1_764_000_000_000_000_000, -1_234_567_890_i64]
    {
        let mut rows = truth.clone();
        rows[2503..].iter_mut().for_each(|row| row.t_ns += set_ns);
        let (found, anomalies) = put_right(&rows, None, 64).unwrap();
        assert_eq!(found, truth, "{set_ns}");
        assert_eq!(kinds(&anomalies), ["clock_set"]);
        assert_eq!(anomalies[0].t_start_ns, truth[2502].t_ns);
    }
}

#[test]
fn a_counter_that_begins_again_and_again_is_told_once() {
    let truth = walk(6000, 100.0);
    let mut rows = truth.clone();
    rows.iter_mut().for_each(|row| row.t_ns %= 16_384_000_000);
    let (found, anomalies) = put_right(&rows, None, 64).unwrap();
    assert!(off_s(&found, &truth) < 0.02, "{}", off_s(&found, &truth));
    assert_eq!(kinds(&anomalies), ["clock_set"]);
    assert!(anomalies[0].detail.contains("3 times"), "{}", anomalies[0].detail);
}

#[test]
fn single_wrong_times_are_replaced_and_late_rows_put_back() {
    let truth = walk(3000, 100.0);
    let mut rows = truth.clone();
    rows[1000].t_ns = 0;
    rows[1500].t_ns += 86_400_000_000_000;
    rows[2000].t_ns = rows[1999].t_ns;
    let (found, anomalies) = put_right(&rows, None, 64).unwrap();
    assert_eq!(found, truth);
    assert_eq!((kinds(&anomalies), anomalies[0].samples), (vec!["times_put_right"], 3));
    let mut rows = truth.clone();
    rows.swap(1200, 1202);
    let (found, anomalies) = put_right(&rows, None, 64).unwrap();
    assert_eq!(found, truth);
    assert_eq!(kinds(&anomalies), ["times_put_right"]);
}

#[test]
fn another_unit_is_named() {
    for (factor, unit) in [
        (1e3, "milliseconds"),
        (1e6, "microseconds"),
        (100.0, "numbers of rows"),
        (1e4, "tenths of a millisecond"),
        (32_768.0, "32768 Hz"),
        (1.0 / 60.0, "minutes"),
        (1.0 / 3_600.0, "hours"),
        (1.0 / 86_400.0, "days"),
    ] {
        let mut rows = walk(1000, 100.0);
        rows.iter_mut().for_each(|row| row.t_ns = (row.t_ns as f64 * factor) as i64);
        let error = put_right(&rows, None, 100).unwrap_err();
        assert!(error.found.contains(unit), "{error}");
    }
}

proptest! {
    #[test]
    fn no_row_is_lost_whatever_the_times_and_pieces_change_nothing(
        stamps in prop::collection::vec(prop_oneof![0_i64..50, Just(100_000_000_i64), Just(-100_000_000_i64), -5_i64..20], 0..900),
        piece in 1_usize..600,
    ) {
        let mut rows = walk(stamps.len(), 100.0);
        let mut t_ns = 0_i64;
        for (row, step) in rows.iter_mut().zip(&stamps) {
            t_ns = t_ns.saturating_add(step.saturating_mul(1_000_000));
            row.t_ns = t_ns;
        }
        let whole = put_right(&rows, Some(100.0), 10_000);
        let pieces = put_right(&rows, Some(100.0), piece);
        match (whole, pieces) {
            (Ok((whole, told)), Ok((pieces, told_pieces))) => {
                prop_assert_eq!(whole.len(), rows.len());
                prop_assert_eq!(whole, pieces);
                prop_assert_eq!(told, told_pieces);
            }
            (whole, pieces) => prop_assert_eq!(whole.is_err(), pieces.is_err()),
        }
    }
}

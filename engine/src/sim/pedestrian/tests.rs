//! Walks as a whole: are they what the catalogue promises, and do sensors err as their figures say?

use nalgebra::{UnitQuaternion, Vector3};

use super::gait::Gait;
use super::{FootTruth, SensorModel, Simulator, Walk, WalkKind, Walker, simulate};
use crate::geo::Site;
use crate::sample::ImuSample;
use crate::sim::{BarometerModel, ImuModel};

fn norm(v: &[f64; 3]) -> f64 {
    Vector3::from(*v).norm()
}

fn separation_m(truth: &[FootTruth; 2]) -> f64 {
    (Vector3::from(truth[0].position_n_m) - Vector3::from(truth[1].position_n_m)).norm()
}

fn middle_n_m(truth: &[FootTruth; 2]) -> Vector3<f64> {
    0.5 * (Vector3::from(truth[0].position_n_m) + Vector3::from(truth[1].position_n_m))
}

fn perfect(kind: WalkKind) -> Walk {
    simulate(&kind, 1, &Site::fast(), &SensorModel::perfect())
}

fn log_bits(log: &[ImuSample]) -> Vec<u64> {
    let bits = |v: &[f64; 3]| v.map(f64::to_bits);
    log.iter()
        .flat_map(|sample| {
            let mag = sample.mag_b_ut.unwrap_or_default();
            [bits(&sample.w_ib_b_rad_s), bits(&sample.f_b_m_s2), bits(&mag)]
                .concat()
                .into_iter()
                .chain([sample.t_ns as u64, sample.pressure_hpa.unwrap_or_default().to_bits()])
        })
        .collect()
}

#[test]
fn integrating_the_readings_of_a_perfect_sensor_returns_the_truth() {
    let model = SensorModel {
        imu: ImuModel { rate_hz: 2000.0, ..SensorModel::perfect().imu },
        ..SensorModel::perfect()
    };
    let site = Site::fast();
    let walk = simulate(&WalkKind::Line { metres: 15.0 }, 3, &site, &model);
    let dt = 1.0 / model.imu.rate_hz;
    let gravity = Vector3::new(0.0, 0.0, -site.gravity_m_s2);
    for (foot, log) in [&walk.left, &walk.right].into_iter().enumerate() {
        let start = walk.truth[0][foot];
        let mut attitude = start.q_nb;
        let mut velocity = Vector3::from(start.velocity_n_m_s);
        let mut position = Vector3::from(start.position_n_m);
        for (sample, truth) in log.iter().zip(&walk.truth).skip(1) {
            let turned = UnitQuaternion::from_scaled_axis(Vector3::from(sample.w_ib_b_rad_s) * dt);
            let halfway = UnitQuaternion::from_scaled_axis(Vector3::from(sample.w_ib_b_rad_s) * (0.5 * dt));
            let acceleration = attitude * (halfway * Vector3::from(sample.f_b_m_s2)) + gravity;
            position += velocity * dt + acceleration * (0.5 * dt * dt);
            velocity += acceleration * dt;
            attitude *= turned;
            let truth = truth[foot];
            assert!(attitude.angle_to(&truth.q_nb) < 1e-5, "{} rad", attitude.angle_to(&truth.q_nb));
            assert!((velocity - Vector3::from(truth.velocity_n_m_s)).norm() < 2e-3, "at {} ns", sample.t_ns);
            assert!((position - Vector3::from(truth.position_n_m)).norm() < 1e-2, "at {} ns", sample.t_ns);
        }
    }
}

#[test]
fn at_rest_a_perfect_sensor_reads_gravity_no_rate_and_the_site_s_field() {
    let site = Site::fast();
    let walker = Walker { micro_motion: 0.0, ..Walker::default() };
    let kind = WalkKind::Standing { seconds: 2.0 };
    let walk = Simulator::with_walker(&kind, 1, &site, &SensorModel::perfect(), walker).into_walk();
    assert_eq!(walk.left.len(), 200);
    for (sample, truth) in walk.left.iter().zip(&walk.truth) {
        assert!((norm(&sample.f_b_m_s2) - site.gravity_m_s2).abs() < 1e-12);
        assert_eq!(sample.w_ib_b_rad_s, [0.0; 3]);
        let up = truth[0].q_nb * Vector3::from(sample.f_b_m_s2);
        assert!((up - Vector3::z() * site.gravity_m_s2).norm() < 1e-9);
        let field = truth[0].q_nb * Vector3::from(sample.mag_b_ut.unwrap());
        assert!((field - Vector3::from(site.magnetic_field().b_n_ut)).norm() < 1e-9);
        let height_m = 44_330.0 * (1.0 - (sample.pressure_hpa.unwrap() / 1013.25f64).powf(1.0 / 5.255));
        assert!((height_m - site.height_m - truth[0].position_n_m[2]).abs() < 1e-6);
    }
    assert!(norm(&walk.start_n_m()) < 1e-9, "the middle of the feet stands at the origin");
}

#[test]
fn a_sensor_on_the_instep_points_down_to_the_toes_and_the_heading_is_its_own() {
    // The foot stands north, toes 0.1 rad out; the sensor is turned on it and tilted.
    let walker = Walker { micro_motion: 0.0, ..Walker::default() };
    let kind = WalkKind::Standing { seconds: 0.1 };
    let model = SensorModel { mounting_deg: [[0.0, 24.0, 6.0], [0.0, 30.0, -9.0]], ..SensorModel::perfect() };
    let walk = Simulator::with_walker(&kind, 1, &Site::fast(), &model, walker).into_walk();
    // Toe-out and the mounting's yaw turn the left sensor to the west, the right one to the east.
    let (left, right) = (walk.truth[0][0].heading_rad, walk.truth[0][1].heading_rad);
    assert!((left + 0.1 + 6f64.to_radians()).abs() < 0.07, "{left}");
    assert!((right - 0.1 - 9f64.to_radians()).abs() < 0.07, "{right}");
    // Nose down by 24°, the x axis reads −g sin 24°.
    let x = walk.left[0].f_b_m_s2[0] / Site::fast().gravity_m_s2;
    assert!((x + 24f64.to_radians().sin()).abs() < 0.03, "{x}");
}

#[test]
fn a_sole_gives_in_each_stance_and_comes_back_with_the_heel() {
    let walker = Walker { micro_motion: 0.0, sole_m: 0.006, ..Walker::default() };
    let kind = WalkKind::Line { metres: 12.0 };
    let walk = Simulator::with_walker(&kind, 1, &Site::fast(), &SensorModel::perfect(), walker).into_walk();
    let feet: Vec<_> = walk.truth.iter().map(|feet| (feet[0].stance, feet[0].position_n_m[2])).collect();
    let landings: Vec<usize> = (1..feet.len()).filter(|k| feet[*k].0 && !feet[k - 1].0).collect();
    assert!(landings.len() > 7);
    for pair in landings.windows(2) {
        let lifts = (pair[0]..pair[1]).find(|k| !feet[*k].0).unwrap();
        // Most of it shows between the first and the last sample of the stance.
        let sunk_m = feet[pair[0]].1 - feet[lifts - 1].1;
        assert!((0.0055..0.0061).contains(&sunk_m), "{sunk_m} m");
    }
    let risen_m = feet[feet.len() - 1].1 - feet[0].1;
    assert!((risen_m + 0.006).abs() < 0.004, "no drift but the last sinking: {risen_m} m");
}

#[test]
fn a_crawling_foot_points_down_and_goes_half_a_metre_a_second() {
    let kind = WalkKind::Crawl { metres: 10.0 };
    let walk = simulate(&kind, 1, &Site::fast(), &SensorModel::perfect());
    let middle = walk.truth.len() / 2;
    let pitched = walk.truth[middle - 300..middle + 300].iter().filter(|feet| {
        // The mounting's 24° and the foot's 46°.
        let x_n = feet[0].q_nb * Vector3::x();
        x_n.z < -0.8
    });
    assert!(pitched.count() > 500);
    let walking_s = walk.truth.len() as f64 / 100.0 - 17.0;
    assert!((0.4..0.6).contains(&(10.0 / walking_s)), "{walking_s} s");
}

#[test]
fn the_earth_turns_under_a_standing_foot() {
    let model = SensorModel { earth_rotation: true, ..SensorModel::perfect() };
    let walker = Walker { micro_motion: 0.0, ..Walker::default() };
    let kind = WalkKind::Standing { seconds: 1.0 };
    let walk = Simulator::with_walker(&kind, 1, &Site::fast(), &model, walker).into_walk();
    let rate = walk.truth[50][1].q_nb * Vector3::from(walk.right[50].w_ib_b_rad_s);
    let latitude = Site::fast().latitude_deg.to_radians();
    let expected = 7.292_115e-5 * Vector3::new(0.0, latitude.cos(), latitude.sin());
    assert!((rate - expected).norm() < 1e-12);
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_another_walk() {
    let walk = |seed| simulate(&WalkKind::Line { metres: 20.0 }, seed, &Site::fast(), &SensorModel::cmp10a());
    let (a, b, c) = (walk(7), walk(7), walk(8));
    assert_eq!(log_bits(&a.left), log_bits(&b.left));
    assert_eq!(log_bits(&a.right), log_bits(&b.right));
    assert_ne!(log_bits(&a.left), log_bits(&a.right));
    assert_ne!(log_bits(&a.left), log_bits(&c.left));
}

#[test]
fn one_stream_does_not_disturb_another() {
    // Without a magnetometer the gyros say the same.
    let quiet = SensorModel { magnetometer: None, ..SensorModel::cmp10a() };
    let kind = WalkKind::Line { metres: 5.0 };
    let a = simulate(&kind, 2, &Site::fast(), &SensorModel::cmp10a());
    let b = simulate(&kind, 2, &Site::fast(), &quiet);
    for (a, b) in a.right.iter().zip(&b.right) {
        assert_eq!(
            (a.w_ib_b_rad_s, a.f_b_m_s2, a.pressure_hpa),
            (b.w_ib_b_rad_s, b.f_b_m_s2, b.pressure_hpa)
        );
        assert_eq!(b.mag_b_ut, None);
    }
}

#[test]
fn the_rectangle_is_1_4_km_in_about_20_minutes_and_closes() {
    let walk = perfect(WalkKind::Rectangle);
    assert!((walk.distance_m - 1400.0).abs() < 5.0, "{}", walk.distance_m);
    let minutes = walk.left.len() as f64 * 0.01 / 60.0;
    assert!((18.0..21.0).contains(&minutes), "{minutes} min");
    let end = middle_n_m(walk.truth.last().unwrap());
    assert!(end.norm() < 0.05, "ends {end:?} from its start");
    let (east, north): (Vec<f64>, Vec<f64>) =
        walk.truth.iter().map(|t| (middle_n_m(t).x, middle_n_m(t).y)).unzip();
    let span =
        |v: &[f64]| v.iter().copied().fold(f64::MIN, f64::max) - v.iter().copied().fold(f64::MAX, f64::min);
    assert!((span(&east) - 200.0).abs() < 0.5 && (span(&north) - 500.0).abs() < 0.5);
}

#[test]
fn the_spiral_is_3_3_km_in_270_000_epochs_with_a_stop_every_150_m() {
    let site = Site::fast();
    let anchors = crate::geo::terrain::anchors(&site);
    let mut off = Vec::new();
    for seed in 1..=5 {
        let walk = simulate(&WalkKind::Spiral, seed, &site, &SensorModel::perfect());
        assert_eq!((walk.left.len(), walk.right.len(), walk.truth.len()), (270_000, 270_000, 270_000));
        assert!((walk.distance_m - 3300.0).abs() < 40.0, "{}", walk.distance_m);
        assert_eq!(walk.visits.len(), 22);
        let standing_end = walk.truth.iter().rev().take_while(|t| t[0].stance && t[1].stance).count();
        assert!((1100..4000).contains(&standing_end), "stands {standing_end} epochs at the end");
        let mut before = walk.start_n_m();
        for visit in &walk.visits {
            let anchor = anchors.iter().find(|anchor| anchor.name == visit.marker).unwrap();
            assert_eq!(anchor.position_n_m, visit.position_n_m);
            let seconds = (visit.t_end_ns - visit.t_start_ns) as f64 * 1e-9;
            assert!((10.0..14.0).contains(&seconds), "{seconds} s at {}", visit.marker);
            let epochs = (visit.t_start_ns / 10_000_000 + 1) as usize..(visit.t_end_ns / 10_000_000) as usize;
            assert!(walk.truth[epochs.clone()].iter().all(|t| t[0].stance && t[1].stance));
            let stood = middle_n_m(&walk.truth[(epochs.start + epochs.end) / 2]);
            off.extend((stood - Vector3::from(visit.position_n_m)).iter());
            let crow_m = (Vector3::from(visit.position_n_m) - Vector3::from(before)).norm();
            assert!((20.0..175.0).contains(&crow_m), "{crow_m} m to {}", visit.marker);
            before = visit.position_n_m;
        }
    }
    // 330 draws of one metre: the sample's sigma is within 12 % (3σ), its mean within 0.17 m.
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let sigma = (off.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / off.len() as f64).sqrt();
    assert!((sigma - 1.0).abs() < 0.12, "sigma {sigma}");
    assert!(mean.abs() < 0.17, "mean {mean}");
}

#[test]
fn stairs_go_up_72_treads_and_come_down_again() {
    let walk = perfect(WalkKind::Stairs);
    let heights: Vec<f64> = walk.truth.iter().map(|t| middle_n_m(t).z).collect();
    let top = heights.iter().copied().fold(0.0, f64::max);
    assert!((top - 72.0 * 0.17).abs() < 0.25, "{top}");
    assert!(heights.last().unwrap().abs() < 0.01);
    // Standing feet stand on treads.
    let treads = walk.truth.iter().filter(|t| t[0].stance).map(|t| t[0].position_n_m[2] / 0.17);
    for tread in treads {
        assert!((tread - tread.round()).abs() < 0.05, "a foot stands at {tread} treads");
    }
}

#[test]
fn walking_feet_move_as_walking_feet_do() {
    let walk = perfect(WalkKind::Rectangle);
    let moving = &walk.truth[2000..100_000];
    let stance = moving.iter().filter(|t| t[0].stance).count() as f64 / moving.len() as f64;
    assert!((0.40..0.45).contains(&stance), "stance share {stance}");
    let speed = (walk.distance_m - 20.0) / (walk.left.len() as f64 * 0.01 - 17.0);
    assert!((1.2..1.3).contains(&speed), "{speed} m/s");
    let fastest = moving.iter().map(|t| norm(&t[1].velocity_n_m_s)).fold(0.0, f64::max);
    assert!((3.5..5.2).contains(&fastest), "a foot reaches {fastest} m/s");
    let quickest = walk.right.iter().map(|s| norm(&s.w_ib_b_rad_s)).fold(0.0, f64::max);
    assert!((4.0..8.5).contains(&quickest), "a foot turns at {quickest} rad/s");
    let hardest = walk.right.iter().map(|s| norm(&s.f_b_m_s2)).fold(0.0, f64::max) / 9.8;
    assert!((3.0..8.0).contains(&hardest), "a heel strikes with {hardest} g");
    // In stance it rolls a little, but a stance detector will know it.
    let stood = walk.left.iter().zip(&walk.truth).filter(|(_, t)| t[0].stance);
    let rates: Vec<f64> = stood.map(|(s, _)| norm(&s.w_ib_b_rad_s)).collect();
    let rms = (rates.iter().map(|w| w * w).sum::<f64>() / rates.len() as f64).sqrt();
    assert!((0.02..0.08).contains(&rms), "{rms} rad/s in stance");
}

#[test]
fn in_mid_swing_the_feet_pass_at_a_hand_s_breadth() {
    for kind in [WalkKind::Rectangle, WalkKind::Running, WalkKind::Spiral] {
        let walk = perfect(kind);
        let apart: Vec<f64> = walk.truth.iter().map(separation_m).collect();
        let mut passing: Vec<f64> =
            apart.windows(3).filter(|w| w[1] < w[0] && w[1] <= w[2] && w[1] < 0.4).map(|w| w[1]).collect();
        passing.sort_by(f64::total_cmp);
        let at = |share: f64| passing[(share * (passing.len() - 1) as f64) as usize];
        assert!(passing.len() > 500, "{kind:?}: {} times", passing.len());
        assert!((0.12..0.15).contains(&at(0.5)), "{kind:?}: median {}", at(0.5));
        assert!(at(0.02) > 0.10 && at(0.98) < 0.19, "{kind:?}: {} to {}", at(0.02), at(0.98));
        assert!(passing[0] > 0.06, "{kind:?}: {} m, feet touch", passing[0]);
        // Never both in the air while walking.
        if kind != WalkKind::Running {
            assert!(apart.iter().all(|&m| m < 1.1), "{kind:?}");
        }
    }
}

#[test]
fn running_has_short_stances_a_flight_phase_and_hard_landings() {
    let walk = perfect(WalkKind::Running);
    let n = walk.truth.len();
    let run = n * 70 / 100..n * 87 / 100;
    let stance = walk.truth[run.clone()].iter().filter(|t| t[0].stance).count() as f64 / run.len() as f64;
    assert!((0.22..0.32).contains(&stance), "{stance}");
    assert!(stance < 1.0 - Gait::Walk.shape().moving_share);
    let hardest = walk.left[run].iter().map(|s| norm(&s.f_b_m_s2)).fold(0.0, f64::max) / 9.8;
    assert!((5.0..14.0).contains(&hardest), "{hardest} g");
}

#[test]
fn biases_and_noise_have_their_sigmas_over_the_seeds() {
    let walker = Walker { micro_motion: 0.0, ..Walker::default() };
    let model = SensorModel { earth_rotation: false, ..SensorModel::cmp10a() };
    let site = Site::fast();
    let (mut gyro_means, mut gyro_scatter, mut lengths) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..60 {
        let kind = WalkKind::Standing { seconds: 4.0 };
        let walk = Simulator::with_walker(&kind, seed, &site, &model, walker.clone()).into_walk();
        for log in [&walk.left, &walk.right] {
            for axis in 0..3 {
                let values: Vec<f64> = log.iter().map(|s| s.w_ib_b_rad_s[axis].to_degrees()).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                gyro_means.push(mean);
                gyro_scatter
                    .push(values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64);
            }
            let mean_length = log.iter().map(|s| norm(&s.f_b_m_s2)).sum::<f64>() / log.len() as f64;
            lengths.push(mean_length - site.gravity_m_s2);
        }
    }
    let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    // 360 biases: 3σ of a sample sigma is 11 %.
    assert!((rms(&gyro_means) / 0.4 - 1.0).abs() < 0.12, "turn-on bias {} °/s", rms(&gyro_means));
    let noise = (gyro_scatter.iter().sum::<f64>() / gyro_scatter.len() as f64).sqrt();
    // 0.01 °/s/√Hz at 100 Hz is 0.1 °/s; rounding to 0.061 °/s adds a little.
    assert!((0.098..0.106).contains(&noise), "{noise}");
    // At rest the length is wrong by bias and scale: √(0.06² + (0.004 · 9.787)²) = 0.072 m/s².
    assert!((rms(&lengths) / 0.072 - 1.0).abs() < 0.2, "{} m/s²", rms(&lengths));
}

#[test]
fn the_gyro_bias_walks_as_its_figure_says() {
    // Everything but the walk is off; it is 0.0015 °/s/√s: 0.0116 °/s after a minute.
    let model = SensorModel {
        imu: ImuModel { gyro_bias_walk_deg_s_rts: 0.0015, ..SensorModel::perfect().imu },
        ..SensorModel::perfect()
    };
    let walker = Walker { micro_motion: 0.0, ..Walker::default() };
    let mut ends = Vec::new();
    for seed in 0..40 {
        let kind = WalkKind::Standing { seconds: 60.0 };
        let walk = Simulator::with_walker(&kind, seed, &Site::fast(), &model, walker.clone()).into_walk();
        for log in [&walk.left, &walk.right] {
            ends.extend(log.last().unwrap().w_ib_b_rad_s.map(f64::to_degrees));
        }
    }
    let rms = (ends.iter().map(|x| x * x).sum::<f64>() / ends.len() as f64).sqrt();
    assert!((rms / (0.0015 * 60f64.sqrt()) - 1.0).abs() < 0.14, "{rms} °/s");
}

#[test]
fn readings_are_whole_steps_within_the_range() {
    let model = SensorModel {
        imu: ImuModel { gyro_range_deg_s: 250.0, accel_range_g: 2.0, ..SensorModel::cmp10a().imu },
        ..SensorModel::cmp10a()
    };
    let walk = simulate(&WalkKind::Line { metres: 20.0 }, 4, &Site::fast(), &model);
    let (gyro_step, accel_step) = (250f64.to_radians() / 32768.0, 2.0 * 9.80665 / 32768.0);
    let mut saturated = 0;
    for sample in &walk.left {
        for (values, step) in [(sample.w_ib_b_rad_s, gyro_step), (sample.f_b_m_s2, accel_step)] {
            for value in values {
                let code = value / step;
                assert!((code - code.round()).abs() < 1e-6, "{code} is no whole code");
                assert!((-32768.5..32767.5).contains(&code));
                saturated += usize::from(code.round() == 32767.0 || code.round() == -32768.0);
            }
        }
    }
    assert!(saturated > 100, "heel strikes pass 2 g: {saturated}");
}

#[test]
fn both_barometers_feel_the_same_weather() {
    let weather = BarometerModel { drift_m_rts: 0.05, offset_m: 30.0, ..BarometerModel::perfect() };
    let model = SensorModel { barometer: Some(weather), ..SensorModel::perfect() };
    let mut drifts_hpa = Vec::new();
    for seed in 0..30 {
        let walk = simulate(&WalkKind::Standing { seconds: 100.0 }, seed, &Site::fast(), &model);
        let difference = |i: usize| walk.left[i].pressure_hpa.unwrap() - walk.right[i].pressure_hpa.unwrap();
        assert!((0..10_000).all(|i| difference(i).abs() < 0.01), "one sole stands as high as the other");
        drifts_hpa.push(walk.left[9_999].pressure_hpa.unwrap() - walk.left[0].pressure_hpa.unwrap());
    }
    // 0.5 m in 100 s, at about 0.105 hPa/m.
    let rms = (drifts_hpa.iter().map(|x| x * x).sum::<f64>() / drifts_hpa.len() as f64).sqrt();
    assert!((0.035..0.075).contains(&rms), "{rms} hPa");
}

#[test]
fn streaming_and_the_whole_walk_are_the_same() {
    let kind = WalkKind::Line { metres: 10.0 };
    let mut stream = Simulator::new(&kind, 9, &Site::fast(), &SensorModel::cmp10a());
    let walk = simulate(&kind, 9, &Site::fast(), &SensorModel::cmp10a());
    assert_eq!(stream.epochs(), walk.left.len());
    assert_eq!(stream.start_n_m(), walk.start_n_m());
    for ((left, right), truth) in walk.left.iter().zip(&walk.right).zip(&walk.truth) {
        let epoch = stream.next_epoch().unwrap();
        assert_eq!((&epoch.samples[0], &epoch.samples[1], &epoch.truth), (left, right, truth));
    }
    assert_eq!(stream.next_epoch(), None);
}

#[test]
fn walks_are_found_by_name() {
    assert_eq!("spiral".parse(), Ok(WalkKind::Spiral));
    assert_eq!("line:12.5".parse(), Ok(WalkKind::Line { metres: 12.5 }));
    for wrong in [
        "",
        "spirale",
        "line",
        "line:",
        "line:-3",
        "line:1e12",
        "standing:inf",
        "standing:1e9",
        "rectangle:2",
    ] {
        let error = wrong.parse::<WalkKind>().unwrap_err();
        assert!(error.contains("choose rectangle"), "{error}");
    }
}

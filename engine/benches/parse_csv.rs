//! What a row of the canonical log costs to read: at most 0.6 µs is asked for.

use divan::counter::ItemsCount;
use lodestep_engine::parse::{ImuCsv, imu_csv};
use lodestep_engine::sample::ImuSample;

fn main() {
    divan::main();
}

/// Rows of the length that a logger writes: eleven columns, about 90 bytes.
fn log(rows: u32) -> String {
    let samples: Vec<ImuSample> = (0..rows)
        .map(|i| {
            let value =
                |scale: f64, steps: f64| (f64::from(i * 7919 % 10_007) * scale * steps).round() / steps;
            ImuSample {
                t_ns: i64::from(i) * 10_000_000,
                w_ib_b_rad_s: [value(1e-3, 1e6), -value(2e-4, 1e6), value(3e-5, 1e6)],
                f_b_m_s2: [value(1e-3, 1e5), -value(2e-4, 1e5), 9.8 + value(1e-5, 1e5)],
                mag_b_ut: Some([value(3e-3, 1e2), -value(1e-3, 1e2), 40.0]),
                pressure_hpa: Some(890.0 + value(1e-4, 1e3)),
            }
        })
        .collect();
    let mut text = String::new();
    imu_csv::write(&samples, true, &mut text);
    text
}

#[divan::bench]
fn imu_rows(bencher: divan::Bencher<'_, '_>) {
    const ROWS: u32 = 10_000;
    let log = log(ROWS);
    let mut samples = Vec::with_capacity(ROWS as usize);
    bencher.counter(ItemsCount::new(ROWS)).bench_local(|| {
        samples.clear();
        let mut parser = ImuCsv::new();
        for piece in log.as_bytes().chunks(64 << 10) {
            parser.push(piece, &mut samples).expect("the log is right");
        }
        parser.finish(&mut samples).expect("the log is right");
        assert_eq!(samples.len(), ROWS as usize);
    });
}

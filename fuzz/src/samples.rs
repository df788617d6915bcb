//! Samples told apart by their bits, so that NaN is like itself.

use lodestep_engine::sample::ImuSample;

/// A sample as integers; every NaN is the same one.
pub(crate) fn bits(sample: &ImuSample) -> [i64; 13] {
    let of = |value: f64| if value.is_nan() { -1 } else { value.to_bits() as i64 };
    let [gx, gy, gz] = sample.w_ib_b_rad_s.map(of);
    let [ax, ay, az] = sample.f_b_m_s2.map(of);
    let [mx, my, mz] = sample.mag_b_ut.unwrap_or_default().map(of);
    let pressure = sample.pressure_hpa.map_or(0, of);
    let (mag, has_pressure) =
        (i64::from(sample.mag_b_ut.is_some()), i64::from(sample.pressure_hpa.is_some()));
    [sample.t_ns, gx, gy, gz, ax, ay, az, mx, my, mz, pressure, mag, has_pressure]
}

/// That two runs of samples are the same to the bit.
pub(crate) fn assert_same(a: &[ImuSample], b: &[ImuSample]) {
    assert_eq!(a.len(), b.len());
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert_eq!(bits(a), bits(b), "sample {k}: {a:?}, {b:?}");
    }
}

//! A single sample that has nothing to do with its neighbours: a bit that flipped, a packet that was mixed up.

use nalgebra::Vector3;

use crate::sample::ImuSample;

/// No foot's rate leaves both neighbours behind by so much within a sample, rad/s: a heel strike may, by ten or fifteen,
const FAR_RAD_S: f64 = 20.0;
/// and they differ from each other by less than this share of it.
const NEAR_SHARE: f64 = 0.2;
/// Samples farther apart are no neighbours, ns.
const NEIGHBOURS_NS: i64 = 35_000_000;

/// How far the rate is from that of both neighbours, rad/s, and what lies between these, where the sample is a spike.
pub(crate) fn spike(before: &ImuSample, sample: &ImuSample, after: &ImuSample) -> Option<(f64, ImuSample)> {
    if after.t_ns - before.t_ns > NEIGHBOURS_NS {
        return None;
    }
    let of = |pick: fn(&ImuSample) -> [f64; 3]| [before, sample, after].map(|s| Vector3::from(pick(s)));
    let [rate_before, rate, rate_after] = of(|s| s.w_ib_b_rad_s);
    let [force_before, _, force_after] = of(|s| s.f_b_m_s2);
    let off_rad_s = (rate - rate_before).norm().min((rate - rate_after).norm());
    let turns = off_rad_s > FAR_RAD_S && (rate_after - rate_before).norm() < NEAR_SHARE * off_rad_s;
    if !turns {
        return None;
    }
    let between = ImuSample {
        w_ib_b_rad_s: (0.5 * (rate_before + rate_after)).into(),
        f_b_m_s2: (0.5 * (force_before + force_after)).into(),
        ..*sample
    };
    Some((off_rad_s, between))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: i64, w: f64, f: f64) -> ImuSample {
        ImuSample {
            t_ns: k * 10_000_000,
            w_ib_b_rad_s: [0.0, w, 0.0],
            f_b_m_s2: [0.0, 0.0, f],
            mag_b_ut: None,
            pressure_hpa: None,
        }
    }

    #[test]
    fn what_stands_alone_is_a_spike_and_a_fast_swing_or_a_heel_strike_is_none() {
        let is = |rates: [f64; 3], forces: [f64; 3]| {
            let [a, b, c] = [0, 1, 2].map(|k| sample(k as i64, rates[k], forces[k]));
            spike(&a, &b, &c).map(|(_, between)| between.w_ib_b_rad_s[1])
        };
        assert_eq!(is([1.0, 30.0, 2.0], [9.8, 150.0, 9.8]), Some(1.5));
        assert_eq!(is([0.0, 0.1, 0.0], [9.8, 150.0, 9.7]), None);
        assert_eq!(is([2.0, 14.0, 20.0], [9.8, 12.0, 14.0]), None);
        assert_eq!(is([0.0, 3.0, 1.0], [14.0, 120.0, 30.0]), None);
    }
}

//! Whatever comes in, in any order: what goes out is finite and orderly.

use lodestep_engine::sample::ImuSample;
use lodestep_engine::session::{Session, SessionConfig, Visit};
use lodestep_engine::systems::pedestrian::{self, Side};
use proptest::prelude::*;

use crate::scenario::{PERIOD_NS, SECOND_NS};
use crate::told::Told;

/// The longest times that files and messages can hold.
const LONGEST_NS: i64 = 9_000_000_000 * SECOND_NS;

/// A number as a broken device may send it.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -20.0..20.0,
        2 => -2e3..2e3,
        1 => prop::sample::select(vec![0.0, -0.0, 1e-300, 1e300, f64::MAX, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
    ]
}

fn triad() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        // Most of the time a foot at rest, so that the filter is reached and not only the doorman.
        3 => (-0.05..0.05, -0.05..0.05, 9.7..9.9).prop_map(|(x, y, z)| [x, y, z]),
        1 => [number(), number(), number()],
    ]
}

fn rate() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![3 => [-0.02..0.02, -0.02..0.02, -0.02..0.02], 1 => [-9.0..9.0, -9.0..9.0, -9.0..9.0], 1 => triad()]
}

/// From one sample to the next, ns.
fn interval_ns() -> impl Strategy<Value = i64> {
    prop_oneof![
        20 => Just(PERIOD_NS),
        2 => 0..3 * PERIOD_NS,
        1 => -SECOND_NS..10 * SECOND_NS,
        1 => prop::sample::select(vec![0, 1, -1, 200 * PERIOD_NS, 86_400 * SECOND_NS, -86_400 * SECOND_NS, LONGEST_NS, -LONGEST_NS]),
    ]
}

/// What a device may do next.
#[derive(Clone, Debug)]
enum Deed {
    /// So many samples in a row, alike but for their time.
    Samples(Side, usize, i64, ImuSample),
    /// Someone says that the inspector stands somewhere.
    Visit(i64, f64, Option<f64>),
    /// A foot ends.
    End(Side),
}

fn deed() -> impl Strategy<Value = Deed> {
    let foot = || prop::sample::select(Side::BOTH.to_vec());
    let sample = (rate(), triad(), prop::option::of(triad()), prop::option::of(number())).prop_map(
        |(w_ib_b_rad_s, f_b_m_s2, mag_b_ut, pressure_hpa)| ImuSample {
            t_ns: 0,
            w_ib_b_rad_s,
            f_b_m_s2,
            mag_b_ut,
            pressure_hpa,
        },
    );
    prop_oneof![
        60 => (foot(), 1..40usize, interval_ns(), sample).prop_map(|(f, count, step, s)| Deed::Samples(f, count, step, s)),
        4 => (-20 * SECOND_NS..20 * SECOND_NS, -200.0..200.0, prop::option::of(-50.0..50.0))
            .prop_map(|(t, e, u)| Deed::Visit(t, e, u)),
        1 => foot().prop_map(Deed::End),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, rng_seed: prop::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn whatever_comes_in_what_goes_out_is_finite_and_orderly(
        deeds in prop::collection::vec(deed(), 1..80),
        lead_s in prop::option::of(0i64..20),
        feet in prop::sample::select(vec![vec![Side::Left], vec![Side::Right], Side::BOTH.to_vec()]),
    ) {
        let max_lead_ns = lead_s.map(|s| s * SECOND_NS);
        let config = SessionConfig { max_lead_ns, ..pedestrian::Config::default().session(&feet) };
        let (mut session, mut events) = (Session::new(config).unwrap(), Vec::new());
        let mut now_ns = [0_i64; 2];
        for deed in deeds {
            match deed {
                Deed::Samples(foot, count, step_ns, sample) => {
                    for k in 0..count {
                        let t_ns = &mut now_ns[foot.index()];
                        let step_ns = if k == 0 { step_ns } else { PERIOD_NS };
                        *t_ns = t_ns.saturating_add(step_ns).clamp(-LONGEST_NS, LONGEST_NS);
                        // Not to the bit alike, or every run would be one of stuck axes.
                        let mut sample = ImuSample { t_ns: *t_ns, ..sample };
                        sample.f_b_m_s2[0] += 1e-3 * (k as f64 * 0.7).sin();
                        session.push(foot, &sample, &mut events);
                    }
                }
                Deed::Visit(from_now_ns, e_m, u_m) => {
                    let t_start_ns = now_ns[0].max(now_ns[1]).saturating_add(from_now_ns);
                    let visit = Visit {
                        marker: "M".to_owned(),
                        t_start_ns,
                        t_end_ns: t_start_ns.saturating_add(4 * SECOND_NS),
                        position_n_m: (e_m, -e_m, u_m),
                    };
                    session.visit(visit, &mut events);
                }
                Deed::End(foot) => session.end(foot, &mut events),
            }
        }
        session.finish(&mut events);
        Told::check(events, session.summary());
    }
}

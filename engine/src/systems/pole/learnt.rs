//! What a first pass says of ground, solutions and sensor, by its own innovations: the second one goes by it.

use nalgebra::Vector3;

use super::landing::Scatter;
use super::pass::{Closure, Pass};
use super::recording::{Fix, Quality};
use super::tuning::Tuning;

/// What a stand's looks scatter by is only its new part: what a hand and a round tip make lasts from look to look, so that
/// more is taken for new than is seen.
const MORE_THAN_SEEN: f64 = 1.75;
/// So many looks say how well a tip stands: some ten seconds.
const FEWEST_LOOKS: usize = 100;
/// In which shares of what is told a stand's sigma is looked for.
const STAND_SHARES: [f64; 2] = [0.5, 2.0];
/// So many looks at tips that have just landed say whether they settle.
const FEWEST_SETTLING: usize = 20;
/// A tip that sinks does so one way, look after look, which is more than as many steps any way.
const ONE_WAY: f64 = 2.0;
/// Of what looks scatter by so much stays: the tip has crept or slipped.
const STAYS: f64 = 0.3;
/// What sinks by less between two looks is not seen to, m.
const UNSEEN_M: f64 = 2e-4;
/// So many solutions say how they scatter.
const FEWEST_FIXES: usize = 20;
/// The median of the normalised innovation squared of three axes.
const MEDIAN: f64 = 2.366;
/// Solutions scatter by no more than so many times what they say.
const MOST_SCATTER: f64 = 3.0;
/// What is believed of the sigmas before a gap has closed, in degrees of freedom.
const BELIEVED: f64 = 4.0;
/// A gap that is off by more than this, in sigmas by axis, is off by a wrong fix and not by wrong sigmas.
const MOST_MISCLOSED: f64 = 8.0;

/// The tuning with what a pass has seen.
pub(super) fn tuned(tuning: &Tuning, pass: &Pass) -> Tuning {
    let mut tuning = tuning.clone();
    stands(&mut tuning, pass);
    settling(&mut tuning, pass);
    solutions(&mut tuning, pass);
    tuning
}

/// Each look says how well the tip stands where it stood at the one before.
fn stands(tuning: &mut Tuning, pass: &Pass) {
    let steady = || pass.landings.iter().filter(|landing| landing.refused == 0);
    let looks: usize = steady().map(|landing| landing.looks).sum();
    if looks >= FEWEST_LOOKS {
        let nis: f64 = steady().map(|landing| landing.nis).sum::<f64>() / (3 * looks) as f64;
        let [least, most] = STAND_SHARES;
        let share = (MORE_THAN_SEEN * nis.sqrt()).clamp(least, most);
        tuning.landing.sigma_m = tuning.landing.sigma_m.map(|sigma_m| sigma_m * share);
    }
}

/// On soft ground a tip that has just landed sinks: looks at its height scatter more than later ones. In plan what scatters then
/// is how fast the pole came down, which tells nothing of the ground.
fn settling(tuning: &mut Tuning, pass: &Pass) {
    let all = |of: usize| {
        pass.landings.iter().filter(|landing| !landing.restless).map(|landing| landing.settling[of]).fold(
            Scatter::default(),
            |sum, more| Scatter {
                squares_m2: [0, 1].map(|k: usize| sum.squares_m2[k] + more.squares_m2[k]),
                looks: sum.looks + more.looks,
            },
        )
    };
    let [early, late] = [all(0), all(1)];
    if early.looks < FEWEST_SETTLING || late.looks < FEWEST_SETTLING {
        return;
    }
    let step_s = tuning.step_s[0];
    let mean = |of: &Scatter, axis: usize| of.squares_m2[axis] / of.looks as f64;
    let sinks_m2 = mean(&early, 1) - 2.0 * mean(&late, 1) - UNSEEN_M * UNSEEN_M;
    tuning.landing.settling_m_sqrt_s = [0.0, (ONE_WAY * sinks_m2.max(0.0) / step_s).sqrt()];
    // In plan the squares are of two axes.
    let [plan, height] = [0.5 * mean(&late, 0), mean(&late, 1)].map(|m2| (STAYS * m2 / step_s).sqrt());
    let creep = &mut tuning.landing.creep_m_sqrt_s;
    *creep = [creep[0].max(plan), creep[1].max(height)];
}

/// Solutions that say less of themselves than they scatter by.
fn solutions(tuning: &mut Tuning, pass: &Pass) {
    let mut nis: Vec<f64> = pass.weighed.iter().map(|fix| fix.nis).collect();
    if nis.len() < FEWEST_FIXES {
        return;
    }
    let middle = nis.len() / 2;
    let median = *nis.select_nth_unstable_by(middle, f64::total_cmp).1;
    let by = (median / MEDIAN).sqrt().clamp(1.0, MOST_SCATTER);
    let gnss = &mut tuning.gnss;
    gnss.white_share = gnss.white_share.map(|share| share * by);
    gnss.slow_share = gnss.slow_share.map(|share| share * by);
    gnss.lasting_share = gnss.lasting_share.map(|share| share * by);
    gnss.least_white_m *= by;
    gnss.least_slow_m *= by;
}

/// By how much variances are larger than the filter has them, by how the gaps close: 1 where they close as they should. A gap or
/// two are few, so that what was taken for granted before counts for something.
pub(super) fn variance_factor(closures: &[Closure]) -> f64 {
    let of = closures.iter().filter(|closure| closure.sigmas < MOST_MISCLOSED);
    let (nis, count) =
        of.fold((0.0, 0.0), |(nis, count), closure| (nis + 3.0 * closure.sigmas.powi(2), count + 3.0));
    ((BELIEVED + nis) / (BELIEVED + count)).max(1.0)
}

/// What a receiver errs by for longer than a survey lasts, nobody on it can see: the square of this share of what its fixed
/// solutions say, on the mean of them, in plan and height, m².
pub(super) fn lasting_m2(tuning: &Tuning, fixes: &[Fix]) -> Vector3<f64> {
    let [plan, height] = tuning.gnss.lasting_share;
    let fixed = || fixes.iter().filter(|fix| fix.quality == Quality::Fixed).map(|fix| fix.sigma_n_m);
    let count = fixed().count().max(1) as f64;
    let mean: Vector3<f64> = fixed().sum::<Vector3<f64>>() / count;
    mean.component_mul(&Vector3::new(plan, plan, height)).map(|m| m * m)
}

/// The tuning whose gate for fixes is as wide as variances that are so many times larger.
pub(super) fn widened(tuning: &Tuning, factor: f64) -> Tuning {
    let mut tuning = tuning.clone();
    tuning.gnss.gate *= factor;
    tuning
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_that_close_say_nothing_and_one_that_does_not_says_that_sigmas_are_too_small() {
        let closed = |sigmas: f64| Closure { at_s: 1.0, gap_s: 30.0, off_m: [0.0; 3], sigmas };
        assert_eq!(variance_factor(&[]), 1.0);
        assert_eq!(variance_factor(&[closed(0.5)]), 1.0);
        assert!((variance_factor(&[closed(4.0)]) - 52.0 / 7.0).abs() < 1e-12);
        assert!(variance_factor(&[closed(4.0), closed(4.0)]) > variance_factor(&[closed(4.0)]));
        // A wrong fix says nothing of sigmas.
        assert_eq!(variance_factor(&[closed(20.0)]), 1.0);
    }
}

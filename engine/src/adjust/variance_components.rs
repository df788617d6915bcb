//! Variance components by Helmert: how good groups of observations are, by their own residuals.
//!
//! The simplified estimate of a group is σ̂² = v'Pv / r, with its share r of the redundancy. An epoch alone has too little of it (a
//! component came out zero or negative in a third of the epochs of a doorway), so sums are kept over a window that forgets, begin with a
//! prior of some weight, and have a floor.

/// The variance factor of one group, 1 where observations are as good as was assumed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VarianceComponent {
    squares: f64,
    redundancy: f64,
    /// Redundancy that the window holds; older residuals fade.
    window: f64,
    floor: f64,
    ceiling: f64,
}

impl VarianceComponent {
    /// A group that is taken for as good as assumed, by `prior` redundant observations; the window holds `window` of them.
    pub fn new(prior: f64, window: f64, floor: f64, ceiling: f64) -> VarianceComponent {
        VarianceComponent { squares: prior, redundancy: prior, window, floor, ceiling }
    }

    /// Takes the residuals of an epoch: v'Pv with the weights that were assumed, and the group's share of the redundancy.
    pub fn take(&mut self, squares: f64, redundancy: f64) {
        if redundancy <= 0.0 || !squares.is_finite() {
            return;
        }
        let keep = (1.0 - redundancy / self.window).max(0.0);
        self.squares = self.squares * keep + squares;
        self.redundancy = self.redundancy * keep + redundancy;
    }

    /// The variance factor.
    pub fn factor(&self) -> f64 {
        (self.squares / self.redundancy).clamp(self.floor, self.ceiling)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_that_is_worse_than_assumed_is_found_out_and_one_epoch_moves_little() {
        let mut component = VarianceComponent::new(20.0, 200.0, 0.25, 100.0);
        component.take(2.0 * 4.0, 2.0);
        assert!(component.factor() < 1.5);
        for _ in 0..1000 {
            component.take(5.0 * 4.0, 5.0);
        }
        assert!((component.factor() - 4.0).abs() < 0.01);
    }

    #[test]
    fn an_epoch_without_redundancy_says_nothing_and_a_factor_has_its_floor() {
        let mut component = VarianceComponent::new(1.0, 10.0, 0.25, 100.0);
        component.take(7.0, 0.0);
        assert_eq!(component.factor(), 1.0);
        for _ in 0..100 {
            component.take(0.0, 5.0);
        }
        assert_eq!(component.factor(), 0.25);
    }
}

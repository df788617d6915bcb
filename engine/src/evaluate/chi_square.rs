//! Between which values a sum of normal squares lies.

/// The bounds that 95 of 100 sums of `count` normal squares keep, two-sided.
///
/// E. B. Wilson, M. M. Hilferty, *The distribution of chi-square*, Proceedings of the National Academy of
/// Sciences 17, 1931: the cube root of χ²/count is nearly normal. Within 1 % from five squares on.
pub fn chi_square_bounds_95(count: u64) -> [f64; 2] {
    const Z_975: f64 = 1.959_963_985;
    let k = count as f64;
    let spread = 2.0 / (9.0 * k);
    [-Z_975, Z_975].map(|z| k * (1.0 - spread + z * spread.sqrt()).max(0.0).powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_met() {
        // Quantiles 0.025 and 0.975 of 10, 50 and 100 degrees of freedom.
        for (count, low, high) in [(10, 3.247, 20.483), (50, 32.357, 71.420), (100, 74.222, 129.561)] {
            let [below, above] = chi_square_bounds_95(count);
            assert!((below / low - 1.0).abs() < 0.01 && (above / high - 1.0).abs() < 0.01, "{below} {above}");
        }
    }
}

//! An axis: where a value stands on it, and which values are written beside it.

/// One axis.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Axis {
    /// What it shows, with its unit.
    pub(in crate::cli) label: String,
    /// By powers of ten.
    pub(in crate::cli) logarithmic: bool,
}

impl Axis {
    pub(in crate::cli) fn linear(label: &str) -> Axis {
        Axis { label: label.to_owned(), logarithmic: false }
    }

    pub(in crate::cli) fn logarithmic(label: &str) -> Axis {
        Axis { label: label.to_owned(), logarithmic: true }
    }

    fn measure(&self, value: f64) -> Option<f64> {
        let measure = if self.logarithmic { value.log10() } else { value };
        measure.is_finite().then_some(measure)
    }

    /// From the smallest to the largest, in the axis' measure; never of no length.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> [f64; 2] {
        let (low, high) = values
            .filter_map(|value| self.measure(value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| (low.min(m), high.max(m)));
        if low > high {
            return [0.0, 1.0];
        }
        if high - low > 1e-9 * high.abs() {
            return [low, high];
        }
        let aside = if self.logarithmic { 0.5 } else { 0.5 * high.abs().max(1.0) };
        [low - aside, high + aside]
    }

    /// Where a value stands in a range, from 0 to 1.
    pub(super) fn place(&self, value: f64, [low, high]: [f64; 2]) -> Option<f64> {
        self.measure(value).map(|measure| (measure - low) / (high - low))
    }

    /// Up to about six round values in the range of `values`, with their places.
    pub(super) fn ticks(&self, values: impl Iterator<Item = f64>) -> Vec<(f64, String)> {
        let [low, high] = self.range(values);
        let round: Vec<f64> = if self.logarithmic && high - low >= 0.9 {
            let every = ((high - low) / 6.0).ceil().max(1.0);
            let first = (low - 1e-9).ceil();
            (0..)
                .map(|k| first + every * f64::from(k))
                .take_while(|m| *m <= high + 1e-9)
                .map(ten_to)
                .collect()
        } else {
            let (from, to) = if self.logarithmic { (ten_to(low), ten_to(high)) } else { (low, high) };
            let rough = (to - from) / 5.0;
            let unit = ten_to(rough.log10().floor());
            let step =
                [1.0, 2.0, 5.0, 10.0].map(|k| k * unit).into_iter().find(|s| *s >= rough).unwrap_or(rough);
            let first = (from / step - 1e-9).ceil();
            (0..).map(|k| (first + f64::from(k)) * step).take_while(|v| *v <= to + 1e-9 * step).collect()
        };
        round.into_iter().filter_map(|value| Some((self.place(value, [low, high])?, number(value)))).collect()
    }
}

fn ten_to(exponent: f64) -> f64 {
    10f64.powf(exponent)
}

/// Short and exact enough for an axis.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, values: &[f64]) -> Vec<String> {
        axis.ticks(values.iter().copied()).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round_and_lie_in_the_range() {
        let linear = Axis::linear("t, s");
        assert_eq!(labels(&linear, &[0.0, 10.0]), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(&linear, &[0.13, 0.41]), ["0.2", "0.3", "0.4"]);
        let logarithmic = Axis::logarithmic("sigma, m");
        assert_eq!(labels(&logarithmic, &[0.001, 10.0]), ["0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(labels(&logarithmic, &[2.0, 6.0]), ["2", "3", "4", "5", "6"]);
        for (place, _) in logarithmic.ticks([0.003, 4000.0].into_iter()) {
            assert!((0.0..=1.0).contains(&place));
        }
    }

    #[test]
    fn one_value_and_none_have_an_axis_too() {
        let axis = Axis::linear("x");
        assert_eq!(axis.place(3.0, axis.range([3.0].into_iter())), Some(0.5));
        assert_eq!(axis.range(std::iter::empty()), [0.0, 1.0]);
        assert_eq!(Axis::logarithmic("x").place(-1.0, [0.0, 1.0]), None);
    }
}

//! `lodestep predict height`: paper 2's question, by formula and by the filter that the formula is for.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use lodestep_engine::sim::white_noise;
use lodestep_engine::systems::vertical::riccati::{Riccati, Settled, settled_after_s};
use lodestep_engine::systems::vertical::{Setup, closed_form, printed_form, trial};

use super::height_sweep;
use crate::cli::failure::Failure;
use crate::cli::plot::{Axis, Chart, Mark, Series, svg, terminal};
use crate::cli::print::print;
use crate::cli::track_output::write_text;

const AFTER_HELP: &str = "\
The sigma is that of the filter over a gait cycle: the root of the height's mean variance. The defaults are
the CMP10A by its data sheet, its barometer read at 20 Hz, and an ordinary walk. Left out are tilt,
accelerometer bias and the weather: a barometer's drift is no noise, and what it adds stays.

Exit codes: 0 done; 1 something failed inside, or a result could not be written; 2 the command line is wrong.";

/// The arguments of `lodestep predict height`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(in crate::cli) struct HeightArgs {
    /// Noise of one altimeter reading, 1σ, m
    #[arg(long, value_name = "M", default_value_t = Setup::default().altimeter_sigma_m)]
    altimeter_sigma_m: f64,

    /// Altimeter readings a second, Hz
    #[arg(long, value_name = "HZ", default_value_t = Setup::default().altimeter_rate_hz)]
    altimeter_rate_hz: f64,

    /// IMU samples a second, Hz; each one in stance is a zero velocity
    #[arg(long, value_name = "HZ", default_value_t = Setup::default().imu_rate_hz)]
    imu_rate_hz: f64,

    /// Velocity random walk, m/s/√s; 1 mg/√Hz is 0.0098
    #[arg(long, value_name = "VRW", default_value_t = Setup::default().velocity_random_walk_m_s_sqrt_s)]
    velocity_random_walk_m_s_sqrt_s: f64,

    /// Noise of one zero velocity, 1σ, m/s
    #[arg(long, value_name = "M_S", default_value_t = Setup::default().zupt_sigma_m_s)]
    zupt_sigma_m_s: f64,

    /// Gait cycle of one foot, s
    #[arg(long, value_name = "S", default_value_t = Setup::default().stride_s)]
    stride_s: f64,

    /// Share of the gait cycle in which the foot stands, 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = Setup::default().stance_share)]
    stance_share: f64,

    /// Sigma of the height at the start, m; the velocity starts as standing still makes it
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    start_sigma_m: f64,

    /// Vary the altimeter: its sigma from 0.001 to 10 m, or its rate from 1 Hz to the IMU's, at most 100 Hz
    #[arg(long, value_enum)]
    sweep: Option<Sweep>,

    /// How often the filter is put to work on drawn noise; 0 leaves it out
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    trials: u32,

    /// The plot as a file, too
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Sweep {
    /// The altimeter's sigma
    Sigma,
    /// The altimeter's rate
    Rate,
}

/// One setup by all ways of working it out.
pub(super) struct Prediction {
    pub(super) closed_m: f64,
    /// √P₃₃ of the printed form; NaN where it has none.
    pub(super) printed_m: f64,
    /// Sample by sample; none where that would take too long.
    pub(super) filter: Option<Settled>,
    /// Drawn errors, rms, m; NaN where none were drawn.
    pub(super) drawn_m: f64,
    pub(super) settled_after_s: f64,
}

impl Prediction {
    pub(super) fn of(setup: &Setup, start_sigma_m: f64, trials: u32) -> Prediction {
        let mut riccati = Riccati::new(setup, start_sigma_m);
        let filter = riccati.settle();
        let drawn_m = if trials > 0 && filter.is_some() {
            trial::rms_m(&riccati, trials, &mut white_noise(1))
        } else {
            f64::NAN
        };
        Prediction {
            closed_m: closed_form::sigma_m(setup),
            printed_m: printed_form::printed_p33(setup).map_or(f64::NAN, f64::sqrt),
            filter,
            drawn_m,
            settled_after_s: closed_form::Settling::new(setup, start_sigma_m).settled_after_s(),
        }
    }

    /// How far a sigma is from the filter's, %.
    pub(super) fn percent(&self, sigma_m: f64) -> f64 {
        self.filter.map_or(f64::NAN, |filter| (sigma_m / filter.rms_m - 1.0) * 100.0)
    }
}

/// Prints and plots.
pub(in crate::cli) fn height(args: &HeightArgs) -> Result<()> {
    let setup = args.setup()?;
    let (text, chart) = match args.sweep {
        Some(sweep) => height_sweep::sweep(&setup, sweep, args.start_sigma_m, args.trials),
        None => (args.in_sentences(&setup), args.over_time(&setup)),
    };
    print(&format!("{text}\n{}", terminal(&chart)))?;
    if let Some(path) = &args.plot {
        write_text(path, &svg(&chart))?;
    }
    Ok(())
}

impl HeightArgs {
    fn setup(&self) -> Result<Setup> {
        let setup = Setup {
            altimeter_sigma_m: self.altimeter_sigma_m,
            altimeter_rate_hz: self.altimeter_rate_hz,
            imu_rate_hz: self.imu_rate_hz,
            velocity_random_walk_m_s_sqrt_s: self.velocity_random_walk_m_s_sqrt_s,
            zupt_sigma_m_s: self.zupt_sigma_m_s,
            stride_s: self.stride_s,
            stance_share: self.stance_share,
        };
        setup.check().map_err(Failure::usage)?;
        if !(0.0..=1e6).contains(&self.start_sigma_m) {
            return Err(Failure::usage(format!(
                "the start sigma has to be a number of m from 0 on, found {}",
                self.start_sigma_m
            )));
        }
        if self.plot.as_ref().is_some_and(|path| path.extension().is_none_or(|ending| ending != "svg")) {
            return Err(Failure::usage("--plot writes SVG: give a name that ends in .svg"));
        }
        Ok(setup)
    }

    fn in_sentences(&self, setup: &Setup) -> String {
        let prediction = Prediction::of(setup, self.start_sigma_m, self.trials);
        let mut text = format!(
            "An altimeter of {} m at {} Hz, an IMU of {} m/s/√s at {} Hz, zero velocity of {} m/s in {:.0} % of a \
             gait of {} s.\n\nThe height settles at a sigma of {} m.\n",
            setup.altimeter_sigma_m,
            setup.altimeter_rate_hz,
            setup.velocity_random_walk_m_s_sqrt_s,
            setup.imu_rate_hz,
            setup.zupt_sigma_m_s,
            100.0 * setup.stance_share,
            setup.stride_s,
            metres(prediction.closed_m)
        );
        let mut push = |line: String| writeln!(text, "{line}").expect("writing to a string cannot fail");
        if self.start_sigma_m > 0.0 {
            push(format!(
                "From {} m it is within 10 % of that after {}.",
                self.start_sigma_m,
                seconds(prediction.settled_after_s)
            ));
        } else {
            push(format!(
                "From a known height it is within 10 % of that after {}.",
                seconds(prediction.settled_after_s)
            ));
        }
        push(format!(
            "With zero velocity alone it would drift by {} m in the first minute, and with the root of the time.",
            metres((60.0 * closed_form::drift_m2_s(setup)).sqrt())
        ));
        match prediction.filter {
            Some(filter) => {
                push(String::new());
                push(format!(
                    "The filter sample by sample: {} m, from {} to {} in the gait; the formula is {:+.1} % off.",
                    metres(filter.rms_m),
                    metres(filter.smallest_m),
                    metres(filter.largest_m),
                    prediction.percent(prediction.closed_m)
                ));
                if let Some(after_s) = settled_after_s(setup, self.start_sigma_m) {
                    push(format!("  It has settled after {}.", seconds(after_s)));
                }
            }
            None => push("The filter sample by sample would take hours to settle and was left out.".into()),
        }
        if prediction.drawn_m.is_finite() {
            push(format!(
                "Put to work on drawn noise {} times, its error is {} m rms.",
                self.trials,
                metres(prediction.drawn_m)
            ));
        }
        push(if prediction.printed_m.is_finite() {
            format!(
                "Paper 2 as printed, its P₃₃ read as a variance in m²: {} m, {:+.0} % off.",
                metres(prediction.printed_m),
                prediction.percent(prediction.printed_m)
            )
        } else {
            "Paper 2 as printed has no value here: what is under its root is negative.".into()
        });
        text
    }

    /// The sigma from the start on, by the formula and sample by sample.
    fn over_time(&self, setup: &Setup) -> Chart {
        const STEPS: u32 = 240;
        let settling = closed_form::Settling::new(setup, self.start_sigma_m);
        // A chart of an hour holds what matters of a settling that takes days.
        let until_s = (2.5 * settling.settled_after_s()).clamp(3.0 * setup.stride_s, 7200.0);
        let times = (0..=STEPS).map(|k| until_s * f64::from(k) / f64::from(STEPS));
        let closed = times.skip(1).map(|t_s| [t_s, settling.sigma_m(t_s)]).collect();
        let mut riccati = Riccati::new(setup, self.start_sigma_m);
        let mut filter = Vec::new();
        let every_s = (until_s / 600.0).max(1.0 / setup.imu_rate_hz);
        let mut next_s = every_s;
        while riccati.t_s() < until_s {
            riccati.step();
            if riccati.t_s() >= next_s {
                filter.push([riccati.t_s(), riccati.sigma_m()]);
                next_s += every_s;
            }
        }
        Chart {
            title: "How the height settles".into(),
            x: Axis::linear("time, s"),
            y: Axis::logarithmic("sigma of the height, m"),
            series: vec![
                Series { name: "filter, sample by sample".into(), mark: Mark::Line, points: filter },
                Series { name: "closed form".into(), mark: Mark::Dashes, points: closed },
            ],
        }
    }
}

/// Three digits.
pub(super) fn metres(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let digits = (2.0 - value.abs().max(1e-12).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

fn seconds(value: f64) -> String {
    if value >= 600.0 { format!("{:.0} min", value / 60.0) } else { format!("{} s", metres(value)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_enough() {
        assert_eq!(
            [0.0123456, 1.2345, 123.4, 0.000_265_7].map(metres),
            ["0.0123", "1.23", "123", "0.000266"]
        );
        assert_eq!(metres(f64::NAN), "–");
        assert_eq!(seconds(1234.0), "21 min");
    }
}

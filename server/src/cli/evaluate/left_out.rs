//! Would another value of a parameter have been chosen without the recordings that it is judged on? Every set is left
//! out once, the value chosen that suits the others best, and the set judged with it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use lodestep_engine::parameters::Parameters;
use lodestep_engine::systems::pedestrian::Aids;

use super::recordings::{self, Recording};
use super::score::{Figures, score};
use crate::cli::failure::Failure;
use crate::cli::print::print;
use crate::cli::progress;
use crate::cli::solution::Solution;

/// The arguments of `lodestep evaluate left-out`.
#[derive(Debug, Args)]
pub(super) struct LeftOutArgs {
    /// A parameter and the values to choose from: stance.threshold=4,8,16
    #[arg(value_name = "KEY=VALUE,…", value_parser = choices)]
    choices: Choices,

    /// Recordings with a truth, or folders of them; recordings of one folder and one day are a set
    #[arg(value_name = "DIR|FILES", required = true)]
    paths: Vec<PathBuf>,

    /// Which solution to score
    #[arg(long, value_enum, default_value_t)]
    solution: Solution,
}

/// A parameter and the values to choose from.
#[derive(Clone, Debug, PartialEq)]
struct Choices {
    key: String,
    values: Vec<f64>,
}

fn choices(text: &str) -> Result<Choices, String> {
    let expected = "expected KEY=VALUE,VALUE such as stance.threshold=4,8,16";
    let (key, values) = text.split_once('=').ok_or_else(|| format!("{expected}, found {text:?}"))?;
    let values = values
        .split(',')
        .map(|value| value.trim().parse().map_err(|_| format!("{expected}, found {value:?} for a value")))
        .collect::<Result<Vec<f64>, String>>()?;
    for value in &values {
        Parameters::new([(key, *value)]).map_err(|error| error.to_string())?;
    }
    Ok(Choices { key: key.to_owned(), values })
}

/// Prints the table.
pub(super) fn left_out(args: &LeftOutArgs) -> Result<()> {
    let Choices { key, values } = &args.choices;
    let mut sets: BTreeMap<String, Vec<Recording>> = BTreeMap::new();
    for recording in recordings::find(&args.paths, false)? {
        sets.entry(set_of(&recording)).or_default().push(recording);
    }
    let walks: usize = sets.values().map(Vec::len).sum();
    let bar = progress::of_count((walks * (values.len() + 1)) as u64, "walks");
    let mut judged = Vec::new();
    for (name, recordings) in sets {
        let mut errors_m = Vec::new();
        for value in std::iter::once(None).chain(values.iter().map(|value| Some(*value))) {
            let parameters = Parameters::new(value.map(|value| (key, value)))?;
            let mut of_walks = Vec::new();
            for recording in &recordings {
                let scored = score(recording, Aids::default(), args.solution, None, &parameters)?;
                of_walks.extend(error_m(&scored.figures));
                bar.inc(1);
            }
            errors_m.push(of_walks.iter().sum::<f64>() / of_walks.len() as f64);
        }
        // A set that nothing is known of judges nothing.
        if errors_m.iter().all(|error_m| error_m.is_finite()) {
            judged.push(Set { name, walks: recordings.len(), default_m: errors_m.remove(0), errors_m });
        }
    }
    bar.finish_and_clear();
    if judged.len() < 2 {
        return Err(Failure::BadInput(format!(
            "expected at least two sets of recordings with a truth, found {}: one is left out, and the others choose",
            judged.len()
        ))
        .into());
    }
    print(&table(key, values, &judged))
}

/// The recordings of one folder and one day, where the name begins with one.
fn set_of(recording: &Recording) -> String {
    let day = recording.name.get(..10).filter(|day| {
        day.char_indices().all(|(at, c)| if at == 4 || at == 7 { c == '-' } else { c.is_ascii_digit() })
    });
    day.map_or_else(|| recording.set.clone(), |day| format!("{} {day}", recording.set))
}

/// The error in plan by which a walk is judged, m.
fn error_m(figures: &Figures) -> Option<f64> {
    match figures {
        Figures::MotionCapture(errors) => errors.map(|errors| errors.armse_m),
        Figures::GroundPoints(errors) => errors.map(|errors| errors.distance.mean_m),
        Figures::ClosedLoop(errors) => errors.map(|errors| errors.end_error_m),
        Figures::Simulated { truth, .. } => truth.map(|errors| errors.horizontal.rms_m),
        Figures::Feet(_) | Figures::Nothing => None,
    }
}

/// A set and its mean errors, m.
struct Set {
    name: String,
    walks: usize,
    default_m: f64,
    /// With each of the values.
    errors_m: Vec<f64>,
}

/// The value that suits these sets best: by the mean of the errors' logarithms, so that no set counts for its size.
fn chosen<'a>(sets: impl Iterator<Item = &'a Set> + Clone, values: usize) -> usize {
    let cost = |at: usize| sets.clone().map(|set| set.errors_m[at].max(1e-6).ln()).sum::<f64>();
    (0..values).min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0)
}

fn table(key: &str, values: &[f64], sets: &[Set]) -> String {
    let mut out = format!(
        "Mean error in plan of each set, m: with the default of `{key}`, with the value of {} that suits all other sets best, and \
         with the one that suits the set itself best. Sets of simulated walks by rms, of closed loops by their end, \
         others by the mean.\n\n\
         | set left out | walks | default, m | chosen by the others | error with it, m | best of its own | error with that, m |\n\
         |---|---|---|---|---|---|---|\n",
        values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")
    );
    for (left_out, set) in sets.iter().enumerate() {
        let others = sets.iter().enumerate().filter(|(at, _)| *at != left_out).map(|(_, set)| set);
        let (by_others, own) = (chosen(others, values.len()), chosen(std::iter::once(set), values.len()));
        writeln!(
            out,
            "| {} | {} | {:.3} | {} | {:.3} | {} | {:.3} |",
            set.name,
            set.walks,
            set.default_m,
            values[by_others],
            set.errors_m[by_others],
            values[own],
            set.errors_m[own]
        )
        .expect("writing to a string cannot fail");
    }
    let all = chosen(sets.iter(), values.len());
    writeln!(out, "\nAll sets together choose {}.", values[all]).expect("writing to a string cannot fail");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_judged_with_the_value_that_the_others_choose() {
        let set = |name: &str, errors_m: [f64; 3]| Set {
            name: name.to_owned(),
            walks: 2,
            default_m: 1.0,
            errors_m: errors_m.to_vec(),
        };
        let sets = [set("a", [1.0, 2.0, 4.0]), set("b", [3.0, 2.0, 1.0]), set("c", [9.0, 5.0, 2.0])];
        let told = table("k", &[1.0, 2.0, 3.0], &sets);
        assert!(told.contains("| a | 2 | 1.000 | 3 | 4.000 | 1 | 1.000 |"), "{told}");
        assert!(told.contains("| c | 2 | 1.000 | 1 | 9.000 | 3 | 2.000 |"), "{told}");
        assert!(told.ends_with("All sets together choose 3.\n"), "{told}");
    }

    #[test]
    fn a_key_that_nobody_knows_and_a_value_out_of_range_are_refused() {
        assert!(choices("stance.threshold=4,8").is_ok());
        for wrong in ["stance.threshold", "stance.threshold=4,x", "nothing=1", "stance.threshold=-5"] {
            assert!(choices(wrong).is_err(), "{wrong}");
        }
    }
}

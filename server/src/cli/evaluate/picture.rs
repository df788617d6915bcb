//! Every scored walk as a panel: its track upon what is known of it.

use super::score::{Figures, Score};
use crate::cli::plot::{Mark, Panel, Way, panels};

/// The picture of all walks, as a file's content.
pub(super) fn of_scores(scores: &[Score]) -> String {
    let drawn: Vec<Panel> = scores.iter().map(panel).collect();
    panels("Tracks (first colour) upon what is known of the walks (second), in plan, north up", &drawn)
}

fn panel(score: &Score) -> Panel {
    let known = if matches!(score.figures, Figures::GroundPoints(_) | Figures::ClosedLoop(_)) {
        Mark::Points
    } else {
        Mark::Dashes
    };
    let ways = vec![
        Way { mark: Mark::Line, places: score.overlay.track.clone() },
        Way { mark: known, places: score.overlay.known.clone() },
    ];
    Panel { title: score.name.clone(), note: format!("{}: {}", score.set, figure(&score.figures)), ways }
}

/// The figure by which a walk is judged.
fn figure(figures: &Figures) -> String {
    match figures {
        Figures::MotionCapture(Some(errors)) => format!("ARMSE {:.3} m", errors.armse_m),
        Figures::GroundPoints(Some(errors)) => format!("mean {:.2} m", errors.distance.mean_m),
        Figures::ClosedLoop(Some(closure)) => {
            format!("end {:.2} m, {:.2} %", closure.end_error_m, closure.end_error_percent)
        }
        Figures::Feet(Some(apart)) => format!("feet end {:.2} m apart", apart.at_end_m),
        Figures::Simulated { truth: Some(truth), .. } => format!("rms {:.2} m", truth.horizontal.rms_m),
        _ => "nothing to compare".to_owned(),
    }
}

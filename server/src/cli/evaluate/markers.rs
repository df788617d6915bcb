//! Which marker is it? The candidates on simulated walks, as Markdown tables.

use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use lodestep_engine::evaluate::MarkerScore;
use lodestep_engine::event::{Event, Stand};
use lodestep_engine::geo::{Site, terrain};
use lodestep_engine::identify::{Identification, Marker, automatic_visits};
use lodestep_engine::session::{Session, SessionConfig};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::{self, Side};

use super::ladder::as_told;
use crate::cli::print::print;
use crate::cli::progress;

/// The arguments of `lodestep evaluate markers`.
#[derive(Debug, Args)]
pub(super) struct MarkersArgs {
    /// How many walks of each kind
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    walks: u64,

    /// Seed of the first walk
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    first_seed: u64,
}

/// What is asked of a walk's stands, live and in hindsight.
#[derive(Default)]
struct Scores {
    live: MarkerScore,
    hindsight: MarkerScore,
    /// Visits that automatic mode makes of all when the walk is over, how many of these are wrong, and
    /// of how many stands.
    taken: u64,
    taken_wrong: u64,
    taken_of: u64,
}

/// Prints the tables.
pub(super) fn markers(args: &MarkersArgs) -> Result<()> {
    let site = Site::fast();
    let markers: Vec<Marker> = terrain::anchors(&site)
        .into_iter()
        .map(|anchor| {
            let [e, n, u] = anchor.position_n_m;
            Marker { name: anchor.name, position_n_m: (e, n, Some(u)) }
        })
        .collect();
    let identification = Identification { markers: Arc::new(markers.into()), ..Identification::default() };
    let kinds =
        [("stops at actuators only", WalkKind::Spiral), ("and pauses elsewhere", WalkKind::SpiralWithPauses)];
    let bar = progress::of_count(args.walks * kinds.len() as u64, "walks");
    let mut rows = Vec::new();
    for (name, kind) in kinds {
        let (mut keyed, mut nobody) = (Scores::default(), Scores::default());
        for seed in args.first_seed..args.first_seed + args.walks {
            let walk = simulate(&kind, seed, &site, &SensorModel::cmp10a());
            keyed.take_keyed(&walk, &site, &identification);
            nobody.take_automatic(&walk, &site, &identification);
            bar.inc(1);
        }
        rows.push((format!("{name}; keyed in"), keyed));
        rows.push((format!("{name}; automatic mode"), nobody));
    }
    bar.finish_and_clear();
    let mut all = Scores::default();
    rows.iter().for_each(|(_, scores)| all.add(scores));
    rows.push(("all".to_owned(), all));

    let mut out = format!(
        "Spirals of 3.3 km at {} with a visit every 150 m, simulated CMP10A sensors, {} markers, {} walks of each kind, \
         seeds from {} on. *Keyed in*: each marker is keyed in once the inspector has left it, and was not known before that; in \
         hindsight, every other one was not keyed in at all, and is asked for when the walk is over. *Automatic mode*: nobody keys \
         anything in. Made by `lodestep evaluate markers --walks {} --first-seed {}`.\n\n",
        site.name,
        identification.markers.all().len(),
        args.walks,
        args.first_seed,
        args.walks,
        args.first_seed
    );
    first_table(&mut out, &rows);
    calibration_table(&mut out, &rows);
    print(&out)
}

/// How often the truth was first, and what automatic mode took.
fn first_table(out: &mut String, rows: &[(String, Scores)]) {
    out.push_str(
        "| walks | stands at a marker | it is first, live | in hindsight | stands elsewhere | \"none of them\" is first, live | in hindsight | taken automatically, live | of these wrong | when the walk is over | of these wrong |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, Scores { live, hindsight, taken, taken_wrong, taken_of }) in rows {
        let of = |part: u64, all: u64| {
            if all == 0 {
                "–".to_owned()
            } else {
                format!("{:.1} % of {all}", 100.0 * part as f64 / all as f64)
            }
        };
        let row = [
            live.at_marker.to_string(),
            of(live.right_first, live.at_marker),
            of(hindsight.right_first, hindsight.at_marker),
            live.elsewhere.to_string(),
            of(live.none_first, live.elsewhere),
            of(hindsight.none_first, hindsight.elsewhere),
            of(hindsight.automatic, *taken_of),
            of(hindsight.automatic_wrong, hindsight.automatic),
            of(*taken, *taken_of),
            of(*taken_wrong, *taken),
        ];
        out.push_str(&format!("| {name} | {} |\n", row.join(" | ")));
    }
}

/// What was stated and what came true.
fn calibration_table(out: &mut String, rows: &[(String, Scores)]) {
    out.push_str(
        "\nDo the probabilities come true? Of the candidates that were told with about one probability: the mean that was \
         told, the share that was right, %, with the standard error of so many.\n\n\
         | walks | | below 5 % | to 15 % | to 35 % | to 65 % | to 85 % | to 95 % | above |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for (name, scores) in rows {
        for (when, score) in [("live", &scores.live), ("in hindsight", &scores.hindsight)] {
            out.push_str(&format!("| {name} | {when} |"));
            for bin in &score.bins {
                if bin.candidates == 0 {
                    out.push_str(" – |");
                    continue;
                }
                let of = bin.candidates as f64;
                let (told, right) = (bin.stated / of, bin.right as f64 / of);
                let standard_error = (told * (1.0 - told) / of).sqrt();
                out.push_str(&format!(
                    " {:.1}: {:.1} ± {:.1} of {} |",
                    100.0 * told,
                    100.0 * right,
                    100.0 * standard_error,
                    bin.candidates
                ));
            }
            out.push('\n');
        }
    }
}

impl Scores {
    /// The inspector keys in each marker after having stood there; then every other one is left out,
    /// and asked for when the walk is over.
    fn take_keyed(&mut self, walk: &Walk, site: &Site, identification: &Identification) {
        let told = listen(walk, site, identification, false, |_| true);
        told.first.iter().for_each(|stand| self.live.take(stand, truth(walk, stand)));
        for left_out in 0..2 {
            let told = listen(walk, site, identification, false, |number| number % 2 != left_out);
            let unkeyed = told.last.iter().filter(|stand| stand.visit.is_none());
            unkeyed.for_each(|stand| self.hindsight.take(stand, truth(walk, stand)));
        }
    }

    /// Nobody keys anything in.
    fn take_automatic(&mut self, walk: &Walk, site: &Site, identification: &Identification) {
        let told = listen(walk, site, identification, true, |_| false);
        told.first.iter().for_each(|stand| self.live.take(stand, truth(walk, stand)));
        told.last.iter().for_each(|stand| self.hindsight.take(stand, truth(walk, stand)));
        self.taken_of += told.last.len() as u64;
        for visit in automatic_visits(&told.last, identification) {
            let stand = told.last.iter().find(|stand| stand.t_start_ns == visit.t_start_ns);
            let right = stand.and_then(|stand| truth(walk, stand)) == Some(visit.marker.as_str());
            self.taken += 1;
            self.taken_wrong += u64::from(!right);
        }
    }

    fn add(&mut self, other: &Scores) {
        self.live.add(&other.live);
        self.hindsight.add(&other.hindsight);
        self.taken += other.taken;
        self.taken_wrong += other.taken_wrong;
        self.taken_of += other.taken_of;
    }
}

/// The stands of a walk as they were told first and last.
struct ToldStands {
    first: Vec<Stand>,
    last: Vec<Stand>,
}

/// Runs a walk live; the visits of these numbers are keyed in when they are over.
fn listen(
    walk: &Walk,
    site: &Site,
    identification: &Identification,
    automatic: bool,
    keyed: impl Fn(usize) -> bool,
) -> ToldStands {
    let mut session = Session::new(SessionConfig {
        initial_position_n_m: walk.start_n_m(),
        declination_rad: site.declination_deg.to_radians(),
        site_field: Some(site.field()),
        gravity_m_s2: site.gravity_m_s2,
        identification: Some(Identification { automatic, ..identification.clone() }),
        ..pedestrian::two_feet()
    })
    .expect("both feet are streams of a walk");
    let mut events = Vec::new();
    let mut told = ToldStands { first: Vec::new(), last: Vec::new() };
    let mut visits = walk.visits.iter().enumerate().filter(|(number, _)| keyed(*number)).peekable();
    for (left, right) in walk.left.iter().zip(&walk.right) {
        session.push(Side::Left, left, &mut events);
        session.push(Side::Right, right, &mut events);
        if let Some((_, visit)) = visits.next_if(|(_, visit)| visit.t_end_ns <= left.t_ns) {
            session.visit(as_told(visit), &mut events);
        }
        events.drain(..).for_each(|event| told.take(event));
    }
    session.finish(&mut events);
    events.drain(..).for_each(|event| told.take(event));
    told
}

impl ToldStands {
    fn take(&mut self, event: Event) {
        let Event::Stand(stand) = event else { return };
        match self.last.iter_mut().find(|known| known.number == stand.number) {
            Some(known) => *known = stand,
            None => {
                self.first.push(stand.clone());
                self.last.push(stand);
            }
        }
    }
}

/// The marker at which the inspector truly stood.
fn truth<'a>(walk: &'a Walk, stand: &Stand) -> Option<&'a str> {
    let stood = walk.visits.iter().find(|visit| {
        visit.t_start_ns < stand.t_start_ns + 4_000_000_000 && visit.t_end_ns > stand.t_start_ns
    });
    stood.map(|visit| visit.marker.as_str())
}

//! Runs side by side: for each walk its own track, worked out with the site's parameters, and the lab runs of it, each figure
//! with its difference to that.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use lodestep_engine::event::AidKind;
use schemars::JsonSchema;
use serde::Serialize;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;
use uuid::Uuid;

use crate::csv_cell::harmless;
use crate::error::{Error, Result};
use crate::store::jobs::JobState;
use crate::store::lab_runs::{self, Figures, LabRun, Provenance};
use crate::store::{Store, inspectors, reports, sessions};
use crate::utc;

/// Lab runs in one comparison.
const MOST_RUNS: u32 = 5_000;

/// A figure by which runs are compared.
struct Figure {
    name: &'static str,
    unit: &'static str,
    aim: Aim,
    read: fn(&Figures) -> Option<f64>,
}

/// Which value of a figure is the better one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "RunFigureAim")]
pub(crate) enum Aim {
    /// The smaller.
    Small,
    /// The larger.
    Large,
    /// The one nearer to 1.
    One,
    /// Neither: it only tells.
    None,
}

const fn figure(
    name: &'static str,
    unit: &'static str,
    aim: Aim,
    read: fn(&Figures) -> Option<f64>,
) -> Figure {
    Figure { name, unit, aim, read }
}

fn nis(figures: &Figures, aid: &str) -> Option<f64> {
    figures.nis_per_degree.get(aid).copied()
}

const FIGURES: &[Figure] = &[
    figure("closure_m", "m", Aim::Small, |f| f.closure_m),
    figure("closure_percent", "%", Aim::Small, |f| f.closure_percent),
    figure("closure_up_m", "m", Aim::None, |f| f.closure_up_m),
    figure("distance_m", "m", Aim::None, |f| Some(f.distance_m)),
    figure("marker_mean_m", "m", Aim::Small, |f| f.marker_mean_m),
    figure("marker_rms_m", "m", Aim::Small, |f| f.marker_rms_m),
    figure("marker_max_m", "m", Aim::Small, |f| f.marker_max_m),
    figure("marker_p95_m", "m", Aim::Small, |f| f.marker_p95_m),
    figure("visits_accepted", "1", Aim::Large, |f| Some(f.visits_accepted as f64)),
    figure("largest_correction_m", "m", Aim::Small, |f| f.largest_correction_m),
    figure("left_stance_share", "1", Aim::None, |f| f.left_stance_share),
    figure("right_stance_share", "1", Aim::None, |f| f.right_stance_share),
    figure("nis_zupt", "1", Aim::One, |f| nis(f, "zupt")),
    figure("nis_heading", "1", Aim::One, |f| nis(f, "heading")),
    figure("nis_maru", "1", Aim::One, |f| nis(f, "maru")),
    figure("nis_separation", "1", Aim::One, |f| nis(f, "separation")),
    figure("nis_markers", "1", Aim::One, |f| nis(f, "markers")),
    figure("nis_altimeter", "1", Aim::One, |f| nis(f, "altimeter")),
    figure("end_sigma_plan_m", "m", Aim::None, |f| f.end_sigma_plan_m),
    figure("anomalies", "1", Aim::None, |f| Some(f.anomalies as f64)),
    figure("process_s", "s", Aim::None, |f| Some(f.process_s)),
];

/// Runs side by side.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "LabComparison")]
pub(crate) struct Comparison {
    /// What is compared, in order.
    pub(crate) figures: Vec<FigureView>,
    /// Walk by walk, its own track first.
    pub(crate) rows: Vec<Row>,
}

/// A figure by which runs are compared.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "RunFigure")]
pub(crate) struct FigureView {
    /// Its name, with its unit at the end where it has one.
    #[schemars(example = &"closure_m")]
    pub(crate) name: &'static str,
    /// Its unit; `1` for a number without one.
    #[schemars(example = &"m")]
    pub(crate) unit: &'static str,
    /// Which value is the better one.
    pub(crate) aim: Aim,
}

/// One run.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "ComparedRun")]
pub(crate) struct Row {
    pub(crate) session_id: Uuid,
    #[schemars(example = &"Ring road, north")]
    pub(crate) title: String,
    #[schemars(example = &"Li Na")]
    pub(crate) inspector: String,
    #[serde(with = "time::serde::rfc3339")]
    #[schemars(with = "utc::Instant")]
    pub(crate) started_at: OffsetDateTime,
    /// `None`: the session's own track.
    pub(crate) run_id: Option<Uuid>,
    /// As it is shown; for the session's own track the set that was the site's, or `default`.
    #[schemars(example = &"main")]
    pub(crate) run: String,
    /// What differs from the default.
    pub(crate) parameters: BTreeMap<String, f64>,
    /// The aids that were chosen; `None`: all that the data allow.
    #[schemars(with = "Option<Vec<String>>", example = ["zupt", "heading"])]
    pub(crate) aids: Option<Vec<AidKind>>,
    /// By name; a figure that the run does not have is left out.
    pub(crate) values: BTreeMap<&'static str, f64>,
    /// This run's value minus that of the session's own track, by name.
    pub(crate) differences: BTreeMap<&'static str, f64>,
    /// Whether it read what the session's own track was computed from, by the same engine; `None` where that is not known.
    pub(crate) comparable: Option<bool>,
    /// Where it comes from.
    pub(crate) provenance: Option<Provenance>,
}

/// Of these sessions, in this order.
pub(crate) async fn compare(store: &Store, session_ids: &[Uuid]) -> Result<Comparison> {
    let db = store.read();
    let mut runs: BTreeMap<Uuid, Vec<LabRun>> = BTreeMap::new();
    for run in lab_runs::list(db, session_ids, MOST_RUNS).await? {
        if run.state == JobState::Finished {
            runs.entry(run.session_id).or_default().push(run);
        }
    }
    let mut rows = Vec::new();
    for &id in session_ids {
        let session = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
        let inspector = inspectors::get(db, session.inspector_id).await?;
        let own = reports::figures(db, id).await?;
        let own_values = own.as_ref().map(|(figures, _)| values(figures)).unwrap_or_default();
        let row = |run_id, run: String, parameters, aids, values, differences, comparable, provenance| Row {
            session_id: id,
            title: session.title.clone(),
            inspector: inspector.as_ref().map(|known| known.name.clone()).unwrap_or_default(),
            started_at: session.started_at,
            run_id,
            run,
            parameters,
            aids,
            values,
            differences,
            comparable,
            provenance,
        };
        let provenance = own.as_ref().map(|(_, provenance)| provenance.clone());
        let from = own.as_ref().map(|(_, from)| from);
        let set = from.and_then(|from| from.parameter_set.as_ref());
        rows.push(row(
            None,
            set.map_or("default".to_owned(), |set| set.name.clone()),
            from.map(|from| from.parameters.clone()).unwrap_or_default(),
            None,
            own_values.clone(),
            BTreeMap::new(),
            None,
            provenance,
        ));
        for run in runs.remove(&id).unwrap_or_default() {
            let values = run.figures.as_ref().map(values).unwrap_or_default();
            let differences = values
                .iter()
                .filter_map(|(name, value)| Some((*name, value - own_values.get(name)?)))
                .collect();
            let comparable = own.as_ref().zip(run.provenance.as_ref()).map(|((_, own), of)| same(own, of));
            rows.push(row(
                Some(run.id),
                run.name,
                run.parameters,
                run.aids,
                values,
                differences,
                comparable,
                run.provenance,
            ));
        }
    }
    let figures = FIGURES.iter().map(|f| FigureView { name: f.name, unit: f.unit, aim: f.aim }).collect();
    Ok(Comparison { figures, rows })
}

/// Whether only what was chosen sets the two apart: the same samples, the same visits as far as both use them, the same
/// engine.
fn same(own: &Provenance, of: &Provenance) -> bool {
    let uses_visits = of.aids.contains(&AidKind::MARKERS);
    own.engine_sha256 == of.engine_sha256
        && own.inputs == of.inputs
        && (!uses_visits || own.visits_sha256 == of.visits_sha256)
}

fn values(figures: &Figures) -> BTreeMap<&'static str, f64> {
    FIGURES.iter().filter_map(|figure| Some((figure.name, (figure.read)(figures)?))).collect()
}

impl Comparison {
    /// A row a run: who and what, then each figure with its difference beside it.
    pub(crate) fn to_csv(&self) -> Result<String> {
        let mut text =
            // By its mark a spreadsheet knows UTF-8.
            String::from("\u{feff}session_id,title,inspector,started_at,run_id,run,parameters,aids,comparable");
        for figure in &self.figures {
            let _ = write!(text, ",{0},{0}_difference", figure.name);
        }
        text.push_str(",engine_version,engine_sha256,visits_sha256,track_sha256\n");
        for row in &self.rows {
            let at = row.started_at.format(&Rfc3339).map_err(|error| Error::Internal(error.into()))?;
            let json = |value: &BTreeMap<String, f64>| serde_json::to_string(value).unwrap_or_default();
            let aids = row.aids.as_ref().map(|aids| aids.iter().map(crate::store::columns_word));
            let words = [
                row.session_id.to_string(),
                row.title.clone(),
                row.inspector.clone(),
                at,
                row.run_id.map(|id| id.to_string()).unwrap_or_default(),
                row.run.clone(),
                json(&row.parameters),
                aids.map(|aids| aids.collect::<Vec<_>>().join(" ")).unwrap_or_default(),
                row.comparable.map(|same| same.to_string()).unwrap_or_default(),
            ];
            text.push_str(&words.map(|word| harmless(&word)).join(","));
            for figure in &self.figures {
                for cell in [row.values.get(figure.name), row.differences.get(figure.name)] {
                    text.push(',');
                    if let Some(value) = cell {
                        let _ = write!(text, "{value}");
                    }
                }
            }
            let from = row.provenance.as_ref();
            for word in [
                from.map(|from| &from.engine_version),
                from.map(|from| &from.engine_sha256),
                from.map(|from| &from.visits_sha256),
                from.map(|from| &from.track_sha256),
            ] {
                text.push(',');
                text.push_str(word.map_or("", String::as_str));
            }
            text.push('\n');
        }
        Ok(text)
    }
}

//! Visits told beside a log: checked as a whole, added once.

use std::collections::HashSet;

use futures_util::FutureExt;
use schemars::JsonSchema;
use serde::Serialize;
use uuid::Uuid;

use crate::auth::Caller;
use crate::error::{Error, Place, Result};
use crate::markers::checked_name;
use crate::state::App;
use crate::store::visits::{self, Origin, Visit};
use crate::store::{audit, markers, sessions};
use crate::utc;
use crate::wire::Change;

/// Visits that one request may tell.
const MOST_VISITS: usize = 10_000;

/// One visit as it is told.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Told {
    pub(crate) marker: String,
    pub(crate) t_start_ns: i64,
    pub(crate) t_end_ns: i64,
    /// Where it stands in what was sent, counted as lines.
    pub(crate) line: u64,
}

/// What became of a list of visits.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct AddedVisits {
    /// How many are new.
    pub(crate) added: u64,
    /// How many the session had already.
    pub(crate) unchanged: u64,
    /// Pairs of visits of this session that overlap in time: nobody stands at two markers at once.
    pub(crate) overlaps: Vec<Overlap>,
    /// All visits of the session, by time.
    pub(crate) visits: Vec<Visit>,
}

/// Two visits that overlap.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "VisitOverlap")]
pub(crate) struct Overlap {
    /// The earlier one's marker.
    #[schemars(example = &"A17")]
    pub(crate) marker: String,
    /// The later one's marker.
    #[schemars(example = &"A18")]
    pub(crate) other_marker: String,
    /// When the overlap begins, ns.
    pub(crate) t_start_ns: i64,
    /// When it ends, ns.
    pub(crate) t_end_ns: i64,
}

/// Adds visits to a session: all, or none when one of them cannot be.
pub(crate) async fn add(
    app: &App,
    caller: &Caller,
    session_id: Uuid,
    told: Vec<Told>,
) -> Result<AddedVisits> {
    let session = sessions::get(app.store.read(), session_id).await?;
    let session = session.ok_or_else(|| Error::not_found("session", session_id))?;
    if told.len() > MOST_VISITS {
        return Err(Error::invalid(
            "too_many_visits",
            format!(
                "expected at most {MOST_VISITS} visits at once, found {}: send them in parts",
                told.len()
            ),
        ));
    }
    check(app, &told, session.declaration().surveys()).await?;
    let rows: Vec<_> = told
        .into_iter()
        .map(|told| Visit {
            id: Uuid::now_v7(),
            session_id,
            marker: told.marker,
            t_start_ns: told.t_start_ns,
            t_end_ns: told.t_end_ns,
            origin: Origin::Keyed,
            keyed_shift_ns: 0,
            created_at: utc::now(),
            outcome: None,
        })
        .collect();
    let of_list = rows.len() as u64;
    let caller = caller.clone();
    let added = app
        .store
        .writer()
        .run(move |db| {
            async move {
                let mut added = Vec::new();
                for visit in rows {
                    if visits::insert(&mut *db, &visit).await? {
                        added.push(visit);
                    }
                }
                if !added.is_empty() {
                    let after = serde_json::to_value(&added).ok();
                    audit::insert(db, &caller.did("visit.told", session_id, None, after)).await?;
                }
                Ok::<_, Error>(added)
            }
            .boxed()
        })
        .await?;
    let new = added.len() as u64;
    app.hub.publish_all(added.iter().cloned().map(Change::Visit));
    app.live.add_visits(session_id, added).await;
    let visits = visits::of_session(app.store.read(), session_id).await?;
    Ok(AddedVisits { added: new, unchanged: of_list - new, overlaps: overlaps(&visits), visits })
}

/// What surveys may have stood on points that are no markers yet.
async fn check(app: &App, told: &[Told], surveys: bool) -> Result<()> {
    let known: HashSet<String> =
        markers::list(app.store.read()).await?.into_iter().map(|marker| marker.name).collect();
    for visit in told {
        let place = |column: &str| Place {
            line: Some(visit.line),
            column: Some(column.to_owned()),
            ..Place::default()
        };
        if surveys {
            checked_name(&visit.marker)?;
        } else if !known.contains(&visit.marker) {
            return Err(Error::invalid_at(
                "unknown_marker",
                format!(
                    "expected the name of a marker, found {:?}: correct the name or add the marker. No visit was stored",
                    visit.marker
                ),
                place("marker"),
            ));
        }
        if visit.t_end_ns < visit.t_start_ns {
            return Err(Error::invalid_at(
                "bad_time",
                format!(
                    "expected t_end_s at or after t_start_s, found {} after {} s: exchange or correct them. No visit was stored",
                    visit.t_end_ns as f64 / 1e9,
                    visit.t_start_ns as f64 / 1e9
                ),
                place("t_end_s"),
            ));
        }
    }
    Ok(())
}

/// Neighbours by time that overlap; the visits come by their start.
fn overlaps(visits: &[Visit]) -> Vec<Overlap> {
    let mut found = Vec::new();
    let mut longest: Option<&Visit> = None;
    for visit in visits {
        if let Some(before) = longest
            && visit.t_start_ns < before.t_end_ns
        {
            found.push(Overlap {
                marker: before.marker.clone(),
                other_marker: visit.marker.clone(),
                t_start_ns: visit.t_start_ns,
                t_end_ns: before.t_end_ns.min(visit.t_end_ns),
            });
        }
        if longest.is_none_or(|before| visit.t_end_ns > before.t_end_ns) {
            longest = Some(visit);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visit(marker: &str, t_start_ns: i64, t_end_ns: i64) -> Visit {
        Visit {
            id: Uuid::now_v7(),
            session_id: Uuid::nil(),
            marker: marker.to_owned(),
            t_start_ns,
            t_end_ns,
            origin: Origin::Keyed,
            keyed_shift_ns: 0,
            created_at: utc::now(),
            outcome: None,
        }
    }

    #[test]
    fn a_long_visit_overlaps_all_that_lie_in_it_and_touching_ones_do_not() {
        let visits = [visit("A1", 0, 100), visit("A2", 10, 20), visit("A3", 30, 120), visit("A4", 120, 130)];
        let found = overlaps(&visits);
        let pairs: Vec<_> = found.iter().map(|o| (o.marker.as_str(), o.other_marker.as_str())).collect();
        assert_eq!(pairs, [("A1", "A2"), ("A1", "A3")]);
        assert_eq!((found[1].t_start_ns, found[1].t_end_ns), (30, 100));
    }
}

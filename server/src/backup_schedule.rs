//! Backups that the server makes by itself, and which of them are kept: the newest of each of the last days, weeks and months.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use time::OffsetDateTime;

use crate::backup::{self, SCHEDULED};
use crate::data_folder;
use crate::state::App;
use crate::store::backup::check;

/// A server that has just been started has something else to do.
const FIRST_AFTER: Duration = Duration::from_secs(600);
/// How often it is looked whether one is due; also the pause after one that failed.
const LOOK_EVERY: Duration = Duration::from_secs(300);

/// How many are kept of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Kept {
    /// The newest of so many days.
    pub(crate) days: usize,
    /// Of so many weeks.
    pub(crate) weeks: usize,
    /// Of so many months.
    pub(crate) months: usize,
}

/// What became of the last one that was looked at again.
#[derive(Debug, Default)]
pub(crate) struct LastChecked(Mutex<Option<Result<PathBuf, String>>>);

impl LastChecked {
    /// Why the last backup is none; `None` where it is good, or was not looked at yet.
    pub(crate) fn why_not_good(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()?.err()
    }

    fn note(&self, checked: Result<PathBuf, String>) {
        metrics::gauge!("lodestep_backup_good").set(f64::from(u8::from(checked.is_ok())));
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(checked);
    }
}

/// Makes a backup whenever one is due, until the server stops.
pub(crate) async fn work(app: App) {
    // PostgreSQL makes its own.
    let Some(every) = app.config.backup_every().filter(|_| cfg!(not(feature = "cluster"))) else { return };
    let mut pause = FIRST_AFTER.min(every);
    while app.stopping.run_until_cancelled(tokio::time::sleep(pause)).await.is_some() {
        pause = LOOK_EVERY.min(every);
        let folder = backup::folder(&app.config.data);
        check_last(&app, &folder).await;
        if is_due(&folder, every) {
            make(&app, &folder).await;
        }
    }
}

fn is_due(folder: &Path, every: Duration) -> bool {
    match scheduled(folder) {
        // A clock that was set back leaves a backup in the future: that is no reason to make none until then.
        Ok(made) => made.iter().all(|(at, _)| (OffsetDateTime::now_utc() - *at).unsigned_abs() >= every),
        Err(error) => {
            tracing::warn!(%error, "could not look for backups in {}: {error}", folder.display());
            false
        }
    }
}

async fn make(app: &App, folder: &Path) {
    match backup::make(&app.config.data, folder, SCHEDULED).await {
        Ok(made) => {
            tracing::info!(bytes = made.bytes, "made the backup {}", made.file.display());
            let why = made.damaged.join("; ");
            app.last_backup.note(if why.is_empty() { Ok(made.file) } else { Err(why) });
            if let Err(error) = remove_old(folder, app.config.backups_kept()) {
                tracing::warn!(%error, "old backups could not be removed: {error}");
            }
        }
        Err(error) => tracing::error!(%error, "no backup was made: {error}"),
    }
}

/// Reads the last backup again: what lies on a disk for weeks may have changed when it is needed.
async fn check_last(app: &App, folder: &Path) {
    let Ok(Some(last)) = data_folder::newest_backup(folder) else { return };
    let checked = match check(&last).await {
        Ok(damaged) if damaged.is_empty() => Ok(last),
        Ok(damaged) => Err(format!("{}: {}", last.display(), damaged.join("; "))),
        Err(error) => Err(format!("{}: {error}", last.display())),
    };
    if let Err(why) = &checked {
        tracing::error!("the last backup is not good: {why}");
    }
    app.last_backup.note(checked);
}

/// The backups that the server made by itself, with when.
fn scheduled(folder: &Path) -> io::Result<Vec<(OffsetDateTime, PathBuf)>> {
    let mut made = Vec::new();
    if !folder.is_dir() {
        return Ok(made);
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(SCHEDULED) && name.ends_with(".db") {
            made.push((entry.metadata()?.modified()?.into(), entry.path()));
        }
    }
    Ok(made)
}

fn remove_old(folder: &Path, kept: Kept) -> io::Result<()> {
    for old in old(scheduled(folder)?, kept) {
        fs::remove_file(&old)?;
        tracing::info!("removed the backup {}, for newer ones have taken its place", old.display());
    }
    data_folder::sync(folder)
}

/// Which of these go: all but the newest of each of the last days, weeks and months that have any.
fn old(mut made: Vec<(OffsetDateTime, PathBuf)>, kept: Kept) -> Vec<PathBuf> {
    made.sort_unstable();
    made.reverse();
    let mut stays = BTreeSet::new();
    let mut keep = |most: usize, period: fn(OffsetDateTime) -> (i32, u16)| {
        let mut periods = BTreeSet::new();
        for (number, (at, _)) in made.iter().enumerate() {
            if periods.len() < most && periods.insert(period(*at)) {
                stays.insert(number);
            }
        }
    };
    // The newest of all stays, whatever is asked for.
    keep(kept.days.max(1), |at| (at.year(), at.ordinal()));
    keep(kept.weeks, |at| {
        let (year, week, _) = at.to_iso_week_date();
        (year, u16::from(week))
    });
    keep(kept.months, |at| (at.year(), u16::from(u8::from(at.month()))));
    let goes =
        |(number, (_, file)): (usize, (OffsetDateTime, PathBuf))| (!stays.contains(&number)).then_some(file);
    made.into_iter().enumerate().filter_map(goes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One a day for so many days, at noon of a day in March.
    fn daily(days: i64) -> Vec<(OffsetDateTime, PathBuf)> {
        let first = OffsetDateTime::from_unix_timestamp(1_772_366_400).unwrap();
        (0..days).map(|day| (first + time::Duration::days(day), PathBuf::from(format!("{day}")))).collect()
    }

    #[test]
    fn the_newest_of_the_last_days_weeks_and_months_stay() {
        let kept = Kept { days: 7, weeks: 4, months: 12 };
        let made = daily(400);
        let gone = old(made.clone(), kept);
        let stays: Vec<_> = made.iter().filter(|(_, file)| !gone.contains(file)).collect();
        // Seven days, three weeks before them, eleven months before this one; some are two of these at once.
        assert!((18..=22).contains(&stays.len()), "{}", stays.len());
        assert_eq!(stays.last().unwrap().1, PathBuf::from("399"));
        assert!(stays[0].0 < made[399].0 - time::Duration::days(300), "no month of last year stays");
        // Removing is done day by day: what stays in the end is the same.
        let mut by_and_by: Vec<(OffsetDateTime, PathBuf)> = Vec::new();
        for one in made.clone() {
            by_and_by.push(one);
            let gone = old(by_and_by.clone(), kept);
            by_and_by.retain(|(_, file)| !gone.contains(file));
        }
        assert_eq!(by_and_by.iter().collect::<Vec<_>>(), stays);
    }

    #[test]
    fn the_last_backup_is_never_removed() {
        let made = daily(3);
        let gone = old(made, Kept { days: 0, weeks: 0, months: 0 });
        assert_eq!(gone, [PathBuf::from("1"), PathBuf::from("0")]);
        assert!(old(Vec::new(), Kept { days: 0, weeks: 0, months: 0 }).is_empty());
    }
}

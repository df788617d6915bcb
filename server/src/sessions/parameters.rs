//! Which parameters a walk is computed with: the site's, or those that what is stored was computed with.

use lodestep_engine::parameters::Parameters;

use super::process::ProcessError;
use crate::state::App;
use crate::store::sessions::Session;
use crate::store::site_parameters::{self, SetVersion, SiteParameters};
use crate::store::{StoreError, reports};

/// Which are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// Those that hold now: what is computed anew.
    Site,
    /// Those that the stored track was computed with: what belongs to it.
    AsStored,
    /// All as by default: the caller sets them.
    Defaults,
}

/// Parameters, and the set that they were taken from.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Chosen {
    pub(crate) parameters: Parameters,
    pub(crate) set: Option<SetVersion>,
}

impl Chosen {
    /// A newer engine may know a parameter no longer, or in another range: then nothing is computed by halves.
    fn of(held: SiteParameters) -> Result<Chosen, ProcessError> {
        let parameters = Parameters::new(held.parameters).map_err(|error| {
            ProcessError::Parameters(format!(
                "{error}. It is one of the site's parameters: make another set the site's in the laboratory, or take the defaults"
            ))
        })?;
        Ok(Chosen { parameters, set: held.set })
    }
}

/// For a walk that is computed from what is stored.
pub(crate) async fn of_walk(app: &App, session: &Session, wanted: Wanted) -> Result<Chosen, ProcessError> {
    let db = app.store.read();
    match wanted {
        Wanted::Defaults => Ok(Chosen::default()),
        Wanted::Site => Chosen::of(site_parameters::newest(db).await?),
        Wanted::AsStored => match reports::figures(db, session.id).await? {
            Some((_, from)) => {
                let parameters = Parameters::new(from.parameters)
                    .map_err(|error| ProcessError::Parameters(format!("{error}. Process the walk again")))?;
                Ok(Chosen { parameters, set: from.parameter_set })
            }
            None => Chosen::of(site_parameters::chosen(db, session.site_parameters_id).await?),
        },
    }
}

/// For a stream: those with which it was begun.
pub(crate) async fn of_stream(app: &App, session: &Session) -> Result<Parameters, StoreError> {
    let held = site_parameters::chosen(app.store.read(), session.site_parameters_id).await?;
    let damaged = |error: ProcessError| StoreError::Damaged {
        what: format!("the parameters of session {}", session.id),
        why: error.to_string(),
    };
    Ok(Chosen::of(held).map_err(damaged)?.parameters)
}

/// The choice that a session which begins now keeps.
pub(crate) async fn of_new_session(app: &App) -> Result<Option<i64>, StoreError> {
    let held = site_parameters::newest(app.store.read()).await?;
    Ok((held.id > 0).then_some(held.id))
}

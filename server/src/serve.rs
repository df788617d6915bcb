//! Puts the parts together and runs them until told to stop.

use std::future::Future;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use tokio::net::TcpListener;
use tokio::sync::{Mutex, Notify, Semaphore};
use tokio_util::sync::CancellationToken;

use crate::auth::Auth;
use crate::backup_schedule::LastChecked;
use crate::config::Config;
use crate::live::InputFile;
use crate::live::hub::Hub;
use crate::live::registry::Registry;
use crate::scrub::Scrubbed;
use crate::sessions::identification::SharedMarkers;
use crate::sessions::upload_turns::UploadTurns;
use crate::sessions::{removal, stale_uploads};
use crate::site::Plan;
use crate::state::{App, STOP_WITHIN, State};
use crate::store::accounts;
use crate::store::{Store, StoreError};
use crate::{
    alarms, api, assets, auth, backup_schedule, connections, data_folder, demo, figures, http, jobs, live,
    private, scrub, site, utc, webhooks,
};

/// Uploaded logs that are read at once; more wait, so that the live sessions keep their share.
const LOG_READERS: usize = 2;

/// How long open requests have to be refused after the disk has failed.
const FAIL_WITHIN: Duration = Duration::from_secs(1);

/// Listens where the configuration says.
pub async fn bind(config: &Config) -> Result<TcpListener> {
    // Before it is said that there is no account.
    data_folder::expect_what_was_there(&config.data)?;
    loopback_only(config, config.listen, config.may_have_accounts())?;
    TcpListener::bind(config.listen)
        .await
        .with_context(|| format!("could not listen on {}: is another server running there?", config.listen))
}

/// Serves until `shutdown` is ready, then ends what is open and closes the store.
pub async fn serve(
    config: Config,
    listener: TcpListener,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> Result<()> {
    let address = listener.local_addr().context("the listener has no address")?;
    loopback_only(&config, address, config.may_have_accounts())?;
    // Held until the end: two servers on one folder would be two writers.
    let _held = data_folder::hold_for_its_database(&config.data)?;
    let last_written = stale_uploads::last_written(&config);
    let app = open(config).await?;
    loopback_only(&app.config, address, app.auth.has_accounts())?;
    // Not by one that may not serve.
    app.store.take_over().await.context("could not make the database this server's own")?;
    stale_uploads::clear(&app, last_written).await.context("could not clear the folder of uploads")?;
    tokio::spawn(figures::fold(app.metrics.clone(), app.stopping.clone()));
    let worker = tokio::spawn(jobs::worker::work(Arc::clone(&app)));
    let postman = tokio::spawn(webhooks::deliver::work(Arc::clone(&app)));
    tokio::spawn(stale_uploads::work(Arc::clone(&app)));
    let scrubber = tokio::spawn(scrub::work(Arc::clone(&app)));
    tokio::spawn(backup_schedule::work(Arc::clone(&app)));
    tokio::spawn(alarms::work(Arc::clone(&app)));
    let remover = tokio::spawn(removal::work(Arc::clone(&app)));
    if let Some(sentence) = assets::missing() {
        tracing::warn!("{sentence}");
    }
    auth::tell_how(&app, address);
    tracing::info!(%address, "serving http://{address}/ for {}", app.site.name);

    tokio::spawn(Arc::clone(&app.hub).run(app.stopping.clone()));
    if app.config.demo {
        tokio::spawn(demo::run(Arc::clone(&app), address));
    }
    let stopping = app.stopping.clone();
    let stop = {
        let stopping = stopping.clone();
        async move {
            shutdown.await;
            tracing::info!("stopping: open requests have {} s to end", STOP_WITHIN.as_secs());
            stopping.cancel();
        }
    };
    let router = api::router(Arc::clone(&app));
    let most = app.config.connections.unwrap_or_else(connections::most);
    let server = async {
        let listening = connections::serve(listener, router, most, stopping.clone());
        let (_stop, ()) = tokio::join!(stop, listening);
    };
    let overdue = {
        let begun = stopping.clone().cancelled_owned();
        async move {
            begun.await;
            tokio::time::sleep(STOP_WITHIN).await;
        }
    };
    let mut server = std::pin::pin!(server);
    let served = tokio::select! {
        () = &mut server => Ok(()),
        () = overdue => {
            tracing::warn!("some requests did not end in time and were cut off");
            Ok(())
        }
        () = app.store.disk_failed() => {
            stopping.cancel();
            // Long enough for the refusals to get out.
            let _ = tokio::time::timeout(FAIL_WITHIN, server).await;
            let why = "see the log for what failed; start the server again, and it goes on from what is on disk";
            Err(StoreError::DiskFailed(why.to_owned()).into())
        }
    };
    stopping.cancel();
    // It stops within some thousand samples, and its job goes on at the next start.
    match tokio::time::timeout(STOP_WITHIN, worker).await {
        Ok(Err(error)) => tracing::error!(%error, "the worker ended badly: {error}"),
        Ok(Ok(())) => {}
        Err(_) => {
            tracing::warn!("a job did not stop in time and was cut off; it begins again at the next start")
        }
    }
    if let Err(error) = scrubber.await {
        tracing::error!(%error, "the scrub ended badly: {error}");
    }
    if let Err(error) = remover.await {
        tracing::error!(%error, "the removal of sessions ended badly: {error}");
    }
    if let Err(error) = postman.await {
        tracing::error!(%error, "the deliveries of webhooks ended badly: {error}");
    }
    app.store.close().await;
    tracing::info!("stopped");
    served
}

/// The state of a server with this configuration: its site read, its store open.
pub(crate) async fn open(config: Config) -> Result<App> {
    ensure!(
        config.track_rate_hz > 0.0 && config.track_rate_hz.is_finite(),
        "the track rate is {} Hz; expected a positive number",
        config.track_rate_hz
    );
    for (what, seconds) in [("retry", config.webhook_retry_s), ("give_up", config.webhook_give_up_s)] {
        ensure!(
            seconds > 0.0 && seconds < 3.2e7,
            "--webhook-{}-s is {seconds}; expected a positive number of seconds, less than a year",
            what.replace('_', "-")
        );
    }
    ensure!(
        config.setup_token.as_ref().is_none_or(|token| token.trim().chars().count() >= 20),
        "the setup token is too short; expected 20 letters or more, so that nobody guesses it"
    );
    let site = site::read(config.site.as_deref())?;
    private::folder(&config.uploads())
        .with_context(|| format!("could not make the data folder {}", config.data.display()))?;
    data_folder::sync_with_its_name(&config.data)?;
    let store = Store::open(&config.database(), config.readers)
        .await
        .with_context(|| format!("could not open the database {}", config.database_told()))?;
    let input_file = InputFile::new_in(&config.data)
        .with_context(|| format!("could not make a file in the data folder {}", config.data.display()))?;
    let board = live::snapshot_from_store(&store).await.context("could not read what the map shows")?;
    let hub = Hub::new(board);
    let has_accounts = accounts::any(store.read()).await.context("could not read the accounts")?;
    let declared = api::routes(&config);
    let routes = http::Table::of(declared.declared());
    let openapi = api::description(&declared).to_string().into();
    let auth = Auth::new(has_accounts, config.setup_token.clone());
    Ok(Arc::new(State {
        started_at: utc::now(),
        config,
        plan: Plan::of(&site),
        site,
        store,
        auth,
        routes,
        openapi,
        upload_turns: UploadTurns::default(),
        shared_markers: SharedMarkers::default(),
        input_file,
        log_readers: Semaphore::new(LOG_READERS),
        jobs: jobs::Queue::default(),
        scrubbed: Scrubbed::default(),
        last_backup: LastChecked::default(),
        import_turns: Mutex::default(),
        removals: Notify::new(),
        webhooks: Notify::new(),
        hub,
        live: Registry::default(),
        poses: Default::default(),
        metrics: figures::handle(),
        stopping: CancellationToken::new(),
    }))
}

/// As long as nobody has an account, everybody who reaches the server may do everything: it is for its own machine then. Asked
/// twice: before anything is begun, where there is no database there is no account.
fn loopback_only(config: &Config, address: SocketAddr, may_have_accounts: bool) -> Result<()> {
    ensure!(
        address.ip().is_loopback() || may_have_accounts,
        "will not listen on {address}: nobody has an account yet, so everybody who reaches the server could read and change everything; make the first one with `lodestep account add NAME --role admin --data {}`, or start it on 127.0.0.1:{} and make it in the page (from elsewhere through an SSH tunnel)",
        config.data.display(),
        address.port()
    );
    Ok(())
}

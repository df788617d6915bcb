//! Everything that can be set, in one place: flag, environment variable, default and unit.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use crate::backup_schedule::Kept;
use crate::data_folder::DATABASE;

/// How the server is set up.
#[derive(Clone, Debug, Args)]
pub struct Config {
    /// Address and port to listen on; a loopback address, until there is an account.
    #[arg(long, env = "LODESTEP_LISTEN", value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,

    /// Folder of the database and of uploads on their way; made when it is missing.
    #[arg(long, env = "LODESTEP_DATA", value_name = "FOLDER", default_value = "data")]
    pub data: PathBuf,

    /// Address of the PostgreSQL database, such as postgres://lodestep@10.0.0.5/lodestep.
    #[cfg(feature = "cluster")]
    #[arg(long, env = "LODESTEP_DATABASE", value_name = "ADDRESS", hide_env_values = true)]
    pub database: Option<String>,

    /// The site: a TOML file with name, latitude_deg, longitude_deg, height_m, gravity_m_s2 and
    /// declination_deg; without it the server serves FAST.
    #[arg(long, env = "LODESTEP_SITE", value_name = "FILE")]
    pub site: Option<PathBuf>,

    /// Largest log that may be uploaded, as sent, in bytes.
    #[arg(long, env = "LODESTEP_UPLOAD_BYTES", value_name = "BYTES", default_value_t = 1 << 30)]
    pub upload_bytes: u64,

    /// Largest log after unpacking, in bytes.
    #[arg(long, env = "LODESTEP_UNPACKED_BYTES", value_name = "BYTES", default_value_t = 2 << 30)]
    pub unpacked_bytes: u64,

    /// How many times its packed size a log may unpack to, beyond the first 16 MiB.
    #[arg(long, env = "LODESTEP_UNPACKED_RATIO", value_name = "TIMES", default_value_t = 200)]
    pub unpacked_ratio: u64,

    /// Largest body of any other request, in bytes.
    #[arg(long, env = "LODESTEP_BODY_BYTES", value_name = "BYTES", default_value_t = 4 << 20)]
    pub body_bytes: usize,

    /// Points kept of a track, per second.
    #[arg(long, env = "LODESTEP_TRACK_RATE_HZ", value_name = "HZ", default_value_t = 10.0)]
    pub track_rate_hz: f64,

    /// Free space on the data folder's disk below which `/readyz` says that the server is not ready, in bytes.
    #[arg(long, env = "LODESTEP_LEAST_FREE_BYTES", value_name = "BYTES", default_value_t = 256 << 20)]
    pub least_free_bytes: u64,

    /// Longest time a request may take until its answer begins, in seconds.
    #[arg(long, env = "LODESTEP_REQUEST_S", value_name = "SECONDS", default_value_t = 60)]
    pub request_s: u64,

    /// Fills an empty database with markers and a recorded walk, and lets simulated inspectors stream.
    #[arg(long, env = "LODESTEP_DEMO")]
    pub demo: bool,

    /// The setup token for the first account, 20 letters or more; made by chance and printed at the
    /// start, when it is left out. No flag: every list of processes would show it.
    #[arg(skip)]
    pub setup_token: Option<String>,

    /// Pause before a webhook that did not answer is tried again, in seconds; each further one is four times longer, up to
    /// four hours.
    #[arg(long, env = "LODESTEP_WEBHOOK_RETRY_S", value_name = "SECONDS", default_value_t = 10.0)]
    pub webhook_retry_s: f64,

    /// How long a webhook may go without answering before it is switched off, in seconds.
    #[arg(long, env = "LODESTEP_WEBHOOK_GIVE_UP_S", value_name = "SECONDS", default_value_t = 259_200.0)]
    pub webhook_give_up_s: f64,

    /// How often the server makes a backup by itself, in hours; 0: never.
    #[arg(long, env = "LODESTEP_BACKUP_EVERY_H", value_name = "HOURS", default_value_t = 24.0)]
    pub backup_every_h: f64,

    /// Of the backups that it made by itself, the newest of so many days are kept.
    #[arg(long, env = "LODESTEP_BACKUP_DAYS", value_name = "COUNT", default_value_t = 7)]
    pub backup_days: usize,

    /// And the newest of so many weeks.
    #[arg(long, env = "LODESTEP_BACKUP_WEEKS", value_name = "COUNT", default_value_t = 4)]
    pub backup_weeks: usize,

    /// And the newest of so many months.
    #[arg(long, env = "LODESTEP_BACKUP_MONTHS", value_name = "COUNT", default_value_t = 12)]
    pub backup_months: usize,

    /// Most connections at a time; as many as the process may have descriptors for, when it is left out.
    #[arg(long, env = "LODESTEP_CONNECTIONS", value_name = "COUNT")]
    pub connections: Option<usize>,

    /// Most walks that are worked out at a time, each on a core of its own; two, or one on a machine with one core, when it is left
    /// out.
    #[arg(long, env = "LODESTEP_JOBS", value_name = "COUNT")]
    pub jobs: Option<usize>,

    /// Longest time that working out a walk may take, in seconds.
    #[arg(long, env = "LODESTEP_JOB_S", value_name = "SECONDS", default_value_t = 3_600)]
    pub job_s: u64,

    /// Most memory that the points of one walk may take while it is worked out, in bytes.
    #[arg(long, env = "LODESTEP_JOB_BYTES", value_name = "BYTES", default_value_t = 4 << 30)]
    pub job_bytes: u64,

    /// A live session of which nothing was heard for so long is lost, in seconds: an alarm.
    #[arg(long, env = "LODESTEP_LOST_AFTER_S", value_name = "SECONDS", default_value_t = 60)]
    pub lost_after_s: u32,

    /// A person who has stayed on one spot for so long is an alarm, in seconds; 0: never.
    #[arg(long, env = "LODESTEP_STANDING_AFTER_S", value_name = "SECONDS", default_value_t = 900)]
    pub standing_after_s: u32,

    /// A live session of which nothing was heard for so long has left without saying so, in seconds: it raises no alarm any more.
    #[arg(long, env = "LODESTEP_GONE_AFTER_S", value_name = "SECONDS", default_value_t = 3_600)]
    pub gone_after_s: u32,

    /// Connections to the database for reading.
    #[arg(long, env = "LODESTEP_READERS", value_name = "COUNT", default_value_t = 4)]
    pub readers: u32,
}

impl Config {
    /// A server for a test: any free loopback port, everything in `data`.
    pub fn for_testing(data: &Path) -> Config {
        Config {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            data: data.to_owned(),
            #[cfg(feature = "cluster")]
            database: None,
            site: None,
            upload_bytes: 256 << 20,
            unpacked_bytes: 512 << 20,
            unpacked_ratio: 200,
            body_bytes: 4 << 20,
            track_rate_hz: 10.0,
            least_free_bytes: 0,
            request_s: 60,
            demo: false,
            setup_token: None,
            webhook_retry_s: 10.0,
            webhook_give_up_s: 259_200.0,
            backup_every_h: 0.0,
            backup_days: 7,
            backup_weeks: 4,
            backup_months: 12,
            connections: None,
            jobs: Some(1),
            job_s: 3_600,
            job_bytes: 4 << 30,
            lost_after_s: 60,
            standing_after_s: 900,
            gone_after_s: 3_600,
            readers: 2,
        }
    }

    /// The database file; where the database is PostgreSQL's, its address.
    pub fn database(&self) -> PathBuf {
        #[cfg(feature = "cluster")]
        if let Some(address) = &self.database {
            return PathBuf::from(address);
        }
        self.data.join(DATABASE)
    }

    /// The database as it is called in a sentence: without the name and the password before its host.
    pub(crate) fn database_told(&self) -> String {
        let database = self.database().display().to_string();
        database
            .rsplit_once('@')
            .filter(|_| cfg!(feature = "cluster"))
            .map_or(database.clone(), |(_, told)| told.to_owned())
    }

    /// How many walks are worked out at a time.
    pub(crate) fn jobs_at_a_time(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        self.jobs.unwrap_or(cores.min(2)).max(1)
    }

    /// Whether the database may have accounts, as far as that is known before it is opened.
    pub(crate) fn may_have_accounts(&self) -> bool {
        cfg!(feature = "cluster") || self.database().exists()
    }

    /// How often a backup is made; `None`: never.
    pub(crate) fn backup_every(&self) -> Option<Duration> {
        Duration::try_from_secs_f64(self.backup_every_h * 3_600.0).ok().filter(|every| !every.is_zero())
    }

    /// Which of these are kept.
    pub(crate) fn backups_kept(&self) -> Kept {
        Kept { days: self.backup_days, weeks: self.backup_weeks, months: self.backup_months }
    }

    /// How long a job may take.
    pub(crate) fn job_limit(&self) -> Duration {
        Duration::from_secs(self.job_s)
    }

    /// The folder of uploads on their way.
    pub fn uploads(&self) -> PathBuf {
        self.data.join("uploads")
    }
}

//! What a session is made of on the server.
//!
//! A log comes in ([`uploads`], [`upload_file`], [`upload_turns`]), is read whole ([`unpack`],
//! [`read_log`], [`spill`]; [`preview_log`] keeps nothing) and accepted ([`accept_log`]); the samples of both streams
//! ([`stored_samples`], [`merge_by_time`]) are run through the engine ([`computation`]), as [`process`] has it:
//! [`stored_session`] reads what a walk is computed from and [`parameters`] says with which parameters, [`clock_tie`]
//! ties what was keyed in to the log's clock, [`replace_result`] stores the result, with many anomalies as few
//! ([`anomaly_runs`]), [`provenance`] says where it comes from. A [`lab_run`] does the same with chosen parameters; [`comparison`] holds such runs against the
//! session's own track. [`removal`] takes one away.

pub(crate) mod accept_log;
pub(crate) mod add_visits;
pub(crate) mod anomaly_runs;
pub(crate) mod archive;
pub(crate) mod body_writer;
mod clock_tie;
pub(crate) mod comparison;
pub(crate) mod computation;
pub(crate) mod engine_config;
pub(crate) mod identification;
pub(crate) mod lab_run;
mod magic_bytes;
pub(crate) mod merge_by_time;
pub(crate) mod parameters;
pub(crate) mod preview_log;
pub(crate) mod process;
pub(crate) mod provenance;
pub(crate) mod read_log;
pub(crate) mod removal;
mod replace_result;
mod run_metrics;
mod spill;
pub(crate) mod stale_uploads;
pub(crate) mod stand_choice;
pub(crate) mod stored_samples;
mod stored_session;
pub(crate) mod thinning;
pub(crate) mod track_file;
pub(crate) mod unknown_start;
pub mod unpack;
mod upload_copy;
pub(crate) mod upload_file;
pub mod upload_turns;
pub(crate) mod uploads;
mod zip;

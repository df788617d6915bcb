//! What a session is made of on the server.
//!
//! A log comes in ([`uploads`], [`upload_file`], [`upload_turns`]), is read whole ([`unpack`],
//! [`read_log`], [`spill`]) and accepted ([`accept_log`]); the samples of both feet
//! ([`stored_samples`], [`in_time_order`]) are run through the engine ([`run`]) and the result takes
//! the place of the former one ([`process`]).

pub(crate) mod accept_log;
pub(crate) mod body_writer;
pub(crate) mod engine_config;
pub(crate) mod identification;
pub(crate) mod in_time_order;
pub(crate) mod process;
pub(crate) mod read_log;
pub(crate) mod run;
mod signature;
mod spill;
pub(crate) mod stale_uploads;
pub(crate) mod stand_choice;
pub(crate) mod stored_grid;
pub(crate) mod stored_samples;
pub(crate) mod tell_visits;
pub(crate) mod track_file;
pub(crate) mod unpack;
pub(crate) mod upload_file;
pub mod upload_turns;
pub(crate) mod uploads;

//! The Lodestep server: logs and streams in; tracks, findings and a live map out.
//!
//! Read in this order: [`serve`](mod@serve) puts the parts together, [`wire`] is what clients see,
//! [`api`] answers them by [`http`], [`live`] follows walks as they happen, [`store`] keeps everything.

pub mod cli;
pub mod config;
pub mod error;
pub mod rights;
pub mod serve;
pub mod site;
pub mod state;
pub mod wire;

mod alarms;
pub mod api;
mod charts;
pub(crate) mod demo;
mod faults;
pub mod http;
pub mod jobs;
pub mod live;
pub mod markers;
pub mod ntrip;
pub mod sessions;
pub mod store;
pub mod stream_field;

mod assets;
mod auth;
mod background;
mod backup;
mod backup_schedule;
mod connections;
mod csv_cell;
mod data_folder;
mod drill;
mod examples;
mod figures;
mod headers;
pub mod origin;
#[cfg(test)]
mod page_words;
mod private;
mod restore;
mod scrub;
pub mod utc;
mod webhooks;

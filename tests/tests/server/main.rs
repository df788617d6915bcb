//! A real server, asked over HTTP and websockets.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod alarms;
#[cfg(not(feature = "cluster"))]
mod backup;
mod bombs;
mod cabin;
mod charts;
mod cross_origin;
mod day;
mod doors;
mod faults;
mod formats;
mod headers;
mod inspectors;
mod intruders;
mod lab;
mod last_release;
mod live;
mod live_units;
mod marker_imports;
mod markers;
mod ntrip;
mod one_persons_mistake;
mod ownership;
mod paged_lists;
mod paths;
mod people;
mod pole;
mod processing;
mod rights;
mod rover;
mod rover_bad_input;
mod rover_stream;
mod sent_again;
mod session_search;
mod sessions;
mod site_parameters;
mod stands;
mod surroundings;
mod systems;
#[cfg(feature = "cluster")]
mod takeover;
mod upload;
mod watching;
mod webhooks;

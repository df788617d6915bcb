//! A real server, asked over HTTP and websockets.

mod inspectors;
mod live;
mod surroundings;
mod upload;

//! A real server, asked over HTTP and websockets.

mod inspectors;
mod surroundings;

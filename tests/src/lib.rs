//! What the tests share: a real server in a folder of its own.

pub mod server;

//! What the tests share: a real server in a folder of its own, and those who speak with it.

pub mod damage;
pub mod described;
pub mod device;
pub mod every_route;
pub mod faults;
pub mod feed;
pub mod hand_in;
pub mod receiver;
pub mod rtcm_writer;
pub mod server;
pub mod staff;

//! Faults that are done to the real program on purpose, and what must hold whatever happens.
//!
//! [`scene`] is a day's work at once: devices that stream, logs that are handed in, markers that are moved, faults
//! that are reported, by clients who never give up. Each notes in [`promises`] what it was told is on disk. A
//! campaign ([`kill`], [`io_error`], [`disk_full`], [`link`], [`clock`]) does its worst to the [`process`] meanwhile, and
//! [`audit`] reads what is on disk. In the end every track must be, to the last bit, that of an undisturbed run. [`restore`]
//! does its worst while a backup is brought back, [`rot`] changes bits of what lies on the disk.

pub mod audit;
pub mod clock;
pub mod device;
pub mod disk_full;
pub mod editor;
pub mod io_error;
pub mod kill;
pub mod link;
pub mod process;
pub mod promises;
pub mod random;
pub mod restart;
pub mod restore;
pub mod rot;
pub mod scene;
pub mod script;
pub mod takeover;
pub mod uploader;

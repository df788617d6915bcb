//! Hashes of what a track was computed from, as the server keeps them with a result.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use anyhow::Result;
use lodestep_engine::session::Visit;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::cli::failure::Failure;
use crate::sessions::provenance::hex;

/// What was read, by hash.
#[derive(Debug, Serialize)]
pub(super) struct Inputs {
    /// Over the bytes of each foot's file, left first.
    logs_sha256: [Option<String>; 2],
    /// Over the visits with the places of their markers.
    visits_sha256: String,
}

impl Inputs {
    /// Of these files and visits.
    pub(super) fn read(logs: [Option<&Path>; 2], visits: &[Visit]) -> Result<Inputs> {
        let [left, right] = logs.map(|path| path.map(file_sha256).transpose());
        Ok(Inputs {
            logs_sha256: [left?, right?],
            visits_sha256: hex(&Sha256::digest(serde_json::to_vec(visits)?)),
        })
    }
}

fn file_sha256(path: &Path) -> Result<String> {
    let cannot = |error: std::io::Error| Failure::bad_input(path, format!("cannot be read: {error}"));
    let mut file = File::open(path).map_err(cannot)?;
    let (mut hash, mut piece) = (Sha256::new(), vec![0; 64 << 10]);
    loop {
        match file.read(&mut piece).map_err(cannot)? {
            0 => return Ok(hex(&hash.finalize())),
            n => hash.update(&piece[..n]),
        }
    }
}

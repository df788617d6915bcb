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
    /// Over the bytes of each stream's file, in the order of the streams' numbers.
    logs_sha256: Vec<Option<String>>,
    /// Over the visits with the places of their markers.
    visits_sha256: String,
}

impl Inputs {
    /// Of these files and visits.
    pub(super) fn read<'a>(
        logs: impl IntoIterator<Item = Option<&'a Path>>,
        visits: &[Visit],
    ) -> Result<Inputs> {
        let logs = logs.into_iter().map(|path| path.map(file_sha256).transpose());
        Ok(Inputs {
            logs_sha256: logs.collect::<Result<_>>()?,
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

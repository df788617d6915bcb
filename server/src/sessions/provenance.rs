//! Where a result comes from: the engine, what it was told, and hashes of what it read.

use lodestep_engine::session::{SessionConfig, Solution, Visit};
use sha2::{Digest, Sha256};
use tokio::runtime::Handle;

use super::merge_by_time::StreamReadings;
use super::parameters::Chosen;
use super::process::ProcessError;
use super::stored_samples::{Recording, StoredSamples};
use super::stored_session::StoredSession;
use crate::store::lab_runs::{Input, Provenance, Source};
use crate::store::{Store, raw_chunks};
use crate::stream_field::StreamField;

/// The engine's version: that of all crates here.
pub(crate) const ENGINE_VERSION: &str = env!("CARGO_PKG_VERSION");
/// Over the engine's source, as it was built.
pub(crate) const ENGINE_SHA256: &str = env!("LODESTEP_ENGINE_SHA256");

/// Of a walk that has been computed, on a thread that may block.
pub(super) fn provenance(
    walk: &StoredSession,
    store: &Store,
    runtime: &Handle,
    (chosen, solution, track_sha256): (&Chosen, Solution, &str),
) -> Result<Provenance, ProcessError> {
    let inputs = walk.recordings.iter().map(|recording| input(recording, store, runtime));
    let visits: Vec<&Visit> = walk.used_visits().collect();
    Ok(Provenance {
        engine_version: ENGINE_VERSION.to_owned(),
        engine_sha256: ENGINE_SHA256.to_owned(),
        parameters: chosen.parameters.clone().into(),
        parameter_set: chosen.set.clone(),
        aids: walk.config.system.aids(),
        solution,
        inputs: inputs.collect::<Result<_, _>>()?,
        visits_sha256: sha256_of_json(&visits)?,
        visits: visits.len() as u64,
        config_sha256: config_sha256(&walk.config, solution)?,
        track_sha256: track_sha256.to_owned(),
    })
}

/// Of all that is told before the first sample, but for the markers to choose from: those that were chosen are among
/// the visits.
fn config_sha256(config: &SessionConfig, solution: Solution) -> Result<String, ProcessError> {
    sha256_of_json(&SessionConfig { identification: None, solution, ..config.clone() })
}

fn sha256_of_json(value: &impl serde::Serialize) -> Result<String, ProcessError> {
    let json = serde_json::to_vec(value).map_err(|error| ProcessError::Read(error.into()))?;
    Ok(hex(&Sha256::digest(json)))
}

fn input(recording: &Recording, store: &Store, runtime: &Handle) -> Result<Input, ProcessError> {
    let (source, sha256) = match &recording.log_sha256 {
        Some(sha256) => (Source::Log, sha256.clone()),
        None => (Source::Stream, samples_sha256(recording, store, runtime)?),
    };
    Ok(Input { stream: StreamField(recording.stream), source, sha256, samples: recording.samples })
}

/// Over a stream's samples, however they lie in chunks: the time and the values of each, as the store lays them out.
fn samples_sha256(recording: &Recording, store: &Store, runtime: &Handle) -> Result<String, ProcessError> {
    let mut reader = StoredSamples::new(store.clone(), runtime.clone(), recording.origin);
    let (mut hash, mut bytes) = (Sha256::new(), Vec::new());
    loop {
        let readings = reader.next_piece().map_err(ProcessError::Read)?;
        if readings.is_empty() {
            return Ok(hex(&hash.finalize()));
        }
        bytes.clear();
        for reading in readings.iter() {
            raw_chunks::lay_out(&reading, &mut bytes);
        }
        hash.update(&bytes);
    }
}

/// As two digits a byte.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

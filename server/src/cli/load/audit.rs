//! Whether every acknowledged sample is stored once, as it was sent.

use anyhow::{Context, Result, bail, ensure};
use lodestep_engine::parse::batch::StreamKey;
use lodestep_engine::parse::frame;
use lodestep_engine::sample::ImuSample;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::Side;
use uuid::Uuid;

use super::api::Api;
use super::device::Outcome;
use super::walks::Walks;
use crate::cli::progress;

/// What the audit found, in samples.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Audit {
    pub(super) acknowledged: u64,
    pub(super) stored: u64,
    /// Acknowledged, and not stored.
    pub(super) lost: u64,
    /// Stored, and not what was sent at that place: doubled, out of order or altered.
    pub(super) wrong: u64,
}

impl Audit {
    pub(super) fn is_clean(&self) -> bool {
        self.lost == 0 && self.wrong == 0
    }
}

/// Fetches all that is stored and holds it against what was sent.
pub(super) async fn audit(
    api: &Api,
    walks: &Walks,
    sessions: &[Uuid],
    outcomes: &[Outcome],
) -> Result<Audit> {
    let mut found = Audit::default();
    let bar = progress::of_count(sessions.len() as u64, "walks audited");
    for (number, (session_id, outcome)) in sessions.iter().zip(outcomes).enumerate() {
        for foot in Side::BOTH {
            let bytes = api.samples(*session_id, foot.name()).await?;
            let stored =
                read(&bytes, foot).with_context(|| format!("the stored samples of session {session_id}"))?;
            let acknowledged = outcome.acknowledged[foot.index()] * walks.per_frame();
            compare(walks.samples(number, foot), &stored, acknowledged, &mut found);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(found)
}

/// The samples of frames one after the other.
fn read(mut bytes: &[u8], foot: Side) -> Result<Vec<ImuSample>> {
    let mut samples = Vec::new();
    while !bytes.is_empty() {
        let length = frame::length(bytes)?;
        ensure!(
            length <= bytes.len(),
            "expected a frame of {length} bytes, found {}: the answer is cut short",
            bytes.len()
        );
        let (frame, rest) = bytes.split_at(length);
        let batch = frame::decode(frame)?;
        let number = StreamKey::Number(foot.index() as u8);
        ensure!(batch.stream == number, "expected {number:?}, found {:?}", batch.stream);
        let Readings::Imu(read) = batch.readings else { bail!("expected samples, found rows of numbers") };
        samples.extend(read);
        bytes = rest;
    }
    Ok(samples)
}

fn compare(sent: &[ImuSample], stored: &[ImuSample], acknowledged: usize, found: &mut Audit) {
    found.acknowledged += acknowledged as u64;
    found.stored += stored.len() as u64;
    found.lost += acknowledged.saturating_sub(stored.len()) as u64;
    found.wrong += stored.len().saturating_sub(sent.len()) as u64;
    found.wrong += sent.iter().zip(stored).filter(|(sent, stored)| sent != stored).count() as u64;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_ns: i64) -> ImuSample {
        ImuSample {
            t_ns,
            w_ib_b_rad_s: [0.0; 3],
            f_b_m_s2: [0.0, 0.0, 9.8],
            mag_b_ut: None,
            pressure_hpa: None,
        }
    }

    fn audited(stored: &[i64], acknowledged: usize) -> (u64, u64) {
        let sent: Vec<_> = (0..10).map(sample).collect();
        let stored: Vec<_> = stored.iter().copied().map(sample).collect();
        let mut found = Audit::default();
        compare(&sent, &stored, acknowledged, &mut found);
        (found.lost, found.wrong)
    }

    #[test]
    fn what_is_lost_doubled_or_out_of_order_is_found() {
        assert_eq!(audited(&[0, 1, 2, 3], 4), (0, 0));
        assert_eq!(audited(&[0, 1, 2, 3, 4], 4), (0, 0), "stored before its acknowledgement went out");
        assert_eq!(audited(&[0, 1, 2], 4), (1, 0));
        assert_eq!(audited(&[0, 1, 1, 2], 4), (0, 2));
        assert_eq!(audited(&[0, 2, 1, 3], 4), (0, 2));
        assert_eq!(audited(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9], 10), (0, 1));
    }
}

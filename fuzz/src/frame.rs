//! The binary frame of a device: as long as it says, and written as it was read.

use lodestep_engine::parse::{Batch, frame};

use crate::{samples, sentence};

/// The bytes are the frame.
pub(crate) fn run(bytes: &[u8]) {
    match frame::decode(bytes) {
        Err(error) => sentence::check(&error, bytes),
        Ok(batch) => {
            assert!((1..=Batch::MOST_SAMPLES).contains(&batch.samples.len()));
            assert_eq!(bytes.len(), 16 + 88 * batch.samples.len());
            let mut again = Vec::new();
            frame::encode(&batch, &mut again).expect("a batch that was read can be written");
            assert_eq!(again.len(), bytes.len());
            assert_eq!(again[..16], bytes[..16], "the header comes back");
            let read = frame::decode(&again).expect("a frame that was written can be read");
            assert_eq!((read.foot, read.sequence), (batch.foot, batch.sequence));
            samples::assert_same(&read.samples, &batch.samples);
        }
    }
}

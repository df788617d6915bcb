//! The binary frame of a device: as long as it says, and written as it was read.

use lodestep_engine::parse::batch::StreamKey;
use lodestep_engine::parse::{Batch, frame};
use lodestep_engine::stream::Readings;

use crate::{samples, sentence};

/// The bytes are the frame.
pub(crate) fn run(bytes: &[u8]) {
    match frame::decode(bytes) {
        Err(error) => sentence::check(&error, bytes),
        Ok(batch) => {
            assert!((1..=Batch::MOST_SAMPLES).contains(&batch.readings.len()));
            assert_eq!(frame::length(bytes).expect("a frame that was read has a length"), bytes.len());
            let StreamKey::Number(number) = batch.stream else { panic!("a frame names no stream") };
            let mut again = Vec::new();
            frame::encode(number, &batch, &mut again).expect("a batch that was read can be written");
            assert_eq!(again.len(), bytes.len());
            // What version 1 can say is written so.
            assert_eq!(again[3..16], bytes[3..16], "the header comes back");
            let read = frame::decode(&again).expect("a frame that was written can be read");
            assert_eq!((read.stream, read.sequence), (batch.stream, batch.sequence));
            match (&read.readings, &batch.readings) {
                (Readings::Imu(read), Readings::Imu(samples)) => samples::assert_same(read, samples),
                (read, written) => assert_eq!(read, written),
            }
        }
    }
}

//! What a device says in JSON: written as it was read, and no longer than a batch may be.

use lodestep_engine::parse::Batch;
use lodestep_engine::parse::live_message::DeviceMessage;

use crate::sentence;

/// The bytes are the message.
pub(crate) fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match DeviceMessage::from_json(text) {
        Err(error) => sentence::check(&error, bytes),
        Ok(message) => {
            if let DeviceMessage::Batch(batch) = &message {
                assert!((1..=Batch::MOST_SAMPLES).contains(&batch.samples.len()));
                // `[0,,,,,,,,,,],` with a null at each place.
                assert!(
                    batch.samples.len() * 50 <= bytes.len(),
                    "{} of {} bytes",
                    batch.samples.len(),
                    bytes.len()
                );
            }
            let written = message.to_json();
            let again = DeviceMessage::from_json(&written).expect("what was written is read");
            assert_eq!(again.to_json(), written);
        }
    }
}

//! What a device says in JSON: written as it was read, and no longer than a batch may be.

use lodestep_engine::parse::Batch;
use lodestep_engine::parse::live_message::DeviceMessage;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::catalogue::former_keys;

use crate::sentence;

/// The bytes are the message.
pub(crate) fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match DeviceMessage::from_json(text, &former_keys()) {
        Err(error) => sentence::check(&error, bytes),
        Ok(message) => {
            if let DeviceMessage::Batch(batch) = &message {
                let readings = batch.readings.len();
                assert!((1..=Batch::MOST_SAMPLES).contains(&readings));
                // `[0,,,,,,,,,,],` with a null at each place, or `[0,[]],`.
                let least = if matches!(batch.readings, Readings::Imu(_)) { 50 } else { 7 };
                assert!(readings * least <= bytes.len() + 1, "{readings} of {} bytes", bytes.len());
            }
            let written = message.to_json();
            let again = DeviceMessage::from_json(&written, &former_keys()).expect("what was written is read");
            assert_eq!(again.to_json(), written);
        }
    }
}

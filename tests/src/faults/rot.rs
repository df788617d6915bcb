//! Bits that change on the disk: what they touch of samples and results is found and named, and nothing else is taken for it.

use std::path::Path;

use lodestep_engine::geo::Site;
use lodestep_engine::sim::pedestrian::{SensorModel, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_server::store::{backup, hashes};
use serde_json::json;
use tempfile::TempDir;

use super::random::Random;
use crate::device::TestDevice;
use crate::hand_in::log;
use crate::server::TestServer;

/// What every row of is checked by a checksum of its own.
const CHECKED: [&str; 6] =
    ["raw_chunks", "stream_chunks", "track_points", "lab_tracks", "session_charts", "fault_photos"];

/// What came of a campaign.
#[derive(Clone, Debug, Default)]
pub struct Came {
    /// Bits that were flipped, each in a copy of its own.
    pub flips: u64,
    /// Of these, after which SQLite itself found the database damaged.
    pub by_structure: u64,
    /// Of these, after which checksums named what is damaged.
    pub by_checksum: u64,
    /// Of these, that touched nothing of samples and results: free bytes, or other tables.
    pub elsewhere: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

/// A database of so many walks, half of them streamed, all worked out.
pub async fn database(walks: u64) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let server = TestServer::start().await;
    for number in 0..walks {
        let kind = WalkKind::Line { metres: 4.0 };
        let walk = simulate(&kind, number, &Site::fast(), &SensorModel::cmp10a());
        let feet = [(Side::Left, "left", &walk.left), (Side::Right, "right", &walk.right)];
        let session = if number % 2 == 0 {
            let session = server.session(json!({})).await;
            for (_, foot, samples) in feet {
                server.hand_in(&session, foot, log(samples)).await;
            }
            session
        } else {
            let (mut device, session) = TestDevice::begin(&server, &server.inspector().await).await;
            for (side, _, samples) in feet {
                for (sequence, batch) in samples.chunks(500).enumerate() {
                    device.send_frame(side, sequence as u64, batch).await;
                }
            }
            device.finish().await;
            session
        };
        let job = server.process(&session).await;
        assert_eq!(job["state"], "finished", "{job}");
    }
    let database = server.folder().join("lodestep.db");
    let kept = folder.path().join("lodestep.db");
    backup::copy(&database, &kept).await.expect("a copy can be made");
    server.stop().await;
    folder
}

/// Flips so many bits of a database, each in a copy of its own, and reads that.
pub async fn flip(database: &Path, flips: u64, random: &mut Random) -> Came {
    let mut came = Came::default();
    let whole = std::fs::read(database).expect("the database can be read");
    let expected = hashes::of(database).await.expect("the database is good");
    let folder = TempDir::new().expect("a temporary folder can be made");
    let copy = folder.path().join("lodestep.db");
    for _ in 0..flips {
        let (at, bit) = (random.below(whole.len() as u64) as usize, random.below(8));
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << bit;
        std::fs::write(&copy, bytes).expect("the copy can be written");
        came.flips += 1;
        let what = format!("bit {bit} of byte {at}");
        match backup::check(&copy).await {
            Err(_) => came.by_structure += 1,
            Ok(named) if !named.is_empty() => {
                came.by_checksum += 1;
                if let Err(error) = hashes::of(&copy).await {
                    came.wrong.push(format!("{what}: {named:?}, and the rest cannot be read: {error}"));
                }
            }
            Ok(_) => match hashes::of(&copy).await {
                Ok(found) => {
                    came.elsewhere += 1;
                    for table in CHECKED {
                        if found.tables.get(table) != expected.tables.get(table) {
                            came.wrong.push(format!("{what}: {table} was changed, and nothing was found"));
                        }
                    }
                }
                Err(error) => came.wrong.push(format!("{what}: nothing was found, and then {error}")),
            },
        }
    }
    came
}

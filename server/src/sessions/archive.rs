//! A ZIP archive, or a folder, of one sensor's files: phone loggers and the x-IMU3 write a file for each of its sensors.

use std::io::Read;

use lodestep_engine::parse::sensor_files::{self, Joined, SensorFile};

use super::unpack::{RATIO_GRACE_BYTES, UnpackError, UnpackLimits};
use super::zip;

/// A recording of one sensor has a dozen files.
const MOST_FILES: usize = 200;
/// The files of a sensor are held in memory while they are joined: an hour of a phone's is a tenth of this.
const MOST_BYTES: u64 = 1 << 30;

/// Unpacks an archive and joins the tables in it to one log.
pub(super) fn read(mut source: impl Read, limits: UnpackLimits) -> Result<Joined, UnpackError> {
    let limit_bytes = limits.max_unpacked_bytes.min(MOST_BYTES);
    let mut packed = Vec::new();
    source.by_ref().take(limit_bytes + 1).read_to_end(&mut packed).map_err(UnpackError::Io)?;
    let packed_bytes = packed.len() as u64;
    if packed_bytes > limit_bytes {
        return Err(UnpackError::TooLarge { limit_bytes });
    }
    let entries = zip::entries(&packed).map_err(|reason| UnpackError::Archive { reason })?;
    if entries.len() > MOST_FILES {
        return Err(UnpackError::NotALog {
            found: "a ZIP archive of more than 200 files",
            advice: "Send one archive for each sensor, as its logger wrote it",
        });
    }
    if entries.iter().any(|entry| entry.name.starts_with("xl/")) {
        return Err(UnpackError::NotALog {
            found: "an Excel workbook",
            advice: "Save its sheet as CSV and send that",
        });
    }
    let (mut files, mut unpacked_bytes) = (Vec::new(), 0);
    for entry in entries.into_iter().filter(|entry| is_table(&entry.name)) {
        let bytes = entry.read(limit_bytes - unpacked_bytes);
        let bytes = bytes.map_err(|error| UnpackError::Archive { reason: error.to_string() })?;
        unpacked_bytes += bytes.len() as u64;
        if unpacked_bytes > RATIO_GRACE_BYTES && unpacked_bytes / packed_bytes.max(1) > limits.max_ratio {
            return Err(UnpackError::RatioTooHigh { limit: limits.max_ratio, packed_bytes, unpacked_bytes });
        }
        if unpacked_bytes > limit_bytes {
            return Err(UnpackError::TooLarge { limit_bytes });
        }
        files.push((entry.name, bytes));
    }
    join(&files)
}

/// Joins the tables of one sensor to one log.
pub(crate) fn join(files: &[(String, Vec<u8>)]) -> Result<Joined, UnpackError> {
    let files: Vec<SensorFile<'_>> = files.iter().map(|(name, bytes)| SensorFile { name, bytes }).collect();
    sensor_files::join(&files).map_err(UnpackError::NoSensorFiles)
}

/// Whether a file may hold a table, by its name: what systems put beside files of one's own does not.
pub(crate) fn is_table(name: &str) -> bool {
    let short = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let lower = short.to_lowercase();
    let foreign = short.starts_with('.')
        || name.starts_with("__MACOSX")
        || name.contains("/meta/")
        || name.starts_with("meta/");
    !foreign && [".csv", ".txt", ".tsv"].iter().any(|ending| lower.ends_with(ending))
}

#[cfg(test)]
mod tests {
    use super::super::unpack::Unpack;
    use super::super::zip::tests::zipped;
    use super::*;

    const LIMITS: UnpackLimits = UnpackLimits { max_unpacked_bytes: 1 << 30, max_ratio: 200 };

    #[test]
    fn an_archive_of_sensor_files_is_one_log_with_a_note() {
        let rows = |value: &str| -> String {
            "time,seconds_elapsed,z,y,x\n".to_owned()
                + &(0..50)
                    .map(|k| format!("{},0,{value}\n", 1_700_000_000_000_000_000_u64 + k * 10_000_000))
                    .collect::<String>()
        };
        let (gyroscope, force) = (rows("0.1,0,0"), rows("9.8,0,0"));
        let packed = zipped(&[
            ("Gyroscope.csv", gyroscope.as_bytes()),
            ("TotalAcceleration.csv", force.as_bytes()),
            ("__MACOSX/Gyroscope.csv", b"\0"),
            ("photo.jpg", b"\xff\xd8\xff"),
        ]);
        let mut unpack = Unpack::new(&packed[..], LIMITS).unwrap();
        let (mut text, mut piece) = (Vec::new(), [0; 100]);
        while let n @ 1.. = unpack.read(&mut piece).unwrap() {
            text.extend_from_slice(&piece[..n]);
        }
        let text = String::from_utf8(text).unwrap();
        assert_eq!(text.lines().count(), 51, "{text}");
        assert!(unpack.note().unwrap().contains("joined by time"));
        let cut = Unpack::new(&packed[..packed.len() / 2], LIMITS).map(|_| ()).unwrap_err().to_string();
        assert!(cut.contains("ZIP"), "{cut}");
        let none =
            Unpack::new(&zipped(&[("a.txt", b"hello")])[..], LIMITS).map(|_| ()).unwrap_err().to_string();
        assert!(none.contains("angular rates"), "{none}");
        let workbook = Unpack::new(&zipped(&[("xl/workbook.xml", b"")])[..], LIMITS)
            .map(|_| ())
            .unwrap_err()
            .to_string();
        assert!(workbook.contains("Excel"), "{workbook}");
    }

    #[test]
    fn an_archive_that_unpacks_to_more_than_any_log_is_refused() {
        let packed = zipped(&[("a.csv", &vec![b'0'; 40 << 20])]);
        let error = Unpack::new(&packed[..], LIMITS).map(|_| ()).unwrap_err();
        assert!(matches!(error, UnpackError::RatioTooHigh { .. }), "{error}");
        let small = UnpackLimits { max_unpacked_bytes: 1 << 20, ..LIMITS };
        let error = Unpack::new(&packed[..], small).map(|_| ()).unwrap_err();
        assert!(matches!(error, UnpackError::TooLarge { .. }), "{error}");
    }
}

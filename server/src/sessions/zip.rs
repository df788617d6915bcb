//! The files in a ZIP archive, by its directory (PKWARE's APPNOTE, 4.3): stored or deflated, without encryption and below 4 GiB, as
//! phones write them. What a whole library brings beside that (AES, time stamps of every system, writing) nobody sends here.

use std::io::{self, Read};

use flate2::Crc;
use flate2::read::DeflateDecoder;

const DIRECTORY_END: &[u8] = b"PK\x05\x06";
const DIRECTORY_END_BYTES: usize = 22;
const DIRECTORY_ENTRY: &[u8] = b"PK\x01\x02";
const DIRECTORY_ENTRY_BYTES: usize = 46;
const LOCAL_ENTRY: &[u8] = b"PK\x03\x04";
const LOCAL_ENTRY_BYTES: usize = 30;
/// The longest comment behind the directory's end.
const LONGEST_COMMENT: usize = 0xFFFF;
/// A size or an offset that stands elsewhere, in the form for large archives.
const ELSEWHERE: usize = 0xFFFF_FFFF;

/// A file in an archive.
#[derive(Debug)]
pub(super) struct Entry<'a> {
    /// Its name, with its folders.
    pub(super) name: String,
    method: u16,
    crc: u32,
    packed: &'a [u8],
}

/// The files of an archive, in the order of its directory.
pub(super) fn entries(archive: &[u8]) -> Result<Vec<Entry<'_>>, String> {
    let last = archive.len().checked_sub(DIRECTORY_END_BYTES).ok_or("it is too short for a directory")?;
    let end = (last.saturating_sub(LONGEST_COMMENT)..=last)
        .rev()
        .find(|at| archive[*at..].starts_with(DIRECTORY_END))
        .ok_or("its directory is missing")?;
    let count = number(archive, end + 10, 2)?;
    let mut at = number(archive, end + 16, 4)?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let entry = slice(archive, at, DIRECTORY_ENTRY_BYTES)?;
        if !entry.starts_with(DIRECTORY_ENTRY) {
            return Err("its directory is broken".to_owned());
        }
        let (flags, method) = (number(entry, 8, 2)?, number(entry, 10, 2)?);
        let (crc, packed_bytes) = (number(entry, 16, 4)?, number(entry, 20, 4)?);
        let [name, extra, comment] = [28, 30, 32].map(|at| number(entry, at, 2));
        let (name_bytes, extra_bytes, comment_bytes) = (name?, extra?, comment?);
        let local = number(entry, 42, 4)?;
        let name =
            String::from_utf8_lossy(slice(archive, at + DIRECTORY_ENTRY_BYTES, name_bytes)?).into_owned();
        if flags & 1 != 0 {
            return Err(format!("{name} is encrypted"));
        }
        if packed_bytes == ELSEWHERE || local == ELSEWHERE {
            return Err(format!("{name} is larger than 4 GiB"));
        }
        let header = slice(archive, local, LOCAL_ENTRY_BYTES)?;
        if !header.starts_with(LOCAL_ENTRY) {
            return Err(format!("{name} is not where the directory says"));
        }
        let data = local + LOCAL_ENTRY_BYTES + number(header, 26, 2)? + number(header, 28, 2)?;
        let (method, crc) = (method as u16, crc as u32);
        entries.push(Entry { name, method, crc, packed: slice(archive, data, packed_bytes)? });
        at += DIRECTORY_ENTRY_BYTES + name_bytes + extra_bytes + comment_bytes;
    }
    Ok(entries)
}

impl Entry<'_> {
    /// What is in it, as far as `most_bytes` and one more.
    pub(super) fn read(&self, most_bytes: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        match self.method {
            0 => self.packed.take(most_bytes + 1).read_to_end(&mut bytes)?,
            8 => DeflateDecoder::new(self.packed).take(most_bytes + 1).read_to_end(&mut bytes)?,
            other => {
                let reason =
                    format!("{} is packed in a way that is not read ({other}): pack it as usual", self.name);
                return Err(io::Error::new(io::ErrorKind::Unsupported, reason));
            }
        };
        let mut crc = Crc::new();
        crc.update(&bytes);
        if bytes.len() as u64 <= most_bytes && crc.sum() != self.crc {
            return Err(io::Error::new(
                io::ErrorKind::InvalidData,
                format!("the checksum of {} is wrong", self.name),
            ));
        }
        Ok(bytes)
    }
}

fn slice(bytes: &[u8], at: usize, count: usize) -> Result<&[u8], String> {
    let end = at.checked_add(count).filter(|end| *end <= bytes.len());
    end.map(|end| &bytes[at..end]).ok_or_else(|| "it points beyond its end".to_owned())
}

/// A little-endian number of so many bytes.
fn number(bytes: &[u8], at: usize, count: usize) -> Result<usize, String> {
    Ok(slice(bytes, at, count)?.iter().rev().fold(0, |value, byte| value << 8 | usize::from(*byte)))
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Write as _;

    use super::*;

    /// An archive of these files, every second one stored as it is.
    pub(in crate::sessions) fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
        let (mut archive, mut directory) = (Vec::new(), Vec::new());
        for (k, (name, bytes)) in files.iter().enumerate() {
            let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(bytes).unwrap();
            let deflated = encoder.finish().unwrap();
            let (method, packed) = if k % 2 == 0 { (8_u16, deflated) } else { (0, bytes.to_vec()) };
            let mut crc = Crc::new();
            crc.update(bytes);
            let mut common = [20_u16, 0, method, 0, 0].map(u16::to_le_bytes).concat();
            common
                .extend([crc.sum(), packed.len() as u32, bytes.len() as u32].map(u32::to_le_bytes).concat());
            common.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
            directory.extend([DIRECTORY_ENTRY, &[20, 0], &common].concat());
            directory.extend([0; 10]);
            directory.extend((archive.len() as u32).to_le_bytes());
            directory.extend(name.as_bytes());
            archive.extend([LOCAL_ENTRY, &common, name.as_bytes(), &packed].concat());
        }
        let (count, at) = (files.len() as u16, archive.len() as u32);
        archive.extend(&directory);
        archive.extend([DIRECTORY_END, &[0; 4], &count.to_le_bytes(), &count.to_le_bytes()].concat());
        archive.extend([directory.len() as u32, at].map(u32::to_le_bytes).concat());
        archive.extend([0; 2]);
        archive
    }

    #[test]
    fn stored_and_deflated_files_come_back_and_a_changed_byte_is_told() {
        let files: [(&str, &[u8]); 2] = [("a/one.csv", b"one one one one one one"), ("two.csv", b"two")];
        let archive = zipped(&files);
        let found = entries(&archive).unwrap();
        for (entry, (name, bytes)) in found.iter().zip(files) {
            assert_eq!((entry.name.as_str(), entry.read(100).unwrap().as_slice()), (name, bytes));
        }
        let mut changed = archive.clone();
        let at = archive.windows(3).position(|bytes| bytes == b"two").unwrap() + 7;
        changed[at] ^= 1;
        assert!(entries(&changed).unwrap()[1].read(100).unwrap_err().to_string().contains("checksum"));
    }

    #[test]
    fn whatever_is_cut_or_changed_there_is_no_panic() {
        let archive = zipped(&[("a.csv", &[7; 300]), ("b.csv", b"b")]);
        let read = |bytes: &[u8]| {
            entries(bytes).map(|found| found.iter().filter(|entry| entry.read(50).is_ok()).count())
        };
        for cut in 0..archive.len() {
            assert!(read(&archive[..cut]).is_err());
        }
        for at in 0..archive.len() {
            let mut changed = archive.clone();
            changed[at] ^= 0xFF;
            let _ = read(&changed);
        }
    }
}

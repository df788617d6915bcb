//! What a file is by its first bytes: how a log is packed, and what is plainly no log.

use super::unpack::Packing;

/// As many bytes as the longest signature looks at.
pub(crate) const LONGEST: usize = 16;

const GZIP: &[u8] = b"\x1f\x8b";
/// An archive of several files.
pub(crate) const ZIP: &[u8] = b"PK\x03\x04";
const ZSTD: &[u8] = b"\x28\xb5\x2f\xfd";

const SEND_THE_LOG: &str = "Choose the CSV log of one stream";
const SEND_GZIP: &str = "Unpack it and send the CSV of one stream, plain or packed with gzip or zstd";

/// Files that people do send, by their first bytes.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    (b"\x89PNG", "a PNG picture", SEND_THE_LOG),
    (b"\xff\xd8\xff", "a JPEG picture", SEND_THE_LOG),
    (b"GIF8", "a GIF picture", SEND_THE_LOG),
    (
        b"\x89HDF",
        "an HDF5 file",
        "Export it as CSV (APDM Motion Studio or Mobility Lab: Export, CSV) and send the table of one sensor",
    ),
    (b"%PDF", "a PDF document", SEND_THE_LOG),
    (ZIP, "a ZIP archive inside a packed file", "Send the archive as it is"),
    (b"\xfd7zXZ", "an xz archive", SEND_GZIP),
    (b"BZh", "a bzip2 archive", SEND_GZIP),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", SEND_GZIP),
    (b"Rar!", "a RAR archive", SEND_GZIP),
    (GZIP, "a gzip file inside a packed one", "Pack it once only"),
    (ZSTD, "a zstd file inside a packed one", "Pack it once only"),
];

/// How a file with these first bytes is packed.
pub(crate) fn packing(head: &[u8]) -> Packing {
    if head.starts_with(GZIP) {
        Packing::Gzip
    } else if head.starts_with(ZSTD) {
        Packing::Zstd
    } else {
        Packing::Plain
    }
}

/// What a file that is no log is, and what to do about it.
pub(crate) fn foreign(head: &[u8]) -> Option<(&'static str, &'static str)> {
    let (_, found, advice) = FOREIGN.iter().find(|(signature, ..)| head.starts_with(signature))?;
    Some((found, advice))
}

//! Unpacks a log as it was sent: plain text, gzip, zstd, or a ZIP archive of one sensor's files, told apart by the first bytes.
//!
//! What was cut off, or is damaged on the way, is read as far as it goes, and that is told: see [`Unpack::odd_end`].
//!
//! Reads piece by piece in bounded memory, and stops as soon as the stream unpacks to more than the
//! limits allow, so that ten megabytes cannot become ten gigabytes.

use std::io::{self, BufRead as _, BufReader, Read};

use flate2::bufread::GzDecoder;

use lodestep_engine::parse::ParseError;
use lodestep_engine::parse::sensor_files::Joined;

use super::{archive, magic_bytes};

/// Below this many unpacked bytes the ratio is not judged: a short log of a still sensor packs well.
pub const RATIO_GRACE_BYTES: u64 = 16 << 20;

/// The largest zstd window that is unpacked, as a power of two: 8 MiB, what level 19 uses.
const ZSTD_WINDOW_LOG_MAX: u32 = 23;

/// A packed file of which less can be unpacked holds no walk: it is refused where it was cut off.
const LEAST_UNPACKED_BYTES: u64 = 16 << 10;

/// Bytes read from the file at a time.
const READ_BYTES: usize = 64 << 10;

/// How far a packed log may grow.
#[derive(Clone, Copy, Debug)]
pub struct UnpackLimits {
    /// Unpacked bytes at most.
    pub max_unpacked_bytes: u64,
    /// Unpacked bytes for one packed byte at most, judged once past `RATIO_GRACE_BYTES`.
    pub max_ratio: u64,
}

/// How a log was packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// Not at all.
    Plain,
    /// One or more gzip members.
    Gzip,
    /// zstd frames.
    Zstd,
}

impl Packing {
    fn name(self) -> &'static str {
        match self {
            Packing::Plain => "plain text",
            Packing::Gzip => "gzip",
            Packing::Zstd => "zstd",
        }
    }
}

/// Why a log could not be unpacked.
#[derive(Debug, thiserror::Error)]
pub enum UnpackError {
    /// Nothing was sent.
    #[error(
        "the file is empty: 0 bytes where a header line and samples were expected. Send the log again from the device"
    )]
    Empty,
    /// A picture, a document, an archive of another kind.
    #[error("expected a CSV log (plain, gzip or zstd), found {found}. {advice}")]
    NotALog {
        /// What it is.
        found: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// The stream was cut off.
    #[error(
        "the {} stream ends in the middle, after {unpacked_bytes} unpacked bytes: the file was cut off. \
         Copy it from the device again and upload the whole of it", packing.name()
    )]
    Truncated {
        /// How it was packed.
        packing: Packing,
        /// Bytes that came out before.
        unpacked_bytes: u64,
    },
    /// The stream does not hold together.
    #[error(
        "the {} stream is damaged after {unpacked_bytes} unpacked bytes ({reason}). \
         Copy the file from the device again, or send it unpacked", packing.name()
    )]
    Damaged {
        /// How it was packed.
        packing: Packing,
        /// Bytes that came out before.
        unpacked_bytes: u64,
        /// In the unpacker's words.
        reason: String,
    },
    /// More than one log may unpack to.
    #[error(
        "the log unpacks to more than {limit_bytes} bytes, which is the limit for one log. \
         Split the session, or raise --unpacked-bytes"
    )]
    TooLarge {
        /// The most.
        limit_bytes: u64,
    },
    /// More for one packed byte than any log unpacks to.
    #[error(
        "the log unpacks to more than {limit} times its packed size ({packed_bytes} bytes became {unpacked_bytes}), \
         which no sensor log does. Send it unpacked if it is a log after all"
    )]
    RatioTooHigh {
        /// The most unpacked bytes for a packed one.
        limit: u64,
        /// Packed bytes that were read.
        packed_bytes: u64,
        /// What they became.
        unpacked_bytes: u64,
    },
    /// An archive that does not hold together.
    #[error(
        "the ZIP archive is damaged or was cut off ({reason}). Copy it from the device again and send the whole of it"
    )]
    Archive {
        /// In the unpacker's words.
        reason: String,
    },
    /// An archive without the files of a sensor.
    #[error("an archive or a folder is read where it holds the files of one sensor. {0}")]
    NoSensorFiles(ParseError),
    /// The disk failed.
    #[error("the uploaded file cannot be read back: {0}")]
    Io(io::Error),
}

/// Counts what the decoder below has consumed.
struct Counted<R> {
    inner: R,
    bytes: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.bytes += n as u64;
        Ok(n)
    }
}

type Source<R> = BufReader<Counted<io::Chain<io::Cursor<Vec<u8>>, R>>>;

enum Stream<R: Read> {
    Plain(Source<R>),
    Gzip(Box<GzDecoder<Source<R>>>),
    /// Behind the last member.
    GzipEnded(Box<Source<R>>),
    /// While one becomes another.
    Nothing,
    Zstd(zstd::stream::read::Decoder<'static, Source<R>>),
    /// Files of an archive that have become one log.
    Joined(io::Cursor<String>),
}

/// A log being unpacked.
pub struct Unpack<R: Read> {
    stream: Stream<R>,
    limits: UnpackLimits,
    unpacked_bytes: u64,
    odd_end: Option<&'static str>,
    /// Nothing more can be unpacked.
    broken_off: bool,
    note: Option<String>,
}

impl<R: Read> Unpack<R> {
    /// Looks at the first bytes of `source` and chooses how to unpack it.
    pub fn new(mut source: R, limits: UnpackLimits) -> Result<Self, UnpackError> {
        let mut head = Vec::with_capacity(magic_bytes::LONGEST);
        source.by_ref().take(magic_bytes::LONGEST as u64).read_to_end(&mut head).map_err(UnpackError::Io)?;
        if head.is_empty() {
            return Err(UnpackError::Empty);
        }
        if head.starts_with(magic_bytes::ZIP) {
            let Joined { csv, note } = archive::read(io::Cursor::new(head).chain(source), limits)?;
            let stream = Stream::Joined(io::Cursor::new(csv));
            return Ok(Unpack {
                stream,
                limits,
                unpacked_bytes: 0,
                odd_end: None,
                broken_off: false,
                note: Some(note),
            });
        }
        let packing = magic_bytes::packing(&head);
        if packing == Packing::Plain {
            refuse_foreign(&head)?;
        }
        let counted = Counted { inner: io::Cursor::new(head).chain(source), bytes: 0 };
        let source = BufReader::with_capacity(READ_BYTES, counted);
        let stream = match packing {
            Packing::Plain => Stream::Plain(source),
            Packing::Gzip => Stream::Gzip(Box::new(GzDecoder::new(source))),
            Packing::Zstd => {
                let mut decoder =
                    zstd::stream::read::Decoder::with_buffer(source).map_err(UnpackError::Io)?;
                decoder.window_log_max(ZSTD_WINDOW_LOG_MAX).map_err(UnpackError::Io)?;
                Stream::Zstd(decoder)
            }
        };
        Ok(Unpack { stream, limits, unpacked_bytes: 0, odd_end: None, broken_off: false, note: None })
    }

    /// The log that several files of one sensor are together.
    pub(crate) fn of_files(files: &[(String, Vec<u8>)], limits: UnpackLimits) -> Result<Self, UnpackError> {
        let Joined { csv, note } = archive::join(files)?;
        let stream = Stream::Joined(io::Cursor::new(csv));
        Ok(Unpack { stream, limits, unpacked_bytes: 0, odd_end: None, broken_off: false, note: Some(note) })
    }

    /// How it was packed.
    pub fn packing(&self) -> Packing {
        match self.stream {
            Stream::Plain(_) | Stream::Nothing | Stream::Joined(_) => Packing::Plain,
            Stream::Gzip(_) | Stream::GzipEnded(_) => Packing::Gzip,
            Stream::Zstd(_) => Packing::Zstd,
        }
    }

    /// The next piece of the log into `buffer`; 0 at its end.
    pub fn read(&mut self, buffer: &mut [u8]) -> Result<usize, UnpackError> {
        if self.broken_off {
            return Ok(0);
        }
        let read = match &mut self.stream {
            Stream::Plain(source) => source.read(buffer),
            Stream::Gzip(_) => self.read_gzip(buffer),
            Stream::GzipEnded(_) | Stream::Nothing => Ok(0),
            Stream::Zstd(decoder) => decoder.read(buffer),
            Stream::Joined(csv) => csv.read(buffer),
        };
        let n = match read {
            Ok(n) => n,
            Err(error) => {
                self.break_off(error)?;
                0
            }
        };
        if self.unpacked_bytes == 0 && n > 0 && self.packing() != Packing::Plain {
            refuse_foreign(&buffer[..n])?;
        }
        self.unpacked_bytes += n as u64;
        self.check_limits()?;
        Ok(n)
    }

    /// What is odd about the end of a packed file of which all was read, if anything.
    pub fn odd_end(&self) -> Option<&'static str> {
        self.odd_end
    }

    /// What was done to make one log of several files, if that was so.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// One member after the other. What stands behind the last and begins no other is filling.
    fn read_gzip(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let Stream::Gzip(decoder) = &mut self.stream {
            let read = decoder.read(buffer)?;
            if read > 0 || buffer.is_empty() {
                return Ok(read);
            }
            let Stream::Gzip(decoder) = std::mem::replace(&mut self.stream, Stream::Nothing) else { break };
            let mut source = decoder.into_inner();
            self.stream = match source.fill_buf()?.first() {
                Some(0x1F) => Stream::Gzip(Box::new(GzDecoder::new(source))),
                rest => {
                    self.odd_end = rest.map(|_| "goes on behind its end with bytes that are not packed");
                    Stream::GzipEnded(Box::new(source))
                }
            };
        }
        Ok(0)
    }

    /// Goes on unpacking, for nothing, as far as the ratio's grace: a parser that gave up on the
    /// first line cannot tell a bomb from a mistake, and the two deserve different answers.
    pub fn judge_packing(&mut self) -> Result<(), UnpackError> {
        let mut discarded = vec![0; READ_BYTES];
        while self.packing() != Packing::Plain && self.unpacked_bytes <= RATIO_GRACE_BYTES {
            if self.read(&mut discarded)? == 0 {
                break;
            }
        }
        Ok(())
    }

    fn packed_bytes(&self) -> u64 {
        match &self.stream {
            Stream::Plain(source) => source.get_ref().bytes,
            Stream::Gzip(decoder) => decoder.get_ref().get_ref().bytes,
            Stream::GzipEnded(source) => source.get_ref().bytes,
            Stream::Nothing => 0,
            // Judged while it was unpacked.
            Stream::Joined(_) => u64::MAX,
            Stream::Zstd(decoder) => decoder.get_ref().get_ref().bytes,
        }
    }

    fn check_limits(&self) -> Result<(), UnpackError> {
        let UnpackLimits { max_unpacked_bytes, max_ratio } = self.limits;
        if self.unpacked_bytes > max_unpacked_bytes {
            return Err(UnpackError::TooLarge { limit_bytes: max_unpacked_bytes });
        }
        let packed_bytes = self.packed_bytes();
        if self.unpacked_bytes > RATIO_GRACE_BYTES && self.unpacked_bytes / packed_bytes.max(1) > max_ratio {
            return Err(UnpackError::RatioTooHigh {
                limit: max_ratio,
                packed_bytes,
                unpacked_bytes: self.unpacked_bytes,
            });
        }
        Ok(())
    }

    /// The stream cannot be unpacked any further: what came before is kept, where it may be a walk.
    fn break_off(&mut self, error: io::Error) -> Result<(), UnpackError> {
        use io::ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
        // What the disk cannot read is another matter.
        let of_stream = matches!(error.kind(), InvalidData | InvalidInput | Other | UnexpectedEof);
        let error = self.explain(error);
        self.odd_end = match error {
            error if !of_stream => return Err(error),
            UnpackError::Truncated { unpacked_bytes, .. } if unpacked_bytes >= LEAST_UNPACKED_BYTES => {
                Some("ends in the middle: it was cut off, and its last rows are missing")
            }
            UnpackError::Damaged { unpacked_bytes, .. } if unpacked_bytes >= LEAST_UNPACKED_BYTES => {
                Some("is damaged: rows before that place may be wrong, and those behind it are missing")
            }
            error => return Err(error),
        };
        self.broken_off = true;
        Ok(())
    }

    fn explain(&self, error: io::Error) -> UnpackError {
        let (packing, unpacked_bytes) = (self.packing(), self.unpacked_bytes);
        match error.kind() {
            _ if packing == Packing::Plain => UnpackError::Io(error),
            io::ErrorKind::UnexpectedEof => UnpackError::Truncated { packing, unpacked_bytes },
            _ => UnpackError::Damaged { packing, unpacked_bytes, reason: error.to_string() },
        }
    }
}

fn refuse_foreign(head: &[u8]) -> Result<(), UnpackError> {
    match magic_bytes::foreign(head) {
        Some((found, advice)) => Err(UnpackError::NotALog { found, advice }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const LIMITS: UnpackLimits = UnpackLimits { max_unpacked_bytes: 1 << 30, max_ratio: 200 };

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn text() -> Vec<u8> {
        text_of(20_000)
    }

    fn text_of(lines: u32) -> Vec<u8> {
        (0..lines).flat_map(|i| format!("{},{}\n", i, (i * 7919) % 1009).into_bytes()).collect()
    }

    fn unpack(packed: &[u8], limits: UnpackLimits) -> Result<Vec<u8>, UnpackError> {
        let mut unpack = Unpack::new(packed, limits)?;
        let (mut all, mut buffer) = (Vec::new(), [0; 1000]);
        loop {
            match unpack.read(&mut buffer)? {
                0 => return Ok(all),
                n => all.extend_from_slice(&buffer[..n]),
            }
        }
    }

    #[test]
    fn every_packing_gives_the_same_bytes() {
        let text = text();
        let zstd = zstd::encode_all(&text[..], 3).unwrap();
        let halves = [gzip(&text[..5000]), gzip(&text[5000..])].concat();
        for packed in [text.clone(), gzip(&text), halves, zstd] {
            assert!(unpack(&packed, LIMITS).unwrap() == text);
        }
    }

    #[test]
    fn a_stream_that_was_cut_is_called_truncated_wherever_it_was_cut() {
        // Some blocks of either packing.
        let text = text_of(160_000);
        for packed in [gzip(&text), zstd::encode_all(&text[..], 3).unwrap()] {
            for cut in [5, 9, 15] {
                let error = unpack(&packed[..cut], LIMITS).unwrap_err();
                assert!(matches!(error, UnpackError::Truncated { .. }), "cut at {cut}: {error}");
            }
            for cut in [packed.len() / 2, packed.len() - 1] {
                let (found, odd_end) = unpack_as_far(&packed[..cut]);
                assert!(text.starts_with(&found) && found.len() >= 16 << 10, "cut at {cut}: {}", found.len());
                assert!(odd_end.unwrap().contains("cut off"));
            }
        }
    }

    /// What came out, and what is odd about the end.
    fn unpack_as_far(packed: &[u8]) -> (Vec<u8>, Option<&'static str>) {
        let mut unpack = Unpack::new(packed, LIMITS).unwrap();
        let (mut all, mut buffer) = (Vec::new(), [0; 1000]);
        while let n @ 1.. = unpack.read(&mut buffer).unwrap() {
            all.extend_from_slice(&buffer[..n]);
        }
        assert_eq!(unpack.read(&mut buffer).unwrap(), 0, "an end is an end");
        (all, unpack.odd_end())
    }

    #[test]
    fn filling_behind_a_whole_stream_is_read_over_and_told() {
        for filling in [&[0; 5000][..], b"\x1a"] {
            let (all, odd_end) = unpack_as_far(&[&gzip(&text()), filling].concat());
            assert!(all == text() && odd_end.is_some());
        }
    }

    #[test]
    fn a_flipped_byte_is_called_damaged() {
        let mut packed = gzip(&text());
        let checksum = packed.len() - 6;
        packed[checksum] ^= 0x10;
        let (all, odd_end) = unpack_as_far(&packed);
        assert!(all == text() && odd_end.unwrap().contains("damaged"));
        let mut short = gzip(b"0,1\n2,3\n");
        let checksum = short.len() - 6;
        short[checksum] ^= 0x10;
        let error = unpack(&short, LIMITS).unwrap_err();
        assert!(matches!(error, UnpackError::Damaged { packing: Packing::Gzip, .. }), "{error}");
    }

    #[test]
    fn nothing_and_a_picture_are_named_for_what_they_are() {
        assert!(matches!(unpack(b"", LIMITS).unwrap_err(), UnpackError::Empty));
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
        for picture in [png.to_vec(), gzip(png)] {
            let error = unpack(&picture, LIMITS).unwrap_err().to_string();
            assert!(error.contains("PNG picture"), "{error}");
        }
        let twice = unpack(&gzip(&gzip(b"t_s,gyr_x_rad_s")), LIMITS).unwrap_err().to_string();
        assert!(twice.contains("gzip file inside"), "{twice}");
    }

    /// 64 GiB of zeros, by way of a source that repeats one gzip member, stops at the grace.
    #[test]
    fn a_bomb_stops_soon_after_the_grace() {
        struct Repeat {
            member: Vec<u8>,
            at: usize,
        }
        impl Read for Repeat {
            fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
                let n = buffer.len().min(self.member.len() - self.at);
                buffer[..n].copy_from_slice(&self.member[self.at..self.at + n]);
                self.at = (self.at + n) % self.member.len();
                Ok(n)
            }
        }
        let member = gzip(&vec![0; 1 << 20]);
        let mut bomb = Unpack::new(Repeat { member, at: 0 }, LIMITS).unwrap();
        let mut buffer = vec![0; 64 << 10];
        let error = loop {
            if let Err(error) = bomb.read(&mut buffer) {
                break error;
            }
        };
        assert!(matches!(error, UnpackError::RatioTooHigh { .. }), "{error}");
        assert!(bomb.unpacked_bytes <= RATIO_GRACE_BYTES + buffer.len() as u64);
    }

    #[test]
    fn the_plain_limit_holds_too_and_is_named() {
        let limits = UnpackLimits { max_unpacked_bytes: 1000, max_ratio: 200 };
        let error = unpack(&text(), limits).unwrap_err().to_string();
        assert!(error.contains("more than 1000 bytes"), "{error}");
        assert_eq!(unpack(&text()[..1000], limits).unwrap().len(), 1000);
    }
}

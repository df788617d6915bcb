//! A device's file, row by row: unpacked and parsed in pieces, and put in order of the tags as far as a window of rows reaches.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::Result;
use lodestep_engine::parse::ParseError;

use crate::cli::failure::Failure;
use crate::cli::log_file::{self, NO_LIMITS};
use crate::sessions::unpack::Unpack;

const PIECE_BYTES: usize = 64 << 10;

/// What makes rows of bytes.
pub(super) trait RowParser {
    type Row;

    /// Rows that these bytes complete.
    fn push(&mut self, bytes: &[u8], rows: &mut Vec<Self::Row>) -> Result<(), ParseError>;

    /// Rows that the end completes.
    fn finish(&mut self, rows: &mut Vec<Self::Row>) -> Result<(), ParseError>;

    fn t_ns(row: &Self::Row) -> i64;
}

/// A file on its way.
pub(super) struct RowFile<P: RowParser> {
    path: PathBuf,
    unpack: Unpack<File>,
    parser: P,
    buffer: Vec<u8>,
    waiting: BinaryHeap<Reverse<Waiting<P::Row>>>,
    /// So many rows wait for one with an earlier tag.
    window: usize,
    read: u64,
    ended: bool,
}

struct Waiting<R> {
    t_ns: i64,
    number: u64,
    row: R,
}

impl<R> PartialEq for Waiting<R> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<R> Eq for Waiting<R> {}

impl<R> PartialOrd for Waiting<R> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<R> Ord for Waiting<R> {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.t_ns, self.number).cmp(&(other.t_ns, other.number))
    }
}

impl<P: RowParser> RowFile<P> {
    /// Opens a file whose rows may be out of order by up to `window` rows.
    pub(super) fn open(path: &Path, parser: P, window: usize) -> Result<RowFile<P>> {
        let unpack =
            Unpack::new(log_file::open(path)?, NO_LIMITS).map_err(|error| Failure::bad_input(path, error))?;
        Ok(RowFile {
            path: path.to_owned(),
            unpack,
            parser,
            buffer: vec![0; PIECE_BYTES],
            waiting: BinaryHeap::new(),
            window,
            read: 0,
            ended: false,
        })
    }

    /// The tag of the next row, ns; `None` at the end.
    pub(super) fn next_ns(&mut self) -> Result<Option<i64>> {
        self.fill()?;
        Ok(self.waiting.peek().map(|Reverse(waiting)| waiting.t_ns))
    }

    /// The next row.
    pub(super) fn next(&mut self) -> Result<Option<P::Row>> {
        self.fill()?;
        Ok(self.waiting.pop().map(|Reverse(waiting)| waiting.row))
    }

    /// What makes its rows.
    pub(super) fn parser(&self) -> &P {
        &self.parser
    }

    fn fill(&mut self) -> Result<()> {
        while !self.ended && self.waiting.len() <= self.window {
            let RowFile { path, unpack, parser, buffer, .. } = self;
            let read = unpack.read(buffer).map_err(|error| Failure::bad_input(path, error))?;
            let mut rows = Vec::new();
            let parsed = match read {
                0 => parser.finish(&mut rows),
                read => parser.push(&buffer[..read], &mut rows),
            };
            parsed.map_err(|error| Failure::bad_input(path, error))?;
            self.ended = read == 0;
            for row in rows {
                self.take(row);
            }
        }
        Ok(())
    }

    fn take(&mut self, row: P::Row) {
        let t_ns = P::t_ns(&row);
        self.waiting.push(Reverse(Waiting { t_ns, number: self.read, row }));
        self.read += 1;
    }
}

//! Packed chunks set aside in a file until the whole log is known to be right, so that a log of any
//! length is read in the memory of one chunk and stored in one transaction.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use crate::private;
use crate::store::raw_chunks::Packed;

/// Chunks in a file of their own, which is removed when this is dropped.
#[derive(Debug)]
pub(crate) struct Spill {
    file: BufWriter<File>,
    /// Each chunk without its body, and the body's length.
    chunks: Vec<(Packed, usize)>,
    _removed: RemovedOnDrop,
}

#[derive(Debug)]
struct RemovedOnDrop(PathBuf);

impl Drop for RemovedOnDrop {
    fn drop(&mut self) {
        // What cannot be removed now is removed at the next start.
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Spill {
    /// An empty file at `path`; one that a killed server left there is overwritten.
    pub(crate) fn create(path: &Path) -> io::Result<Spill> {
        let file = BufWriter::new(private::file().write(true).create(true).truncate(true).open(path)?);
        Ok(Spill { file, chunks: Vec::new(), _removed: RemovedOnDrop(path.to_owned()) })
    }

    /// How many chunks it holds.
    pub(crate) fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// Sets a chunk aside.
    pub(crate) fn push(&mut self, mut chunk: Packed) -> io::Result<()> {
        let body = chunk.take_body();
        self.file.write_all(&body)?;
        self.chunks.push((chunk, body.len()));
        Ok(())
    }

    /// The chunks, in order, read back one by one.
    pub(crate) fn into_chunks(mut self) -> io::Result<impl Iterator<Item = io::Result<Packed>>> {
        self.file.flush()?;
        let mut file = File::open(&self._removed.0)?;
        let removed = self._removed;
        Ok(self.chunks.into_iter().map(move |(mut chunk, length)| {
            // Held as long as somebody reads.
            let _removed = &removed;
            let mut body = vec![0; length];
            file.read_exact(&mut body)?;
            chunk.put_body(body);
            Ok(chunk)
        }))
    }
}

//! A result that is there whole or not at all.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// A file that is written beside its place and moved there when it is complete, so that a reader
/// never sees half of it and a failure leaves what was there before.
pub(super) struct OutputFile {
    place: PathBuf,
    partial: Partial,
    out: BufWriter<File>,
}

/// The unfinished file, which goes when it was not moved to its place.
struct Partial(PathBuf);

impl Drop for Partial {
    fn drop(&mut self) {
        // After the move there is nothing left to remove.
        let _ = fs::remove_file(&self.0);
    }
}

impl OutputFile {
    /// Begins a file.
    pub(super) fn create(place: &Path) -> Result<OutputFile> {
        let name =
            place.file_name().with_context(|| format!("{} is not the name of a file", place.display()))?;
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}.part", std::process::id()));
        let path = place.with_file_name(hidden);
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .open(&path)
            .with_context(|| cannot(place))?;
        let out = BufWriter::with_capacity(1 << 16, file);
        Ok(OutputFile { place: place.to_owned(), partial: Partial(path), out })
    }

    /// Puts the complete file into its place.
    pub(super) fn finish(self) -> Result<()> {
        let OutputFile { place, partial, out } = self;
        let file =
            out.into_inner().map_err(io::IntoInnerError::into_error).with_context(|| cannot(&place))?;
        file.sync_all().with_context(|| cannot(&place))?;
        fs::rename(&partial.0, &place).with_context(|| cannot(&place))
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Writes a whole file at once.
pub(super) fn write(place: &Path, content: impl FnOnce(&mut OutputFile) -> io::Result<()>) -> Result<()> {
    let mut file = OutputFile::create(place)?;
    content(&mut file).with_context(|| cannot(place))?;
    file.finish()
}

pub(super) fn cannot(place: &Path) -> String {
    format!("{} cannot be written", place.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.csv");
        write(&path, |out| out.write_all(b"first")).unwrap();
        let failed = write(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("the disk is full"))
        });
        assert!(
            format!("{:#}", failed.unwrap_err()).ends_with("track.csv cannot be written: the disk is full")
        );
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

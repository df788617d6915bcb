//! A result that is there whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tempfile::TempPath;

/// A file that is written beside its place and moved there when it is complete, so that a reader
/// never sees half of it and a failure leaves what was there before.
pub(super) struct OutputFile {
    place: PathBuf,
    /// The unfinished file, which goes when it was not moved to its place. Its name is by chance: nobody can have put a link
    /// there that is written through.
    partial: TempPath,
    out: BufWriter<File>,
}

impl OutputFile {
    /// Begins a file.
    pub(super) fn create(place: &Path) -> Result<OutputFile> {
        let name =
            place.file_name().with_context(|| format!("{} is not the name of a file", place.display()))?;
        let folder = place.parent().filter(|folder| !folder.as_os_str().is_empty());
        let hidden = format!(".{}.", name.to_string_lossy());
        let mut unfinished = tempfile::Builder::new();
        unfinished.prefix(&hidden).suffix(".part");
        // A result is for whom its owner's umask lets read it.
        #[cfg(unix)]
        unfinished.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = unfinished.tempfile_in(folder.unwrap_or(Path::new("."))).with_context(|| cannot(place))?;
        let (file, partial) = file.into_parts();
        let out = BufWriter::with_capacity(1 << 16, file);
        Ok(OutputFile { place: place.to_owned(), partial, out })
    }

    /// Puts the complete file into its place.
    pub(super) fn finish(self) -> Result<()> {
        let OutputFile { place, partial, out } = self;
        let file =
            out.into_inner().map_err(io::IntoInnerError::into_error).with_context(|| cannot(&place))?;
        file.sync_all().with_context(|| cannot(&place))?;
        partial.persist(&place).map_err(|failed| failed.error).with_context(|| cannot(&place))
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
    use std::fs;

    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_result_has_the_mode_that_any_new_file_has() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let (ours, other) = (folder.path().join("track.csv"), folder.path().join("other.csv"));
        write(&ours, |out| out.write_all(b"first")).unwrap();
        fs::write(&other, b"first").unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&other));
    }

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

//! The bytes of a log on their way: one file in the folder of uploads, named by the log's own id.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tokio::fs::{self, File, OpenOptions};
use tokio::io::{AsyncSeekExt, AsyncWriteExt, SeekFrom};
use uuid::Uuid;

use crate::private;

const SUFFIX: &str = ".upload";
const SPILL_SUFFIX: &str = ".samples";

/// Where the bytes of a log lie until it is accepted.
pub(crate) fn path(folder: &Path, log_id: Uuid) -> PathBuf {
    folder.join(format!("{log_id}{SUFFIX}"))
}

/// Where a log's samples are set aside while it is read.
pub(crate) fn spill_path(folder: &Path, log_id: Uuid) -> PathBuf {
    folder.join(format!("{log_id}{SPILL_SUFFIX}"))
}

/// An upload that is being appended to.
pub(crate) struct UploadFile {
    file: File,
    end_bytes: u64,
    /// A write or sync failed. Which bytes are there is unknown, and a second sync would say that all is well.
    failed: bool,
}

impl UploadFile {
    /// Opens the file at an offset up to which it is known to be on disk. What a killed server had
    /// written behind that offset, and never promised, is cut off.
    pub(crate) async fn open_at(folder: &Path, log_id: Uuid, offset_bytes: u64) -> io::Result<UploadFile> {
        let path = path(folder, log_id);
        let mut options = private::file();
        options.write(true).create(true).truncate(false);
        let mut file = OpenOptions::from(options).open(&path).await?;
        let length_bytes = file.metadata().await?.len();
        if length_bytes < offset_bytes {
            let lost = format!("{offset_bytes} bytes were acknowledged and {length_bytes} are in the file");
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, lost));
        }
        file.set_len(offset_bytes).await?;
        if length_bytes == 0 {
            // The name of a new file is on disk only when its folder is.
            File::open(folder).await?.sync_all().await?;
        }
        file.seek(SeekFrom::Start(offset_bytes)).await?;
        Ok(UploadFile { file, end_bytes: offset_bytes, failed: false })
    }

    /// Appends bytes; they are not on disk yet, and may not even be in the file.
    pub(crate) async fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = self.file.write_all(bytes).await;
        self.failed |= written.is_err();
        written?;
        self.end_bytes += bytes.len() as u64;
        Ok(())
    }

    /// Whether a write or sync failed: then nothing more can be promised, and what was not promised is cut off
    /// by the next one that opens it.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed
    }

    /// Where the next byte goes.
    pub(crate) fn end_bytes(&self) -> u64 {
        self.end_bytes
    }

    /// Brings everything so far to disk, and tells up to where that is.
    pub(crate) async fn sync(&mut self) -> io::Result<u64> {
        if self.failed {
            return Err(io::Error::other("an earlier write to this file failed"));
        }
        let synced = match self.file.flush().await {
            Ok(()) => self.file.sync_data().await,
            failed => failed,
        };
        self.failed |= synced.is_err();
        synced.map(|()| self.end_bytes)
    }

    /// Lets go of the bytes that were never promised, for they may take the room that others need.
    pub(crate) async fn cut_back(self, promised_bytes: u64) {
        // The next one that opens it does it, too.
        let _ = self.file.set_len(promised_bytes).await;
    }
}

/// Removes the bytes of a log, if there are any.
pub(crate) async fn remove(folder: &Path, log_id: Uuid) -> io::Result<()> {
    match fs::remove_file(path(folder, log_id)).await {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// The log that a file in the folder belongs to, when it is an upload, and how long ago it was last
/// written to.
async fn upload_of(entry: &fs::DirEntry) -> io::Result<Option<(Uuid, Duration)>> {
    let name = entry.file_name();
    let Some(log_id) = name.to_str().and_then(|name| name.strip_suffix(SUFFIX)?.parse().ok()) else {
        return Ok(None);
    };
    let written_at = entry.metadata().await?.modified()?;
    Ok(Some((log_id, SystemTime::now().duration_since(written_at).unwrap_or_default())))
}

/// All uploads in the folder, each with the time since it was last written to.
pub(crate) async fn all(folder: &Path) -> io::Result<Vec<(Uuid, Duration)>> {
    let mut entries = fs::read_dir(folder).await?;
    let mut uploads = Vec::new();
    while let Some(entry) = entries.next_entry().await? {
        uploads.extend(upload_of(&entry).await?);
    }
    Ok(uploads)
}

/// Removes samples that a killed server had set aside.
pub(crate) async fn remove_spills(folder: &Path) -> io::Result<()> {
    let mut entries = fs::read_dir(folder).await?;
    while let Some(entry) = entries.next_entry().await? {
        if entry.file_name().to_str().is_some_and(|name| name.ends_with(SPILL_SUFFIX)) {
            fs::remove_file(entry.path()).await?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_was_not_promised_is_written_again() {
        let folder = tempfile::tempdir().unwrap();
        let id = Uuid::now_v7();
        let mut file = UploadFile::open_at(folder.path(), id, 0).await.unwrap();
        file.append(b"promised").await.unwrap();
        assert_eq!(file.sync().await.unwrap(), 8);
        file.append(b" lost").await.unwrap();
        file.sync().await.unwrap();

        let mut file = UploadFile::open_at(folder.path(), id, 8).await.unwrap();
        file.append(b"!").await.unwrap();
        assert_eq!(file.sync().await.unwrap(), 9);
        assert_eq!(fs::read(path(folder.path(), id)).await.unwrap(), b"promised!");
    }

    #[tokio::test]
    async fn bytes_that_were_promised_and_are_gone_are_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let error = UploadFile::open_at(folder.path(), Uuid::now_v7(), 5).await.err().unwrap();
        assert_eq!(error.to_string(), "5 bytes were acknowledged and 0 are in the file");
    }

    #[tokio::test]
    async fn only_uploads_are_listed_and_removing_twice_is_fine() {
        let folder = tempfile::tempdir().unwrap();
        let id = Uuid::now_v7();
        UploadFile::open_at(folder.path(), id, 0).await.unwrap();
        fs::write(folder.path().join("notes.txt"), "keep").await.unwrap();
        let listed: Vec<_> = all(folder.path()).await.unwrap().into_iter().map(|(id, _)| id).collect();
        assert_eq!(listed, [id]);
        remove(folder.path(), id).await.unwrap();
        remove(folder.path(), id).await.unwrap();
        assert!(all(folder.path()).await.unwrap().is_empty());
    }
}

//! The bytes of uploads on their way where another server may take the database over: each piece is in it before it is promised, and
//! the file in the data folder is a copy.

use futures_util::TryStreamExt;
use tokio::fs::File;
use tokio::io::{AsyncReadExt, AsyncSeekExt, SeekFrom};
use uuid::Uuid;

use super::upload_file::{self, UploadFile};
use crate::error::{Error, Result};
use crate::sessions::uploads::disk_error;
use crate::state::App;
use crate::store::logs::Log;
use crate::store::{IS_SHARED, upload_pieces};

/// What has come of an upload between these two offsets; `None` where the file is all there is.
pub(super) async fn piece(
    app: &App,
    log_id: Uuid,
    (from_bytes, to_bytes): (u64, u64),
) -> Result<Option<Vec<u8>>> {
    if !IS_SHARED || from_bytes == to_bytes {
        return Ok(None);
    }
    let path = upload_file::path(&app.config.uploads(), log_id);
    let read = async {
        let mut file = File::open(path).await?;
        file.seek(SeekFrom::Start(from_bytes)).await?;
        let mut piece = Vec::new();
        file.take(to_bytes - from_bytes).read_to_end(&mut piece).await?;
        Ok(piece)
    };
    read.await.map(Some).map_err(disk_error)
}

/// Writes the file of an upload anew that another server has taken so far.
pub(super) async fn bring(app: &App, log: &Log) -> Result<()> {
    let folder = app.config.uploads();
    let path = upload_file::path(&folder, log.id);
    let there = tokio::fs::metadata(&path).await.map_or(0, |file| file.len());
    if !IS_SHARED || there >= log.offset_bytes {
        return Ok(());
    }
    let mut file = UploadFile::open_at(&folder, log.id, 0).await.map_err(disk_error)?;
    let mut pieces = Box::pin(upload_pieces::of_log(app.store.read(), log.id));
    while let Some(piece) = pieces.try_next().await? {
        file.append(&piece).await.map_err(disk_error)?;
    }
    let end_bytes = file.sync().await.map_err(disk_error)?;
    if end_bytes < log.offset_bytes {
        return Err(Error::Internal(anyhow::anyhow!(
            "upload {}: {} bytes were acknowledged and {end_bytes} are in the database",
            log.id,
            log.offset_bytes
        )));
    }
    Ok(())
}

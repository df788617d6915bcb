//! What a server keeps is for its own user alone: password hashes, secrets of webhooks, where people were.
//!
//! Files are made with mode 600 and folders with 700, whatever the umask; a name that turns out to be a link is not followed,
//! for the one who put it there chose where it leads. Where there are no such modes, the system's own rules stand.

use std::fs::{self, DirBuilder, OpenOptions};
use std::io;
use std::path::Path;

/// How files are opened that this program makes.
pub(crate) fn file() -> OpenOptions {
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.mode(0o600).custom_flags(rustix::fs::OFlags::NOFOLLOW.bits().cast_signed());
    }
    options
}

/// Makes a folder, and those that hold it, where they are missing.
pub(crate) fn folder(path: &Path) -> io::Result<()> {
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}

/// Takes from others what an earlier version, or a copy, let them read of a data folder. A folder that holds
/// other things, too, stays open to those who need them.
pub(crate) fn close(data: &Path) -> io::Result<()> {
    let mut is_ours_alone = true;
    for entry in fs::read_dir(data)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with("lodestep") || ["uploads", "backups"].contains(&name) {
            close_one(&path)?;
        } else {
            is_ours_alone = false;
        }
    }
    if is_ours_alone { close_one(data) } else { Ok(()) }
}

#[cfg(unix)]
fn close_one(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    let found = fs::symlink_metadata(path)?;
    let mode = found.permissions().mode();
    if found.is_symlink() || mode & 0o077 == 0 {
        return Ok(());
    }
    fs::set_permissions(path, fs::Permissions::from_mode(mode & 0o7700))
}

#[cfg(not(unix))]
fn close_one(_: &Path) -> io::Result<()> {
    Ok(())
}

//! Names the sources of this build, so that a saved state of another build's engine is not taken for its own.

#![expect(
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "runs while building: cargo is told by printing, and the sources are files"
)]

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=src");
    let mut sources = BTreeMap::new();
    read(Path::new("src"), &mut sources)?;
    let mut hasher = DefaultHasher::new();
    sources.hash(&mut hasher);
    env::var("TARGET").unwrap_or_default().hash(&mut hasher);
    println!("cargo:rustc-env=LODESTEP_ENGINE_SOURCES={:016x}", hasher.finish());
    Ok(())
}

fn read(folder: &Path, sources: &mut BTreeMap<String, Vec<u8>>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            read(&path, sources)?;
        } else {
            sources.insert(path.to_string_lossy().into_owned(), fs::read(&path)?);
        }
    }
    Ok(())
}

//! Says at build time when the browser libraries are missing (the server says it again at its start), and takes the hash
//! of the engine's source, which every result carries.

use std::path::{Path, PathBuf};
use std::{fs, io};

use sha2::{Digest, Sha256};

fn main() -> io::Result<()> {
    let engine = Path::new(env!("CARGO_MANIFEST_DIR")).join("../engine/src");
    println!("cargo::rerun-if-changed={}", engine.display());
    println!("cargo::rustc-env=LODESTEP_ENGINE_SHA256={}", sha256_of_source(&engine)?);
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../static");
    // A new page, too, is embedded by a release build.
    println!("cargo::rerun-if-changed={}", pages.display());
    if !pages.join("vendor").is_dir() {
        println!(
            "cargo::warning=the browser libraries are missing, so the map would stay empty: run `make vendor` (npm ci, then a copy into static/vendor/)"
        );
    }
    Ok(())
}

/// Over the names and texts of all files of a folder, in the order of their names: the same on every machine.
fn sha256_of_source(folder: &Path) -> io::Result<String> {
    let mut files = Vec::new();
    gather(folder, &mut files)?;
    let mut named: Vec<(String, PathBuf)> = files
        .into_iter()
        .map(|file| {
            let name = file.strip_prefix(folder).unwrap_or(&file).to_string_lossy().replace('\\', "/");
            (name, file)
        })
        .collect();
    named.sort();
    let mut hash = Sha256::new();
    for (name, file) in named {
        let text = fs::read(file)?;
        for part in [name.as_bytes(), &text] {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn gather(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            gather(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

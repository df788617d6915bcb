//! Says at build time when the browser libraries are missing; the server says it again at its start.

use std::path::Path;

fn main() {
    let pages = Path::new(env!("CARGO_MANIFEST_DIR")).join("../static");
    // A new page, too, is embedded by a release build.
    println!("cargo::rerun-if-changed={}", pages.display());
    if !pages.join("vendor").is_dir() {
        println!(
            "cargo::warning=the browser libraries are missing, so the map would stay empty: run `make vendor` (npm ci, then a copy into static/vendor/)"
        );
    }
}

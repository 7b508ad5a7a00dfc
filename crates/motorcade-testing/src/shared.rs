//! The folder of development data.

use std::path::{Path, PathBuf};

/// Path of a part of the development data, in the folder `MOTORCADE_SHARED` (default `../shared` beside the repository). `None`, with
/// a note on stdout that `.ci/run` looks for, when it is not there.
#[allow(clippy::print_stdout, reason = "a skipped test says so")]
pub fn shared(part: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let path = std::env::var_os("MOTORCADE_SHARED").map_or_else(beside, PathBuf::from).join(part);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there (set MOTORCADE_SHARED)", path.display());
    None
}

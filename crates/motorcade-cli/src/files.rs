//! Single files a command writes: whole or not at all.

use std::io::{self, Write};
use std::path::Path;

use tempfile::NamedTempFile;

/// An empty file beside `path`, to be filled and then [`put`] in its place. Asked for before long work, so that a place that
/// cannot be written is reported at once.
pub fn beside(path: &Path) -> Result<NamedTempFile, motorcade::Error> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(error(path, &io::Error::from(io::ErrorKind::IsADirectory)));
    }
    tempfile::Builder::new().prefix(".motorcade-").tempfile_in(folder).map_err(|e| error(path, &e))
}

/// Puts a filled file in its place.
pub fn put(file: NamedTempFile, path: &Path) -> Result<(), motorcade::Error> {
    // tempfile makes private files; results are for everybody.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let open = std::fs::Permissions::from_mode(0o644);
        std::fs::set_permissions(file.path(), open).map_err(|e| error(path, &e))?;
    }
    file.persist(path).map(drop).map_err(|e| error(path, &e.error))
}

/// Writes text to a file and puts it in its place.
pub fn write(mut file: NamedTempFile, path: &Path, text: &str) -> Result<(), motorcade::Error> {
    file.write_all(text.as_bytes()).map_err(|e| error(path, &e))?;
    put(file, path)
}

fn error(path: &Path, error: &io::Error) -> motorcade::Error {
    // tempfile adds the name of its own file.
    let inner = error.get_ref().and_then(|e| e.source()).and_then(|e| e.downcast_ref::<io::Error>());
    let error = inner.unwrap_or(error);
    let full = matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded);
    motorcade::Error::Output { path: path.to_path_buf(), reason: error.to_string(), full }
}

//! The writer of all single output files: whole or not at all, through symbolic links, and never over anything but a regular file.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::regular_file::special_name;
use crate::staging;

/// A file to be written. Making one checks its place, so that long work does not end in a file that cannot be written.
#[derive(Debug)]
pub struct PendingFile {
    place: Destination,
}

#[derive(Debug)]
enum Destination {
    /// A regular file or nothing yet: the content is written beside it and renamed.
    Beside { staged: Box<NamedTempFile>, target: PathBuf, _lock: Option<fs::File> },
    /// A FIFO or a character device.
    Stream(PathBuf),
    /// `/dev/stdout`, by any name.
    Stdout,
}

impl PendingFile {
    /// Checks the place of a file and makes a temporary file beside it.
    ///
    /// # Errors
    /// A directory, a socket, a block device, a folder that cannot be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let place = match fs::metadata(path) {
            Ok(found) if is_stdout(&found) => Destination::Stdout,
            Ok(found) if found.is_file() => beside(fs::canonicalize(path)?)?,
            Ok(found) if found.is_dir() => return Err(io::Error::from(io::ErrorKind::IsADirectory)),
            Ok(found) if is_stream(&found) => Destination::Stream(path.to_path_buf()),
            Ok(found) => return Err(refused(&found)),
            Err(e) if e.kind() == io::ErrorKind::NotFound => beside(end_of_links(path))?,
            Err(e) => return Err(e),
        };
        Ok(Self { place })
    }

    /// The temporary file, for another program to write to; then [`finish`](Self::finish) puts it in its place. `None` for streams.
    pub fn staged_path(&self) -> Option<&Path> {
        match &self.place {
            Destination::Beside { staged, .. } => Some(staged.path()),
            Destination::Stream(_) | Destination::Stdout => None,
        }
    }

    /// Puts the temporary file in its place, as another program wrote it.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn finish(self) -> io::Result<()> {
        self.write([])
    }

    /// Writes the content and puts the file in its place.
    ///
    /// # Errors
    /// Those of the file system; an existing file then stays as it was. When the last move fails, the error names the file that
    /// holds the content.
    pub fn write(self, contents: impl AsRef<[u8]>) -> io::Result<()> {
        match self.place {
            Destination::Beside { mut staged, target, _lock } => {
                staged.write_all(contents.as_ref())?;
                put(*staged, &target)
            }
            Destination::Stream(path) => open_stream(&path)?.write_all(contents.as_ref()),
            Destination::Stdout => {
                let mut out = io::stdout().lock();
                out.write_all(contents.as_ref()).and_then(|()| out.flush())
            }
        }
    }
}

/// Writes a file: beside its place and renamed, so that a reader never sees a part of it. An existing file is replaced, at
/// the end of symbolic links; FIFOs and character devices are written to.
///
/// # Errors
/// As [`PendingFile::create`] and [`PendingFile::write`].
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> io::Result<()> {
    PendingFile::create(path)?.write(contents)
}

fn beside(target: PathBuf) -> io::Result<Destination> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if target.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"));
    }
    staging::remove_stale(folder, Path::is_dir);
    let make = |builder: &mut tempfile::Builder<'_, '_>, folder: &Path| {
        // Results are for everybody the umask allows; tempfile's own default is the owner alone.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder)
    };
    let (staged, _lock) = staging::create(folder, make, NamedTempFile::path)?;
    Ok(Destination::Beside { staged: Box::new(staged), target, _lock })
}

fn put(staged: NamedTempFile, target: &Path) -> io::Result<()> {
    // Somebody may have put something else there since.
    if let Ok(found) = fs::symlink_metadata(target) {
        if !found.is_file() {
            return Err(kept(staged, target, &refused(&found)));
        }
        fs::set_permissions(staged.path(), found.permissions())?;
    }
    staged.persist(target).map(drop).map_err(|e| kept(e.file, target, &e.error))
}

/// Keeps a complete file whose last move failed, under a name that nobody removes as stale, and says where it is.
fn kept(staged: NamedTempFile, target: &Path, error: &io::Error) -> io::Error {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    let free = target.with_file_name(format!("{name}-not-moved-{}", std::process::id()));
    let kept = match staged.persist_noclobber(&free) {
        Ok(_) => Ok(free),
        Err(e) => e.file.keep().map(|(_, path)| path),
    };
    match kept {
        Ok(path) => io::Error::new(error.kind(), format!("{error}; the content lies in {}", path.display())),
        Err(_) => io::Error::new(error.kind(), error.to_string()),
    }
}

fn refused(found: &fs::Metadata) -> io::Error {
    let problem = format!("is a {}; give a regular file", special_name(found.file_type()));
    io::Error::new(io::ErrorKind::InvalidInput, problem)
}

/// The path a chain of symbolic links ends at, when nothing is there.
fn end_of_links(path: &Path) -> PathBuf {
    let mut path = path.to_path_buf();
    // A circle of links does not get here: asking for its metadata fails otherwise.
    while let Ok(next) = fs::read_link(&path) {
        path = path.parent().map_or(next.clone(), |folder| folder.join(&next));
    }
    path
}

#[cfg(unix)]
fn is_stream(found: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_fifo() || found.file_type().is_char_device()
}

#[cfg(not(unix))]
fn is_stream(_: &fs::Metadata) -> bool {
    false
}

/// True for the file stdout goes to: renaming over it would lose all that is printed.
#[cfg(unix)]
fn is_stdout(found: &fs::Metadata) -> bool {
    use std::os::fd::AsFd;
    use std::os::unix::fs::MetadataExt;
    let stdout = io::stdout().as_fd().try_clone_to_owned().map(fs::File::from).and_then(|f| f.metadata());
    stdout.is_ok_and(|s| (s.dev(), s.ino()) == (found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn is_stdout(_: &fs::Metadata) -> bool {
    false
}

/// Opens a FIFO or character device for writing; a FIFO that nobody reads is an error, because opening it would wait.
fn open_stream(path: &Path) -> io::Result<fs::File> {
    let mut options = fs::OpenOptions::new();
    options.write(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let probe = options.clone().custom_flags(libc::O_NONBLOCK).open(path);
        if probe.as_ref().is_err_and(|e| e.raw_os_error() == Some(libc::ENXIO)) {
            return Err(io::Error::new(io::ErrorKind::BrokenPipe, "no process reads from this FIFO"));
        }
        // While the probe is open this call does not wait, and the reader does not meet an end: it would leave, and the
        // next open would wait for ever.
        let file = options.open(path);
        drop(probe);
        file
    }
    #[cfg(not(unix))]
    options.open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        let inside_a_file = path.join("b.txt");
        assert!(write(&inside_a_file, "three").is_err());
        assert!(write(Path::new("/"), "three").is_err());
        assert!(write(folder.path(), "three").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_stay() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("elsewhere")).unwrap();
        fs::write(at("elsewhere/a.txt"), "one").unwrap();
        std::os::unix::fs::symlink("elsewhere/a.txt", at("link")).unwrap();
        std::os::unix::fs::symlink("elsewhere/new.txt", at("dangling")).unwrap();
        write(&at("link"), "two").unwrap();
        write(&at("dangling"), "three").unwrap();
        assert!(at("link").is_symlink() && at("dangling").is_symlink());
        assert_eq!(fs::read_to_string(at("elsewhere/a.txt")).unwrap(), "two");
        assert_eq!(fs::read_to_string(at("elsewhere/new.txt")).unwrap(), "three");
    }

    #[cfg(unix)]
    #[test]
    fn streams_are_written_to_and_stay() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let fifo = folder.path().join("fifo");
        assert!(std::process::Command::new("mkfifo").arg(&fifo).status().unwrap().success());
        assert!(write(&fifo, "lost").unwrap_err().to_string().contains("no process reads"));
        let from = fifo.clone();
        let reader = std::thread::spawn(move || fs::read_to_string(from).unwrap());
        while write(&fifo, "written").is_err() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert_eq!(reader.join().unwrap(), "written");
        assert!(fs::symlink_metadata(&fifo).unwrap().file_type().is_fifo());
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert!(write(&socket, "no").unwrap_err().to_string().contains("socket"));
        write(Path::new("/dev/null"), "nothing").unwrap();
        assert!(fs::symlink_metadata("/dev/null").unwrap().file_type().is_char_device());
    }

    #[cfg(unix)]
    #[test]
    fn stale_files_go_and_files_being_written_stay() {
        let folder = tempfile::tempdir().unwrap();
        let stale = folder.path().join(format!("{}abc123", staging::PREFIX));
        let other = folder.path().join(format!("{}of-a-user", staging::PREFIX));
        fs::write(&stale, "half").unwrap();
        fs::write(&other, "mine").unwrap();
        let one = PendingFile::create(&folder.path().join("one")).unwrap();
        let two = PendingFile::create(&folder.path().join("two")).unwrap();
        two.write("2").unwrap();
        one.write("1").unwrap();
        assert!(!stale.exists() && other.exists());
        assert_eq!(fs::read_to_string(folder.path().join("one")).unwrap(), "1");
    }

    /// The file that an error says the content lies in.
    #[cfg(unix)]
    fn kept_file(error: &io::Error) -> PathBuf {
        let text = error.to_string();
        let (_, path) = text.split_once("; the content lies in ").unwrap();
        PathBuf::from(path)
    }

    #[cfg(unix)]
    #[test]
    fn nothing_but_a_file_that_came_in_the_meantime_is_replaced() {
        type Put = fn(&Path);
        let put: [(&str, Put); 4] = [
            ("FIFO", |at| {
                assert!(std::process::Command::new("mkfifo").arg(at).status().unwrap().success());
            }),
            ("socket", |at| drop(std::os::unix::net::UnixListener::bind(at).unwrap())),
            ("directory", |at| fs::create_dir(at).unwrap()),
            ("link", |at| std::os::unix::fs::symlink("elsewhere", at).unwrap()),
        ];
        for (kind, put) in put {
            for replaced in [false, true] {
                let folder = tempfile::tempdir().unwrap();
                let target = folder.path().join("a.txt");
                if replaced {
                    fs::write(&target, "old").unwrap();
                }
                let pending = PendingFile::create(&target).unwrap();
                if replaced {
                    fs::remove_file(&target).unwrap();
                }
                put(&target);
                let there = fs::symlink_metadata(&target).unwrap().file_type();
                let error = pending.write("content").unwrap_err();
                assert_eq!(fs::symlink_metadata(&target).unwrap().file_type(), there, "{kind} stays");
                assert!(error.to_string().contains(kind), "{kind}: {error}");
                let kept = kept_file(&error);
                assert_eq!(fs::read_to_string(&kept).unwrap(), "content", "{kind}");
                // The next writer in this folder removes what is stale, and not this.
                write(&folder.path().join("b.txt"), "b").unwrap();
                assert!(kept.exists(), "{kind}: {}", kept.display());
                assert!(!folder.path().join("elsewhere").exists());
            }
        }
    }

    #[cfg(unix)]
    #[test]
    fn two_files_that_could_not_be_moved_are_both_kept() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        let pending = [PendingFile::create(&target).unwrap(), PendingFile::create(&target).unwrap()];
        fs::create_dir(&target).unwrap();
        let kept = pending.map(|file| kept_file(&file.write("content").unwrap_err()));
        assert!(kept[0] != kept[1] && kept.iter().all(|path| path.exists()), "{kept:?}");
    }
}

//! A run as an MCAP recording.

use std::fs::File;
use std::io::{BufWriter, Cursor, Seek, Write};
use std::path::Path;

use motorcade::output::io_error;
use motorcade::{Progress, RecordedRun};
use motorcade_dataset::Sequence;
use motorcade_dataset::atomic_file::PendingFile;
use motorcade_mcap::{Recording, Schemas};

use crate::progress::Reporter;

/// Writes all frames of a sequence that the run of `directory` has, and puts the file in its place. Returns their number.
///
/// # Errors
/// A file that cannot be written; nothing is left behind then. When it was cancelled nothing is put in place either.
pub fn write(
    (path, file): (&Path, PendingFile),
    schemas: Schemas,
    directory: &Path,
    run: &RecordedRun,
    sequence: &Sequence,
    reporter: &Reporter,
) -> anyhow::Result<usize> {
    let Some(staged) = file.staged_path() else {
        // A stream cannot be gone back in.
        let (bytes, frames) = fill(Cursor::new(Vec::new()), schemas, directory, run, sequence, reporter)?;
        file.write(bytes.into_inner()).map_err(|e| io_error(path, &e))?;
        return Ok(frames);
    };
    let writer = BufWriter::new(File::create(staged).map_err(|e| io_error(path, &e))?);
    let (mut writer, frames) = fill(writer, schemas, directory, run, sequence, reporter)?;
    writer.flush().map_err(|e| io_error(path, &e))?;
    if !reporter.cancelled() {
        file.finish().map_err(|e| io_error(path, &e))?;
    }
    Ok(frames)
}

fn fill<W: Write + Seek>(
    writer: W,
    schemas: Schemas,
    directory: &Path,
    run: &RecordedRun,
    sequence: &Sequence,
    reporter: &Reporter,
) -> anyhow::Result<(W, usize)> {
    let mut recording = Recording::new(writer, schemas, directory, run.clone(), sequence.camera()?)?;
    let stop = || reporter.cancelled();
    let mut frames = sequence.frames();
    let (mut seen, mut written) = (0, 0);
    while let Some(frame) = frames.next_unless(&stop) {
        let done = match &frame {
            Ok(frame) => recording.frame(frame.number, Some(frame.rgb().as_ref()))?,
            Err(bad) => {
                reporter.warn(&bad.to_string());
                recording.frame(bad.number, None)?
            }
        };
        seen += 1;
        written += usize::from(done);
        reporter.advance(seen);
    }
    Ok((recording.finish()?, written))
}

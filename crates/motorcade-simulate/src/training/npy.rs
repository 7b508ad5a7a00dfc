//! Arrays in NumPy's file format, version 1.0, written row by row.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// An array file, written along its first axis.
pub(super) struct NpyWriter {
    path: PathBuf,
    file: BufWriter<File>,
}

impl NpyWriter {
    /// Starts an array of `rows` × `shape`; `kind` is NumPy's name of the element type, such as `|u1` or `<f4`.
    pub(super) fn create(path: &Path, kind: &str, rows: usize, shape: &[usize]) -> Result<Self> {
        let sizes: Vec<String> = std::iter::once(&rows).chain(shape).map(ToString::to_string).collect();
        let header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({},), }}", sizes.join(", "));
        // Magic, version and header length take 10 bytes; data begin at a multiple of 64.
        let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.resize(10 + length - 1, b' ');
        bytes.push(b'\n');
        let file = File::create(path).map_err(Error::io(path))?;
        let mut writer = Self { path: path.to_path_buf(), file: BufWriter::new(file) };
        writer.bytes(&bytes)?;
        Ok(writer)
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).map_err(Error::io(&self.path))
    }

    pub(super) fn floats(&mut self, values: &[f32]) -> Result<()> {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.bytes(&bytes)
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.file.flush().map_err(Error::io(&self.path))
    }
}

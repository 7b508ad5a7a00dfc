//! Tables as Parquet files: columns with units and descriptions, compressed with zstd, the same bytes for the same values.
//!
//! [`Table`] is a list of named columns; [`write_parquet`] writes it, and [`read_rows`] reads any small flat Parquet file as text.
//! [`frames`] and [`tracks`] make tables of a run's directory, [`join`] makes one dataset of many runs.
//!
//! ```
//! use motorcade_tables::{Column, Table, Values, parquet_bytes};
//!
//! let speed = Column {
//!     name: "speed_mps".into(),
//!     unit: "m/s".into(),
//!     description: "Speed of the camera".into(),
//!     values: Values::F64(vec![Some(13.9), None]),
//! };
//! let table = Table { name: "speeds".into(), description: "One row a frame".into(), columns: vec![speed] };
//! let bytes = parquet_bytes(&table, &[])?;
//! assert_eq!(&bytes[..4], b"PAR1");
//! # Ok::<(), motorcade_tables::Error>(())
//! ```

mod dataset;
mod drive;
mod drives;
mod error;
mod extras;
mod metadata;
mod read;
mod run;
mod table;
mod write;

pub use dataset::{TABLES_RECORD, join};
pub use drive::{Drive, named};
pub use error::{Error, Result};
pub use extras::extras;
pub use read::read_rows;
pub use run::{RunFiles, RunTable, frames, tracks};
pub use table::{Column, Table, Values};
pub use write::{parquet_bytes, write_parquet};

use super::*;

use crate::{Column, Table, Values, parquet_bytes};

fn file(columns: Vec<Column>) -> tempfile::NamedTempFile {
    let table = Table { name: "list".into(), description: String::new(), columns };
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), parquet_bytes(&table, &[]).unwrap()).unwrap();
    file
}

fn column(name: &str, values: Values) -> Column {
    Column { name: name.into(), unit: String::new(), description: String::new(), values }
}

#[test]
fn rows_are_text_by_name() {
    let file = file(vec![
        column("input", Values::Text(vec![Some("a.mp4".into()), None])),
        column("height", Values::F64(vec![Some(1.65), Some(2.0)])),
        column("frames", Values::U64(vec![Some(u64::MAX), None])),
        column("online", Values::Bool(vec![Some(true), Some(false)])),
        column("time", Values::TimestampNs(vec![Some(1_700_000_000_123_456_789), None])),
    ]);
    let rows = read_rows(file.path()).unwrap();
    let row = |k: usize, name: &str| rows[k][name].as_str();
    assert_eq!((row(0, "input"), row(0, "height"), row(0, "online")), ("a.mp4", "1.65", "true"));
    assert_eq!((row(0, "frames"), row(0, "time")), ("18446744073709551615", "1700000000123456789"));
    assert_eq!((row(1, "input"), row(1, "height"), row(1, "frames")), ("", "2.0", ""));
}

#[test]
fn files_that_are_no_parquet_are_named() {
    let file = tempfile::NamedTempFile::with_suffix(".parquet").unwrap();
    for content in [&b""[..], b"input,height\na.mp4,1.65\n", b"PAR1aaaaaaaaPAR1"] {
        std::fs::write(file.path(), content).unwrap();
        let message = read_rows(file.path()).unwrap_err().to_string();
        assert!(message.contains(".parquet") && message.contains("expected a Parquet file"), "{message}");
    }
    let message = read_rows(Path::new("nowhere.parquet")).unwrap_err().to_string();
    assert!(message.contains("cannot read nowhere.parquet"), "{message}");
}

#[test]
fn cut_files_are_errors() {
    let whole = file(vec![column("input", Values::Text(vec![Some("a.mp4".into()); 40]))]);
    let bytes = std::fs::read(whole.path()).unwrap();
    for length in 0..bytes.len() {
        std::fs::write(whole.path(), &bytes[..length]).unwrap();
        assert!(read_rows(whole.path()).is_err(), "{length} bytes");
    }
}

/// The lowest bit is the sign of a number there: the decoder panics on lengths that are negative.
#[test]
fn damaged_files_are_read_or_are_errors() {
    let whole = file(vec![column("input", Values::Text(vec![Some("a.mp4".into()); 4]))]);
    let bytes = std::fs::read(whole.path()).unwrap();
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1;
        std::fs::write(whole.path(), damaged).unwrap();
        if let Err(error) = read_rows(whole.path()) {
            assert!(error.exit_code() == 3, "byte {at}: {error}");
        }
    }
}

use super::*;

use arrow_array::Array;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int64Type, TimestampNanosecondType, UInt64Type};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::reader::{FileReader, SerializedFileReader};

fn column(name: &str, values: Values) -> Column {
    Column { name: name.into(), unit: "m".into(), description: format!("The {name}"), values }
}

fn table() -> Table {
    let columns = vec![
        column("number", Values::F64(vec![Some(0.1), None, Some(-3.0)])),
        column("signed", Values::I64(vec![Some(i64::MIN), None, Some(3)])),
        column("whole", Values::U64(vec![Some(u64::MAX), Some(2), None])),
        column("text", Values::Text(vec![Some("Car".into()), None, Some(String::new())])),
        column("flag", Values::Bool(vec![Some(true), Some(false), None])),
        column("time", Values::TimestampNs(vec![Some(1_700_000_000_123_456_789), None, Some(0)])),
    ];
    Table { name: "some".into(), description: "One row a case".into(), columns }
}

fn read(bytes: Vec<u8>) -> (Arc<Schema>, Vec<RecordBatch>) {
    let builder = ParquetRecordBatchReaderBuilder::try_new(bytes::Bytes::from(bytes)).unwrap();
    let schema = Arc::clone(builder.schema());
    (schema, builder.build().unwrap().map(Result::unwrap).collect())
}

#[test]
fn values_types_and_nulls_come_back() {
    let (schema, batches) = read(parquet_bytes(&table(), &[]).unwrap());
    let batch = &batches[0];
    let numbers = batch.column(0).as_primitive::<Float64Type>();
    assert_eq!(numbers.iter().collect::<Vec<_>>(), [Some(0.1), None, Some(-3.0)]);
    let signed = batch.column(1).as_primitive::<Int64Type>();
    assert_eq!(signed.iter().collect::<Vec<_>>(), [Some(i64::MIN), None, Some(3)]);
    let whole = batch.column(2).as_primitive::<UInt64Type>();
    assert_eq!(whole.iter().collect::<Vec<_>>(), [Some(u64::MAX), Some(2), None]);
    let text = batch.column(3).as_string::<i32>();
    assert_eq!(text.iter().collect::<Vec<_>>(), [Some("Car"), None, Some("")]);
    let flags = batch.column(4).as_boolean();
    assert_eq!(flags.iter().collect::<Vec<_>>(), [Some(true), Some(false), None]);
    let times = batch.column(5).as_primitive::<TimestampNanosecondType>();
    assert_eq!((times.value(0), times.is_null(1)), (1_700_000_000_123_456_789, true));
    assert_eq!(*schema.field(5).data_type(), DataType::Timestamp(TimeUnit::Nanosecond, None));
}

#[test]
fn units_and_conventions_stand_in_the_file() {
    let (schema, _) = read(parquet_bytes(&table(), &[]).unwrap());
    let field = schema.field(0).metadata();
    assert_eq!((field["unit"].as_str(), field["description"].as_str()), ("m", "The number"));
    assert!(schema.metadata()["vehicle"].contains("x forward, y left, z up"));
    let columns: serde_json::Value = serde_json::from_str(&schema.metadata()["columns"]).unwrap();
    assert_eq!((&columns[2]["name"], &columns[2]["unit"]), (&"whole".into(), &"m".into()));
}

#[test]
fn groups_are_those_asked_for_and_bytes_are_the_same_again() {
    let bytes = parquet_bytes(&table(), &[1]).unwrap();
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes.clone())).unwrap();
    let rows: Vec<i64> = reader.metadata().row_groups().iter().map(|group| group.num_rows()).collect();
    assert_eq!(rows, [1, 2]);
    let compression = reader.metadata().row_group(0).column(0).compression();
    assert!(matches!(compression, Compression::ZSTD(_)));
    // Metadata of fields is a hash map in memory.
    assert!((0..20).all(|_| parquet_bytes(&table(), &[1]).unwrap() == bytes));
}

#[test]
fn an_empty_table_keeps_its_columns() {
    let columns = vec![column("number", Values::F64(Vec::new()))];
    let (schema, batches) = read(parquet_bytes(&Table { columns, ..table() }, &[0]).unwrap());
    assert_eq!((schema.fields().len(), batches.iter().map(RecordBatch::num_rows).sum::<usize>()), (1, 0));
}

#[test]
fn columns_that_make_no_table_are_refused() {
    let message = |table: Table, groups: &[usize]| parquet_bytes(&table, groups).unwrap_err().to_string();
    let with = |column: Column| {
        let mut table = table();
        table.columns.push(column);
        table
    };
    assert!(message(with(column("short", Values::Bool(vec![None]))), &[]).contains("`short` has 1 values"));
    assert!(message(with(column("flag", Values::Bool(vec![None; 3]))), &[]).contains("two columns `flag`"));
    assert!(message(Table { columns: Vec::new(), ..table() }, &[]).contains("no columns"));
    assert!(message(table(), &[2, 2]).contains("more than its 3 rows"));
}

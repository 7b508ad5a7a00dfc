//! What a file says about itself: units, descriptions, frame conventions.

use parquet::file::metadata::KeyValue;
use serde_json::json;

use crate::table::Table;

/// Frame conventions of all tables of the project.
const CONVENTIONS: [(&str, &str); 5] = [
    ("units", "metres, seconds, radians; units stand at the end of the names of columns"),
    ("world", "frame of the first camera: x right, y down, z forward"),
    ("camera", "x right, y down, z forward"),
    ("vehicle", "origin on the road below the centre of the vehicle: x forward, y left, z up"),
    (
        "covariance",
        "tangents are [omega, nu], rotation then translation in the body's own frame; quaternions are x y z w",
    ),
];

/// Key-value metadata of a file. `columns` is a JSON list, for readers that do not show Arrow's metadata of fields.
pub(crate) fn key_values(table: &Table) -> Vec<KeyValue> {
    let columns: Vec<_> = table
        .columns
        .iter()
        .map(|c| json!({"name": c.name, "unit": c.unit, "description": c.description}))
        .collect();
    let own = [("table", table.name.clone()), ("description", table.description.clone())];
    let conventions = CONVENTIONS.map(|(key, value)| (key, value.to_owned()));
    let columns = [("columns", serde_json::Value::Array(columns).to_string())];
    own.into_iter()
        .chain(conventions)
        .chain(columns)
        .map(|(key, value)| KeyValue::new(key.to_owned(), value))
        .collect()
}

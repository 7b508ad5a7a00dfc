//! `speeds.csv` as messages.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::error::Error;

/// The table of speeds: a row by frame number.
pub(crate) struct Speeds {
    columns: Vec<String>,
    rows: BTreeMap<u64, Map<String, Value>>,
}

impl Speeds {
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let wrong = |e: csv::Error| Error::Speeds(format!("{}: {e}", path.display()));
        let mut table = csv::Reader::from_path(path).map_err(wrong)?;
        let columns: Vec<String> = table.headers().map_err(wrong)?.iter().map(str::to_owned).collect();
        let mut rows = BTreeMap::new();
        for (k, record) in table.records().enumerate() {
            let record = record.map_err(wrong)?;
            let number = record.get(0).and_then(|text| text.parse().ok());
            let number = number.ok_or_else(|| {
                Error::Speeds(format!("{}:{}: expected a frame number", path.display(), k + 2))
            })?;
            let cells = columns.iter().zip(record.iter()).map(|(name, text)| (name.clone(), cell(text)));
            rows.insert(number, cells.collect());
        }
        Ok(Self { columns, rows })
    }

    /// The row of a frame as JSON.
    pub(crate) fn json(&self, number: u64) -> Option<Vec<u8>> {
        self.rows.get(&number).map(|row| Value::Object(row.clone()).to_string().into_bytes())
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The number in a cell of a frame's row; `None` where there is none.
    pub(crate) fn number(&self, number: u64, column: &str) -> Option<f64> {
        self.rows.get(&number)?.get(column)?.as_f64()
    }

    /// JSON schema of a row; cells without a value are null.
    pub(crate) fn schema(&self) -> String {
        let kind = |name: &str| if name == "ahead_class" { "string" } else { "number" };
        let columns = self.columns.iter().map(|name| (name.clone(), json!({"type": [kind(name), "null"]})));
        json!({"title": "motorcade.Speeds", "type": "object", "properties": columns.collect::<Map<_, _>>()})
            .to_string()
    }
}

fn cell(text: &str) -> Value {
    match text.parse::<f64>() {
        _ if text.is_empty() => Value::Null,
        Ok(number) => json!(number),
        Err(_) => json!(text),
    }
}

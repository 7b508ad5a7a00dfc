//! Manifests of one JSON object a line.

use serde_json::{Map, Value};

use crate::row::Row;

/// Rows of the text, or the line and what is wrong with it.
pub(crate) fn rows(text: &str) -> Result<Vec<Row>, (u64, String)> {
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    lines.map(|(line, text)| row(line, text).map_err(|problem| (line, problem))).collect()
}

fn row(line: u64, text: &str) -> Result<Row, String> {
    let object: Map<String, Value> =
        serde_json::from_str(text).map_err(|e| format!("expected one JSON object: {e}"))?;
    let cells = object.into_iter().map(|(name, value)| match cell(&value) {
        Some(text) => Ok((name, text)),
        None => {
            Err(format!("column `{name}`: expected a text, a number, true, false, null or a list of texts"))
        }
    });
    Ok(Row::new(line, cells.collect::<Result<Vec<_>, String>>()?))
}

fn cell(value: &Value) -> Option<String> {
    Some(match value {
        Value::Null => String::new(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(parts) => parts.iter().map(Value::as_str).collect::<Option<Vec<_>>>()?.join(";"),
        Value::Object(_) => return None,
    })
}

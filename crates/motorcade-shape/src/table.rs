//! Tables of numbers in text files, a row per line.

use std::path::Path;

use crate::error::PriorError;
use crate::json::read_text;

/// Reads rows of `columns` numbers parted by spaces or commas; empty lines and lines that start with `#` are skipped.
pub(crate) fn read(path: &Path, columns: usize) -> Result<Vec<Vec<f64>>, PriorError> {
    let text = read_text(path)?;
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let refuse = |expected: String, found: String| PriorError::Line {
            path: path.to_owned(),
            line: index + 1,
            expected,
            found,
        };
        let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let row = words
            .map(|word| match word.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(number),
                _ => Err(refuse("a finite number".into(), format!("`{word}`"))),
            })
            .collect::<Result<Vec<f64>, _>>()?;
        if row.len() != columns {
            return Err(refuse(format!("{columns} numbers"), row.len().to_string()));
        }
        rows.push(row);
    }
    Ok(rows)
}

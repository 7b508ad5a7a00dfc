//! A configuration as commented TOML.

use std::fmt::Write as _;

use schemars::schema_for;
use serde_json::Value as Schema;
use toml::{Table, Value};

use crate::config::Config;

impl Config {
    /// All settings as TOML, each under its documentation: unit, source, what it trades. [`Config::overlay`] reads it back.
    pub fn to_commented_toml(&self) -> String {
        let schema = schema_for!(Config).to_value();
        let mut text = String::new();
        if let Ok(values) = Table::try_from(*self) {
            table(&mut text, "", &values, &schema, &schema);
        }
        text
    }
}

/// Writes a table: its own values first, then the tables in it.
fn table(text: &mut String, path: &str, values: &Table, schema: &Schema, root: &Schema) {
    let property = |key: &str| resolve(&schema["properties"][key], root);
    for (key, value) in values.iter().filter(|(_, v)| !v.is_table()) {
        comment(text, &schema["properties"][key], property(key));
        // Writing to a string does not fail.
        let _ = writeln!(text, "{key} = {value}\n");
    }
    for (key, value) in values {
        let Value::Table(inner) = value else { continue };
        let full = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        comment(text, &schema["properties"][key], property(key));
        let _ = writeln!(text, "[{full}]\n");
        table(text, &full, inner, property(key), root);
    }
}

/// The schema a reference points to.
fn resolve<'s>(schema: &'s Schema, root: &'s Schema) -> &'s Schema {
    let target = schema["$ref"].as_str().and_then(|r| r.strip_prefix('#')).and_then(|r| root.pointer(r));
    target.unwrap_or(schema)
}

/// Documentation of a property, and of the values it may take.
fn comment(text: &mut String, own: &Schema, resolved: &Schema) {
    let described = own["description"].as_str().or_else(|| resolved["description"].as_str());
    for line in described.unwrap_or_default().replace("\\[", "[").replace("\\]", "]").lines() {
        let _ = writeln!(text, "# {line}");
    }
    for choice in resolved["oneOf"].as_array().into_iter().flatten() {
        if let Some(name) = choice["const"].as_str() {
            let meaning = choice["description"].as_str().unwrap_or_default().replace('\n', " ");
            let _ = writeln!(text, "#   \"{name}\": {meaning}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;

    #[test]
    fn the_text_reads_back_and_documents_every_setting() {
        let config = Config::preset(Preset::Paper);
        let text = config.to_commented_toml();
        assert_eq!(Config::default().overlay(&text, "text").unwrap(), config);
        let mut before = "";
        for line in text.lines().filter(|line| !line.is_empty()) {
            let is_setting = !line.starts_with('#') && !line.starts_with('[');
            assert!(!is_setting || before.starts_with('#'), "no comment above `{line}`");
            before = line;
        }
        assert!(text.contains("[road]") && text.contains("\"paper\": "), "{text}");
    }
}

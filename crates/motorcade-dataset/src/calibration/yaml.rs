//! The subset of YAML that calibration files use: nested keys, scalars, `[flow, lists]` over several lines and
//! `- block` lists. Keys are dotted paths.

/// One value with its line (counted from 1).
#[derive(Debug, PartialEq)]
pub(super) struct Entry {
    pub line: usize,
    pub key: String,
    pub value: String,
}

pub(super) fn entries(text: &str) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut parents: Vec<(usize, String)> = Vec::new();
    let mut open_list = false;
    for (i, raw) in text.lines().enumerate() {
        let content = without_comment(raw);
        let trimmed = content.trim();
        if trimmed.is_empty() || trimmed.starts_with('%') || trimmed == "---" || trimmed == "..." {
            continue;
        }
        if open_list {
            open_list = !trimmed.contains(']');
            append(&mut entries, trimmed);
            continue;
        }
        if let Some(item) = trimmed.strip_prefix("- ") {
            append(&mut entries, &format!("{}, ", item.trim()));
            continue;
        }
        let Some((key, value)) = trimmed.split_once(':') else { continue };
        let indent = content.len() - content.trim_start().len();
        parents.retain(|(depth, _)| *depth < indent);
        let key = key.trim().trim_matches(['"', '\'']);
        let path = parents.iter().map(|(_, name)| name.as_str()).chain([key]).collect::<Vec<_>>().join(".");
        // Tags such as `!!opencv-matrix` are redundant.
        let value = value.trim();
        let value =
            if value.starts_with("!!") { value.split_once(' ').map_or("", |(_, rest)| rest) } else { value };
        open_list = value.starts_with('[') && !value.contains(']');
        entries.push(Entry { line: i + 1, key: path, value: value.trim_matches(['"', '\'']).to_owned() });
        parents.push((indent, key.to_owned()));
    }
    entries
}

fn append(entries: &mut [Entry], text: &str) {
    if let Some(last) = entries.last_mut() {
        last.value.push(' ');
        last.value.push_str(text);
    }
}

/// `#` starts a comment at the start of the line or after white space.
fn without_comment(line: &str) -> &str {
    let start = line
        .char_indices()
        .find(|(i, c)| *c == '#' && line[..*i].chars().next_back().is_none_or(char::is_whitespace));
    start.map_or(line, |(i, _)| &line[..i])
}

//! Names of drives.

use std::path::Path;

use crate::column::Column;

/// The name of the input's file without its extension, with sequence and camera where given.
pub(crate) fn default(input: &str, options: &[(Column, String)]) -> String {
    let stem =
        Path::new(input).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let more = options.iter().filter(|(column, _)| matches!(column.name, "sequence" | "camera"));
    let name = more.fold(stem, |name, (_, value)| format!("{name}-{value}"));
    name.chars().map(|letter| if is_safe(letter) { letter } else { '_' }).collect()
}

fn is_safe(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || matches!(letter, '.' | '_' | '-')
}

/// What is wrong with a name that cannot be a directory's.
pub(crate) fn check(id: &str) -> Result<(), String> {
    const MOST: usize = 100;
    let fine =
        id.len() <= MOST && id.chars().all(is_safe) && id.starts_with(|c: char| c.is_ascii_alphanumeric());
    let expected = format!("1 to {MOST} letters, digits, `.`, `_`, `-`, a letter or digit first");
    if fine {
        Ok(())
    } else {
        Err(format!("column `id`: `{id}` cannot name a directory; expected {expected}"))
    }
}

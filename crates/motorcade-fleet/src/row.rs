//! A row of a manifest as it was read.

/// Cells that hold something, with the names of their columns as written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Line, from 1.
    pub line: u64,
    /// Column and value.
    pub cells: Vec<(String, String)>,
}

impl Row {
    /// A row without its empty cells.
    pub(crate) fn new(line: u64, cells: impl IntoIterator<Item = (String, String)>) -> Self {
        let cells = cells.into_iter().map(|(name, value)| (name, value.trim().to_owned()));
        Self { line, cells: cells.filter(|(_, value)| !value.is_empty()).collect() }
    }
}

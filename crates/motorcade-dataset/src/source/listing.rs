//! Numbered image files of a folder.

use std::path::{Path, PathBuf};

use motorcade_geometry::robust::median_by;

use super::decode::IMAGE_ENDINGS;
use crate::error::{Error, Result};

/// The images of a folder in the order of their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Listing {
    pub entries: Vec<Entry>,
    /// Files whose number is taken by another file.
    pub duplicates: Vec<PathBuf>,
    /// Images without a number among numbered ones.
    pub unnumbered: Vec<PathBuf>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    pub number: u64,
    pub path: PathBuf,
    pub bytes: u64,
}

/// An image by its ending, in any case.
pub(crate) fn is_image(path: &Path) -> bool {
    path.extension().is_some_and(|e| IMAGE_ENDINGS.iter().any(|k| e.eq_ignore_ascii_case(k)))
}

/// The last run of digits in the file stem: `frame_000016.png` is 16.
pub(crate) fn number_of(path: &Path) -> Option<u64> {
    let stem = path.file_stem()?.to_str()?;
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |i| i + stem[i..].chars().next().map_or(1, char::len_utf8));
    stem[start..end].parse().ok()
}

/// Lists a folder without hidden files. A folder without any number is numbered in the order of names.
pub(crate) fn list(folder: &Path) -> Result<Listing> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(Error::io(folder))? {
        let entry = entry.map_err(Error::io(folder))?;
        let path = entry.path();
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if !hidden && is_image(&path) {
            // A dangling link is an unreadable frame, not the end of the listing.
            let bytes = std::fs::metadata(&path).map_or(0, |m| m.len());
            files.push((number_of(&path), path, bytes));
        }
    }
    files.sort_by(|a, b| a.1.cmp(&b.1));
    let mut listing = Listing::default();
    if files.iter().all(|(number, ..)| number.is_none()) {
        let numbered = files.into_iter().enumerate();
        listing.entries =
            numbered.map(|(i, (_, path, bytes))| Entry { number: i as u64, path, bytes }).collect();
        return Ok(listing);
    }
    let mut entries = Vec::new();
    for (number, path, bytes) in files {
        match number {
            Some(number) => entries.push(Entry { number, path, bytes }),
            None => listing.unnumbered.push(path),
        }
    }
    // Stable: among equal numbers the first name wins.
    entries.sort_by_key(|entry| entry.number);
    for entry in entries {
        if listing.entries.last().is_some_and(|last| last.number == entry.number) {
            listing.duplicates.push(entry.path);
        } else {
            listing.entries.push(entry);
        }
    }
    Ok(listing)
}

/// Median difference of consecutive numbers (the lower one).
pub(crate) fn numbering_step(entries: &[Entry]) -> u64 {
    let mut steps: Vec<u64> = entries.windows(2).map(|pair| pair[1].number - pair[0].number).collect();
    median_by(&mut steps, u64::cmp).unwrap_or(1).max(1)
}

/// Missing numbers; none when the numbers are not regular (such as times).
pub(crate) fn gaps(entries: &[Entry], step: u64) -> Vec<u64> {
    let regular = entries.windows(2).all(|pair| (pair[1].number - pair[0].number).is_multiple_of(step));
    let (Some(first), Some(last)) = (entries.first(), entries.last()) else { return Vec::new() };
    let expected = ((last.number - first.number) / step).saturating_add(1);
    // More missing than present: parts of several drives, or numbers with another meaning.
    if !regular || expected > 2 * entries.len() as u64 {
        return Vec::new();
    }
    let mut missing = Vec::new();
    for pair in entries.windows(2) {
        let mut number = pair[0].number + step;
        while number < pair[1].number {
            missing.push(number);
            number += step;
        }
    }
    missing
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str]) -> (tempfile::TempDir, Listing) {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            std::fs::write(folder.path().join(name), name).unwrap();
        }
        let listing = list(folder.path()).unwrap();
        (folder, listing)
    }

    #[test]
    fn natural_order_mixed_endings_duplicates() {
        let (_folder, listing) =
            folder(&["f10.PNG", "f2.jpg", "f1.png", "f2.JPEG", "note.txt", "cover.png", ".f3.png"]);
        let numbers: Vec<u64> = listing.entries.iter().map(|e| e.number).collect();
        assert_eq!(numbers, [1, 2, 10]);
        assert!(listing.duplicates[0].ends_with("f2.jpg"), "f2.JPEG sorts first and wins");
        assert!(listing.unnumbered[0].ends_with("cover.png"));
    }

    #[test]
    fn gaps_follow_the_step() {
        let (_a, listing) = folder(&["0.png", "2.png", "4.png", "8.png", "10.png"]);
        let step = numbering_step(&listing.entries);
        assert_eq!((step, gaps(&listing.entries, step)), (2, vec![6]));
        let (_b, times) =
            folder(&["1403636579763555584.png", "1403636579813555456.png", "1403636579863555584.png"]);
        assert!(gaps(&times.entries, numbering_step(&times.entries)).is_empty());
    }

    #[test]
    fn numbers_of_names() {
        for (name, number) in
            [("000016.png", Some(16)), ("img_7_left.png", Some(7)), ("left.png", None), ("é12.png", Some(12))]
        {
            assert_eq!(number_of(Path::new(name)), number, "{name}");
        }
    }
}

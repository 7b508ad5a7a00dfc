//! Rows of a drive of any length, of which the oldest can be forgotten.

use std::ops::{Index, IndexMut, Range, RangeFrom, RangeInclusive, RangeTo};

/// Rows to be forgotten at least before memory is moved: a shift costs as much as the rows that stay.
const LEAST_FORGOTTEN: usize = 256;

/// A list whose oldest rows can be forgotten; indices stay those of the drive. Forgotten rows cannot be indexed: `get` answers `None`.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Rows<T> {
    /// Index of the first row that is kept.
    first: usize,
    kept: Vec<T>,
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self { first: 0, kept: Vec::new() }
    }
}

impl<T> From<Vec<T>> for Rows<T> {
    fn from(kept: Vec<T>) -> Self {
        Self { first: 0, kept }
    }
}

impl<T> Rows<T> {
    /// Rows of which those before `first` are forgotten already.
    pub fn starting_at(first: usize, kept: Vec<T>) -> Self {
        Self { first, kept }
    }
    /// Rows so far, forgotten ones included.
    pub fn len(&self) -> usize {
        self.first + self.kept.len()
    }
    /// True before the first row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Index of the first row that is kept.
    pub fn first_kept(&self) -> usize {
        self.first
    }
    /// The rows that are kept.
    pub fn kept(&self) -> &[T] {
        &self.kept
    }
    /// A row; `None` of one that is forgotten or that has not come yet.
    pub fn get(&self, row: usize) -> Option<&T> {
        self.kept.get(row.checked_sub(self.first)?)
    }
    /// The newest row.
    pub fn last(&self) -> Option<&T> {
        self.kept.last()
    }
    /// The newest row.
    pub fn last_mut(&mut self) -> Option<&mut T> {
        self.kept.last_mut()
    }
    /// Adds a row.
    pub fn push(&mut self, row: T) {
        self.kept.push(row);
    }
    /// Drops the rows from `row` on.
    pub fn truncate(&mut self, row: usize) {
        self.kept.truncate(row.saturating_sub(self.first));
    }
    /// The rows that are kept, oldest first.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.kept.iter()
    }
    /// The rows that are kept, oldest first.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.kept.iter_mut()
    }
    /// Puts rows back that were taken out, those just before the ones that are kept.
    pub fn put_back(&mut self, mut older: Vec<T>) {
        self.first = self.first.saturating_sub(older.len());
        older.append(&mut self.kept);
        self.kept = older;
    }
    /// The rows that are kept, without their indices.
    pub fn into_kept(self) -> Vec<T> {
        self.kept
    }
    /// Takes out the rows before `row`, oldest first, once they are worth the work; none until then.
    pub fn forget_before(&mut self, row: usize) -> impl Iterator<Item = T> + '_ {
        let old = row.saturating_sub(self.first).min(self.kept.len());
        let old = if old < LEAST_FORGOTTEN.max(self.kept.len() / 2) { 0 } else { old };
        self.first += old;
        self.kept.drain(..old)
    }
}

impl<'a, T> IntoIterator for &'a Rows<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut Rows<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T> Index<usize> for Rows<T> {
    type Output = T;
    fn index(&self, row: usize) -> &T {
        &self.kept[row - self.first]
    }
}

impl<T> IndexMut<usize> for Rows<T> {
    fn index_mut(&mut self, row: usize) -> &mut T {
        &mut self.kept[row - self.first]
    }
}

/// Indexing by a kind of range, moved by the rows that are forgotten.
macro_rules! by_range {
    ($range:ty, $moved:expr) => {
        impl<T> Index<$range> for Rows<T> {
            type Output = [T];
            fn index(&self, rows: $range) -> &[T] {
                &self.kept[$moved(rows, self.first)]
            }
        }
        impl<T> IndexMut<$range> for Rows<T> {
            fn index_mut(&mut self, rows: $range) -> &mut [T] {
                &mut self.kept[$moved(rows, self.first)]
            }
        }
    };
}

by_range!(Range<usize>, |r: Range<usize>, first| r.start - first..r.end - first);
by_range!(RangeInclusive<usize>, |r: RangeInclusive<usize>, first| r.start() - first..=r.end() - first);
by_range!(RangeFrom<usize>, |r: RangeFrom<usize>, first| r.start - first..);
by_range!(RangeTo<usize>, |r: RangeTo<usize>, first| ..r.end - first);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_their_indices_when_older_ones_are_forgotten() {
        let mut rows = Rows::default();
        let (mut forgotten, mut most) = (Vec::new(), 0);
        for k in 0..5000_usize {
            rows.push(k);
            forgotten.extend(rows.forget_before((k + 1).saturating_sub(100)));
            most = most.max(rows.kept().len());
            assert_eq!((rows.len(), rows[k], rows.last()), (k + 1, k, Some(&k)));
        }
        assert!(most < 600 && forgotten.len() > 4400, "{most} kept, {} forgotten", forgotten.len());
        assert!(forgotten.iter().copied().eq(0..forgotten.len()) && rows.first_kept() == forgotten.len());
        assert_eq!(rows[4990..4992], [4990, 4991]);
        assert_eq!(rows[4990..=4991], [4990, 4991]);
        assert_eq!((rows[4998..].len(), rows[..4999].last()), (2, Some(&4998)));
        assert_eq!((rows.get(10), rows.get(4999), rows.get(5000)), (None, Some(&4999), None));
        rows.push(0);
        rows.truncate(5000);
        assert_eq!((rows.len(), rows.last()), (5000, Some(&4999)));
        rows.put_back(forgotten);
        assert_eq!((rows.first_kept(), rows.len(), rows[10]), (0, 5000, 10));
        assert!(rows.into_kept().into_iter().eq(0..5000));
    }
}

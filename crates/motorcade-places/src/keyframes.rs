//! Keyframes of a search by their numbers.

use std::collections::BTreeMap;
use std::ops::Index;

use crate::keyframe::PlacedKeyframe;

/// Keyframes by their numbers, from 0 in the order they came; those that are not needed any more can be taken out and keep their numbers.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Keyframes {
    count: usize,
    kept: BTreeMap<usize, PlacedKeyframe>,
}

impl Keyframes {
    /// Keyframes so far, those taken out included.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True before the first.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A keyframe; `None` of one that was taken out or that has not come yet.
    pub fn get(&self, keyframe: usize) -> Option<&PlacedKeyframe> {
        self.kept.get(&keyframe)
    }

    /// The newest.
    pub fn last(&self) -> Option<&PlacedKeyframe> {
        self.get(self.count.checked_sub(1)?)
    }

    /// Those from `first` on that were not taken out.
    pub fn since(&self, first: usize) -> impl Iterator<Item = &PlacedKeyframe> {
        self.kept.range(first..).map(|(_, keyframe)| keyframe)
    }

    pub(crate) fn push(&mut self, keyframe: PlacedKeyframe) {
        self.kept.insert(self.count, keyframe);
        self.count += 1;
    }

    pub(crate) fn get_mut(&mut self, keyframe: usize) -> Option<&mut PlacedKeyframe> {
        self.kept.get_mut(&keyframe)
    }

    /// Numbers of those before `before` that were not taken out.
    pub(crate) fn numbers_before(&self, before: usize) -> impl Iterator<Item = usize> {
        self.kept.range(..before).map(|(number, _)| *number)
    }

    /// Takes out those of these numbers.
    pub(crate) fn take_out(&mut self, numbers: &[usize]) -> Vec<(usize, PlacedKeyframe)> {
        numbers.iter().filter_map(|k| Some((*k, self.kept.remove(k)?))).collect()
    }

    pub(crate) fn put_back(&mut self, older: Vec<(usize, PlacedKeyframe)>) {
        self.kept.extend(older);
    }

    pub(crate) fn into_vec(self) -> Vec<PlacedKeyframe> {
        self.kept.into_values().collect()
    }
}

impl Index<usize> for Keyframes {
    type Output = PlacedKeyframe;
    fn index(&self, keyframe: usize) -> &PlacedKeyframe {
        &self.kept[&keyframe]
    }
}

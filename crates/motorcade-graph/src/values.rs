//! Values of all variables, by id.

use crate::GraphError;
use crate::ids::VariableId;
use crate::manifold::{Manifold, Value, Variable};

/// The values of a graph's variables.
///
/// Ids count up for ever, storage does not: once most slots are of removed variables, the stretch at the front where
/// they are is dropped, and the few variables that live on in it (a scale, a calibration) move to a list of their own.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Values {
    /// Survivors from before `base`, increasing.
    old: Vec<(VariableId, Value)>,
    /// Id of the first slot.
    base: u32,
    slots: Vec<Option<Value>>,
    /// Empty slots.
    dead: usize,
}

/// Empty slots that are not worth a clean-up.
const SPARE_SLOTS: usize = 64;

/// Equal variables, wherever they are stored.
impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl Values {
    /// Adds a value under the next id.
    pub(crate) fn push(&mut self, value: Value) -> VariableId {
        let id = VariableId(self.base + self.slots.len() as u32);
        self.slots.push(Some(value));
        id
    }

    /// Removes a variable. Its id stays unused.
    pub(crate) fn remove(&mut self, id: VariableId) {
        if let Some(slot) = self.entry(id).filter(|s| s.is_some()) {
            *slot = None;
            self.dead += 1;
            if self.dead > SPARE_SLOTS && 2 * self.dead > self.slots.len() {
                self.compact();
            }
        } else if let Ok(at) = self.old.binary_search_by_key(&id, |o| o.0) {
            self.old.remove(at);
        }
    }

    /// Drops the stretch at the front with the most empty slots over full ones.
    fn compact(&mut self) {
        let (mut sum, mut best, mut cut) = (0_isize, 0, 0);
        for (k, slot) in self.slots.iter().enumerate() {
            sum += if slot.is_none() { 1 } else { -1 };
            if sum > best {
                (best, cut) = (sum, k + 1);
            }
        }
        let base = self.base;
        let moved = self.slots.drain(..cut).enumerate();
        let before = self.old.len();
        self.old.extend(moved.filter_map(|(k, s)| Some((VariableId(base + k as u32), s?))));
        self.dead -= cut - (self.old.len() - before);
        self.base += cut as u32;
    }

    /// True of values that were kept in a file and are none of another program.
    pub(crate) fn fit_together(&self) -> bool {
        let Self { old, base, slots, dead } = self;
        let ordered = old.is_sorted_by(|a, b| a.0 < b.0) && old.last().is_none_or(|o| o.0.0 < *base);
        let counted = u32::try_from(slots.len()).is_ok_and(|count| base.checked_add(count).is_some());
        ordered && counted && slots.iter().filter(|slot| slot.is_none()).count() == *dead
    }

    fn entry(&mut self, id: VariableId) -> Option<&mut Option<Value>> {
        self.slots.get_mut(id.0.checked_sub(self.base)? as usize)
    }

    /// Place of a variable among all slots, old ones first.
    pub(crate) fn slot(&self, id: VariableId) -> Option<usize> {
        match id.0.checked_sub(self.base) {
            Some(k) => Some(self.old.len() + k as usize),
            None => self.old.binary_search_by_key(&id, |o| o.0).ok(),
        }
    }

    /// Number of slots, empty ones included.
    pub(crate) fn slots(&self) -> usize {
        self.old.len() + self.slots.len()
    }

    /// The value of any type.
    #[inline]
    pub fn value(&self, id: VariableId) -> Result<&Value, GraphError> {
        match self.slots.get(id.0.wrapping_sub(self.base) as usize) {
            Some(Some(value)) => Ok(value),
            _ => self.old_value(id),
        }
    }

    #[cold]
    fn old_value(&self, id: VariableId) -> Result<&Value, GraphError> {
        let at = self.old.binary_search_by_key(&id, |o| o.0);
        at.map(|k| &self.old[k].1).map_err(|_| GraphError::UnknownVariable(id))
    }

    /// The value of a variable of a known type, for example `values.get::<Isometry3<f64>>(id)`.
    pub fn get<V: Variable>(&self, id: VariableId) -> Result<&V, GraphError> {
        // Not `ok_or`, which makes the error, and drops it, at every look-up.
        let Some(value) = V::of(self.value(id)?) else {
            return Err(GraphError::WrongType { variable: id, expected: V::NAME });
        };
        Ok(value)
    }

    /// The number in a variable of R^1.
    pub fn scalar(&self, id: VariableId) -> Result<f64, GraphError> {
        let wrong = GraphError::WrongType { variable: id, expected: "scalar" };
        self.get::<nalgebra::DVector<f64>>(id)?.get(0).copied().ok_or(wrong)
    }

    /// Replaces a value by one of the same space and size.
    pub fn set(&mut self, id: VariableId, value: impl Into<Value>) -> Result<(), GraphError> {
        let value = value.into();
        let old = self.value(id)?;
        if std::mem::discriminant(old) != std::mem::discriminant(&value) || old.dof() != value.dof() {
            return Err(GraphError::WrongType { variable: id, expected: "value of the same space" });
        }
        self.put(id, value);
        Ok(())
    }

    /// Replaces the value of an existing variable, unchecked.
    pub(crate) fn put(&mut self, id: VariableId, value: Value) {
        if let Some(slot) = self.entry(id) {
            *slot = Some(value);
        } else if let Ok(at) = self.old.binary_search_by_key(&id, |o| o.0) {
            self.old[at].1 = value;
        }
    }

    /// All variables, by increasing id.
    pub fn iter(&self) -> impl Iterator<Item = (VariableId, &Value)> {
        let base = self.base;
        let slots = self.slots.iter().enumerate();
        let recent = slots.filter_map(move |(k, s)| Some((VariableId(base + k as u32), s.as_ref()?)));
        self.old.iter().map(|(id, value)| (*id, value)).chain(recent)
    }

    /// Number of variables.
    pub fn len(&self) -> usize {
        self.slots() - self.dead
    }

    /// True without variables.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

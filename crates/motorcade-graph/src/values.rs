//! Values of all variables, by id.

use std::fmt;

use crate::GraphError;
use crate::manifold::{Manifold, Value, Variable};

/// Name of a variable: a number that is never used again, also after the variable was removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VariableId(pub(crate) u32);

impl VariableId {
    /// Variables are numbered from 0 in the order they were added.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl fmt::Display for VariableId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// The values of a graph's variables.
#[derive(Clone, Debug, Default)]
pub struct Values {
    /// Id of the first slot: slots of long removed variables are dropped from the front.
    base: u32,
    slots: Vec<Option<Value>>,
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
        if let Some(slot) = self.slot(id).and_then(|k| self.slots.get_mut(k)) {
            *slot = None;
        }
        let dead = self.slots.iter().take_while(|s| s.is_none()).count();
        if dead > 64 && 2 * dead > self.slots.len() {
            self.slots.drain(..dead);
            self.base += dead as u32;
        }
    }

    pub(crate) fn slot(&self, id: VariableId) -> Option<usize> {
        id.0.checked_sub(self.base).map(|k| k as usize)
    }

    /// Number of slots, empty ones included.
    pub(crate) fn slots(&self) -> usize {
        self.slots.len()
    }

    /// The value of any type.
    pub fn value(&self, id: VariableId) -> Result<&Value, GraphError> {
        let slot = self.slot(id).and_then(|k| self.slots.get(k));
        slot.and_then(Option::as_ref).ok_or(GraphError::UnknownVariable(id))
    }

    /// The value of a variable of a known type, for example `values.get::<Isometry3<f64>>(id)`.
    pub fn get<V: Variable>(&self, id: VariableId) -> Result<&V, GraphError> {
        V::of(self.value(id)?).ok_or(GraphError::WrongType { variable: id, expected: V::NAME })
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
        if let Some(slot) = self.slot(id).and_then(|k| self.slots.get_mut(k)) {
            *slot = Some(value);
        }
    }

    /// All variables, by increasing id.
    pub fn iter(&self) -> impl Iterator<Item = (VariableId, &Value)> {
        let base = self.base;
        self.slots
            .iter()
            .enumerate()
            .filter_map(move |(k, s)| Some((VariableId(base + k as u32), s.as_ref()?)))
    }

    /// Number of variables.
    pub fn len(&self) -> usize {
        self.slots.iter().filter(|s| s.is_some()).count()
    }

    /// True without variables.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

//! Variables and the factors between them.

mod state;

use motorcade_geometry::robust::Loss;
use nalgebra::{DMatrixViewMut, DVectorViewMut};

use crate::GraphError;
use crate::factor::Factor;
use crate::group::{GroupId, LossScale};
use crate::ids::{FactorId, VariableId};
use crate::manifold::{Manifold, Value};
use crate::values::Values;

pub(crate) use state::GraphState;

/// A factor of a graph.
#[derive(Debug)]
pub(crate) struct Entry {
    pub id: FactorId,
    group: GroupId,
    pub factor: Box<dyn Factor>,
}

/// A least-squares problem: minimise `Σ ρ(rᵀ Ω r)` over the variables that are not fixed.
#[derive(Debug, Default)]
pub struct Graph {
    values: Values,
    /// Increasing.
    fixed: Vec<VariableId>,
    factors: Vec<Entry>,
    /// Scales of groups 1 and on; group 0, of all factors that were not assigned to one, has none.
    groups: Vec<LossScale>,
    next_factor: u32,
    /// Changes whenever the pattern of the normal equations may have changed.
    version: u64,
}

impl Graph {
    /// A graph without anything.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a variable with its starting value: a pose ([`nalgebra::Isometry3`], [`nalgebra::Isometry2`]), a
    /// similarity, a [`nalgebra::DVector`] or a number.
    pub fn add_variable(&mut self, value: impl Into<Value>) -> VariableId {
        self.version += 1;
        self.values.push(value.into())
    }

    /// Holds a variable at its value: it leaves the equations altogether.
    pub fn fix(&mut self, variable: VariableId) -> Result<(), GraphError> {
        self.values.value(variable)?;
        if let Err(at) = self.fixed.binary_search(&variable) {
            self.fixed.insert(at, variable);
            self.version += 1;
        }
        Ok(())
    }

    /// Lets a fixed variable move again.
    pub fn release(&mut self, variable: VariableId) {
        if let Ok(at) = self.fixed.binary_search(&variable) {
            self.fixed.remove(at);
            self.version += 1;
        }
    }

    /// True for variables held at their value.
    pub fn is_fixed(&self, variable: VariableId) -> bool {
        self.fixed.binary_search(&variable).is_ok()
    }

    /// Fixed variables, increasing.
    pub fn fixed(&self) -> &[VariableId] {
        &self.fixed
    }

    /// Adds a factor after evaluating it once: unknown variables, wrong types and sizes are refused here.
    pub fn add_factor(&mut self, factor: impl Factor + 'static) -> Result<FactorId, GraphError> {
        self.add_boxed(Box::new(factor))
    }

    /// [`add_factor`](Self::add_factor) for a factor already boxed.
    pub fn add_boxed(&mut self, factor: Box<dyn Factor>) -> Result<FactorId, GraphError> {
        self.check(factor.as_ref())?;
        let id = FactorId(self.next_factor);
        self.next_factor += 1;
        self.version += 1;
        self.factors.push(Entry { id, group: GroupId::default(), factor });
        Ok(id)
    }

    /// Evaluates a factor once.
    fn check(&self, factor: &dyn Factor) -> Result<(), GraphError> {
        let mut dof = 0;
        for (k, &id) in factor.variables().iter().enumerate() {
            dof += self.values.value(id)?.dof();
            if factor.variables()[..k].contains(&id) {
                return Err(GraphError::Information(format!("variable {id} appears twice in one factor")));
            }
        }
        let m = factor.dim();
        if factor.information().shape() != (m, m) {
            let found = factor.information().nrows();
            return Err(GraphError::Size { what: "information matrix", expected: m, found });
        }
        let (mut r, mut j) = (vec![0.0; m], vec![0.0; m * dof]);
        factor.evaluate(
            &self.values,
            &mut DVectorViewMut::from_slice(&mut r, m),
            Some(&mut DMatrixViewMut::from_slice(&mut j, m, dof)),
        )?;
        if r.iter().chain(&j).any(|x| !x.is_finite()) {
            return Err(GraphError::NotFinite);
        }
        Ok(())
    }

    /// Removes a factor; the others keep their ids.
    pub fn remove_factor(&mut self, id: FactorId) -> Option<Box<dyn Factor>> {
        let at = self.place(id)?;
        self.version += 1;
        Some(self.factors.remove(at).factor)
    }

    /// Removes several factors at once; unknown ones are ignored.
    pub fn remove_factors(&mut self, ids: &[FactorId]) {
        let mut gone = ids.to_vec();
        gone.sort_unstable();
        self.factors.retain(|f| gone.binary_search(&f.id).is_err());
        self.version += 1;
    }

    fn place(&self, id: FactorId) -> Option<usize> {
        self.factors.binary_search_by_key(&id, |f| f.id).ok()
    }

    /// A new group of factors without scale; see [`assign`](Self::assign).
    pub fn add_group(&mut self) -> GroupId {
        self.groups.push(LossScale::default());
        GroupId(self.groups.len() as u32)
    }

    /// Puts a factor into a group.
    ///
    /// # Errors
    /// A factor or group that the graph does not have.
    pub fn assign(&mut self, factor: FactorId, group: GroupId) -> Result<(), GraphError> {
        let known = group.0 as usize <= self.groups.len();
        match self.place(factor).filter(|_| known) {
            Some(at) => self.factors[at].group = group,
            None => return Err(GraphError::UnknownFactor(factor)),
        }
        Ok(())
    }

    /// Group of a factor; `None` for an unknown one.
    pub fn group(&self, factor: FactorId) -> Option<GroupId> {
        Some(self.factors[self.place(factor)?].group)
    }

    /// Scales the losses of a group of factors: an input of the next solve.
    ///
    /// # Errors
    /// A scale that is not positive, or a group that the graph does not have.
    pub fn set_scale(&mut self, group: GroupId, scale: LossScale) -> Result<(), GraphError> {
        let slot = (group.0 as usize).checked_sub(1).and_then(|at| self.groups.get_mut(at));
        match slot.filter(|_| scale.variance > 0.0 && scale.amplitude > 0.0) {
            Some(slot) => *slot = scale,
            None => {
                return Err(GraphError::Option { name: "scale", reason: format!("{scale:?} of {group:?}") });
            }
        }
        Ok(())
    }

    /// Scale of the losses of a group.
    pub fn scale(&self, group: GroupId) -> LossScale {
        (group.0 as usize).checked_sub(1).and_then(|at| self.groups.get(at)).copied().unwrap_or_default()
    }

    /// Loss of a factor at `s = rᵀ Ω r`, under its kernel and the scale of its group.
    #[inline]
    pub(crate) fn loss_at(&self, entry: &Entry, s: f64) -> Loss {
        if entry.group.0 == 0 {
            return entry.factor.loss(s);
        }
        self.scale(entry.group).apply(s, |s| entry.factor.loss(s))
    }

    /// Loss of a factor at the current values.
    ///
    /// # Errors
    /// A factor that the graph does not have.
    pub fn loss(&self, id: FactorId) -> Result<Loss, GraphError> {
        let at = self.place(id).ok_or(GraphError::UnknownFactor(id))?;
        let entry = &self.factors[at];
        Ok(self.loss_at(entry, entry.factor.squared_norm(&self.values)?))
    }

    /// Removes a variable and every factor that touches it.
    pub fn remove_variable(&mut self, variable: VariableId) -> Result<(), GraphError> {
        self.take_factors_of(&[variable]);
        self.discard(variable)
    }

    pub(crate) fn discard(&mut self, variable: VariableId) -> Result<(), GraphError> {
        self.values.value(variable)?;
        self.release(variable);
        self.values.remove(variable);
        self.version += 1;
        Ok(())
    }

    /// Takes out all factors that touch any of `variables` (increasing).
    pub(crate) fn take_factors_of(&mut self, variables: &[VariableId]) -> Vec<Entry> {
        let touches = |f: &dyn Factor| f.variables().iter().any(|v| variables.binary_search(v).is_ok());
        let (taken, kept): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.factors).into_iter().partition(|f| touches(f.factor.as_ref()));
        self.factors = kept;
        self.version += 1;
        taken
    }

    /// Current values.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Current values, to be changed.
    pub fn values_mut(&mut self) -> &mut Values {
        &mut self.values
    }

    /// All factors by increasing id.
    pub fn factors(&self) -> impl ExactSizeIterator<Item = (FactorId, &dyn Factor)> {
        self.factors.iter().map(|f| (f.id, f.factor.as_ref()))
    }

    /// One factor.
    pub fn factor(&self, id: FactorId) -> Option<&dyn Factor> {
        Some(self.factors[self.place(id)?].factor.as_ref())
    }

    pub(crate) fn entries(&self) -> &[Entry] {
        &self.factors
    }

    pub(crate) fn version(&self) -> u64 {
        self.version
    }

    /// `Σ ρ(rᵀ Ω r)` at the current values (no factor ½).
    pub fn cost(&self) -> Result<f64, GraphError> {
        let mut total = 0.0;
        for entry in &self.factors {
            total += self.loss_at(entry, entry.factor.squared_norm(&self.values)?).cost;
        }
        Ok(total)
    }

    /// Connected components, each increasing, ordered by their smallest variable.
    pub fn components(&self) -> Vec<Vec<VariableId>> {
        let ids: Vec<VariableId> = self.values.iter().map(|(id, _)| id).collect();
        let index = |id: VariableId| ids.binary_search(&id).unwrap_or(0);
        let mut root: Vec<usize> = (0..ids.len()).collect();
        fn find(root: &mut [usize], mut i: usize) -> usize {
            while root[i] != i {
                root[i] = root[root[i]];
                i = root[i];
            }
            i
        }
        for entry in &self.factors {
            let mut at = entry.factor.variables().iter().map(|&id| index(id));
            let Some(first) = at.next() else { continue };
            for other in at {
                let (a, b) = (find(&mut root, first), find(&mut root, other));
                root[a.max(b)] = a.min(b);
            }
        }
        let mut components: Vec<Vec<VariableId>> = vec![Vec::new(); ids.len()];
        for i in 0..ids.len() {
            components[find(&mut root, i)].push(ids[i]);
        }
        components.retain(|c| !c.is_empty());
        components
    }

    /// Fixes the first variable of every component that has neither a fixed variable nor a factor of its own on a
    /// single variable; returns what was fixed.
    pub fn anchor_components(&mut self) -> Result<Vec<VariableId>, GraphError> {
        let mut known: Vec<VariableId> = self.fixed.clone();
        known.extend(self.factors.iter().filter_map(|f| match f.factor.variables() {
            [only] => Some(*only),
            _ => None,
        }));
        known.sort_unstable();
        let mut anchors = Vec::new();
        for component in self.components() {
            if !component.iter().any(|id| known.binary_search(id).is_ok())
                && let Some(&first) = component.first()
            {
                self.fix(first)?;
                anchors.push(first);
            }
        }
        Ok(anchors)
    }
}

//! The normal equations of a graph: a pattern made once, filled at every linearisation.

use motorcade_sparse::{BlockMatrix, Ordering, PairSlots, Slot};
use rayon::prelude::*;

use crate::GraphError;
use crate::factor::Normal;
use crate::graph::{Entry, Graph};
use crate::ids::VariableId;
use crate::manifold::{Manifold, Value};
use crate::values::Values;

const FIXED: u32 = u32::MAX;
/// Factors linearised in parallel before their results are added up in order.
const BATCH: usize = 4096;

/// One variable of a factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct VariableSlot {
    /// Block in the matrix, `FIXED` for none.
    block: u32,
    dof: u32,
}

/// Pattern and storage of `H δ = −g`.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    /// Variable of each block (original numbering).
    pub variables: Vec<VariableId>,
    pub matrix: BlockMatrix,
    places: Vec<VariableSlot>,
    /// Start of each factor in `places`.
    starts: Vec<u32>,
    /// Slots of all block pairs (k ≥ l) of each factor, one after the other; none for fixed variables.
    slots: Vec<Option<Slot>>,
    slot_starts: Vec<u32>,
    /// Cost, weight and share of the factors linearised in parallel.
    batch: Vec<(f64, f64, Normal)>,
    /// True where the pattern is the one of the problem before.
    pub reused: bool,
}

impl Problem {
    /// Analyses `graph`. Where `last` has the same pattern, that of a window shifted by a frame for example, its
    /// ordering, symbolic factorisation and memory are taken over.
    pub(crate) fn new(graph: &Graph, last: Option<Self>) -> Result<Self, GraphError> {
        Self::ordered(graph, last, Ordering::LeastWork, &[])
    }

    /// For covariances, also those between the two variables of each of `pairs`, which must not be fixed: they are in the pattern beside the
    /// pairs that factors join.
    pub(crate) fn for_covariances(
        graph: &Graph,
        pairs: &[(VariableId, VariableId)],
    ) -> Result<Self, GraphError> {
        Self::ordered(graph, None, Ordering::ShortPaths, pairs)
    }

    fn ordered(
        graph: &Graph,
        last: Option<Self>,
        ordering: Ordering,
        beside: &[(VariableId, VariableId)],
    ) -> Result<Self, GraphError> {
        let values = graph.values();
        let mut block_of = vec![FIXED; values.slots()];
        let (mut variables, mut dims) = (Vec::new(), Vec::new());
        for (id, value) in values.iter() {
            if !graph.is_fixed(id)
                && value.dof() > 0
                && let Some(slot) = values.slot(id)
            {
                block_of[slot] = variables.len() as u32;
                variables.push(id);
                dims.push(value.dof());
            }
        }
        let factors = graph.entries().len();
        let (mut places, mut starts) = (Vec::with_capacity(2 * factors), Vec::with_capacity(factors + 1));
        starts.push(0);
        for entry in graph.entries() {
            for &id in entry.factor.variables() {
                let dof = values.value(id)?.dof() as u32;
                let block = values.slot(id).map_or(FIXED, |k| block_of[k]);
                places.push(VariableSlot { block, dof });
            }
            starts.push(places.len() as u32);
        }
        if let Some(last) = last
            && (&last.places, &last.starts) == (&places, &starts)
            && last.matrix.has_blocks(&dims)
        {
            return Ok(Self { variables, reused: true, ..last });
        }
        let mut pairs = Vec::with_capacity(factors + beside.len());
        let block = |id: VariableId| values.slot(id).map(|k| block_of[k]).filter(|b| *b != FIXED);
        pairs.extend(beside.iter().filter_map(|(a, b)| block(*a).zip(block(*b))));
        for range in starts.windows(2) {
            let own: &[VariableSlot] = &places[range[0] as usize..range[1] as usize];
            for (k, a) in own.iter().enumerate() {
                let free = own[..k].iter().filter(|b| a.block != FIXED && b.block != FIXED);
                pairs.extend(free.map(|b| (a.block, b.block)));
            }
        }
        let matrix = BlockMatrix::ordered(&dims, &pairs, ordering);
        let (mut pairs, mut slot_starts) = (Vec::with_capacity(3 * factors), Vec::with_capacity(factors));
        for range in starts.windows(2) {
            slot_starts.push(pairs.len() as u32);
            let own = &places[range[0] as usize..range[1] as usize];
            for (k, a) in own.iter().enumerate() {
                pairs.extend(own[..=k].iter().map(|b| (a.block, b.block)));
            }
        }
        let slots = matrix.slots(pairs.into_iter());
        Ok(Self { variables, matrix, places, starts, slots, slot_starts, batch: Vec::new(), reused: false })
    }

    fn places(&self, f: usize) -> &[VariableSlot] {
        &self.places[self.starts[f] as usize..self.starts[f + 1] as usize]
    }

    fn size(&self, f: usize) -> usize {
        self.places(f).iter().map(|p| p.dof as usize).sum()
    }

    /// Fills matrix and right-hand side at `values`; returns the cost. The sums are formed in the order of the
    /// factors whether or not the terms are computed in parallel.
    pub(crate) fn linearise(
        &mut self,
        graph: &Graph,
        values: &Values,
        parallel: bool,
    ) -> Result<f64, GraphError> {
        self.matrix.rhs.fill(0.0);
        let mut total = Sum::default();
        let factors = graph.entries();
        if !parallel {
            let mut normal = Normal::default();
            for (f, entry) in factors.iter().enumerate() {
                normal.resize(self.size(f));
                let loss = graph.loss_at(entry, entry.factor.normal_equations(values, &mut normal)?);
                total.add(loss.cost);
                self.scatter(f, loss.weight, &normal);
            }
            return Ok(total.value());
        }
        let mut batch = std::mem::take(&mut self.batch);
        batch.resize_with(BATCH.min(factors.len()), Default::default);
        for (b, chunk) in factors.chunks(BATCH).enumerate() {
            let first = b * BATCH;
            let this = &*self;
            batch.par_iter_mut().with_min_len(64).zip(chunk.par_iter()).enumerate().try_for_each(
                |(k, ((cost, weight, normal), entry))| {
                    normal.resize(this.size(first + k));
                    let loss = graph.loss_at(entry, entry.factor.normal_equations(values, normal)?);
                    (*cost, *weight) = (loss.cost, loss.weight);
                    Ok::<(), GraphError>(())
                },
            )?;
            for (k, (cost, weight, normal)) in batch[..chunk.len()].iter().enumerate() {
                total.add(*cost);
                self.scatter(first + k, *weight, normal);
            }
        }
        self.batch = batch;
        Ok(total.value())
    }

    /// Adds one factor's share.
    #[inline]
    fn scatter(&mut self, f: usize, weight: f64, normal: &Normal) {
        if let [a, b] = self.places(f)
            && let Some(share) = normal.chunks().filter(|_| a.dof == 6)
            && let Some(blocks) = self.slots[self.slot_starts[f] as usize..].first_chunk()
        {
            let start = |p: &VariableSlot| (p.block != FIXED).then(|| self.matrix.range(p.block).start);
            let slots = PairSlots { blocks: *blocks, rhs: [start(a), start(b)] };
            self.matrix.add_pair(share, weight, &slots);
            return;
        }
        let n = normal.size();
        let (from, to) = (self.starts[f] as usize, self.starts[f + 1] as usize);
        let mut slot = self.slot_starts[f] as usize;
        let mut row = 0;
        for k in from..to {
            let a = self.places[k];
            let mut column = 0;
            for l in from..=k {
                let b = self.places[l];
                if let Some(slot) = self.slots[slot] {
                    let local = &normal.h()[column * n + row..];
                    self.matrix.add(slot, weight, local, n, (a.dof as usize, b.dof as usize));
                }
                slot += 1;
                column += b.dof as usize;
            }
            if a.block != FIXED {
                self.matrix.add_rhs(a.block, -weight, &normal.g()[row..row + a.dof as usize]);
            }
            row += a.dof as usize;
        }
    }

    /// Time of a factorisation in units of everything else in an iteration, by a rough model (nanoseconds on one core
    /// of a Zen 3) of counts alone: decisions must not depend on the clock.
    pub(crate) fn factorisation_in_steps(&self) -> f64 {
        let scalars = self.matrix.factor_len() as f64;
        let factors = (self.starts.len() - 1) as f64;
        (0.09 * self.matrix.factor_multiplications() + 2.5 * scalars) / (1.4 * scalars + 350.0 * factors)
    }

    /// Writes `x ⊞ δ` of all free variables into `out`, δ in elimination order.
    pub(crate) fn retract(&self, values: &Values, delta: &[f64], out: &mut Values) -> Result<(), GraphError> {
        for (block, &id) in self.variables.iter().enumerate() {
            let moved: Value = values.value(id)?.retract(&delta[self.matrix.range(block as u32)]);
            out.put(id, moved);
        }
        Ok(())
    }
}

/// A sum in chunks of fixed length, the same however the terms were computed.
#[derive(Default)]
struct Sum {
    chunk: f64,
    count: usize,
    total: f64,
}

const CHUNK: usize = 256;

impl Sum {
    #[inline]
    fn add(&mut self, x: f64) {
        self.chunk += x;
        self.count += 1;
        if self.count == CHUNK {
            self.total += self.chunk;
            (self.chunk, self.count) = (0.0, 0);
        }
    }
    fn value(self) -> f64 {
        self.total + self.chunk
    }
}

/// `Σ ρ(rᵀ Ω r)` at `values`, the same bits as from [`Problem::linearise`]'s order of summation.
pub(crate) fn cost(graph: &Graph, values: &Values, parallel: bool) -> Result<f64, GraphError> {
    let factors = graph.entries();
    let one = |entry: &Entry| Ok(graph.loss_at(entry, entry.factor.squared_norm(values)?).cost);
    let chunk_cost =
        |chunk: &[Entry]| chunk.iter().try_fold(0.0, |sum, e| Ok::<f64, GraphError>(sum + one(e)?));
    if !parallel {
        let mut total = 0.0;
        for chunk in factors.chunks(CHUNK) {
            total += chunk_cost(chunk)?;
        }
        return Ok(total);
    }
    let chunks: Result<Vec<f64>, GraphError> = factors.par_chunks(CHUNK).map(chunk_cost).collect();
    Ok(chunks?.iter().sum())
}

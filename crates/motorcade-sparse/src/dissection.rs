//! Nested dissection: a graph is cut in two by a small separator, the halves again, and separators are eliminated last.
//!
//! George, *Nested dissection of a regular finite element mesh*, SIAM J. Numer. Anal. 10 (1973). The cut: the
//! levels of a breadth-first search from an outer node give two shores with a band between them, and maximum flow
//! through the band (unit capacity a node) the least separator in it. Ties are broken by position only, so the order is reproducible.

use crate::amd;

/// The halves of a node: entry and exit of the flow.
const IN: usize = 0;
const OUT: usize = 1;
const NONE: u32 = u32::MAX;
/// The source or sink of a flow, in place of a neighbour.
const SHORE: u32 = u32::MAX - 1;
/// Rules by which a graph is cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuts {
    /// Parts up to this size are ordered by minimum degree.
    leaf: usize,
    /// A node next to more than this share of its part joins the separator, for no cut avoids it: a scale or a landmark of many frames. Each of
    /// these shares is tried.
    hub_shares: &'static [f64],
    /// Shares of the nodes on either shore before the flow, each of which is tried. The wider the band between the shores, the smaller the separator
    /// may be, and the less even the halves.
    shore_shares: &'static [f64],
}

impl Cuts {
    /// For least work.
    pub(crate) const FEW: Self = Self { leaf: 150, hub_shares: &[1.0], shore_shares: &[0.27] };
    /// For short paths to the root.
    pub(crate) const MANY: Self =
        Self { leaf: 12, hub_shares: &[0.25, 0.1, 0.04], shore_shares: &[0.15, 0.27, 0.4] };
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Outside,
    Near,
    Band,
    Far,
}

/// Near shore, far shore and separator of a part.
struct Cut {
    parts: [Vec<u32>; 3],
    /// Nodes of the separator for each node of the halves (the ratio cut).
    cost: f64,
}

impl Cut {
    fn of(parts: [Vec<u32>; 3]) -> Self {
        let [near, far, separator] = parts.each_ref().map(|nodes| nodes.len() as f64);
        Self { parts, cost: separator * (1.0 / near + 1.0 / far) }
    }

    /// True of a separator that is small for what it separates.
    fn is_good(&self) -> bool {
        let [near, far, separator] = self.parts.each_ref().map(Vec::len);
        3 * separator < near + far && 5 * near.min(far) > separator
    }
}

struct Dissection<'a> {
    adjacency: &'a [Vec<u32>],
    cuts: Cuts,
    side: Vec<Side>,
    level: Vec<u32>,
    /// Neighbours of a node on the path of the flow through it.
    before: Vec<u32>,
    after: Vec<u32>,
    /// Predecessor in the search, for both halves (in, out) of every node.
    from: Vec<[u32; 2]>,
    order: Vec<u32>,
}

/// Elimination order of the pattern; see [`amd::order`].
pub(crate) fn order(adjacency: &[Vec<u32>], cuts: Cuts) -> Vec<u32> {
    let n = adjacency.len();
    let mut work = Dissection {
        adjacency,
        cuts,
        side: vec![Side::Outside; n],
        level: vec![NONE; n],
        before: vec![NONE; n],
        after: vec![NONE; n],
        from: vec![[NONE; 2]; n],
        order: Vec::with_capacity(n),
    };
    work.dissect((0..n as u32).collect());
    work.order
}

impl Dissection<'_> {
    fn dissect(&mut self, part: Vec<u32>) {
        let cut = if part.len() > self.cuts.leaf { self.cut_beside_hubs(&part) } else { None };
        match cut {
            Some([near, far, separator]) => {
                self.dissect(near);
                self.dissect(far);
                self.order.extend(separator);
            }
            None => self.leaf(&part),
        }
    }

    fn leaf(&mut self, part: &[u32]) {
        for (k, &i) in part.iter().enumerate() {
            self.level[i as usize] = k as u32;
        }
        let inside = |i: u32| part.get(self.level[i as usize] as usize) == Some(&i);
        let near = |i: u32| self.adjacency[i as usize].iter().filter(|&&j| inside(j));
        let local = part.iter().map(|&i| near(i).map(|&j| self.level[j as usize]).collect()).collect();
        self.order.extend(amd::order(local).into_iter().map(|k| part[k as usize]));
    }

    /// Near shore, far shore and separator of a part, its hubs in the separator; `None` where there is no good cut.
    fn cut_beside_hubs(&mut self, part: &[u32]) -> Option<[Vec<u32>; 3]> {
        for &i in part {
            self.side[i as usize] = Side::Band;
        }
        let inside = |j: &&u32| self.side[**j as usize] == Side::Band;
        let degree = |i: &u32| self.adjacency[*i as usize].iter().filter(inside).count() as f64;
        let degrees: Vec<f64> = part.iter().map(degree).collect();
        for &i in part {
            self.side[i as usize] = Side::Outside;
        }
        let mut best: Option<Cut> = None;
        let mut tried = None;
        for share in self.cuts.hub_shares {
            let most = share * part.len() as f64;
            let (hubs, rest): (Vec<_>, Vec<_>) = part.iter().zip(&degrees).partition(|(_, d)| **d > most);
            if tried.replace(hubs.len()) == Some(hubs.len()) {
                continue;
            }
            let rest: Vec<u32> = rest.into_iter().map(|(i, _)| *i).collect();
            let Some([near, far, mut separator]) = self.cut(&rest) else { continue };
            separator.extend(hubs.into_iter().map(|(i, _)| *i));
            let cut = Cut::of([near, far, separator]);
            if best.as_ref().is_none_or(|best| cut.cost < best.cost) {
                best = Some(cut);
            }
        }
        best.map(|cut| cut.parts)
    }

    /// Near shore, far shore and separator of a part; `None` where there is no good one.
    fn cut(&mut self, part: &[u32]) -> Option<[Vec<u32>; 3]> {
        for &i in part {
            self.side[i as usize] = Side::Band;
        }
        let mut reached = self.levels(part, *part.first()?);
        for _ in 0..2 {
            reached = self.levels(part, *reached.last()?);
        }
        let result = if reached.len() < part.len() {
            let rest = part.iter().copied().filter(|&i| self.level[i as usize] == NONE).collect();
            Some(Cut::of([reached, rest, Vec::new()]))
        } else {
            let shares = self.cuts.shore_shares.iter();
            let cuts = shares.filter_map(|share| Some(Cut::of(self.separate(&reached, *share)?)));
            cuts.filter(Cut::is_good).min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        for &i in part {
            self.side[i as usize] = Side::Outside;
        }
        result.filter(Cut::is_good).map(|cut| cut.parts)
    }

    /// Nodes of the part in the order of a breadth-first search; fills their levels.
    fn levels(&mut self, part: &[u32], start: u32) -> Vec<u32> {
        for &i in part {
            self.level[i as usize] = NONE;
        }
        self.level[start as usize] = 0;
        let mut queue = vec![start];
        let mut at = 0;
        while let Some(&i) = queue.get(at) {
            at += 1;
            for &j in &self.adjacency[i as usize] {
                if self.side[j as usize] != Side::Outside && self.level[j as usize] == NONE {
                    self.level[j as usize] = self.level[i as usize] + 1;
                    queue.push(j);
                }
            }
        }
        queue
    }

    fn separate(&mut self, by_level: &[u32], shore_share: f64) -> Option<[Vec<u32>; 3]> {
        let share = (shore_share * by_level.len() as f64) as usize;
        let level = |k: usize| by_level.get(k).map(|&i| self.level[i as usize]);
        let (first, last) = (level(share)?, level(by_level.len() - 1 - share)?);
        for &i in by_level {
            let l = self.level[i as usize];
            self.side[i as usize] = match l {
                _ if l < first => Side::Near,
                _ if l > last => Side::Far,
                _ => Side::Band,
            };
            (self.before[i as usize], self.after[i as usize]) = (NONE, NONE);
        }
        let band: Vec<u32> =
            by_level.iter().copied().filter(|&i| self.side[i as usize] == Side::Band).collect();
        while self.more_flow(&band) {}
        // Of the last searches, which did not reach the far shore: the cut runs through the nodes half reached.
        let (mut near, mut far, mut separator) = (Vec::new(), Vec::new(), Vec::new());
        for &i in by_level {
            let (inward, outward) = (self.from[i as usize][IN], self.from[i as usize][OUT]);
            match self.side[i as usize] {
                Side::Near => near.push(i),
                Side::Band if outward != NONE => near.push(i),
                Side::Band if inward != NONE => separator.push(i),
                _ => far.push(i),
            }
        }
        Some([near, far, separator])
    }

    /// Sends more flow, by searches that share what they have visited; false when there is no more.
    fn more_flow(&mut self, band: &[u32]) -> bool {
        for &i in band {
            self.from[i as usize] = [NONE; 2];
        }
        let mut more = false;
        for &i in band {
            let shore = self.adjacency[i as usize].iter().any(|&j| self.side[j as usize] == Side::Near);
            if shore && self.from[i as usize][IN] == NONE {
                self.from[i as usize][IN] = SHORE;
                if let Some(end) = self.search(i) {
                    self.augment(end);
                    more = true;
                }
            }
        }
        more
    }

    /// Depth-first search for one more path from `start`, far levels first; returns its last node.
    fn search(&mut self, start: u32) -> Option<u32> {
        let mut stack = vec![(start, IN)];
        while let Some((i, half)) = stack.pop() {
            let (i_, used) = (i as usize, self.before[i as usize] != NONE);
            if half == IN {
                // Through a free node, or back along the path that came in.
                let (next, way) = if used { (self.before[i_], i) } else { (i, i) };
                if next != SHORE && self.from[next as usize][OUT] == NONE {
                    self.from[next as usize][OUT] = way;
                    stack.push((next, OUT));
                }
                continue;
            }
            if used && self.from[i_][IN] == NONE {
                self.from[i_][IN] = i;
                stack.push((i, IN));
            }
            for forward in [false, true] {
                for &j in &self.adjacency[i_] {
                    match self.side[j as usize] {
                        Side::Far if self.after[i_] != SHORE => return Some(i),
                        Side::Band
                            if (self.level[j as usize] > self.level[i_]) == forward
                                && self.after[i_] != j
                                && self.from[j as usize][IN] == NONE =>
                        {
                            self.from[j as usize][IN] = i;
                            stack.push((j, IN));
                        }
                        _ => {}
                    }
                }
            }
        }
        None
    }

    /// Adds the path found: what it runs against is taken away first.
    fn augment(&mut self, end: u32) {
        let (mut added, mut removed) = (vec![(end, SHORE)], Vec::new());
        let (mut at, mut out) = (end, true);
        while at != SHORE {
            let from = self.from[at as usize][usize::from(out)];
            if out {
                // Came through the node itself, or back from its successor.
                if from != at {
                    removed.push((at, from));
                }
                (at, out) = (from, false);
            } else if from == at {
                out = true; // back through the node
            } else {
                added.push((from, at));
                (at, out) = (from, true);
            }
        }
        for (i, j) in removed {
            (self.after[i as usize], self.before[j as usize]) = (NONE, NONE);
        }
        for (i, j) in added {
            if i != SHORE {
                self.after[i as usize] = j;
            }
            if j != SHORE {
                self.before[j as usize] = i;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of `side` × `long` nodes with diagonals in every cell.
    fn grid(side: i32, long: i32) -> Vec<Vec<u32>> {
        let near = |k: i32| {
            let (x, y) = (k % side, k / side);
            let all = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            let inside = all.filter(|&(a, b)| (0..side).contains(&a) && (0..long).contains(&b));
            inside.map(|(a, b)| (b * side + a) as u32).filter(|&j| j != k as u32).collect()
        };
        (0..side * long).map(near).collect()
    }

    #[test]
    fn halves_of_a_grid_are_separate_and_the_cut_is_least() {
        let graph = grid(16, 100);
        let part: Vec<u32> = (0..1600).collect();
        let n = graph.len();
        let mut work = Dissection {
            adjacency: &graph,
            cuts: Cuts::FEW,
            side: vec![Side::Outside; n],
            level: vec![NONE; n],
            before: vec![NONE; n],
            after: vec![NONE; n],
            from: vec![[NONE; 2]; n],
            order: Vec::new(),
        };
        let [near, far, separator] = work.cut(&part).unwrap();
        assert_eq!(near.len() + far.len() + separator.len(), n);
        assert_eq!(separator.len(), 16);
        assert!(near.iter().all(|&i| graph[i as usize].iter().all(|j| !far.contains(j))));
        assert!(near.len().min(far.len()) >= 300);
    }

    #[test]
    fn order_is_a_permutation() {
        let mut graph = grid(25, 25);
        let more = graph.clone(); // a second component
        graph.extend(more.into_iter().map(|near| near.into_iter().map(|j| j + 625).collect()));
        let mut order = order(&graph, Cuts::FEW);
        order.sort_unstable();
        assert!(order.iter().enumerate().all(|(k, &i)| k == i as usize) && order.len() == 1250);
    }

    /// A chain of 400, and so many variables beside it, each next to every `step`-th node.
    fn beside_a_chain(hubs: u32, step: u32) -> Vec<Vec<u32>> {
        let n = 400_u32;
        let next_to = |hub: u32, k: u32| (k + hub).is_multiple_of(step);
        let near = |k: u32| {
            let along = [k.checked_sub(1), (k + 1 < n).then_some(k + 1)].into_iter().flatten();
            along.chain((0..hubs).filter(|h| next_to(*h, k)).map(|h| n + h)).collect()
        };
        let of_hub = |h: u32| (0..n).filter(|k| next_to(h, *k)).collect();
        (0..n).map(near).chain((0..hubs).map(of_hub)).collect()
    }

    #[test]
    fn hubs_join_the_separator() {
        // Of five hubs each is next to a fifth of the chain: no cut of the first share of neighbours.
        for (hubs, step) in [(2, 1), (5, 5)] {
            let order = order(&beside_a_chain(hubs, step), Cuts::MANY);
            let last = &order[order.len() - hubs as usize - 1..];
            assert!((400..400 + hubs).all(|hub| last.contains(&hub)), "{last:?}");
            let middle = last.iter().find(|k| **k < 400).unwrap();
            assert!((100..300).contains(middle), "the chain is cut at {middle}");
        }
    }
}

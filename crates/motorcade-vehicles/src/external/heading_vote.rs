//! Vote of a track's frames on which end of the vehicle is its front.

use nalgebra::Vector3;

use crate::options::KeypointViewOptions;

/// The heading of one view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vote {
    /// Forward direction, camera frame.
    pub forward: Vector3<f64>,
    /// Cost of the opposite heading over that of this one, at least 0.
    pub margin: f64,
}

/// Result of a vote.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Verdict {
    /// True for views that are to be turned.
    pub turned: Vec<bool>,
    /// Cost by which the best headings beat those with the first view turned.
    pub margin: f64,
}

/// The cheapest choice of a heading for every view: each as it is or turned, changes between neighbours at a cost.
pub(super) fn vote(votes: &[Vote], options: &KeypointViewOptions) -> Verdict {
    let Some(last) = votes.len().checked_sub(1) else {
        return Verdict { turned: Vec::new(), margin: 0.0 };
    };
    let own = |k: usize, turned: usize| turned as f64 * votes[k].margin.min(options.most_heading_margin);
    // Cost of headings that point the same way or not, by the states of the views before and after.
    let change = |k: usize, before: usize, after: usize| {
        let apart = votes[k - 1].forward.dot(&votes[k].forward) < 0.0;
        if apart != (before != after) { options.turn_cost } else { 0.0 }
    };
    // Least cost from a view to the end, by its state, and the state after it.
    let mut costs = [own(last, 0), own(last, 1)];
    let mut next = vec![[0, 0]; votes.len()];
    for k in (0..last).rev() {
        let through = |state: usize, after: usize| change(k + 1, state, after) + costs[after];
        next[k] = [0, 1].map(|state| usize::from(through(state, 1) < through(state, 0)));
        costs = [0, 1].map(|state| own(k, state) + through(state, next[k][state]));
    }
    let mut state = usize::from(costs[1] < costs[0]);
    let margin = (costs[1] - costs[0]).abs();
    let mut turned = Vec::with_capacity(votes.len());
    for choices in &next {
        turned.push(state == 1);
        state = choices[state];
    }
    Verdict { turned, margin }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vote(votes: &[Vote]) -> Verdict {
        super::vote(votes, &KeypointViewOptions::default())
    }

    fn ahead(sign: f64, margin: f64) -> Vote {
        Vote { forward: Vector3::new(0.1, 0.0, sign), margin }
    }

    #[test]
    fn a_few_reversed_views_are_turned_by_the_others() {
        let votes = [1.0, 1.0, -1.0, 1.0, -1.0, 1.0].map(|s| ahead(s, 5.0));
        let verdict = vote(&votes);
        assert_eq!(verdict.turned, [false, false, true, false, true, false]);
        assert!(verdict.margin > 9.0, "{}", verdict.margin);
    }

    #[test]
    fn certain_views_outvote_many_doubtful_ones() {
        let mut votes = vec![ahead(-1.0, 0.5); 6];
        votes.extend([ahead(1.0, 50.0), ahead(1.0, 50.0)]);
        assert_eq!(vote(&votes).turned, [[true; 6].as_slice(), &[false; 2]].concat());
    }

    #[test]
    fn a_vehicle_that_turns_slowly_is_left_alone() {
        let votes: Vec<Vote> = (0..20)
            .map(|k| {
                let angle = 0.15 * f64::from(k);
                Vote { forward: Vector3::new(angle.sin(), 0.0, angle.cos()), margin: 3.0 }
            })
            .collect();
        assert!(vote(&votes).turned.iter().all(|t| !t));
    }

    #[test]
    fn nothing_to_vote_on() {
        assert_eq!(vote(&[]), Verdict { turned: Vec::new(), margin: 0.0 });
        let one = vote(&[ahead(1.0, 2.0)]);
        assert!(!one.turned[0] && (one.margin - 2.0).abs() < 1e-12);
    }
}

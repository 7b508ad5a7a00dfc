//! Agreement of matches along the way.

use std::ops::Index;

use crate::keyframe::PlacedKeyframe;
use crate::options::SequenceOptions;
use crate::verification::PlaceMatch;

/// The matches that enough others agree with: driven on by odometry, they say the same of the two visits.
pub(crate) fn supported<K: Index<usize, Output = PlacedKeyframe>>(
    keyframes: &K,
    matches: Vec<PlaceMatch>,
    options: &SequenceOptions,
) -> Vec<PlaceMatch> {
    let support = |m: &PlaceMatch| {
        let way = keyframes[m.query].way_m;
        // Matches come in order of their queries.
        let from = matches.partition_point(|o| keyframes[o.query].way_m < way - options.reach_m);
        let near = matches[from..].iter().take_while(|o| keyframes[o.query].way_m <= way + options.reach_m);
        near.filter(|o| o.query != m.query && agree(keyframes, m, o, options)).count()
    };
    let enough: Vec<bool> = matches.iter().map(|m| support(m) >= options.least_support).collect();
    let kept: Vec<PlaceMatch> =
        matches.into_iter().zip(enough).filter(|(_, enough)| *enough).map(|(m, _)| m).collect();
    let long = long_enough(keyframes, &kept, options);
    kept.into_iter().zip(long).filter(|(_, long)| *long).map(|(m, _)| m).collect()
}

/// False for matches between two maps that agree over a short way only, unless several are sure: no odometry connects the maps, and some houses stand
/// twice, but seldom all that is in view.
fn long_enough<K: Index<usize, Output = PlacedKeyframe>>(
    keyframes: &K,
    matches: &[PlaceMatch],
    options: &SequenceOptions,
) -> Vec<bool> {
    let between = |m: &PlaceMatch| keyframes[m.query].segment != keyframes[m.candidate].segment;
    let way_m = |k: usize| keyframes[matches[k].query].way_m;
    let mut out = vec![true; matches.len()];
    let over: Vec<usize> = (0..matches.len()).filter(|k| between(&matches[*k])).collect();
    let goes_on = |a: &usize, b: &usize| {
        way_m(*b) - way_m(*a) <= options.reach_m && agree(keyframes, &matches[*a], &matches[*b], options)
    };
    for run in over.chunk_by(goes_on) {
        let [first, last] = [run.first(), run.last()].map(|k| k.map_or(0.0, |k| way_m(*k)));
        let sure = run.iter().filter(|k| matches[**k].share >= options.sure_share).count();
        if last - first < options.least_join_m && sure < options.sure_matches {
            run.iter().for_each(|k| out[*k] = false);
        }
    }
    out
}

fn agree<K: Index<usize, Output = PlacedKeyframe>>(
    keyframes: &K,
    a: &PlaceMatch,
    b: &PlaceMatch,
    options: &SequenceOptions,
) -> bool {
    let [q, c, r, d] = [a.query, a.candidate, b.query, b.candidate].map(|k| &keyframes[k]);
    if q.segment != r.segment || c.segment != d.segment {
        return false;
    }
    let step =
        |to: &PlacedKeyframe, from: &PlacedKeyframe| to.world_from_camera.inverse() * from.world_from_camera;
    let expected = step(r, q) * a.query_from_candidate * step(c, d);
    let apart = expected.inverse() * b.query_from_candidate;
    let driven = (q.way_m - r.way_m).abs() + (c.way_m - d.way_m).abs();
    apart.translation().norm() <= options.most_shift_m + options.most_shift_share * driven
        && apart.rotation().angle() <= options.most_turn_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::HiddenParts;
    use motorcade_geometry::Pose;
    use nalgebra::{Matrix6, Vector6};

    /// Two visits of a straight street, 2 m a keyframe, the second 0.5 m to the right.
    fn keyframes() -> Vec<PlacedKeyframe> {
        let at = |k: usize| {
            let (visit, step) = (k / 20, (k % 20) as f64);
            let pose = Vector6::new(0.0, 0.0, 0.0, 0.5 * visit as f64, 0.0, 2.0 * step);
            PlacedKeyframe {
                frame: k,
                segment: 0,
                world_from_camera: Pose::exp(&pose),
                covariance: Matrix6::zeros(),
                way_m: 2.0 * step + 300.0 * visit as f64,
                features: Vec::new(),
                landmarks: Vec::new(),
                hidden: HiddenParts::default(),
            }
        };
        (0..40).map(at).collect()
    }

    fn found(query: usize, candidate: usize, ahead_m: f64) -> PlaceMatch {
        let query_from_candidate = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, -0.5, 0.0, -ahead_m));
        let covariance = Matrix6::identity();
        PlaceMatch {
            query,
            candidate,
            query_from_candidate,
            covariance,
            inliers: 50,
            share: 0.6,
            rms_px: 1.0,
        }
    }

    #[test]
    fn matches_that_agree_stay_and_those_alone_go() {
        let matches = vec![
            found(22, 2, 0.0),
            found(23, 4, -2.0),
            found(24, 9, 0.0),
            found(25, 5, 0.1),
            found(38, 18, 0.0),
        ];
        let kept = supported(&keyframes(), matches, &SequenceOptions::default());
        // The third is 10 m off, the last one alone within its reach but for one.
        assert_eq!(kept.iter().map(|m| m.query).collect::<Vec<_>>(), [22, 23, 25]);
    }

    #[test]
    fn maps_are_joined_over_a_long_way_or_by_sure_matches() {
        let mut frames = keyframes();
        frames[20..].iter_mut().for_each(|k| k.segment = 1);
        let options = SequenceOptions { least_join_m: 20.0, ..SequenceOptions::default() };
        let some = |count: usize, share: f64| {
            let all = (22..22 + count).map(|q| PlaceMatch { share, ..found(q, q - 20, 0.0) });
            supported(&frames, all.collect(), &options).len()
        };
        assert_eq!([some(10, 0.5), some(12, 0.5), some(3, 0.7)], [0, 12, 3]);
        // Two sure ones, and another one that agrees.
        let mut three: Vec<PlaceMatch> =
            (22..25).map(|q| PlaceMatch { share: 0.7, ..found(q, q - 20, 0.0) }).collect();
        three[1].share = 0.5;
        assert!(supported(&frames, three, &options).is_empty());
    }

    #[test]
    fn other_maps_give_no_support() {
        let mut frames = keyframes();
        frames[23].segment = 1;
        let matches = vec![found(22, 2, 0.0), found(23, 3, 0.0), found(24, 4, 0.0)];
        assert!(supported(&frames, matches, &SequenceOptions::default()).is_empty());
    }
}

//! Settings of place recognition.

use serde::{Deserialize, Serialize};

/// Corners and descriptors of a keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureOptions {
    /// Most features of a keyframe; 44 bytes each. More find places from farther aside and cost memory and time in proportion.
    pub count: usize,
    /// Levels of the pyramid; each further one covers places seen from `level_scale` times nearer or farther.
    pub levels: usize,
    /// Scale from level to level. FAST corners repeat over a change of scale by a quarter (Rosten et al., PAMI 2010).
    pub level_scale: f64,
    /// Least contrast of a corner \[grey levels\]: above the noise of a sensor and of a video codec.
    pub threshold: u8,
}

impl Default for FeatureOptions {
    fn default() -> Self {
        Self { count: 320, levels: 4, level_scale: 1.3, threshold: 10 }
    }
}

/// Positions of a keyframe's features, from neighbouring keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LandmarkOptions {
    /// Neighbouring keyframes on each side that a feature is looked for in.
    pub neighbours: usize,
    /// Largest Hamming distance of two views of a feature (of 256 bits): views of the same corner from neighbouring keyframes differ by 10
    /// to 40, others by 128 ± 8.
    pub most_distance: u32,
    /// The best view near the epipolar line must be this much nearer than the second best.
    pub ratio: f64,
    /// Largest distance from the epipolar line, and of the reprojected point \[px of the feature's level\].
    pub most_error_px: f64,
    /// Standard deviation of a feature's pixel \[px of its level\]: FAST corners are found to whole pixels.
    pub sigma_px: f64,
    /// Largest standard deviation of a landmark's depth as a share of the depth; others have no position.
    pub most_depth_sigma: f64,
}

impl Default for LandmarkOptions {
    fn default() -> Self {
        Self {
            neighbours: 2,
            most_distance: 50,
            ratio: 0.8,
            most_error_px: 2.0,
            sigma_px: 0.7,
            most_depth_sigma: 0.15,
        }
    }
}

/// Search for keyframes that look alike.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SearchOptions {
    /// Hash tables; each holds every landmark once (8 bytes). More find more of the features that changed.
    pub tables: usize,
    /// Bits of the descriptor in the key of a table. Two views that differ in 30 of 256 bits share a key of 16 with 13 %; 8 tables find 67 %.
    pub key_bits: usize,
    /// Largest Hamming distance of a vote.
    pub most_distance: u32,
    /// Landmarks with the same key beyond which it says nothing of a place, as words that stand in every text.
    pub most_alike: usize,
    /// Way driven since a visit before the next one counts as another \[m\]. Shorter ones add nothing to odometry.
    pub least_way_m: f64,
    /// Candidates that are verified by geometry.
    pub candidates: usize,
    /// Least score of a candidate, as a share of that of a query whose every landmark votes for it alone.
    pub least_score: f64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            tables: 8,
            key_bits: 16,
            most_distance: 44,
            most_alike: 200,
            least_way_m: 40.0,
            candidates: 4,
            least_score: 0.02,
        }
    }
}

/// Geometric verification of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VerificationOptions {
    /// Largest Hamming distance of matched features of two visits.
    pub most_distance: u32,
    /// The best match must be this much nearer than the second best.
    pub ratio: f64,
    /// Largest difference of orientation of matched features \[rad\]: cars do not roll.
    pub most_turn_rad: f64,
    /// Reprojection error beyond which a match is an outlier \[px of the feature's level\].
    pub inlier_px: f64,
    /// Samples drawn at most.
    pub most_samples: usize,
    /// Least matched landmarks that agree with the pose.
    pub least_inliers: usize,
    /// Least share of the landmarks in view that agree with it. Houses that stand twice bring a part of the view only (30 % on rendered
    /// twins, true visits 41 to 97 %); higher loses visits in other light.
    pub least_share: f64,
    /// Least standard deviation of the inliers' pixels along the image's width, as a share of it: one house on one side is not a place.
    pub least_spread: f64,
    /// Largest rotation between two visits \[rad\]: the opposite direction is another place.
    pub most_rotation_rad: f64,
    /// Largest distance between two visits \[camera-to-landmark median depths\]: beyond, positions of landmarks are extrapolated.
    pub most_shift_depths: f64,
    /// Levels of the pyramid that two views of a feature may be apart: a factor of 1.7 in distance at the default `level_scale`. Chosen, not measured:
    /// more find places from farther away, and more wrong matches.
    pub most_levels: u8,
    /// Distance from the edge of the picture below which a landmark does not count as in view \[px\]: features have no descriptor there (18 px of their
    /// level). Chosen between those of the finest and the coarsest level: a smaller one expects features where there can be none.
    pub margin_px: f64,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for VerificationOptions {
    fn default() -> Self {
        Self {
            most_distance: 60,
            ratio: 0.9,
            most_turn_rad: 0.5,
            inlier_px: 3.0,
            most_samples: 300,
            least_inliers: 20,
            least_share: 0.35,
            least_spread: 0.15,
            most_rotation_rad: 0.7,
            most_shift_depths: 0.7,
            most_levels: 2,
            margin_px: 20.0,
            seed: 1,
        }
    }
}

/// Agreement of matches with each other along the way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SequenceOptions {
    /// Other matches, within `reach_m`, that must say the same of the two visits. One wrong match is chance, three in a row are a street that
    /// looks the same.
    pub least_support: usize,
    /// Way driven within which matches support each other \[m\].
    pub reach_m: f64,
    /// Way over which matches between two maps must agree, one after another \[m\]: odometry does not connect the maps. 28 m of houses that
    /// stand twice on both sides look the same in five of eight keyframes. Larger joins fewer maps.
    pub least_join_m: f64,
    /// Share of the landmarks in view from which on a match counts as sure. Of rendered houses that stand twice on both sides (18 drives, from every start) the
    /// third best match reaches 0.64, of true visits 0.68 and more in three quarters of the starts. Larger joins maps later.
    pub sure_share: f64,
    /// Sure matches that agree, one after another, and join two maps over a shorter way. Fewer join maps on the word of a house that stands twice.
    pub sure_matches: usize,
    /// Disagreement of positions that is none \[m\].
    pub most_shift_m: f64,
    /// More of it for each metre driven between the two matches on both visits.
    pub most_shift_share: f64,
    /// Disagreement of orientations that is none \[rad\].
    pub most_turn_rad: f64,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            least_support: 2,
            reach_m: 25.0,
            least_join_m: 40.0,
            sure_share: 0.67,
            sure_matches: 3,
            most_shift_m: 0.5,
            most_shift_share: 0.03,
            most_turn_rad: 0.03,
        }
    }
}

/// Settings of place recognition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlaceOptions {
    /// Corners and descriptors.
    pub features: FeatureOptions,
    /// Positions of features, search, verification and agreement of matches.
    pub advanced: AdvancedPlaceOptions,
}

/// Positions of features, search, verification and agreement of matches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedPlaceOptions {
    /// Positions of features.
    pub landmarks: LandmarkOptions,
    /// Search for keyframes that look alike.
    pub search: SearchOptions,
    /// Verification by geometry.
    pub verification: VerificationOptions,
    /// Agreement of matches along the way.
    pub sequence: SequenceOptions,
}

impl PlaceOptions {
    /// The first setting out of its range, with what it must be.
    ///
    /// # Errors
    /// Name and range of that setting.
    pub fn validate(&self) -> Result<(), String> {
        let AdvancedPlaceOptions { landmarks, search, verification, sequence } = &self.advanced;
        let features = &self.features;
        let positive = |name: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(format!("places.{name} must be positive"))
            }
        };
        let within = |name: &str, value: usize, least: usize, most: usize| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(format!("places.{name} must lie between {least} and {most}"))
            }
        };
        within("features.count", features.count, 50, 5000)?;
        within("features.levels", features.levels, 1, 8)?;
        if !(1.05..=2.0).contains(&features.level_scale) {
            return Err("places.features.level_scale must lie between 1.05 and 2".into());
        }
        within("features.threshold", usize::from(features.threshold), 1, 200)?;
        within("advanced.landmarks.neighbours", landmarks.neighbours, 1, 5)?;
        within("advanced.search.tables", search.tables, 1, 16)?;
        within("advanced.search.key_bits", search.key_bits, 8, 20)?;
        within("advanced.search.tables × advanced.search.key_bits", search.tables * search.key_bits, 8, 256)?;
        within("advanced.search.candidates", search.candidates, 1, 50)?;
        within("advanced.verification.least_inliers", verification.least_inliers, 6, 10_000)?;
        within("advanced.sequence.sure_matches", sequence.sure_matches, 1, 10_000)?;
        for (name, value) in [
            ("advanced.landmarks.most_error_px", landmarks.most_error_px),
            ("advanced.landmarks.sigma_px", landmarks.sigma_px),
            ("advanced.landmarks.most_depth_sigma", landmarks.most_depth_sigma),
            ("advanced.search.least_way_m", search.least_way_m),
            ("advanced.verification.inlier_px", verification.inlier_px),
            ("advanced.verification.most_rotation_rad", verification.most_rotation_rad),
            ("advanced.verification.most_shift_depths", verification.most_shift_depths),
            ("advanced.verification.most_turn_rad", verification.most_turn_rad),
            ("advanced.sequence.reach_m", sequence.reach_m),
            ("advanced.sequence.least_join_m", sequence.least_join_m),
            ("advanced.sequence.most_shift_m", sequence.most_shift_m),
            ("advanced.sequence.most_turn_rad", sequence.most_turn_rad),
        ] {
            positive(name, value)?;
        }
        for (name, value) in [
            ("advanced.landmarks.ratio", landmarks.ratio),
            ("advanced.verification.ratio", verification.ratio),
            ("advanced.verification.least_share", verification.least_share),
            ("advanced.verification.least_spread", verification.least_spread),
            ("advanced.sequence.sure_share", sequence.sure_share),
            ("advanced.search.least_score", search.least_score),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("places.{name} must lie between 0 and 1"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_named() {
        assert_eq!(PlaceOptions::default().validate(), Ok(()));
        let mut options = PlaceOptions::default();
        options.advanced.search.tables = 17;
        assert!(options.validate().unwrap_err().contains("search.tables"));
        options = PlaceOptions::default();
        options.advanced.verification.inlier_px = f64::NAN;
        assert!(options.validate().unwrap_err().contains("verification.inlier_px"));
    }
}

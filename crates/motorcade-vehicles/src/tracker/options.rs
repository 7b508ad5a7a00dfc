//! Options of the tracker.

/// Options of the tracker.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrackerOptions {
    /// Score from which a box may start a track.
    pub begin_score: f64,
    /// Score below which a box is ignored; scores in between may only extend a track (Zhang et al., ByteTrack, ECCV 2022).
    pub least_score: f64,
    /// Overlap (IoU) with the predicted box from which a box is assigned.
    pub least_iou: f64,
    /// Longest gap that is bridged \[s\].
    pub longest_gap_s: f64,
    /// Boxes of a track below which it is not reported, counted as at most one per correlation time of the vehicle options: four
    /// within 0.3 s at any frame rate.
    pub least_boxes: usize,
    /// Gates of the association.
    pub advanced: AdvancedTrackerOptions,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self {
            begin_score: 0.45,
            least_score: 0.15,
            least_iou: 0.25,
            longest_gap_s: 2.0,
            least_boxes: 4,
            advanced: AdvancedTrackerOptions::default(),
        }
    }
}

/// Gates of the association.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdvancedTrackerOptions {
    /// χ² of the four edges and the size of a box up to which a heading along the road explains it: 99 % quantile of χ²₄.
    pub explained_chi2: f64,
    /// Time since the last box from which a track counts as occluded rather than missed once, and may be re-identified by
    /// its position \[s\].
    pub occluded_after_s: f64,
    /// Overlap (IoU) of two boxes from which they are duplicates of one vehicle.
    pub duplicate_iou: f64,
    /// Score of a box against that of another one from which it hides edges of it. Chosen on KITTI 0005 and 0003, where 0.25 to 0.45 do as well: with 0
    /// weak boxes beside a clear one keep it from starting a track; from 0.5 on the boxes of a lorry's parts hide none of its edges, which helps it.
    pub hiding_score_ratio: f64,
    /// Gate of the re-identification by position \[χ²₃\]: 95 % quantile.
    pub reidentify_chi2: f64,
    /// Largest distance, and largest standard deviation of the predicted position, of a re-identification \[m\]: a car's length
    /// and a little; another vehicle in the same lane is further away.
    pub reidentify_m: f64,
    /// Apparent motion of a vehicle that stands, as a share of the camera's way: errors of the size or of the road's height that
    /// all its boxes share shrink with the distance. Parked cars of KITTI 0005 are placed up to a tenth too near or too far.
    pub apparent_motion_share: f64,
    /// Largest evidence for motion or standing that is kept (twice the logarithm of the likelihood ratio): vehicles stop and start.
    pub most_evidence: f64,
    /// Evidence from which one of motion and standing is excluded: 150 to 1.
    pub decisive_evidence: f64,
    /// Overlap (IoU) of a box with the predicted one of a vehicle that stands, motion being excluded, below which it is another vehicle's: the next one of
    /// a row overlaps by about a third; occluded edges are bounds. Of whole drives: online a track that is interrupted begins without its history. 0.45
    /// and 0.55 find fewer cars of KITTI 0005 and of rendered crowds within an IoU of 0.5.
    pub least_standing_overlap: f64,
    /// Largest change of the predicted box's scale between two boxes.
    pub largest_scale_change: f64,
    /// Smallest weight of a box in the vote on the class, where its score is lower: every box counts, also those of files without scores. Chosen;
    /// a larger one weighs doubtful boxes more.
    pub least_vote: f64,
}

impl Default for AdvancedTrackerOptions {
    fn default() -> Self {
        Self {
            explained_chi2: 13.3,
            occluded_after_s: 0.3,
            duplicate_iou: 0.5,
            hiding_score_ratio: 0.35,
            reidentify_chi2: 7.8,
            reidentify_m: 5.0,
            apparent_motion_share: 0.1,
            most_evidence: 12.0,
            decisive_evidence: 10.0,
            least_standing_overlap: 0.35,
            largest_scale_change: 2.0,
            least_vote: 0.01,
        }
    }
}

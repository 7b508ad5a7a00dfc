//! Options of the choice between heading hypotheses of a track.

/// Goodness of fit of a track's boxes, and when a second heading hypothesis replaces the first.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HypothesisOptions {
    /// Alternations between headings and positions at most.
    pub rounds: usize,
    /// χ² by which the second hypothesis must fit better: most traffic goes along the road.
    pub preference_chi2: f64,
    /// The boxes of a track count as at most this many independent ones in its χ².
    pub independent_views: f64,
    /// Expected χ² of the edges of one box: with position and size free few degrees of freedom remain.
    pub expected_chi2: f64,
    /// Share of a detector's votes on the class from which other classes are tried only if the boxes fit badly.
    pub agreed_class_share: f64,
    /// χ² by which another class must be more probable than the detector's: errors of the road's plane are common to all
    /// boxes of a track.
    pub class_preference_chi2: f64,
    /// Largest deviation of a size from the mean of a class other than the detector's, in standard deviations of that class: nine in ten of its
    /// vehicles. The others stay what the detector calls them. With 2 a small oncoming lorry of the renders is better explained, but a lorry of KITTI 0005
    /// becomes a bus.
    pub typical_size_sigmas: f64,
    /// Overlap (IoU) of a box with the projected vehicle below which it is another vehicle's. A neighbour in a row of parked cars
    /// overlaps by about a third; occluded and truncated edges are bounds.
    pub least_box_iou: f64,
    /// Share of the largest box's height from which boxes of a track are near: those at less than 1.7 times the least distance.
    pub near_share: f64,
    /// Height of a box from which on it is near whatever the largest one is, as an angle \[rad\]: a car at 19 m. Boxes of a
    /// vehicle that passes closely by are near over a short way only, which places it badly.
    pub near_rad: f64,
    /// Overlap (IoU) of a box with a standing vehicle below which it is another one's: a box of 15 px with an error of two overlaps by 0.6, a
    /// neighbour in a row by a third.
    pub least_standing_iou: f64,
    /// Overlap (IoU of the columns) of a box with its vehicle that speaks neither for nor against it, where boxes that are linked forwards and backwards
    /// make different vehicles. Chosen on KITTI 0005 and 0003, where 0.6 to 0.7 do as well: a neighbour in a row overlaps by about a third, and a smaller
    /// one lets boxes in doubt count for a vehicle.
    pub neutral_overlap: f64,
    /// Overlap (IoU) of a box with the projected vehicle, or with what nearer ones leave of that, below which it does not show the vehicle where it was
    /// placed. Chosen on KITTI 0005 and 0003, where boxes of vehicles overlap by 0.6 to 0.9 and those of clutter by 0.1 to 0.45. A larger one takes
    /// vehicles behind hedges and poles for clutter.
    pub least_visible_iou: f64,
    /// Share of the boxes of a track that may be foreign without being parted from it.
    pub most_foreign_share: f64,
    /// Standard deviations of the road's height by which the lower edges of something that stands in the background lie above the road, where a
    /// vehicle of its class would drive: 93 % of the vehicles are lower.
    pub hanging_sigmas: f64,
    /// Share of the boxes of a track that one standing point must explain within `background_sigmas`.
    pub background_share: f64,
    /// Residual of a column and of a height up to which a standing point explains a box \[standard deviations\]: 95 % of the boxes of such a
    /// point. A larger one takes more slow vehicles far ahead for background.
    pub background_sigmas: f64,
    /// Passes of the triangulation of a standing point, each weighted by the depths and residuals of the one before. Chosen, not measured: more resist
    /// more outliers and take longer.
    pub background_passes: usize,
    /// Height above which nothing is a vehicle \[m\]: double-deck buses reach 4.4 m.
    pub tallest_m: f64,
    /// Boxes below which a part of a track is no vehicle, counted as at most one per correlation time.
    pub least_consistent_boxes: f64,
    /// Times that a track is parted.
    pub splits: usize,
    /// Overlap (IoU) of two boxes from which they may be boxes of one vehicle: that of the detector's duplicates.
    pub double_iou: f64,
    /// Share of a box within another one from which it may be a part of that vehicle.
    pub double_inside: f64,
    /// Share of a vehicle's box from which a box around it may show that vehicle alone. Chosen: a larger one keeps more weak boxes around a vehicle as
    /// vehicles of their own.
    pub double_around: f64,
    /// Score of such a part against that of the vehicle, at most: what stands in front of a vehicle is seen as well as it.
    pub double_score_ratio: f64,
    /// Share of the boxes of a track on those of another one from which it is a second track on that vehicle.
    pub double_share: f64,
    /// Mean score of the boxes of a track from a gap to its end, zero where the vehicle is missed, below which they are clutter, over what a single box
    /// must reach (`tracker.least_score`). A larger one cuts more off the ends of tracks.
    pub least_mean_score_ratio: f64,
    /// Mean log odds of the boxes of a track that they show a vehicle, below which it is none.
    pub least_presence: f64,
    /// Share of a vehicle's box behind the box of a nearer one from which the detector may miss it.
    pub hidden_share: f64,
}

impl Default for HypothesisOptions {
    fn default() -> Self {
        Self {
            rounds: 3,
            preference_chi2: 6.0,
            independent_views: 12.0,
            expected_chi2: 2.0,
            agreed_class_share: 0.8,
            class_preference_chi2: 2.0,
            typical_size_sigmas: 1.645,
            least_box_iou: 0.3,
            near_share: 0.6,
            near_rad: 0.08,
            least_standing_iou: 0.45,
            neutral_overlap: 0.65,
            least_visible_iou: 0.4,
            most_foreign_share: 0.1,
            hanging_sigmas: 1.5,
            background_share: 0.6,
            background_sigmas: 2.0,
            background_passes: 6,
            tallest_m: 4.5,
            least_consistent_boxes: 4.0,
            splits: 3,
            double_iou: 0.5,
            double_inside: 0.7,
            double_around: 0.5,
            double_score_ratio: 0.5,
            double_share: 0.5,
            least_mean_score_ratio: 1.0,
            least_presence: 0.0,
            hidden_share: 0.3,
        }
    }
}

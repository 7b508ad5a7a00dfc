//! Options of the camera's height by accumulated likelihood.

use super::mirror_options::MirrorOptions;

/// The camera's height in the odometry's unit, searched and watched by the likelihood of many pairs of frames.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HeightOptions {
    /// Least and greatest height considered \[odometry units\]: the unit makes the median depth of the scene 15, so that 0.08 is a camera
    /// 1.1 m above an open motorway with a median depth of 200 m, and 12 one of 3.2 m in a street with one of 4 m.
    pub range_units: [f64; 2],
    /// Step of the grid of log heights; the likelihood of textured asphalt is about as wide.
    pub step: f64,
    /// Half width of the stretch of road \[camera heights\]: the own lane with its markings, which often are all there is to see.
    pub half_width_heights: f64,
    /// Pyramid level of the comparison.
    pub level: usize,
    /// Pixels compared at most, those whose grey value changes most along the motion.
    pub most_pixels: usize,
    /// Share of the stretch's pixels compared at most; the rest has no texture along the motion.
    pub informative_share: f64,
    /// Pixels needed.
    pub least_pixels: usize,
    /// Pixels that count as one: they share texture and misalignment.
    pub correlated_pixels: f64,
    /// Independent pixels at most: what all share, a road that is no plane and an error of the motion, does not average out.
    pub most_independent: f64,
    /// Cap of a grey difference \[grey levels\].
    pub capped_grey: f64,
    /// Grey difference of two pictures of the same point, at least \[grey levels\].
    pub least_grey: f64,
    /// Grey difference of two pictures up to which a pixel may belong to something fixed to the camera: noise \[grey levels\], plus
    /// this shift of its gradient \[px of the level\].
    pub fixed_grey: f64,
    /// See `fixed_grey`.
    pub fixed_px: f64,
    /// Share of the pixels that must lie on the road of both pictures.
    pub least_overlap: f64,
    /// Least distance between two frames \[odometry units\]: shorter ones show no parallax anywhere.
    pub least_baseline_units: f64,
    /// Least step from frame to frame that gives the direction of travel \[odometry units\].
    pub least_step_units: f64,
    /// Least and greatest distance between two frames when the height is known \[camera heights\].
    pub baseline_heights: [f64; 2],
    /// Factor between the distances of the pairs of one frame.
    pub baseline_factor: f64,
    /// Pairs of one frame at most.
    pub most_pairs: usize,
    /// Time constant with which evidence is forgotten \[s\].
    pub forget_s: f64,
    /// Least time between two frames compared while the height is known \[s\].
    pub interval_s: f64,
    /// Time after which the whole range is compared again \[s\], in case the known height is a false one.
    pub whole_range_s: f64,
    /// Share of the probability within `mode_width` of the best height from which it is known.
    pub least_mass: f64,
    /// Half width of the best height's peak \[log height\].
    pub mode_width: f64,
    /// Pairs of frames that must have been compared.
    pub least_pairs: usize,
    /// Standard deviation of log height by one frame's likelihood, at least: pitch of the body against the direction of travel.
    pub least_sigma: f64,
    /// Difference of an aligned plane's log height from the known one, at most \[standard deviations\].
    pub gate: f64,
    /// Evidence kept at most \[log likelihood\]: a minute of asphalt must be able to correct a strong false edge.
    pub most_evidence: f64,
    /// Standard deviation of log height by one frame's likelihood from which it is no measurement.
    pub most_sigma: f64,
    /// Standard deviations of pitch and roll of the road against the expected ones \[rad\]: 0.4° and 1°.
    pub tilt_sigmas_rad: [f64; 2],
    /// Time constant of the direction of travel in the camera's frame \[s\].
    pub travel_s: f64,
    /// Largest angle of an aligned road to the direction of travel \[rad\], 3.4°, and largest roll, 7°: a hill's foot, a leaning
    /// rider; a camera that is mounted askew.
    pub most_tilt_rad: [f64; 2],
    /// A road that mirrors what stands above it.
    pub mirror: MirrorOptions,
}

impl Default for HeightOptions {
    fn default() -> Self {
        Self {
            range_units: [0.08, 12.0],
            step: 0.03,
            half_width_heights: 1.9,
            level: 1,
            most_pixels: 1000,
            informative_share: 0.4,
            least_pixels: 100,
            correlated_pixels: 30.0,
            most_independent: 60.0,
            capped_grey: 20.0,
            least_grey: 0.5,
            fixed_grey: 3.0,
            fixed_px: 0.5,
            least_overlap: 0.5,
            least_baseline_units: 0.05,
            least_step_units: 0.01,
            baseline_heights: [0.4, 6.0],
            baseline_factor: 1.6,
            most_pairs: 6,
            forget_s: 5.0,
            interval_s: 0.07,
            whole_range_s: 1.0,
            least_mass: 0.98,
            mode_width: 0.12,
            least_pairs: 3,
            least_sigma: 0.02,
            gate: 4.0,
            most_evidence: 40.0,
            most_sigma: 0.1,
            tilt_sigmas_rad: [7e-3, 17e-3],
            travel_s: 1.0,
            most_tilt_rad: [0.06, 0.12],
            mirror: MirrorOptions::default(),
        }
    }
}

impl HeightOptions {
    /// The first setting out of its range, with what it must be; all are usable otherwise.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        let [low, high] = self.range_units;
        if !(low > 0.0 && high > low && high < 1e4 * low) {
            return Err("range_units must be two positive heights, the second greater, at most 10000 times"
                .to_owned());
        }
        let positive = [
            ("correlated_pixels", self.correlated_pixels),
            ("least_grey", self.least_grey),
            ("forget_s", self.forget_s),
            ("least_sigma", self.least_sigma),
            ("travel_s", self.travel_s),
            ("most_evidence", self.most_evidence),
        ];
        if let Some((name, _)) = positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            return Err(format!("{name} must be positive"));
        }
        for (name, value, least, most) in [
            ("step", self.step, 1e-3, 0.2),
            ("mode_width", self.mode_width, self.step, 1.0),
            ("baseline_factor", self.baseline_factor, 1.01, 100.0),
        ] {
            if !(least..=most).contains(&value) {
                return Err(format!("{name} must lie between {least} and {most}"));
            }
        }
        self.mirror.validate()
    }
}

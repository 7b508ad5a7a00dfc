//! Options of the test for a road that mirrors.

/// A road so wet that it shows the mirror image of what stands above it.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MirrorOptions {
    /// False takes what the road shows for its texture.
    pub enabled: bool,
    /// Half side of a compared patch \[px of the level\].
    pub patch_px: usize,
    /// Least standard deviation of a patch \[grey levels\]: below lies the noise of cameras.
    pub least_contrast: f64,
    /// Distance to the columns that serve as control \[px of the level\]: farther than a patch is wide.
    pub control_px: usize,
    /// Patches of one frame compared with the control at most.
    pub tested_patches: usize,
    /// Patches of one frame matched at most on a road that mirrors.
    pub matched_patches: usize,
    /// Time between tests \[s\], once the first ones have decided; a test costs as much as an alignment.
    pub interval_s: f64,
    /// Patches that decide first.
    pub least_patches: f64,
    /// Time constant with which tests are forgotten \[s\].
    pub forget_s: f64,
    /// Share of the road's texture that must be a mirror image: above it the image outweighs the texture of the asphalt in the
    /// alignment. Without a mirror the share is 0 by construction; half of it ends the state.
    pub least_share: f64,
    /// The same in standard deviations of a share without a mirror.
    pub least_sigmas: f64,
    /// Patches that count as one: neighbours share texture.
    pub correlated_patches: f64,
    /// Least correlation of a patch and its mirror image that gives a distance.
    pub least_correlation: f64,
}

impl Default for MirrorOptions {
    fn default() -> Self {
        Self {
            enabled: true,
            patch_px: 4,
            least_contrast: 2.0,
            control_px: 12,
            tested_patches: 64,
            matched_patches: 200,
            interval_s: 1.0,
            least_patches: 100.0,
            forget_s: 5.0,
            least_share: 0.15,
            least_sigmas: 4.0,
            correlated_patches: 1.5,
            least_correlation: 0.7,
        }
    }
}

impl MirrorOptions {
    /// The first setting out of its range, with what it must be.
    ///
    /// # Errors
    /// The name of the setting and its range.
    pub fn validate(&self) -> Result<(), String> {
        if !(1..=32).contains(&self.patch_px) {
            return Err("mirror.patch_px must lie between 1 and 32".to_owned());
        }
        if self.control_px <= self.patch_px {
            return Err("mirror.control_px must be greater than patch_px".to_owned());
        }
        let positive = [
            ("least_contrast", self.least_contrast),
            ("interval_s", self.interval_s),
            ("forget_s", self.forget_s),
            ("least_patches", self.least_patches),
            ("correlated_patches", self.correlated_patches),
        ];
        match positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            Some((name, _)) => Err(format!("mirror.{name} must be positive")),
            None => Ok(()),
        }
    }
}

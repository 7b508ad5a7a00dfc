//! Outputs of the vehicle network for some crops, and their mean with those of the crops seen in a mirror.

use motorcade_shape::Layout;
use rten_tensor::prelude::*;
use rten_tensor::{Layout as _, Tensor};

use super::crop::INPUT_PX;
use super::engine::Network;
use crate::error::Result;

/// Keypoints of `car-36`.
pub(super) const POINTS: usize = Layout::Car36.count();
/// Points of one side of a vehicle: point i and point i + 18 mirror each other.
const SIDE_POINTS: usize = POINTS / 2;
/// Cells of a heat map along each axis.
pub(super) const CELLS: usize = 16;
/// Bins of the heading over the full turn; bin 0 drives straight away, which it does in a mirror too.
const HEADING_BINS: usize = 24;
/// Bins on each side of the largest that a heading is the mean of.
const NEAR_BINS: usize = 2;

/// Logits of heat maps, visibilities and headings, crop by crop.
pub(super) struct CropOutputs {
    heat: Vec<f32>,
    visibility: Vec<f32>,
    heading: Vec<f32>,
}

impl CropOutputs {
    /// The first three outputs of a network for this many crops; an error where their shapes are others.
    pub(super) fn new(network: &Network, outputs: &[Tensor<f32>], crops: usize) -> Result<Self> {
        let shapes: [&[usize]; 3] =
            [&[crops, POINTS, CELLS, CELLS], &[crops, POINTS], &[crops, HEADING_BINS]];
        if outputs.len() < shapes.len() {
            return Err(network.wrong_output(&[outputs.len()], "heat maps, visibility, heading"));
        }
        for (output, shape) in outputs.iter().zip(shapes) {
            if output.shape() != shape {
                return Err(network.wrong_output(output.shape(), &format!("{shape:?}")));
            }
        }
        Ok(Self { heat: outputs[0].to_vec(), visibility: outputs[1].to_vec(), heading: outputs[2].to_vec() })
    }

    /// Heat map of a keypoint (`CELLS`² logits).
    pub(super) fn map(&self, crop: usize, point: usize) -> &[f32] {
        &self.heat[(crop * POINTS + point) * CELLS * CELLS..][..CELLS * CELLS]
    }

    /// Logit of the visibility of a keypoint.
    pub(super) fn visibility(&self, crop: usize, point: usize) -> f32 {
        self.visibility[crop * POINTS + point]
    }

    /// Weights of the heading's bins.
    pub(super) fn heading(&self, crop: usize) -> Vec<f64> {
        let logits = &self.heading[crop * HEADING_BINS..][..HEADING_BINS];
        let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        logits.iter().map(|l| f64::from(l - most).exp()).collect()
    }

    /// Probability of the heading about its largest bin.
    pub(super) fn heading_share(&self, crop: usize) -> f64 {
        let bins = self.heading(crop);
        let best = (0..bins.len()).max_by(|a, b| bins[*a].total_cmp(&bins[*b])).unwrap_or(0);
        let near = (best + HEADING_BINS - NEAR_BINS..=best + HEADING_BINS + NEAR_BINS)
            .map(|bin| bins[bin % HEADING_BINS]);
        near.sum::<f64>() / bins.iter().sum::<f64>()
    }

    /// Takes the mean of a crop's outputs and those of its mirror image, crop `of` of `mirrored`.
    pub(super) fn average_with_mirrored(&mut self, crop: usize, mirrored: &Self, of: usize) {
        for point in 0..POINTS {
            let other = (point + SIDE_POINTS) % POINTS;
            let at = crop * POINTS + point;
            self.visibility[at] = 0.5 * (self.visibility[at] + mirrored.visibility(of, other));
            let map = &mut self.heat[at * CELLS * CELLS..][..CELLS * CELLS];
            for (row, seen) in map.chunks_exact_mut(CELLS).zip(mirrored.map(of, other).chunks_exact(CELLS)) {
                row.iter_mut().zip(seen.iter().rev()).for_each(|(own, seen)| *own = 0.5 * (*own + seen));
            }
        }
        for bin in 0..HEADING_BINS {
            let seen = mirrored.heading[of * HEADING_BINS + (HEADING_BINS - bin) % HEADING_BINS];
            let own = &mut self.heading[crop * HEADING_BINS + bin];
            *own = 0.5 * (*own + seen);
        }
    }
}

/// A crop (channels of `INPUT_PX`² each) seen in a mirror.
pub(super) fn mirror_image(crop: &[f32]) -> impl Iterator<Item = f32> {
    crop.chunks_exact(INPUT_PX).flat_map(|row| row.iter().rev().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Outputs of one crop in which every number differs.
    fn outputs(seed: f32) -> CropOutputs {
        let numbers = |count: usize| (0..count).map(|k| (seed * (k + 1) as f32).sin()).collect();
        CropOutputs {
            heat: numbers(POINTS * CELLS * CELLS),
            visibility: numbers(POINTS),
            heading: numbers(HEADING_BINS),
        }
    }

    #[test]
    fn a_mirror_image_of_a_mirror_image_is_the_crop() {
        let crop: Vec<f32> = (0..4 * INPUT_PX * INPUT_PX).map(|k| k as f32).collect();
        let once: Vec<f32> = mirror_image(&crop).collect();
        assert_eq!(once[0], (INPUT_PX - 1) as f32);
        assert_eq!(mirror_image(&once).collect::<Vec<f32>>(), crop);
    }

    /// The mean is the same whichever of the two is the crop, but for the mirror.
    #[test]
    fn the_mean_of_a_crop_and_its_mirror_image_is_symmetric() {
        let [mut straight, mut mirrored] = [outputs(0.7), outputs(1.9)];
        straight.average_with_mirrored(0, &outputs(1.9), 0);
        mirrored.average_with_mirrored(0, &outputs(0.7), 0);
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        assert!(
            (0..POINTS)
                .all(|k| near(straight.visibility(0, k), mirrored.visibility(0, (k + SIDE_POINTS) % POINTS)))
        );
        // A point at the left of the front is one at the right of it in a mirror.
        assert!(near(straight.map(0, 3)[5 * CELLS + 2], mirrored.map(0, 21)[5 * CELLS + 13]));
        // A vehicle that turns to the left turns to the right in a mirror.
        assert!(
            near(straight.heading[3], mirrored.heading[21]) && near(straight.heading[0], mirrored.heading[0])
        );
    }

    #[test]
    fn a_heading_is_as_sure_as_its_largest_bins() {
        let mut of = outputs(0.7);
        of.heading = vec![-20.0; HEADING_BINS];
        (of.heading[0], of.heading[23]) = (3.0, 3.0);
        assert!(of.heading_share(0) > 0.999);
        of.heading[11] = 3.0;
        assert!((of.heading_share(0) - 2.0 / 3.0).abs() < 1e-6);
    }
}

//! The vehicle network: crops around boxes to keypoints (`training/README.md` specifies its outputs).

use motorcade_dataset::Frame;
use motorcade_shape::{HeadingEvidence, Layout, ObservedKeypoint};
use nalgebra::{Point2, Vector2};
use rten_tensor::prelude::*;
use rten_tensor::{Layout as _, NdTensor, Tensor};

use super::crop::{CropFrame, INPUT_PX};
use super::crop_options::{CropChoice, CropOptions};
use super::crop_outputs::{CELLS, CropOutputs, POINTS, mirror_image};
use super::engine::Network;
use crate::detection::{BoundingBox, Detection, VehicleClass};
use crate::detectors::KeypointDetector;
use crate::error::Result;
use crate::keypoints::VehicleKeypoints;
use crate::manifest::{KeypointVariance, PresenceWeights};

/// Cells on each side of the peak that its position is the mean of.
const REACH: usize = 2;

/// Place of the presence among the outputs, counted from 0.
const PRESENCE_OUTPUT: usize = 5;
/// Scores nearer to 0 and 1 count as this near, as in the training.
const SCORE_MARGIN: f64 = 0.02;

/// A network that finds the 36 keypoints of `car-36` in crops.
pub struct KeypointNetwork {
    network: Network,
    variance: KeypointVariance,
    presence: Option<PresenceWeights>,
    options: CropOptions,
    /// Crops for keypoints.
    recent: RecentCrops,
    /// Crops for the presence, apart: a lorry's box about a car must not stand for the car's.
    recent_presence: RecentCrops,
}

/// Time and box of the crops of the last `interval_s`.
#[derive(Default)]
struct RecentCrops(Vec<(i64, BoundingBox)>);

impl RecentCrops {
    /// The largest of some boxes, without those cropped a moment ago, which are then among these.
    fn due<'d>(
        &mut self,
        timestamp_ns: i64,
        candidates: impl Iterator<Item = &'d Detection>,
        choice: &CropChoice,
        same_iou: f64,
    ) -> Vec<&'d Detection> {
        let age_s = |then: i64| (timestamp_ns - then) as f64 * 1e-9;
        self.0.retain(|(then, _)| (0.0..choice.interval_s).contains(&age_s(*then)));
        let known = |d: &&Detection| self.0.iter().any(|(_, bbox)| bbox.iou(&d.bbox) > same_iou);
        let mut due: Vec<&Detection> = candidates.filter(|d| !known(d)).collect();
        due.sort_by(|a, b| b.bbox.area().total_cmp(&a.bbox.area()));
        due.truncate(choice.max_crops);
        self.0.extend(due.iter().map(|d| (timestamp_ns, d.bbox)));
        due
    }
}

impl KeypointNetwork {
    pub(crate) fn new(
        network: Network,
        variance: KeypointVariance,
        presence: Option<PresenceWeights>,
        options: CropOptions,
    ) -> Self {
        let (recent, recent_presence) = Default::default();
        Self { network, variance, presence, options, recent, recent_presence }
    }

    /// Boxes to look at, without those looked at a moment ago: those with keypoints, then the others, each largest first.
    fn chosen<'d>(&mut self, timestamp_ns: i64, detections: &'d [Detection]) -> Vec<&'d Detection> {
        let CropOptions { keypoints, presence, same_iou, .. } = self.options;
        let with_keypoints = detections.iter().filter(|d| self.options.has_keypoints(d));
        let mut chosen = self.recent.due(timestamp_ns, with_keypoints, &keypoints, same_iou);
        if self.presence.is_some() {
            let others = detections.iter().filter(|d| {
                d.class != VehicleClass::Motorcycle && presence.includes(d) && !self.options.has_keypoints(d)
            });
            chosen.extend(self.recent_presence.due(timestamp_ns, others, &presence, same_iou));
        }
        chosen
    }
}

impl CropOptions {
    /// True for a box whose keypoints are looked for: the network knows those of cars and vans.
    fn has_keypoints(&self, detection: &Detection) -> bool {
        matches!(detection.class, VehicleClass::Car | VehicleClass::Van) && self.keypoints.includes(detection)
    }
}

impl KeypointDetector for KeypointNetwork {
    fn keypoints(&mut self, frame: &Frame, detections: &[Detection]) -> Result<Vec<VehicleKeypoints>> {
        let chosen = self.chosen(frame.timestamp_ns, detections);
        if chosen.is_empty() {
            return Ok(Vec::new());
        }
        let image = frame.rgb();
        let crops: Vec<CropFrame> = chosen.iter().map(|d| CropFrame::of_box(&d.bbox)).collect();
        let mut data = Vec::with_capacity(crops.len() * 4 * INPUT_PX * INPUT_PX);
        crops.iter().for_each(|crop| crop.append(&image, &mut data));
        let (outputs, presence) = self.outputs(&chosen, data)?;
        let vehicle = |(k, crop): (usize, &CropFrame)| {
            let point = |i: usize| self.point(crop, outputs.map(k, i), f64::from(outputs.visibility(k, i)));
            let known = self.options.has_keypoints(chosen[k]);
            VehicleKeypoints {
                layout: Layout::Car36,
                points: (0..POINTS)
                    .map(|i| if known { point(i) } else { ObservedKeypoint::missing() })
                    .collect(),
                bbox: chosen[k].bbox,
                heading: known.then(|| HeadingEvidence::new(outputs.heading(k))).flatten(),
                presence: presence.get(k).copied(),
            }
        };
        Ok(crops.iter().enumerate().map(vehicle).collect())
    }

    fn skipped(&mut self, timestamp_ns: i64, detections: &[Detection]) {
        self.chosen(timestamp_ns, detections);
    }

    fn description(&self) -> String {
        self.network.description()
    }
}

impl KeypointNetwork {
    /// Outputs for some crops; those whose heading is in doubt are seen in a mirror too.
    fn outputs(&mut self, chosen: &[&Detection], data: Vec<f32>) -> Result<(CropOutputs, Vec<f64>)> {
        let one = 4 * INPUT_PX * INPUT_PX;
        let sure = self.options.sure_heading;
        let run = |network: &mut Network, data: Vec<f32>| -> Result<(CropOutputs, Vec<Tensor<f32>>)> {
            let count = data.len() / one;
            let all = network.run_all(NdTensor::from_data([count, 4, INPUT_PX, INPUT_PX], data))?;
            Ok((CropOutputs::new(network, &all, count)?, all))
        };
        let (mut outputs, all) = run(&mut self.network, data.clone())?;
        let presence = self.presence(&all, chosen)?;
        let in_doubt = |k: &usize| self.options.has_keypoints(chosen[*k]) && outputs.heading_share(*k) < sure;
        let doubtful: Vec<usize> = (0..chosen.len()).filter(in_doubt).collect();
        if !doubtful.is_empty() {
            let mirrored = doubtful.iter().flat_map(|k| mirror_image(&data[k * one..][..one])).collect();
            let (mirrored, _) = run(&mut self.network, mirrored)?;
            doubtful.iter().enumerate().for_each(|(of, k)| outputs.average_with_mirrored(*k, &mirrored, of));
        }
        Ok((outputs, presence))
    }

    /// Log odds that each box shows a vehicle; none where the manifest has no weights for them.
    fn presence(&self, outputs: &[Tensor<f32>], boxes: &[&Detection]) -> Result<Vec<f64>> {
        let Some(PresenceWeights { logit, score, bias }) = self.presence else { return Ok(Vec::new()) };
        let output = outputs.get(PRESENCE_OUTPUT);
        let Some(logits) = output.filter(|output| output.shape() == [boxes.len(), 1]) else {
            let found = output.map_or(vec![outputs.len()], |output| output.shape().to_vec());
            return Err(self
                .network
                .wrong_output(&found, &format!("presence as output 6, [{}, 1]", boxes.len())));
        };
        let odds = |score: f64| {
            let held = score.clamp(SCORE_MARGIN, 1.0 - SCORE_MARGIN);
            (held / (1.0 - held)).ln()
        };
        let one = |(found, b): (f32, &&Detection)| logit * f64::from(found) + score * odds(b.score) + bias;
        Ok(logits.to_vec().into_iter().zip(boxes).map(one).collect())
    }

    /// A keypoint from its heat map (logits) and the logit of its visibility.
    fn point(&self, crop: &CropFrame, map: &[f32], visibility: f64) -> ObservedKeypoint {
        let Peak { at: [x, y], moment } = Peak::of(map);
        let [u, v] = crop.pixel(x, y);
        let KeypointVariance { gain, floor } = self.variance;
        let sigma = moment.map(|m| (gain * m + floor).sqrt());
        let sigma_px = crop.extent(sigma[0], sigma[1]);
        ObservedKeypoint::new(Point2::new(u, v), 1.0 / (1.0 + (-visibility).exp()))
            .with_sigma_px(Vector2::from(sigma_px))
    }
}

/// The peak of a heat map, in shares of the map's extent.
struct Peak {
    /// Mean over the cells about the largest.
    at: [f64; 2],
    /// Second moment of the whole map about it: large where the map has several peaks.
    moment: [f64; 2],
}

impl Peak {
    fn of(map: &[f32]) -> Self {
        let best = (0..map.len()).max_by(|a, b| map[*a].total_cmp(&map[*b]).then(b.cmp(a))).unwrap_or(0);
        let (row, column) = (best / CELLS, best % CELLS);
        let near = |a: usize, b: usize| a.abs_diff(b) <= REACH;
        let centre = |k: usize| (k as f64 + 0.5) / CELLS as f64;
        let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
        let mut all = [0.0; 5];
        for (k, logit) in map.iter().enumerate() {
            let (r, c) = (k / CELLS, k % CELLS);
            let weight = f64::from(logit - map[best]).exp();
            let (u, v) = (centre(c), centre(r));
            for (sum, term) in all.iter_mut().zip([1.0, u, v, u * u, v * v]) {
                *sum += weight * term;
            }
            if near(r, row) && near(c, column) {
                x += weight * u;
                y += weight * v;
                total += weight;
            }
        }
        let at = [x / total, y / total];
        let [mass, u, v, uu, vv] = all;
        let about = |square: f64, mean: f64, place: f64| {
            ((square - 2.0 * mean * place) / mass + place * place).max(0.0)
        };
        Self { at, moment: [about(uu, u, at[0]), about(vv, v, at[1])] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_between_two_cells_is_half_way() {
        let mut map = vec![-20.0; CELLS * CELLS];
        map[5 * CELLS + 7] = 3.0;
        map[5 * CELLS + 8] = 3.0;
        let Peak { at: [x, y], moment } = Peak::of(&map);
        assert!((x - 8.0 / 16.0).abs() < 1e-6 && (y - 5.5 / 16.0).abs() < 1e-6, "{x} {y}");
        // Half a cell to each side along x, nothing along y.
        assert!((moment[0] - (0.5_f64 / 16.0).powi(2)).abs() < 1e-6 && moment[1] < 1e-6, "{moment:?}");
    }

    #[test]
    fn two_peaks_widen_the_moment_and_leave_the_place() {
        let mut map = vec![-20.0; CELLS * CELLS];
        map[5 * CELLS + 2] = 3.0;
        map[5 * CELLS + 13] = 2.9;
        let Peak { at: [x, _], moment } = Peak::of(&map);
        assert!((x - 2.5 / 16.0).abs() < 1e-4 && moment[0] > 0.1, "{x} {moment:?}");
    }
}

//! Faults of the boxes that a drive came with: vehicles found twice, a detector that saw nothing for a while, identities that are not those of vehicles.

use motorcade_perception::Detection;

use crate::check_options::DetectionFaultOptions;
use crate::record::FrameInfo;

/// Warnings about the boxes of a drive, one entry of `detections` a frame, of an image `height_px` high.
pub(crate) fn of(
    frames: &[FrameInfo],
    detections: &[Vec<Detection>],
    height_px: u32,
    options: &DetectionFaultOptions,
) -> Vec<String> {
    let n = frames.len().min(detections.len());
    let (frames, detections) = (&frames[..n], &detections[..n]);
    let mut out = Vec::new();
    out.extend(doubled(frames, detections, options));
    out.extend(gaps(frames, detections, f64::from(height_px) * options.least_height_share, options));
    out.extend(changed_identities(detections, options));
    out
}

/// Vehicles that have two boxes. Detectors leave one of two boxes that overlap that much, and vehicles that hide each other are rarely seen so.
fn doubled(
    frames: &[FrameInfo],
    detections: &[Vec<Detection>],
    options: &DetectionFaultOptions,
) -> Option<String> {
    let on_another = |of_frame: &[Detection], k: usize| {
        let other = |(_, d): &(usize, &Detection)| d.bbox.iou(&of_frame[k].bbox) > options.double_iou;
        of_frame.iter().enumerate().filter(|(j, _)| *j != k).any(|found| other(&found))
    };
    let doubles = |of_frame: &[Detection]| (0..of_frame.len()).filter(|k| on_another(of_frame, *k)).count();
    let counts: Vec<usize> = detections.iter().map(|of_frame| doubles(of_frame)).collect();
    let (found, all) = (counts.iter().sum::<usize>(), detections.iter().map(Vec::len).sum::<usize>());
    if found < options.least_boxes || (found as f64) < options.doubled_share * all as f64 {
        return None;
    }
    let first = counts.iter().position(|count| *count > 0)?;
    Some(format!(
        "{found} of {all} boxes lie on another box, first in frame {}: the detector seems to find vehicles twice; leave out all but the surest of boxes that overlap",
        frames[first].number
    ))
}

/// Spans in which no box is found, between frames with several large ones: vehicles do not leave and come all at once.
fn gaps(
    frames: &[FrameInfo],
    detections: &[Vec<Detection>],
    least_height_px: f64,
    options: &DetectionFaultOptions,
) -> Option<String> {
    // In a frame without a picture of its own nothing was looked for.
    let looked_at: Vec<usize> = (0..frames.len()).filter(|k| frames[*k].problem.is_none()).collect();
    let large = |k: usize| detections[k].iter().filter(|d| d.bbox.height() >= least_height_px).count();
    let seconds = |a: usize, b: usize| (frames[b].timestamp_ns - frames[a].timestamp_ns) as f64 * 1e-9;
    let filled: Vec<usize> = (0..looked_at.len()).filter(|i| !detections[looked_at[*i]].is_empty()).collect();
    let mut found = Vec::new();
    for pair in filled.windows(2) {
        let (before, after) = (looked_at[pair[0]], looked_at[pair[1]]);
        let long = pair[1] - pair[0] > options.gap_frames && seconds(before, after) > options.gap_s;
        if long && large(before).min(large(after)) >= options.gap_boxes {
            let [first, last] = [pair[0] + 1, pair[1] - 1].map(|i| looked_at[i]);
            let (first, last, lasting_s) =
                (frames[first].number, frames[last].number, seconds(before, after));
            let (was, is) = (detections[before].len(), detections[after].len());
            found.push(format!("{first} to {last} ({lasting_s:.1} s, {was} boxes before and {is} after)"));
        }
    }
    let more = found.len().saturating_sub(options.named);
    let more = if more > 0 { format!(" and {more} more times") } else { String::new() };
    let named = found[..found.len().min(options.named)].join(", ");
    (!found.is_empty()).then(|| {
        format!(
            "no box was found in frames {named}{more}: the detector seems to have seen nothing there; vehicles are not followed in between"
        )
    })
}

/// Identities that a file gives and that change from frame to frame on one vehicle.
fn changed_identities(detections: &[Vec<Detection>], options: &DetectionFaultOptions) -> Option<String> {
    let (mut pairs, mut changed) = (0_usize, 0_usize);
    for two in detections.windows(2) {
        for before in &two[0] {
            let overlap = |d: &&Detection| d.bbox.iou(&before.bbox);
            let nearest = two[1].iter().max_by(|a, b| overlap(a).total_cmp(&overlap(b)));
            let nearest = nearest.filter(|d| overlap(d) > options.same_iou);
            if let Some((was, is)) = nearest.and_then(|d| before.external_id.zip(d.external_id)) {
                pairs += 1;
                changed += usize::from(was != is);
            }
        }
    }
    (changed >= options.least_boxes && changed as f64 >= options.changed_share * pairs as f64).then(|| {
        format!(
            "the identity of a box changes from one frame to the next in {changed} of {pairs} cases: the identities are not those of vehicles; vehicles are followed without them, but poses of --vehicle-poses may go to wrong ones"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use motorcade_perception::{BoundingBox, BoxConvention, VehicleClass};

    fn frames(n: usize) -> Vec<FrameInfo> {
        let of =
            |k: usize| FrameInfo { number: k as u64, timestamp_ns: k as i64 * 100_000_000, problem: None };
        (0..n).map(of).collect()
    }

    fn boxed(x: f64, width: f64, external_id: Option<i64>) -> Detection {
        Detection {
            class: VehicleClass::Car,
            score: 0.9,
            bbox: BoundingBox::new([x, 100.0, x + width, 100.0 + 0.8 * width]),
            convention: BoxConvention::VisibleExtent,
            external_id,
            pixel_size: 1.0,
            road_below: None,
        }
    }

    /// Two cars that move slowly through the picture.
    fn two_cars(n: usize) -> Vec<Vec<Detection>> {
        (0..n)
            .map(|k| vec![boxed(10.0 + k as f64, 60.0, Some(1)), boxed(300.0 - k as f64, 50.0, Some(2))])
            .collect()
    }

    fn said(frames: &[FrameInfo], detections: &[Vec<Detection>]) -> Vec<String> {
        of(frames, detections, 375, &DetectionFaultOptions::default())
    }

    #[test]
    fn sound_boxes_are_not_spoken_of() {
        let mut detections = two_cars(60);
        assert!(said(&frames(60), &detections).is_empty());
        // One car that leaves, another one that comes seconds later; and two small ones that flicker.
        detections[20..40].iter_mut().for_each(Vec::clear);
        detections[..20].iter_mut().for_each(|of_frame| of_frame.truncate(1));
        assert!(said(&frames(60), &detections).is_empty());
        let mut small: Vec<Vec<Detection>> =
            (0..60).map(|_| vec![boxed(10.0, 20.0, None), boxed(80.0, 20.0, None)]).collect();
        small[20..40].iter_mut().for_each(Vec::clear);
        assert!(said(&frames(60), &small).is_empty());
        // Frames without a picture have no boxes.
        let (mut lost, mut detections) = (frames(60), two_cars(60));
        for k in 20..40 {
            lost[k].problem = Some("no such file".to_owned());
            detections[k].clear();
        }
        assert!(said(&lost, &detections).is_empty());
    }

    #[test]
    fn boxes_that_lie_on_others_are_counted() {
        let mut detections = two_cars(60);
        for of_frame in &mut detections[7..] {
            let again: Vec<Detection> =
                of_frame.iter().map(|d| boxed(d.bbox.x1 + 3.0, d.bbox.width(), d.external_id)).collect();
            of_frame.extend(again);
        }
        let said = said(&frames(60), &detections);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("212 of 226 boxes lie on another box, first in frame 7:"), "{said:?}");
    }

    #[test]
    fn seconds_without_boxes_between_many_are_named() {
        let mut detections = two_cars(100);
        detections[30..80].iter_mut().for_each(Vec::clear);
        let said = said(&frames(100), &detections);
        assert_eq!(said.len(), 1, "{said:?}");
        let begin = "no box was found in frames 30 to 79 (5.1 s, 2 boxes before and 2 after):";
        assert!(said[0].starts_with(begin), "{said:?}");
    }

    #[test]
    fn identities_that_change_are_counted() {
        let mut detections = two_cars(40);
        for (k, d) in detections.iter_mut().flatten().enumerate() {
            d.external_id = Some(k as i64 % 7);
        }
        let found = said(&frames(40), &detections);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("in 78 of 78 cases"), "{found:?}");
        detections.iter_mut().flatten().for_each(|d| d.external_id = None);
        assert!(said(&frames(40), &detections).is_empty());
    }
}

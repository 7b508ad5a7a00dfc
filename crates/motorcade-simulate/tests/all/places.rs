//! Places of rendered drives: the same one is found again where it is, those that look alike are not joined.

#![allow(clippy::unwrap_used, reason = "helpers of tests may fail loudly too")]

use image::DynamicImage;
use motorcade_places::{
    FeatureExtractor, FoundPlaces, FramePlacement, HiddenParts, PlaceKeyframe, PlaceMatch, PlaceOptions,
    PlaceSearch, PlacedKeyframe, find_places, place_keyframes,
};
use motorcade_simulate::{Drive, RenderOptions, Renderer, Scenario, simulate, simulate_again};

fn driven(name: &str, frames: usize) -> Drive {
    rendered(name, frames, (3, 828))
}

fn rendered(name: &str, frames: usize, (seed, width): (u64, u32)) -> Drive {
    let render = RenderOptions::default().with_width(width);
    simulate(&Scenario::by_name(name).unwrap(), frames, seed, &render).unwrap()
}

/// Keyframes of these frames with exact poses; with `maps` each visit is a map of its own.
fn keyframes(drive: &Drive, visits: &[&[usize]], maps: bool, options: &PlaceOptions) -> Vec<PlacedKeyframe> {
    let renderer = Renderer::new(drive);
    let mut extractor = FeatureExtractor::new(options.features);
    let mut all = Vec::new();
    for (segment, frames) in visits.iter().enumerate() {
        for &frame in *frames {
            let picture = renderer.render(frame).unwrap();
            let gray = DynamicImage::ImageRgb8(picture.rgb).into_luma8();
            let segment = if maps { segment } else { 0 };
            let usable = |x: f64, y: f64| {
                picture.instance.get_pixel_checked(x as u32, y as u32).is_none_or(|i| i.0[0] == 0)
            };
            let features = extractor.extract(&gray, usable);
            let hidden = HiddenParts::of(gray.dimensions(), usable);
            all.push(PlaceKeyframe { frame, segment, features, hidden });
        }
    }
    let poses = drive.world_from_camera();
    let placement = |frame: usize| FramePlacement {
        world_from_camera: poses[frame],
        covariance: nalgebra::Matrix6::zeros(),
        way_m: 0.7 * frame as f64,
    };
    place_keyframes(&drive.camera(), all, placement, options)
}

/// Error of a match's position \[m\] and orientation \[rad\].
fn error(m: &PlaceMatch, placed: &[PlacedKeyframe]) -> (f64, f64) {
    let truth = placed[m.query].world_from_camera.inverse() * placed[m.candidate].world_from_camera;
    let apart = truth.inverse() * m.query_from_candidate;
    (apart.translation().norm(), apart.rotation().angle())
}

/// Frame of the second round nearest to one of the first.
fn again(drive: &Drive, frame: usize) -> usize {
    let apart = |k: usize| {
        (drive.site_from_camera[k].translation() - drive.site_from_camera[frame].translation()).norm()
    };
    (frame + 300..drive.len()).min_by(|a, b| apart(*a).total_cmp(&apart(*b))).unwrap()
}

#[test]
fn the_second_round_finds_the_first() {
    let drive = driven("block", 700);
    let options = PlaceOptions::default();
    let first: Vec<usize> = (0..7).map(|k| 60 + 5 * k).collect();
    let second: Vec<usize> = first.iter().map(|f| again(&drive, *f) + 2).collect();
    let placed = keyframes(&drive, &[&first, &second], false, &options);
    let FoundPlaces { keyframes: placed, matches: found, report } =
        find_places(&drive.camera(), placed, |_, _, _| true, &options);
    assert!(found.len() >= 6, "{report:?}");
    for m in &found {
        let (way_m, turn_rad) = error(m, &placed);
        assert!(
            way_m < 0.25 && turn_rad < 0.01,
            "{} and {}: {way_m} m, {turn_rad} rad",
            m.query,
            m.candidate
        );
        let covariance = m.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        assert!((0.003..0.3).contains(&covariance), "{covariance} m");
    }
}

#[test]
fn twin_houses_are_two_places() {
    // The second stretch of houses stands 90 m farther on: 112.5 frames.
    let drive = driven("twin-houses", 200);
    let options = PlaceOptions::default();
    let first: Vec<usize> = (0..8).map(|k| 20 + 5 * k).collect();
    let second: Vec<usize> = first.iter().map(|f| f + 112).collect();
    let placed = keyframes(&drive, &[&first, &second], true, &options);
    // Odometry may not help: the two visits are maps of their own.
    let FoundPlaces { matches: found, report, .. } =
        find_places(&drive.camera(), placed, |_, _, _| true, &options);
    assert!(found.is_empty(), "{report:?}: {found:?}");
    // The houses do look alike: it is the short way that decides.
    assert!(report.verified >= 3, "{report:?}");
}

#[test]
fn many_views_of_twin_houses_are_two_places() {
    let options = PlaceOptions::default();
    let first: Vec<usize> = (0..12).map(|k| 5 + 5 * k).collect();
    let mut verified = 0;
    // Among seeds 1 to 6 and three widths, the second drive is the one in which the most of the view is the same.
    for (seed, width, begins) in [(3, 828, [128, 140, 152]), (2, 621, [118, 124, 130])] {
        let drive = rendered("twin-houses", 200, (seed, width));
        for begin in begins {
            // A map that has just begun has a keyframe every frame: many views of the same houses agree.
            let second: Vec<usize> = (begin..begin + 12).collect();
            let placed = keyframes(&drive, &[&first, &second], true, &options);
            let FoundPlaces { matches, report, .. } =
                find_places(&drive.camera(), placed, |_, _, _| true, &options);
            assert!(matches.is_empty(), "{seed} {begin}: {report:?}: {matches:?}");
            verified += report.verified;
        }
    }
    assert!(verified >= 30, "{verified}");
}

#[test]
fn another_visit_at_another_hour_finds_the_places_of_the_first() {
    let render = RenderOptions::default().with_width(828);
    let scenario = Scenario::by_name("block").unwrap();
    let first = simulate(&scenario, 300, 3, &render).unwrap();
    let evening = RenderOptions { hour: 15.0, ..render };
    let again = simulate_again(&scenario, 300, (3, 4), &evening).unwrap();
    let options = PlaceOptions::default();
    let frames: Vec<usize> = (0..16).map(|k| 10 + 5 * k).collect();
    let known = keyframes(&first, &[&frames], false, &options);
    let mut search = PlaceSearch::new(first.camera(), options);
    known.into_iter().for_each(|keyframe| search.add(keyframe));
    let later = |k: PlacedKeyframe| PlacedKeyframe { segment: 1, ..k };
    for keyframe in keyframes(&again, &[&frames], false, &options).into_iter().map(later) {
        search.take(keyframe, |_, _, _| true);
    }
    let FoundPlaces { keyframes: placed, matches, report } = search.finish();
    assert!(matches.len() >= 8, "{report:?}");
    let truth = again.first_visit_from_camera().unwrap();
    for m in &matches {
        let expected = truth[placed[m.query].frame].inverse() * placed[m.candidate].world_from_camera;
        let apart = expected.inverse() * m.query_from_candidate;
        assert!(apart.translation().norm() < 0.4 && apart.rotation().angle() < 0.015, "{m:?}");
    }
}

#[test]
fn the_opposite_direction_is_another_place() {
    let drive = driven("same-street-opposite", 330);
    let options = PlaceOptions::default();
    let first: Vec<usize> = (0..8).map(|k| 20 + 5 * k).collect();
    let back: Vec<usize> = (0..8).map(|k| 285 + 5 * k).collect();
    let placed = keyframes(&drive, &[&first, &back], true, &options);
    let FoundPlaces { keyframes: placed, matches: found, report } =
        find_places(&drive.camera(), placed, |_, _, _| true, &options);
    assert!(found.is_empty(), "{report:?}");
    // Each visit has landmarks: it is not for want of them.
    assert!(placed.iter().all(|k| k.landmarks.len() > 40));
}

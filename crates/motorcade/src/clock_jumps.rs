//! Frames that come far later than the others: the clock jumped, or frames are missing that no number shows.

use motorcade_geometry::robust::upper_median_by;
use motorcade_odometry::EgoFrame;

use crate::check_options::ClockJumpOptions;
use crate::record::FrameInfo;

/// A warning that names the frames before and after each jump.
pub(crate) fn of(frames: &[FrameInfo], ego: &[EgoFrame], options: &ClockJumpOptions) -> Option<String> {
    let mut intervals: Vec<i64> = frames.windows(2).map(|w| w[1].timestamp_ns - w[0].timestamp_ns).collect();
    let late: Vec<usize> = (1..frames.len().min(ego.len())).collect();
    let usual_ns = upper_median_by(&mut intervals, i64::cmp)?;
    let seconds = |ns: i64| ns as f64 * 1e-9;
    let interval_ns = |k: usize| frames[k].timestamp_ns - frames[k - 1].timestamp_ns;
    let late_s = options.late_s.max(options.late_intervals * seconds(usual_ns));
    let is_late = |k: &usize| seconds(interval_ns(*k)) > late_s;
    let late: Vec<usize> = late.into_iter().filter(is_late).collect();
    let described = |k: &usize| {
        let (before, after, apart_s) = (frames[k - 1].number, frames[*k].number, seconds(interval_ns(*k)));
        let way = if ego[*k].step_measured {
            "the pictures go on, so that the clock seems to have jumped"
        } else {
            "the way between is assumed from the speeds before and after"
        };
        format!("{before} and {after} ({apart_s:.1} s: {way})")
    };
    let named: Vec<String> = late.iter().take(options.named).map(described).collect();
    let more = late.len().saturating_sub(options.named);
    let more = if more > 0 { format!(" and {more} more pairs") } else { String::new() };
    (!late.is_empty()).then(|| {
        format!(
            "frames {}{more} are far apart in time, usual are {:.2} s: check the times of the frames",
            named.join(", "),
            seconds(usual_ns)
        )
    })
}

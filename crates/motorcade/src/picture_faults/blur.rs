//! Parts of a picture that blur within a frame and stay so: dirt or water on the lens.

use std::collections::VecDeque;

use motorcade_geometry::robust::upper_median_by;

use super::cells::Cells;
use super::options::PictureFaultOptions;

/// A part of the picture that blurs.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct Part {
    /// First frame.
    number: u64,
    /// Share of the picture.
    share: f64,
    /// Left, top, right and bottom edge \[px\].
    edges: [usize; 4],
}

/// Search for parts that blur. What the camera drives past changes cell by cell and frame by frame; dirt changes its cells in one frame.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct BlurredParts {
    /// Number and relative gradients of each of the last pictures.
    pictures: VecDeque<(u64, Vec<f32>)>,
    /// The largest part that blurs in each of the last three frames that could be judged.
    largest: VecDeque<Part>,
    found: Vec<Part>,
    dropped: Vec<bool>,
    values: Vec<f32>,
}

impl BlurredParts {
    /// Forgets the last pictures: the next one does not follow them.
    pub fn restart(&mut self) {
        self.pictures.clear();
        self.largest.clear();
    }

    /// Takes the next picture; its blank cells count as unchanged.
    pub fn observe(&mut self, number: u64, now: &Cells, options: &PictureFaultOptions) {
        let frames = options.blur_frames;
        let spare = (self.pictures.len() == 2 * frames).then(|| self.pictures.pop_front()).flatten();
        let mut gradients = spare.map(|(_, values)| values).unwrap_or_default();
        let floor = options.blur_floor_grey as f32;
        self.values.clear();
        self.values.extend(now.gradients.iter().map(|g| g + floor));
        gradients.clear();
        gradients.extend_from_slice(&self.values);
        let usual = upper_median_by(&mut self.values, f32::total_cmp).unwrap_or(1.0);
        for (gradient, deviation) in gradients.iter_mut().zip(&now.deviations) {
            let blank = f64::from(*deviation) < options.blank_grey;
            *gradient = if blank { f32::INFINITY } else { *gradient / usual };
        }
        self.pictures.push_back((number, gradients));
        if self.pictures.len() < 2 * frames {
            return;
        }
        let part = self.largest_drop(now, options);
        if self.largest.len() == 3 {
            self.largest.pop_front();
        }
        self.largest.push_back(part);
        if let [before, part, after] = *self.largest.make_contiguous()
            && part.share - before.share.max(after.share) > options.blur_share
        {
            self.found.push(part);
        }
    }

    /// The largest connected part whose gradients are smaller in all of the later pictures than in all of the earlier ones.
    fn largest_drop(&mut self, cells: &Cells, options: &PictureFaultOptions) -> Part {
        let ratio = options.blur_ratio as f32;
        let Self { pictures, dropped, .. } = self;
        let (early, late) = (0..options.blur_frames, options.blur_frames..2 * options.blur_frames);
        let of = |k: usize, cell: usize| pictures[k].1.get(cell).copied().unwrap_or(f32::INFINITY);
        // A cell that was blank before has nothing to lose.
        let had = |k: usize, cell: usize| Some(of(k, cell)).filter(|g| g.is_finite()).unwrap_or(0.0);
        dropped.clear();
        dropped.extend((0..cells.len()).map(|cell| {
            let least = early.clone().map(|k| had(k, cell)).fold(f32::INFINITY, f32::min);
            let most = late.clone().map(|k| of(k, cell)).fold(0.0, f32::max);
            most < ratio * least
        }));
        let number = pictures[options.blur_frames].0;
        let mut largest = Part { number, ..Part::default() };
        for start in 0..dropped.len() {
            let part = take_part(dropped, start, cells);
            if part.share > largest.share {
                largest = Part { number, ..part };
            }
        }
        largest
    }

    /// A warning for each part.
    pub fn describe(&self) -> Vec<String> {
        let described = |part: &Part| {
            let [left, top, right, bottom] = part.edges;
            format!(
                "a part of the picture (x {left} to {right} px, y {top} to {bottom} px) blurs in frame {} and stays so, as by dirt or water on the lens; \
                 leave it out with --ignore where results suffer",
                part.number
            )
        };
        self.found.iter().map(described).collect()
    }
}

/// Clears the connected part that holds a cell, and returns its extent.
fn take_part(dropped: &mut [bool], start: usize, cells: &Cells) -> Part {
    let (columns, side) = (cells.columns, cells.side);
    let mut part = Part { edges: [usize::MAX, usize::MAX, 0, 0], ..Part::default() };
    let mut open = vec![start];
    let mut count = 0;
    while let Some(cell) = open.pop() {
        if !dropped.get(cell).copied().unwrap_or(false) {
            continue;
        }
        dropped[cell] = false;
        count += 1;
        let (column, row) = (cell % columns, cell / columns);
        let [left, top, right, bottom] = part.edges;
        part.edges = [
            left.min(column * side),
            top.min(row * side),
            right.max((column + 1) * side),
            bottom.max((row + 1) * side),
        ];
        open.extend((column > 0).then(|| cell - 1));
        open.extend((column + 1 < columns).then_some(cell + 1));
        open.extend(cell.checked_sub(columns));
        open.push(cell + columns);
    }
    part.share = f64::from(count) / cells.len().max(1) as f64;
    part
}

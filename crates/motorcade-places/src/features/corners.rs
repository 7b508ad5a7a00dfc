//! FAST corners (Rosten & Drummond, ECCV 2006) with Harris' measure as their strength.

use image::GrayImage;

/// The circle of radius 3, in order round it.
const CIRCLE: [(i32, i32); 16] = [
    (0, -3),
    (1, -3),
    (2, -2),
    (3, -1),
    (3, 0),
    (3, 1),
    (2, 2),
    (1, 3),
    (0, 3),
    (-1, 3),
    (-2, 2),
    (-3, 1),
    (-3, 0),
    (-3, -1),
    (-2, -2),
    (-1, -3),
];
/// Neighbours in a row on the circle that must all be brighter or all be darker.
const ARC: u32 = 9;
/// Harris' constant.
const K: f32 = 0.04;

/// A corner of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    pub x: i32,
    pub y: i32,
    pub strength: f32,
}

/// All corners at least `border_px` from the edge, row by row; of neighbours the strongest alone. `threshold` in grey levels.
pub(super) fn corners(image: &GrayImage, threshold: u8, border_px: i32) -> Vec<Corner> {
    let (width, height) = (image.width() as i32, image.height() as i32);
    let border = border_px.max(5);
    let pixels = image.as_raw();
    let offsets = CIRCLE.map(|(x, y)| (y * width + x) as isize);
    let mut found = Vec::new();
    for y in border..height - border {
        for x in border..width - border {
            let at = (y * width + x) as usize;
            if let Some(contrast) = contrast(pixels, at, &offsets, i16::from(threshold)) {
                found.push(Corner { x, y, strength: contrast });
            }
        }
    }
    // Harris' measure costs more than all else: of neighbours the one with most contrast is measured.
    let mut chosen = strongest_of_neighbours(&found, height as usize);
    for corner in &mut chosen {
        corner.strength = harris(pixels, (corner.y * width + corner.x) as usize, width as usize);
    }
    chosen
}

/// Sum of the differences between a corner and the circle \[grey levels\]; `None` where there is no corner.
#[inline]
fn contrast(pixels: &[u8], at: usize, offsets: &[isize; 16], threshold: i16) -> Option<f32> {
    let centre = i16::from(pixels[at]);
    let value = |k: usize| i16::from(pixels[at.wrapping_add_signed(offsets[k])]);
    let (high, low) = (centre + threshold, centre - threshold);
    // An arc of nine holds one of two opposite points, whichever two.
    let differs = |v: i16| v > high || v < low;
    if !(differs(value(0)) || differs(value(8))) || !(differs(value(4)) || differs(value(12))) {
        return None;
    }
    let mut sum = 0;
    let (mut bright, mut dark) = (0_u32, 0_u32);
    for k in 0..16 {
        let v = value(k);
        bright |= u32::from(v > high) << k;
        dark |= u32::from(v < low) << k;
        sum += (v - centre).abs();
    }
    (has_arc(bright) || has_arc(dark)).then(|| f32::from(sum))
}

/// True when `ARC` bits in a row are set, counting round the circle of 16.
fn has_arc(bits: u32) -> bool {
    let mut run = bits | (bits << 16);
    // After n steps a bit says that n + 1 bits in a row were set.
    for _ in 1..ARC {
        run &= run >> 1;
    }
    run & 0xffff != 0
}

/// det M − k tr² M of the gradients in 7×7 pixels.
fn harris(pixels: &[u8], at: usize, width: usize) -> f32 {
    let (mut xx, mut xy, mut yy) = (0_i32, 0_i32, 0_i32);
    for row in 0..7 {
        let line = at + row * width - 3 * width - 3;
        let (here, above, below) = (
            &pixels[line - 1..line + 8],
            &pixels[line - width..line - width + 7],
            &pixels[line + width..line + width + 7],
        );
        for i in 0..7 {
            let dx = i32::from(here[i + 2]) - i32::from(here[i]);
            let dy = i32::from(below[i]) - i32::from(above[i]);
            xx += dx * dx;
            xy += dx * dy;
            yy += dy * dy;
        }
    }
    let (xx, xy, yy) = (xx as f32 * 1e-3, xy as f32 * 1e-3, yy as f32 * 1e-3);
    xx * yy - xy * xy - K * (xx + yy) * (xx + yy)
}

/// Drops corners with a stronger one among their eight neighbours.
fn strongest_of_neighbours(found: &[Corner], height: usize) -> Vec<Corner> {
    // Index of the first corner of each row.
    let mut rows = vec![found.len(); height + 1];
    for (i, c) in found.iter().enumerate().rev() {
        rows[c.y as usize] = i;
    }
    for y in (0..height).rev() {
        rows[y] = rows[y].min(rows[y + 1]);
    }
    let in_row = |y: i32| -> &[Corner] {
        match usize::try_from(y) {
            Ok(y) if y < height => &found[rows[y]..rows[y + 1]],
            _ => &[],
        }
    };
    let stronger = |a: &Corner, b: &Corner| {
        // Of equally strong ones the first stays.
        let order = a.strength.total_cmp(&b.strength).then((b.y, b.x).cmp(&(a.y, a.x)));
        order == std::cmp::Ordering::Greater
    };
    let peak = |c: &&Corner| {
        let near = (c.y - 1..=c.y + 1).flat_map(|y| {
            let row = in_row(y);
            let from = row.partition_point(|o| o.x < c.x - 1);
            row[from..].iter().take_while(|o| o.x <= c.x + 1)
        });
        near.into_iter().all(|o| !stronger(o, c))
    };
    found.iter().filter(peak).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn a_square_has_four_corners_and_an_edge_none() {
        let image = GrayImage::from_fn(80, 60, |x, y| {
            Luma([if (30..50).contains(&x) && (20..40).contains(&y) { 200 } else { 40 }])
        });
        let found = corners(&image, 20, 4);
        for (x, y) in [(30, 20), (49, 20), (30, 39), (49, 39)] {
            assert!(found.iter().any(|c| (c.x - x).abs() <= 2 && (c.y - y).abs() <= 2), "{x} {y} {found:?}");
        }
        assert!(found.len() <= 8, "{found:?}");
        let edge = GrayImage::from_fn(80, 60, |x, _| Luma([if x < 40 { 40 } else { 200 }]));
        assert!(corners(&edge, 20, 4).is_empty());
    }

    #[test]
    fn arcs_are_counted_round_the_circle() {
        assert!(has_arc(0b1_1111_1111) && has_arc(0b1111_0000_0001_1111));
        assert!(!has_arc(0b1111_1111) && !has_arc(0b1111_0000_0000_1111) && has_arc(0xffff));
    }
}

//! Even distribution of corners over the image.

use super::corners::Corner;

/// Side of a cell \[px\] so that `count` cells of about two to one cover an image: structure on both sides of a street counts alike.
fn cell_px(width: u32, height: u32, count: usize) -> usize {
    let area = f64::from(width) * f64::from(height) / count.max(1) as f64;
    (2.0 * area).sqrt().max(8.0) as usize
}

/// At most `count` corners: cells are served in turn, each with its strongest corner not taken yet.
pub(super) fn spread(corners: &[Corner], (width, height): (u32, u32), count: usize) -> Vec<Corner> {
    let side = cell_px(width, height, count);
    let (columns, rows) = ((width as usize).div_ceil(side), (height as usize).div_ceil(side));
    let mut cells: Vec<Vec<Corner>> = vec![Vec::new(); columns * rows];
    for c in corners {
        let cell = (c.y as usize / side).min(rows - 1) * columns + (c.x as usize / side).min(columns - 1);
        cells[cell].push(*c);
    }
    for cell in &mut cells {
        cell.sort_by(|a, b| b.strength.total_cmp(&a.strength).then((a.y, a.x).cmp(&(b.y, b.x))));
    }
    let mut out = Vec::with_capacity(count);
    let mut round = 0;
    while out.len() < count {
        let mut next: Vec<Corner> = cells.iter().filter_map(|cell| cell.get(round).copied()).collect();
        if next.is_empty() {
            break;
        }
        // The last round has more than are wanted: the strongest of it.
        next.sort_by(|a, b| b.strength.total_cmp(&a.strength).then((a.y, a.x).cmp(&(b.y, b.x))));
        next.truncate(count - out.len());
        out.extend(next);
        round += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_the_image_gets_its_share() {
        // Strong corners in the left tenth, weak ones elsewhere.
        let corner = |i: i32| {
            let (x, y) = ((i * 37) % 400, (i * 91) % 200);
            Corner { x, y, strength: if x < 40 { 1000.0 + i as f32 } else { 1.0 + i as f32 * 1e-3 } }
        };
        let all: Vec<Corner> = (0..4000).map(corner).collect();
        let chosen = spread(&all, (400, 200), 100);
        assert_eq!(chosen.len(), 100);
        let right = chosen.iter().filter(|c| c.x >= 200).count();
        assert!((35..65).contains(&right), "{right} of 100 in the right half");
    }
}

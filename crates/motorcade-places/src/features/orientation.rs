//! Orientation of a patch by its intensity centroid (Rosin 1999; ORB, Rublee et al., ICCV 2011).

use image::GrayImage;

use super::pattern::RADIUS_PX;

/// Orientation of the patch around a pixel in 256ths of a turn: the direction from its middle to the centroid of its grey values.
pub(super) fn turn(image: &GrayImage, x: i32, y: i32) -> u8 {
    let width = image.width() as i32;
    let pixels = image.as_raw();
    let (mut m10, mut m01) = (0_i64, 0_i64);
    for dy in -RADIUS_PX..=RADIUS_PX {
        let half = f64::from(RADIUS_PX * RADIUS_PX - dy * dy).sqrt() as i32;
        let line = (y + dy) * width + x;
        let (mut row, mut along) = (0_i64, 0_i64);
        for dx in -half..=half {
            let v = i64::from(pixels.get((line + dx) as usize).copied().unwrap_or(0));
            row += v;
            along += v * i64::from(dx);
        }
        m10 += along;
        m01 += row * i64::from(dy);
    }
    let turns = (m01 as f64).atan2(m10 as f64) / std::f64::consts::TAU;
    (turns * 256.0).round().rem_euclid(256.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn patches_point_to_their_bright_side() {
        let half = |bright: fn(u32, u32) -> bool| {
            turn(&GrayImage::from_fn(61, 61, |x, y| Luma([if bright(x, y) { 220 } else { 30 }])), 30, 30)
        };
        assert_eq!(half(|x, _| x > 30), 0);
        assert_eq!(half(|_, y| y > 30), 64);
        assert_eq!(half(|x, _| x < 30), 128);
        assert_eq!(half(|x, y| x > y), 224);
    }
}

//! Shadows of vehicles on the static scenery.

use nalgebra::{Point3, Vector3};

/// Side of a grid cell \[m\].
const CELL_M: f64 = 8.0;

/// Footprint of a vehicle that casts a shadow.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadowCaster {
    pub centre: [f64; 2],
    pub forward: [f64; 2],
    pub half_length_m: f64,
    pub half_width_m: f64,
    pub height_m: f64,
}

/// Shadows of a frame on a grid: few vehicles of a street shade a given point.
#[derive(Clone, Debug, Default)]
pub(super) struct Shadows {
    /// Lower corner of the grid.
    corner: [f64; 2],
    /// Cells along x and y.
    size: [usize; 2],
    cells: Vec<Vec<ShadowCaster>>,
}

impl Shadows {
    pub(super) fn new(casters: &[ShadowCaster]) -> Self {
        let over = |axis: usize, sign: f64| {
            casters.iter().map(|c| sign * c.centre[axis] + c.reach_m()).fold(f64::NEG_INFINITY, f64::max)
        };
        if casters.is_empty() {
            return Self::default();
        }
        let corner = [-over(0, -1.0), -over(1, -1.0)];
        let size = [0, 1].map(|k| ((over(k, 1.0) - corner[k]) / CELL_M) as usize + 1);
        let mut cells = vec![Vec::new(); size[0] * size[1]];
        for caster in casters {
            let [columns, rows] = [0, 1].map(|k| {
                let cell = |at: f64| (((at - corner[k]) / CELL_M).max(0.0) as usize).min(size[k] - 1);
                cell(caster.centre[k] - caster.reach_m())..=cell(caster.centre[k] + caster.reach_m())
            });
            for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
                cells[row * size[0] + column].push(*caster);
            }
        }
        Self { corner, size, cells }
    }

    /// 1 in the open, less under and beside vehicles; `clear` is 1 for sharp shadows, 0 for none.
    pub(super) fn light_at(&self, point: &Point3<f64>, sun: &Vector3<f64>, clear: f32) -> f32 {
        let (x, y) = ((point.x - self.corner[0]) / CELL_M, (point.y - self.corner[1]) / CELL_M);
        if x < 0.0 || y < 0.0 || x >= self.size[0] as f64 || y >= self.size[1] as f64 {
            return 1.0;
        }
        let cell = self.cells.get(y as usize * self.size[0] + x as usize);
        let mut light = 1.0;
        for caster in cell.into_iter().flatten() {
            caster.shade(&mut light, point, sun, f64::from(clear));
        }
        light as f32
    }
}

impl ShadowCaster {
    /// Largest distance of shaded points from its centre, along either axis \[m\].
    fn reach_m(&self) -> f64 {
        self.half_length_m + self.height_m + 1.0
    }

    fn shade(&self, light: &mut f64, point: &Point3<f64>, sun: &Vector3<f64>, clear: f64) {
        let (dx, dy) = (point.x - self.centre[0], point.y - self.centre[1]);
        if dx.abs() > self.reach_m() || dy.abs() > self.reach_m() {
            return;
        }
        let outside = |dx: f64, dy: f64| {
            let along = (dx * self.forward[0] + dy * self.forward[1]).abs() - self.half_length_m;
            let across = (dy * self.forward[0] - dx * self.forward[1]).abs() - self.half_width_m;
            let (a, b) = (along.max(0.0), across.max(0.0));
            (a * a + b * b).sqrt() + along.max(across).min(0.0)
        };
        // Dark below the body, fading within half a metre of its edge.
        let below = ((0.45 - outside(dx, dy)) / 0.60).clamp(0.0, 1.0);
        *light *= 1.0 - 0.92 * below * below * (3.0 - 2.0 * below);
        let throw = 0.5 * self.height_m / sun.z.max(0.2);
        let cast = ((0.10 - outside(dx + throw * sun.x, dy + throw * sun.y)) / 0.25).clamp(0.0, 1.0);
        *light = light.min(1.0 - 0.55 * clear * cast);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_finds_the_same_shadows_as_asking_everybody() {
        let casters: Vec<ShadowCaster> = (0..12)
            .map(|i| {
                let angle = f64::from(i);
                ShadowCaster {
                    centre: [7.0 * f64::from(i % 4), 5.0 * f64::from(i / 4)],
                    forward: [angle.cos(), angle.sin()],
                    half_length_m: 2.0,
                    half_width_m: 0.9,
                    height_m: 1.5,
                }
            })
            .collect();
        let shadows = Shadows::new(&casters);
        let sun = Vector3::new(0.45, -0.55, 0.70).normalize();
        let mut shaded = 0;
        for (i, j) in (-20..80).flat_map(|i| (-20..50).map(move |j| (i, j))) {
            let point = Point3::new(0.5 * f64::from(i), 0.5 * f64::from(j), 0.0);
            let mut light = 1.0;
            casters.iter().for_each(|c| c.shade(&mut light, &point, &sun, 0.75));
            assert_eq!(shadows.light_at(&point, &sun, 0.75), light as f32, "{point}");
            shaded += usize::from(light < 0.9);
        }
        assert!(shaded > 100, "{shaded}");
        assert_eq!(Shadows::new(&[]).light_at(&Point3::origin(), &sun, 1.0), 1.0);
    }
}

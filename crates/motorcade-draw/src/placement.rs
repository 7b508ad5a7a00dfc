//! Places of labels that cover neither each other nor, where it can be helped, vehicles.

use crate::segment::Rectangle;

/// Rectangles that are taken \[px\].
pub(crate) struct Placement {
    area: Rectangle,
    labels: Vec<Rectangle>,
    vehicles: Vec<Rectangle>,
}

/// Largest share of a label that may cover vehicles.
const MOST_COVERED: f64 = 0.9;

impl Placement {
    pub(crate) fn new(area: Rectangle, vehicles: Vec<Rectangle>) -> Self {
        Self { area, labels: Vec::new(), vehicles }
    }

    /// A place for a label of this size around a vehicle: above it, raised in steps, else below. Takes the place that covers
    /// least of the vehicles; none where every place covers another label or leaves the image.
    pub(crate) fn around(&mut self, vehicle: &Rectangle, (width, height): (f64, f64)) -> Option<Rectangle> {
        let gap = 0.25 * height;
        let middle = 0.5 * (vehicle.x1 + vehicle.x2);
        let columns = [middle - 0.5 * width, middle - 0.15 * width, middle - 0.85 * width];
        let above = (0..8).map(|k| vehicle.y1 - gap - height - f64::from(k) * (0.5 * height + gap));
        let rows = above.chain([vehicle.y2 + gap]);
        let mut best: Option<(f64, Rectangle)> = None;
        for (row, y) in rows.enumerate() {
            for (column, x) in columns.iter().enumerate() {
                let x = x.clamp(self.area.x1, (self.area.x2 - width).max(self.area.x1));
                let place = Rectangle::new(x, y, x + width, y + height);
                if self.area.common(&place) != Some(place) || covered(&place, &self.labels) > 0.0 {
                    continue;
                }
                let covered = covered(&place, &self.vehicles) / place.area();
                if covered > MOST_COVERED {
                    continue;
                }
                // A step away counts as a tenth of the label on a vehicle.
                let cost = covered + 0.1 * row as f64 + 0.05 * column as f64;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, place));
                }
            }
        }
        let (_, place) = best?;
        self.labels.push(place);
        Some(place)
    }
}

/// Area of a rectangle that others cover \[px²\], each counted.
fn covered(place: &Rectangle, others: &[Rectangle]) -> f64 {
    others.iter().filter_map(|other| place.common(other)).map(|common| common.area()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_do_not_cover_each_other() {
        let mut placement = Placement::new(Rectangle::new(0.0, 0.0, 200.0, 100.0), Vec::new());
        let vehicle = Rectangle::new(90.0, 60.0, 110.0, 70.0);
        let found: Vec<_> = (0..20).map_while(|_| placement.around(&vehicle, (60.0, 20.0))).collect();
        assert!((3..20).contains(&found.len()), "{found:?}");
        for (k, a) in found.iter().enumerate() {
            assert!(found[..k].iter().all(|b| a.common(b).is_none()), "{found:?}");
        }
    }

    #[test]
    fn a_label_above_the_image_goes_below_the_vehicle() {
        let area = Rectangle::new(0.0, 0.0, 200.0, 100.0);
        let vehicle = Rectangle::new(90.0, 5.0, 110.0, 40.0);
        let place = Placement::new(area, vec![vehicle]).around(&vehicle, (60.0, 20.0)).unwrap();
        assert!(place.y1 > vehicle.y2, "{place:?}");
    }
}

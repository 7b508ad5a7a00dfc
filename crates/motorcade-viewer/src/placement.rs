//! Placement of labels without overlap.

/// Occupied rectangles of a drawing, as x1, y1, x2, y2 \[px\].
pub(crate) struct Placement {
    area: [f64; 4],
    occupied: Vec<[f64; 4]>,
}

impl Placement {
    /// An empty drawing.
    pub(crate) fn new(area: [f64; 4]) -> Self {
        Self { area, occupied: Vec::new() }
    }

    /// Marks a rectangle as occupied.
    pub(crate) fn occupy(&mut self, rectangle: [f64; 4]) {
        self.occupied.push(rectangle);
    }

    /// Baseline start of a text of this size beside an outline, where there is room; none when all sides are occupied.
    pub(crate) fn beside(&mut self, outline: [f64; 4], (width, height): (f64, f64)) -> Option<(f64, f64)> {
        let gap = 2.0;
        let (x, y) = (0.5 * (outline[0] + outline[2]), 0.5 * (outline[1] + outline[3]));
        let corners = [
            (x - 0.5 * width, outline[1] - gap - height),
            (x - 0.5 * width, outline[3] + gap),
            (outline[2] + gap, y - 0.5 * height),
            (outline[0] - gap - width, y - 0.5 * height),
        ];
        for (left, top) in corners {
            let rectangle = [left, top, left + width, top + height];
            let inside = rectangle[0] >= self.area[0]
                && rectangle[1] >= self.area[1]
                && rectangle[2] <= self.area[2]
                && rectangle[3] <= self.area[3];
            if inside && !self.occupied.iter().any(|other| overlap(&rectangle, other)) {
                self.occupied.push(rectangle);
                return Some((left, top + 0.9 * height));
            }
        }
        None
    }
}

fn overlap(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::Placement;

    #[test]
    fn a_fifth_label_at_one_point_finds_no_room() {
        let mut placement = Placement::new([0.0, 0.0, 100.0, 100.0]);
        let found: Vec<_> =
            (0..5).map(|_| placement.beside([44.0, 44.0, 56.0, 56.0], (10.0, 10.0)).is_some()).collect();
        assert_eq!(found, [true, true, true, true, false]);
        // Near an edge the label goes to the inside; on an occupied rectangle there is no label.
        let (x, y) = placement.beside([98.0, 10.0, 100.0, 12.0], (10.0, 10.0)).unwrap();
        assert!(x + 10.0 <= 100.0 && y <= 20.0, "{x} {y}");
        placement.occupy([0.0, 0.0, 100.0, 100.0]);
        assert_eq!(placement.beside([20.0, 20.0, 22.0, 22.0], (10.0, 10.0)), None);
    }
}

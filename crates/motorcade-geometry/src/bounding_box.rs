//! Axis-aligned boxes in an image.

/// An axis-parallel box in pixels, x1 ≤ x2, y1 ≤ y2.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BoundingBox {
    /// Left edge \[px\].
    pub x1: f64,
    /// Upper edge \[px\].
    pub y1: f64,
    /// Right edge \[px\].
    pub x2: f64,
    /// Lower edge \[px\].
    pub y2: f64,
}

impl BoundingBox {
    /// From x1, y1, x2, y2 \[px\].
    pub fn new([x1, y1, x2, y2]: [f64; 4]) -> Self {
        Self { x1, y1, x2, y2 }
    }
    /// x1, y1, x2, y2 \[px\].
    pub fn to_array(self) -> [f64; 4] {
        [self.x1, self.y1, self.x2, self.y2]
    }
    /// Width \[px\].
    pub fn width(&self) -> f64 {
        self.x2 - self.x1
    }
    /// Height \[px\].
    pub fn height(&self) -> f64 {
        self.y2 - self.y1
    }
    /// Area \[px²\].
    pub fn area(&self) -> f64 {
        self.width().max(0.0) * self.height().max(0.0)
    }
    /// Centre x, y \[px\].
    pub fn centre(&self) -> (f64, f64) {
        (0.5 * (self.x1 + self.x2), 0.5 * (self.y1 + self.y2))
    }
    /// True when the pixel lies in the box.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        x >= self.x1 && x <= self.x2 && y >= self.y1 && y <= self.y2
    }
    /// Grown by `margin_px` on every side.
    #[must_use]
    pub fn grown(&self, margin_px: f64) -> Self {
        Self {
            x1: self.x1 - margin_px,
            y1: self.y1 - margin_px,
            x2: self.x2 + margin_px,
            y2: self.y2 + margin_px,
        }
    }
    /// The part inside an image.
    #[must_use]
    pub fn clipped(&self, width: u32, height: u32) -> Self {
        let (right, bottom) = (f64::from(width) - 1.0, f64::from(height) - 1.0);
        Self {
            x1: self.x1.clamp(0.0, right),
            y1: self.y1.clamp(0.0, bottom),
            x2: self.x2.clamp(0.0, right),
            y2: self.y2.clamp(0.0, bottom),
        }
    }
    /// Area in both boxes \[px²\].
    pub fn intersection(&self, other: &Self) -> f64 {
        let width = self.x2.min(other.x2) - self.x1.max(other.x1);
        let height = self.y2.min(other.y2) - self.y1.max(other.y1);
        width.max(0.0) * height.max(0.0)
    }
    /// Intersection over union, 0 to 1.
    pub fn iou(&self, other: &Self) -> f64 {
        let both = self.intersection(other);
        if both == 0.0 {
            return 0.0;
        }
        both / (self.area() + other.area() - both)
    }
}

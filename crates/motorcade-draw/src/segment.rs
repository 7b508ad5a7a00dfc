//! Segments and polygons in the image, clipped to rectangles. Coordinates in pixels, y down.

/// A point in the image \[px\].
pub(crate) type Pixel = [f64; 2];

/// A segment between two points.
pub(crate) type Segment = [Pixel; 2];

/// A rectangle, sides parallel to the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rectangle {
    pub(crate) x1: f64,
    pub(crate) y1: f64,
    pub(crate) x2: f64,
    pub(crate) y2: f64,
}

impl Rectangle {
    pub(crate) fn new(x1: f64, y1: f64, x2: f64, y2: f64) -> Self {
        Self { x1, y1, x2, y2 }
    }

    /// The smallest rectangle around points; `None` without points.
    pub(crate) fn around(points: impl IntoIterator<Item = Pixel>) -> Option<Self> {
        let grown = |r: Option<Self>, [x, y]: Pixel| {
            let r = r.unwrap_or(Self::new(x, y, x, y));
            Some(Self::new(r.x1.min(x), r.y1.min(y), r.x2.max(x), r.y2.max(y)))
        };
        points.into_iter().fold(None, grown)
    }

    /// The common part; `None` where there is none.
    pub(crate) fn common(&self, other: &Self) -> Option<Self> {
        let common = Self::new(
            self.x1.max(other.x1),
            self.y1.max(other.y1),
            self.x2.min(other.x2),
            self.y2.min(other.y2),
        );
        (common.x1 < common.x2 && common.y1 < common.y2).then_some(common)
    }

    pub(crate) fn area(&self) -> f64 {
        (self.x2 - self.x1) * (self.y2 - self.y1)
    }

    /// Part of a segment inside, as fractions of its way; Liang and Barsky, 1984.
    fn span(&self, [a, b]: &Segment) -> Option<(f64, f64)> {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let sides =
            [(-dx, a[0] - self.x1), (dx, self.x2 - a[0]), (-dy, a[1] - self.y1), (dy, self.y2 - a[1])];
        let (mut start, mut end) = (0.0_f64, 1.0_f64);
        for (p, q) in sides {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                start = start.max(q / p);
            } else {
                end = end.min(q / p);
            }
        }
        (start < end).then_some((start, end))
    }

    /// The part of a segment inside.
    pub(crate) fn clip(&self, segment: &Segment) -> Option<Segment> {
        self.span(segment).map(|(start, end)| part(segment, start, end))
    }

    /// The part of a convex polygon inside; Sutherland and Hodgman, 1974.
    pub(crate) fn clip_polygon(&self, polygon: Vec<Pixel>) -> Vec<Pixel> {
        let sides: [(usize, f64, f64); 4] =
            [(0, 1.0, self.x1), (0, -1.0, -self.x2), (1, 1.0, self.y1), (1, -1.0, -self.y2)];
        sides.iter().fold(polygon, |polygon, (axis, sign, limit)| {
            cut(&polygon, |p| sign * p[*axis] - limit, point_between)
        })
    }
}

/// The part of a convex polygon with non-negative `distance`; `between` gives the point at a fraction of a side.
pub(crate) fn cut<P: Copy>(
    polygon: &[P],
    distance: impl Fn(&P) -> f64,
    between: impl Fn(&P, &P, f64) -> P,
) -> Vec<P> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (k, to) in polygon.iter().enumerate() {
        let from = &polygon[(k + polygon.len() - 1) % polygon.len()];
        let (before, after) = (distance(from), distance(to));
        if (before < 0.0) != (after < 0.0) {
            out.push(between(from, to, before / (before - after)));
        }
        if after >= 0.0 {
            out.push(*to);
        }
    }
    out
}

/// The parts of a segment outside all rectangles.
pub(crate) fn outside(segment: &Segment, rectangles: &[Rectangle]) -> Vec<Segment> {
    let mut spans: Vec<(f64, f64)> = rectangles.iter().filter_map(|r| r.span(segment)).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut out, mut reached) = (Vec::new(), 0.0);
    for (start, end) in spans {
        if start > reached {
            out.push(part(segment, reached, start));
        }
        reached = end.max(reached);
    }
    if reached < 1.0 {
        out.push(part(segment, reached, 1.0));
    }
    out
}

fn part([a, b]: &Segment, start: f64, end: f64) -> Segment {
    [point_between(a, b, start), point_between(a, b, end)]
}

fn point_between(a: &Pixel, b: &Pixel, t: f64) -> Pixel {
    [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_end_at_the_sides() {
        let square = Rectangle::new(0.0, 0.0, 10.0, 10.0);
        assert_eq!(square.clip(&[[-10.0, 5.0], [20.0, 5.0]]), Some([[0.0, 5.0], [10.0, 5.0]]));
        assert_eq!(square.clip(&[[2.0, 2.0], [2.0, 30.0]]), Some([[2.0, 2.0], [2.0, 10.0]]));
        assert_eq!(square.clip(&[[-1.0, -5.0], [-1.0, 50.0]]), None);
    }

    #[test]
    fn what_lies_in_rectangles_is_left_out() {
        let boxes = [Rectangle::new(2.0, -1.0, 4.0, 1.0), Rectangle::new(3.0, -1.0, 6.0, 1.0)];
        let parts = outside(&[[0.0, 0.0], [10.0, 0.0]], &boxes);
        assert_eq!(parts, [[[0.0, 0.0], [2.0, 0.0]], [[6.0, 0.0], [10.0, 0.0]]]);
        assert!(outside(&[[2.5, 0.0], [5.0, 0.0]], &boxes).is_empty());
    }

    #[test]
    fn polygons_are_cut_to_the_rectangle() {
        let square = Rectangle::new(0.0, 0.0, 10.0, 10.0);
        let large = vec![[-1e7, -1e7], [1e7, -1e7], [1e7, 1e7], [-1e7, 1e7]];
        let inside = square.clip_polygon(large);
        assert_eq!(Rectangle::around(inside), Some(square));
        assert!(square.clip_polygon(vec![[20.0, 1.0], [30.0, 1.0], [30.0, 9.0]]).is_empty());
    }
}

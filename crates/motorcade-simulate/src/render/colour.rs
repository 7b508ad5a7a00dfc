//! Colours.

/// A colour, red, green, blue, 0 to 1.
pub(super) type Colour = [f32; 3];

pub(super) fn times(a: Colour, b: Colour) -> Colour {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

pub(super) fn added(a: Colour, b: Colour) -> Colour {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline]
pub(super) fn scaled(colour: Colour, factor: f32) -> Colour {
    let [r, g, b] = colour;
    [r * factor, g * factor, b * factor]
}

/// Mix of a and b with a share of b.
#[inline]
pub(super) fn mixed(a: Colour, b: Colour, share: f32) -> Colour {
    [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, a[2] + (b[2] - a[2]) * share]
}

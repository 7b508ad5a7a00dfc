//! Colours.

/// A colour with opacity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Colour {
    pub(crate) red: u8,
    pub(crate) green: u8,
    pub(crate) blue: u8,
    /// From 0, not seen, to 1.
    pub(crate) opacity: f32,
}

pub(crate) const WHITE: Colour = Colour::gray(245);
pub(crate) const BLACK: Colour = Colour::gray(0);

impl Colour {
    pub(crate) const fn gray(value: u8) -> Self {
        Self { red: value, green: value, blue: value, opacity: 1.0 }
    }

    /// From hue \[deg\], saturation and lightness \[0, 1\].
    pub(crate) fn from_hue(hue_deg: u32, saturation: f64, lightness: f64) -> Self {
        let chroma = saturation * lightness.min(1.0 - lightness);
        let channel = |offset: f64| {
            let k = (offset + f64::from(hue_deg % 360) / 30.0) % 12.0;
            let value = lightness - chroma * (k - 3.0).min(9.0 - k).clamp(-1.0, 1.0);
            (255.0 * value).round() as u8
        };
        Self { red: channel(0.0), green: channel(8.0), blue: channel(4.0), opacity: 1.0 }
    }

    /// The same with this share of its opacity.
    pub(crate) fn faded(self, share: f64) -> Self {
        Self { opacity: self.opacity * share as f32, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_those_of_the_report() {
        let rgb = |c: Colour| [c.red, c.green, c.blue];
        assert_eq!(rgb(Colour::from_hue(0, 1.0, 0.5)), [255, 0, 0]);
        assert_eq!(rgb(Colour::from_hue(120, 1.0, 0.5)), [0, 255, 0]);
        assert_eq!(rgb(Colour::from_hue(240, 1.0, 0.5)), [0, 0, 255]);
        assert_eq!(rgb(Colour::from_hue(400, 0.0, 1.0)), [255, 255, 255]);
    }
}

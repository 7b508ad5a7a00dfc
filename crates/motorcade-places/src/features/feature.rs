//! A corner with its descriptor.

use nalgebra::Point2;

use super::descriptor::Descriptor;

/// A corner with its descriptor. 44 bytes.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Feature {
    /// The descriptor, steered by the orientation of the patch.
    pub descriptor: Descriptor,
    /// Pixel in the full image.
    pub pixel: [f32; 2],
    /// Level of the pyramid it was found on, 0 the finest.
    pub level: u8,
    /// Orientation of the patch in 256ths of a turn.
    pub turn: u8,
}

impl Feature {
    /// Pixel in the full image.
    pub fn point(&self) -> Point2<f64> {
        Point2::new(f64::from(self.pixel[0]), f64::from(self.pixel[1]))
    }

    /// Angle between the orientations of two features, in 256ths of a turn, 0 to 128.
    pub(crate) fn turn_to(&self, other: &Self) -> u8 {
        let apart = self.turn.wrapping_sub(other.turn);
        apart.min(apart.wrapping_neg())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_are_compared_across_zero() {
        let at = |turn: u8| Feature { descriptor: Descriptor::default(), pixel: [0.0; 2], level: 0, turn };
        assert_eq!(at(250).turn_to(&at(4)), 10);
        assert_eq!(at(0).turn_to(&at(128)), 128);
    }
}

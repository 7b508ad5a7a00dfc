//! Kinds of bodies.

/// A kind of body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyType {
    /// Smallest cars, up to about 3.75 m.
    City,
    /// Two boxes, steep tail.
    Hatchback,
    /// Three boxes.
    Saloon,
    /// Saloon with the roof drawn to the tail.
    Estate,
    /// High two-box body.
    Suv,
    /// People carriers.
    Van,
    /// Low, roof falling to the tail.
    Coupe,
}

impl BodyType {
    /// All of them, in order.
    pub const ALL: [Self; 7] =
        [Self::City, Self::Hatchback, Self::Saloon, Self::Estate, Self::Suv, Self::Van, Self::Coupe];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::City => "city",
            Self::Hatchback => "hatchback",
            Self::Saloon => "saloon",
            Self::Estate => "estate",
            Self::Suv => "suv",
            Self::Van => "van",
            Self::Coupe => "coupe",
        }
    }

    /// Approximate share of European traffic, the weight of the type in the mean. The shares sum to 1.
    pub fn share(self) -> f64 {
        match self {
            Self::City => 0.10,
            Self::Hatchback => 0.30,
            Self::Saloon => 0.20,
            Self::Estate => 0.13,
            Self::Suv => 0.15,
            Self::Van => 0.08,
            Self::Coupe => 0.04,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one() {
        assert!((BodyType::ALL.iter().map(|t| t.share()).sum::<f64>() - 1.0).abs() < 1e-12);
    }
}

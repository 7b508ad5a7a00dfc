//! Kinds of weather.

/// Weather of a drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weather {
    /// Sun and some clouds, with shadows.
    #[default]
    Clear,
    /// A bright grey sky without shadows.
    Overcast,
    /// A dark grey sky, haze, a reflecting wet road, rain streaks and drops on the lens.
    Rain,
}

impl Weather {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Clear, Self::Overcast, Self::Rain];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clear => "clear",
            Self::Overcast => "overcast",
            Self::Rain => "rain",
        }
    }

    /// 0 for a clear sky with sharp shadows, 1 for a grey one without.
    pub(super) fn overcast(self) -> f32 {
        match self {
            Self::Clear => 0.25,
            Self::Overcast | Self::Rain => 1.0,
        }
    }
}

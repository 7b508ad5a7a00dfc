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
    /// Low beams of the camera's own car and little else; a noisy picture.
    Night,
    /// The sun 8° above the horizon, 15° from the first direction of travel: glare, glitter, long shadows.
    LowSun,
    /// Half of the way without daylight, by lamps every 12 m; the exposure follows within half a second.
    Tunnel,
    /// A grey sky over a wet road that mirrors what stands beside and on it.
    WetMirror,
}

impl Weather {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Clear, Self::Overcast, Self::Rain, Self::Night, Self::LowSun, Self::Tunnel, Self::WetMirror];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clear => "clear",
            Self::Overcast => "overcast",
            Self::Rain => "rain",
            Self::Night => "night",
            Self::LowSun => "low-sun",
            Self::Tunnel => "tunnel",
            Self::WetMirror => "wet-mirror",
        }
    }

    /// 0 for a clear sky with sharp shadows, 1 for a grey one without.
    pub(super) fn overcast(self) -> f32 {
        match self {
            Self::Clear => 0.25,
            Self::LowSun => 0.0,
            Self::Overcast | Self::Rain | Self::Night | Self::Tunnel | Self::WetMirror => 1.0,
        }
    }

    /// Factor of the sensor's noise: at night the gain of a camera is high.
    pub(super) fn noise(self) -> f32 {
        if self == Self::Night { 3.0 } else { 1.0 }
    }
}

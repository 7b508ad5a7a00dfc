//! Requests to stop long work.

/// Asked now and then in the course of long work; says true where that is to be given up.
#[derive(Clone, Copy)]
pub struct Stop<'a>(&'a (dyn Fn() -> bool + Sync));

impl<'a> Stop<'a> {
    /// Work that is always done to its end.
    pub const NEVER: Stop<'static> = Stop(&|| false);

    /// A question that costs little: it is asked some twenty times a second.
    pub fn new(asked: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self(asked)
    }

    /// True where the work is to be given up.
    pub fn asked(&self) -> bool {
        (self.0)()
    }
}

/// Multiplications between two looks at a request: some twentieth of a second on one core. Less work is done without a look, so that a short time limit
/// does not keep a small problem from its first step.
const LOOK_EVERY: f64 = (1_u64 << 28) as f64;

/// Counts work between two looks at a request to stop.
pub(crate) struct Lookout<'a> {
    stop: Stop<'a>,
    /// Multiplications up to the next look.
    left: f64,
}

impl<'a> Lookout<'a> {
    /// For work that begins after so many multiplications: the looks are at the same places whichever thread does a part.
    pub(crate) fn new(stop: Stop<'a>, before: f64) -> Self {
        Self { stop, left: LOOK_EVERY - before % LOOK_EVERY }
    }

    /// Counts work done; true where the rest is to be given up.
    #[inline]
    pub(crate) fn stops_after(&mut self, multiplications: f64) -> bool {
        self.left -= multiplications;
        if self.left > 0.0 {
            return false;
        }
        self.left = LOOK_EVERY;
        self.stop.asked()
    }
}

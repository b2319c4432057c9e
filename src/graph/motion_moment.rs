use super::Motion;

/// A moment of a motion.
#[derive(Clone, Copy, Debug)]
pub struct MotionMoment<'a> {
    /// The motion.
    pub motion: &'a Motion,
    /// Time since the start of the motion, in seconds.
    pub seconds: f32,
}

impl Motion {
    /// The moment `seconds` after the start.
    #[must_use]
    pub fn moment_at(&self, seconds: f32) -> MotionMoment<'_> {
        MotionMoment {
            motion: self,
            seconds,
        }
    }
}

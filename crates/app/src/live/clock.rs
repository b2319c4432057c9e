/// How time goes on the stage while it goes on outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Seconds on the stage in a second outside. Default 1.
    pub speed: f32,
    /// Whether it stands still.
    pub paused: bool,
    step: bool,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            speed: 1.0,
            paused: false,
            step: false,
        }
    }
}

impl Clock {
    /// A frame that took longer counts as this long, seconds: after a pause outside nothing leaps.
    pub const LONGEST: f32 = 0.1;
    /// Of a single step, seconds.
    pub const STEP: f32 = 1.0 / 60.0;

    /// Stands still from now on, but for one step at the next [`Clock::advance`].
    pub fn step(&mut self) {
        self.paused = true;
        self.step = true;
    }

    /// How far the stage's time goes on while `seconds` go by outside. What is negative or no number is nothing.
    pub fn advance(&mut self, seconds: f32) -> f32 {
        if std::mem::take(&mut self.step) {
            return Self::STEP;
        }
        // So that a NaN is nothing as well.
        match !self.paused && seconds > 0.0 {
            true => seconds.min(Self::LONGEST) * self.speed,
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_bounded_slowed_and_stepped() {
        let mut clock = Clock::default();
        assert_eq!(clock.advance(0.02), 0.02);
        assert_eq!(clock.advance(7.0), Clock::LONGEST);
        assert_eq!(clock.advance(-1.0), 0.0);
        assert_eq!(clock.advance(f32::NAN), 0.0);
        clock.speed = 0.25;
        assert_eq!(clock.advance(0.04), 0.01);
        clock.step();
        assert_eq!(clock.advance(0.04), Clock::STEP);
        assert_eq!(clock.advance(0.04), 0.0, "after a step it stands");
        clock.paused = false;
        assert_eq!(clock.advance(0.04), 0.01);
    }
}

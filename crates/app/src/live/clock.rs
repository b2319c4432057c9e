/// Maps real time to simulated time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Simulated seconds per real second. Default: 1.
    pub speed: f32,
    /// Whether simulated time stands still.
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
    /// Longest real time of a frame, in seconds; after a pause nothing leaps.
    pub const LONGEST: f32 = 0.1;
    /// Duration of a single step, in seconds.
    pub const STEP: f32 = 1.0 / 60.0;

    /// Pauses after one step at the next [`Clock::advance`].
    pub fn step(&mut self) {
        self.paused = true;
        self.step = true;
    }

    /// Simulated seconds for real `seconds`. Negative numbers and NaN count as 0.
    pub fn advance(&mut self, seconds: f32) -> f32 {
        if std::mem::take(&mut self.step) {
            return Self::STEP;
        }
        // NaN becomes 0, too.
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

use serde::{Deserialize, Serialize};

/// Limits of steering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteerSettings {
    /// Time between two searches, in seconds. Default 0.15. A goal that changes is searched for at once.
    pub interval: f32,
    /// Time in which a jump blends, in seconds. Default 0.3.
    pub blend: f32,
    /// A jump is made only to a moment that is nearer to what is asked for than the one that is played, by this: a squared distance of
    /// features without a unit, of which 1 is about 8 cm of the way in 0.2 s. Default 1.5.
    pub gain: f32,
    /// Slowest playback rate. Default 0.8.
    pub slowest: f32,
    /// Fastest playback rate. Default 1.25.
    pub fastest: f32,
    /// Fastest turn that is added to a character that walks, in radians per second. Default 2.6.
    pub turn: f32,
    /// Fastest turn that is added to a character that stands, in radians per second. Default 1.6.
    pub standing_turn: f32,
    /// Largest turn that a jump adds, in radians. Default 0.5.
    pub jump_turn: f32,
    /// Distance that the root keeps from obstacles on the ground, in metres. Default 0.45.
    pub clearance: f32,
    /// Obstacles that are reached within this time are steered around, in seconds. Default 1.2.
    pub foresight: f32,
    /// What stands idle repeats nothing within this time where the clips allow, in seconds. Default 10.
    pub repeat: f32,
}

impl Default for SteerSettings {
    fn default() -> Self {
        Self {
            interval: 0.15,
            blend: 0.3,
            gain: 1.5,
            slowest: 0.8,
            fastest: 1.25,
            turn: 2.6,
            standing_turn: 1.6,
            jump_turn: 0.5,
            clearance: 0.45,
            foresight: 1.2,
            repeat: 10.0,
        }
    }
}

impl SteerSettings {
    /// Whether every number is finite and in its range.
    pub(in crate::character) fn is_sound(&self) -> bool {
        let most = [
            (self.interval, 60.0),
            (self.blend, 10.0),
            (self.gain, 1e6),
            (self.turn, 100.0),
            (self.standing_turn, 100.0),
            (self.jump_turn, 10.0),
            (self.clearance, 100.0),
            (self.foresight, 60.0),
            (self.repeat, 3600.0),
        ];
        most.iter()
            .all(|(value, most)| (0.0..=*most).contains(value))
            && 0.1 <= self.slowest
            && self.slowest <= self.fastest
            && self.fastest <= 10.0
    }
}

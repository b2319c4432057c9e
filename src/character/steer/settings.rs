use serde::{Deserialize, Serialize};

use super::super::error::CharacterError;
use super::super::range::within;

/// Limits of steering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteerSettings {
    /// Time between two searches, in seconds, 0 to 60. Default 0.15. A goal that changes is searched for at once.
    pub interval: f32,
    /// Time in which a jump blends, in seconds, 0 to 10. Default 0.3.
    pub blend: f32,
    /// A jump is made only to a moment that is nearer to what is asked for than the one that is played, by this: a squared distance of
    /// features without a unit, of which 1 is about 8 cm of the way in 0.2 s; 0 to 1,000,000. Default 1.5.
    pub gain: f32,
    /// Slowest playback rate, 0.1 to 10. Default 0.8.
    pub slowest: f32,
    /// Fastest playback rate, from the slowest to 10. Default 1.25.
    pub fastest: f32,
    /// Fastest turn that is added to a character that walks, in radians per second, 0 to 100. Default 2.6.
    pub turn: f32,
    /// Fastest turn that is added to a character that stands, in radians per second, 0 to 100. Default 1.6.
    pub standing_turn: f32,
    /// Largest turn that a jump adds, in radians, 0 to 10. Default 0.5.
    pub jump_turn: f32,
    /// Distance that the root keeps from obstacles on the ground, in metres, 0 to 100. Default 0.45.
    pub clearance: f32,
    /// Obstacles that are reached within this time are steered around, in seconds, 0 to 60. Default 1.2.
    pub foresight: f32,
    /// What stands idle repeats nothing within this time where the clips allow, in seconds, 0 to 3,600. Default 10.
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
    /// Refuses what no step could use.
    pub(in crate::character) fn check(&self) -> Result<(), CharacterError> {
        for (name, value, least, most) in [
            ("the time between searches", self.interval, 0.0, 60.0),
            ("the time of a jump's blend", self.blend, 0.0, 10.0),
            ("the gain of a jump", self.gain, 0.0, 1e6),
            ("the slowest rate", self.slowest, 0.1, 10.0),
            ("the fastest rate", self.fastest, self.slowest, 10.0),
            ("the turn of what walks", self.turn, 0.0, 100.0),
            ("the turn of what stands", self.standing_turn, 0.0, 100.0),
            ("the turn of a jump", self.jump_turn, 0.0, 10.0),
            ("the distance from obstacles", self.clearance, 0.0, 100.0),
            ("the foresight", self.foresight, 0.0, 60.0),
            ("the time without repetition", self.repeat, 0.0, 3600.0),
        ] {
            within(name, value, least..=most)?;
        }
        Ok(())
    }
}

use super::side::Side;
use crate::graph::{EdgeId, Motion, Playhead};
use crate::query::{Attack, Request};

/// An announced attack.
#[derive(Clone, Debug, PartialEq)]
pub struct Challenge {
    /// Fighter that attacks.
    pub attacker: Side,
    /// Current position of the fighter that is attacked.
    pub playhead: Playhead,
    /// Motion of the attacked fighter from now on. Its blend fades out in every answer.
    pub playing: Motion,
    /// Attack, in the world of the duel. Its times count from now.
    pub attack: Attack,
    /// Edge of the attack.
    pub strike: EdgeId,
    /// Edges that lead to the attack, from the attacker's next node when it decides to attack.
    pub path: Vec<EdgeId>,
    /// Time from the duel's start to the announcement, in seconds.
    pub announced: f32,
    /// Time from now to the impact, in seconds.
    pub lead: f32,
    /// Clearance of a fighter that does not react, in metres. It is below 0.
    pub without: f32,
}

impl Challenge {
    /// Request of the attacked fighter.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request {
            playing: Some(self.playing.moment_at(0.0)),
            ..Request::new(self.playhead, &self.attack)
        }
    }
}

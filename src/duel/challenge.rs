use super::side::Side;
use crate::graph::{EdgeId, Motion, Playhead};
use crate::query::{Attack, Request};

/// An announced attack.
#[derive(Clone, Debug, PartialEq)]
pub struct Challenge {
    /// The fighter that attacks.
    pub attacker: Side,
    /// Current position of the fighter that is attacked.
    pub playhead: Playhead,
    /// What that fighter plays from now on. Its blend fades out in every answer.
    pub playing: Motion,
    /// Attack in the duel's world; its clock starts now.
    pub attack: Attack,
    /// Edge of the attack.
    pub strike: EdgeId,
    /// Edges that lead to it, from the attacker's next node at its beginning.
    pub path: Vec<EdgeId>,
    /// Time of the announcement, seconds since the duel's start.
    pub announced: f32,
    /// Time from now to the impact, seconds.
    pub lead: f32,
    /// Clearance of the body of a fighter that does not react, metres; below 0.
    pub without: f32,
}

impl Challenge {
    /// The request of the character that is attacked.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request {
            playing: Some(self.playing.moment_at(0.0)),
            ..Request::new(self.playhead, &self.attack)
        }
    }
}

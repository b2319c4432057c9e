//! The embedded motions: a humanoid of 24 nodes that stands in guard, moves about, strikes and, above all, evades.
//!
//! All of it is made by code when asked for: key postures, foot steps and events are
//! written down as a choreography, curves run through the keys, and a solver turns each instant into joint rotations.
//! Planted feet stand still, since legs reach for them and not the other way round. The same bits come out every time.
//!
//! Every clip starts and ends in nearly the same guard, so that a motion graph can join them all.

mod attacks;
pub mod by_time;
pub mod coverage;
mod evasions;
mod feet;
pub mod interval;
mod keys;
mod locomotion;
mod rhythm;
mod score;
mod skeleton;
mod solve;
mod stance;
pub mod throw;

use sabaki::anim::{Clip, ClipError, Event, Skeleton};

/// The embedded motions.
#[derive(Clone, Debug)]
pub struct Motions {
    /// 24 nodes with five end sites, 1.75 m tall, T-pose with identity rotations; left is +X, facing +Z, metres.
    pub skeleton: Skeleton,
    /// At 30 frames per second, each from guard to guard, starting at the origin; metres, ground at y = 0.
    pub clips: Vec<Clip>,
    /// Every attack and evasion in `clips`, by clip and start.
    pub events: Vec<Event>,
}

/// Makes the embedded motions. The same bits each time.
///
/// # Errors
/// None but by a fault in the choreography, which the tests would show.
pub fn motions() -> Result<Motions, ClipError> {
    let skeleton = skeleton::humanoid()?;
    let mut scores = Vec::new();
    stance::scores(&mut scores);
    locomotion::scores(&mut scores);
    evasions::scores(&mut scores);
    attacks::scores(&mut scores);
    let mut clips = Vec::with_capacity(scores.len());
    let mut events = Vec::new();
    for (index, score) in scores.iter().enumerate() {
        let (clip, of_clip) = score.play(&skeleton, index)?;
        clips.push(clip);
        events.extend(of_clip);
    }
    Ok(Motions {
        skeleton,
        clips,
        events,
    })
}

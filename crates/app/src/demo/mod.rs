//! The embedded motions: a humanoid of 24 nodes that stands in guard, moves about, strikes and evades.
//!
//! Code generates all clips on demand: a choreography lists key poses, foot steps and events, splines interpolate the
//! keys, and an inverse-kinematics solver computes the joint rotations of each frame. Planted feet stand still, since
//! the legs reach for them. The result is the same to the bit every time.
//!
//! All clips start and end in nearly the same guard, so that a motion graph can join them.

mod attacks;
pub mod by_time;
mod choreography;
pub mod coverage;
mod evasions;
mod feet;
mod guard;
pub mod interval;
mod keys;
mod limbs;
mod locomotion;
pub mod quality;
mod rhythm;
mod skeleton;
mod solve;
mod stance;
pub mod throw;
pub mod why_hit;

use sabaki::anim::{Clip, ClipError, Event, Skeleton};

/// The embedded motions.
#[derive(Clone, Debug)]
pub struct Motions {
    /// 24 nodes with five end sites, 1.75 m tall, T-pose with identity rotations. Left is +X, forward is +Z. In metres.
    pub skeleton: Skeleton,
    /// Clips at 30 frames per second, each from guard to guard, starting at the origin. In metres; ground at y = 0.
    pub clips: Vec<Clip>,
    /// The attacks and evasions of `clips`, sorted by clip and start.
    pub events: Vec<Event>,
}

/// Generates the embedded motions. The result is the same to the bit every time.
///
/// # Errors
/// Only by a fault in the choreography, which the tests would find.
pub fn motions() -> Result<Motions, ClipError> {
    let skeleton = skeleton::humanoid()?;
    let mut choreographies = Vec::new();
    stance::choreographies(&mut choreographies);
    locomotion::choreographies(&mut choreographies);
    evasions::choreographies(&mut choreographies);
    attacks::choreographies(&mut choreographies);
    let mut clips = Vec::with_capacity(choreographies.len());
    let mut events = Vec::new();
    for (index, choreography) in choreographies.iter().enumerate() {
        let (clip, of_clip) = choreography.play(&skeleton, index)?;
        clips.push(clip);
        events.extend(of_clip);
    }
    Ok(Motions {
        skeleton,
        clips,
        events,
    })
}

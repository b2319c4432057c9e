//! Final check of a warped motion, frame by frame: planted feet stay in place, and no joint exceeds the limits of speed.

use glam::{Quat, Vec3};

use crate::anim::{Chain, Pose, Rig};
use crate::graph::{Motion, MotionGraph};
use crate::query::settings::WarpLimits;

/// Scratch of the check: poses of the last three frames, each without and with the warp.
pub(super) type Frames = [[Pose; 2]; 3];

/// Reason why a warp is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Refused {
    /// A planted foot moves.
    Slides,
    /// The angular velocity or acceleration of a joint is too high.
    TooFast,
}

/// Checks each frame of a warped motion within the envelope, at the frame rate of the clips. `plain` is the motion without the warp.
pub(super) fn check(
    graph: &MotionGraph,
    motion: &Motion,
    plain: &Motion,
    limits: &WarpLimits,
    frames: &mut Frames,
) -> Result<(), Refused> {
    let Some(warp) = motion.warp() else {
        return Ok(());
    };
    let rate = graph.frame_rate() as f32;
    let first = (warp.envelope.start.max(0.0) * rate) as usize;
    let last = (warp.envelope.end * rate).ceil() as usize + 1;
    for (count, frame) in (first.saturating_sub(1)..=last).enumerate() {
        frames.rotate_left(1);
        let seconds = frame as f32 / rate;
        let [base, bent] = &mut frames[2];
        motion.sample_unbent(graph, seconds, bent);
        match warp.moment(seconds) == seconds {
            true => base.copy_from(bent),
            false => plain.sample(graph, seconds, base),
        }
        let weight = warp.envelope.weight(seconds);
        if weight > 0.0 {
            let feet_before = Ankles::new(graph, bent);
            warp.bend.apply(graph.rigged_skeleton(), weight, bent);
            check_feet(graph, motion, limits.slide, &feet_before, bent, seconds)?;
        }
        if count >= 1 {
            check_speeds(graph, limits, frames, count >= 2)?;
        }
    }
    Ok(())
}

/// Checks that planted feet move by at most `slide` metres, except lifted ones.
fn check_feet(
    graph: &MotionGraph,
    motion: &Motion,
    slide: f32,
    before: &Ankles,
    pose: &Pose,
    seconds: f32,
) -> Result<(), Refused> {
    let playhead = motion.playhead(graph, seconds);
    let after = Ankles::new(graph, pose);
    let bend = motion.warp().map(|warp| warp.bend).unwrap_or_default();
    for limb in 0..Rig::LEGS {
        let (Some(before), Some(after)) = (before.0[limb], after.0[limb]) else {
            continue;
        };
        let is_lifted = bend.ends[limb] != Vec3::ZERO;
        let stands = graph.foot_stands(playhead.edge, playhead.frame, limb);
        if stands && !is_lifted && before.distance(after) > slide {
            return Err(Refused::Slides);
        }
    }
    Ok(())
}

/// Checks that no displaced joint exceeds the limits, unless the motion without the warp exceeds them too.
fn check_speeds(
    graph: &MotionGraph,
    limits: &WarpLimits,
    frames: &Frames,
    has_three: bool,
) -> Result<(), Refused> {
    let rate = graph.frame_rate() as f32;
    for joint in 0..graph.skeleton().len() {
        let [before, now] = [1, 2].map(|at| [0, 1].map(|kind| frames[at][kind].rotations[joint]));
        let earlier = [0, 1].map(|kind| {
            let pose = frames[0][kind].rotations.get(joint);
            pose.copied().unwrap_or(before[kind])
        });
        if now[0] == now[1] && before[0] == before[1] {
            continue;
        }
        let velocity = |a: Quat, b: Quat| {
            let turn = a.conjugate() * b;
            let turn = if turn.w < 0.0 { -turn } else { turn };
            // For the small angles between two frames the sine is nearly the angle.
            turn.xyz() * (2.0 * rate)
        };
        let speeds = |kind: usize| {
            let latest = velocity(before[kind], now[kind]);
            let change = (latest - velocity(earlier[kind], before[kind])) * rate;
            (latest.length(), change.length())
        };
        let (own, bent) = (speeds(0), speeds(1));
        let is_faster = bent.0 > limits.angular_velocity.max(own.0);
        let is_sharper = has_three && bent.1 > limits.angular_acceleration.max(own.1);
        if is_faster || is_sharper {
            return Err(Refused::TooFast);
        }
    }
    Ok(())
}

/// Positions of the ankles.
struct Ankles([Option<Vec3>; Rig::LEGS]);

impl Ankles {
    fn new(graph: &MotionGraph, pose: &Pose) -> Self {
        let chain = Chain::of(graph.skeleton(), pose);
        let ankle = |limb: usize| {
            let leg = graph.rig().limbs()[limb]?;
            Some(chain.global(leg.foot).translation)
        };
        Self([ankle(0), ankle(1)])
    }
}

//! Final check of a warped motion, frame by frame: planted feet stay in place, and no joint exceeds the limits of speed.

use glam::Vec3;

use super::settings::WarpLimits;
use crate::anim::{Chain, Pose, Rig};
use crate::graph::{Motion, MotionGraph};

/// Scratch of the check.
#[derive(Clone, Debug, Default)]
pub(super) struct CheckScratch {
    /// Poses of the last three frames, each without and with the warp.
    frames: [[Pose; 2]; 3],
}

/// Reason why a warp is rejected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Refused {
    /// A planted foot moves.
    Slides,
    /// The angular velocity or acceleration of a joint is too high.
    TooFast,
}

/// The check of one warped motion.
pub(super) struct MotionCheck<'a> {
    pub graph: &'a MotionGraph,
    /// The motion with the warp.
    pub motion: &'a Motion,
    /// The motion without the warp.
    pub plain: &'a Motion,
    pub limits: &'a WarpLimits,
}

impl MotionCheck<'_> {
    /// Checks each frame within the envelope, at the frame rate of the clips.
    pub(super) fn run(&self, scratch: &mut CheckScratch) -> Result<(), Refused> {
        let &Self {
            graph,
            motion,
            plain,
            ..
        } = self;
        let Some(warp) = motion.warp() else {
            return Ok(());
        };
        let rate = graph.frame_rate() as f32;
        let first = (warp.envelope.start.max(0.0) * rate) as usize;
        let last = (warp.envelope.end * rate).ceil() as usize + 1;
        for (count, frame) in (first.saturating_sub(1)..=last).enumerate() {
            scratch.frames.rotate_left(1);
            let seconds = frame as f32 / rate;
            let [base, bent] = &mut scratch.frames[2];
            motion.sample_unbent(graph, seconds, bent);
            match warp.moment(seconds) == seconds {
                true => base.copy_from(bent),
                false => plain.sample(graph, seconds, base),
            }
            let weight = warp.envelope.weight(seconds);
            if weight > 0.0 {
                let feet_before = Ankles::of(graph, bent);
                warp.bend.apply(graph.rigged_skeleton(), weight, bent);
                self.feet(&feet_before, bent, seconds)?;
            }
            if count >= 1 {
                self.speeds(&scratch.frames, count >= 2)?;
            }
        }
        Ok(())
    }

    /// Checks that planted feet stay, except lifted ones.
    fn feet(&self, before: &Ankles, pose: &Pose, seconds: f32) -> Result<(), Refused> {
        let Self { graph, motion, .. } = self;
        let playhead = motion.playhead(graph, seconds);
        let after = Ankles::of(graph, pose);
        let bend = motion.warp().map(|warp| warp.bend).unwrap_or_default();
        for limb in 0..Rig::LEGS {
            let (Some(before), Some(after)) = (before.0[limb], after.0[limb]) else {
                continue;
            };
            let is_lifted = bend.ends[limb] != Vec3::ZERO;
            let stands = graph.foot_stands(playhead.edge, playhead.frame, limb);
            if stands && !is_lifted && before.distance(after) > self.limits.slide {
                return Err(Refused::Slides);
            }
        }
        Ok(())
    }

    /// Checks that no displaced joint exceeds the limits, unless the motion without the warp exceeds them too.
    fn speeds(&self, frames: &[[Pose; 2]; 3], has_three: bool) -> Result<(), Refused> {
        let Self { graph, limits, .. } = self;
        let rate = graph.frame_rate() as f32;
        for joint in 0..graph.skeleton().len() {
            let [before, now] =
                [1, 2].map(|at| [0, 1].map(|kind| frames[at][kind].rotations[joint]));
            let earlier = [0, 1].map(|kind| {
                let pose = frames[0][kind].rotations.get(joint);
                pose.copied().unwrap_or(before[kind])
            });
            if now[0] == now[1] && before[0] == before[1] {
                continue;
            }
            let velocity = |a: glam::Quat, b: glam::Quat| {
                let turn = a.conjugate() * b;
                let turn = if turn.w < 0.0 { -turn } else { turn };
                // For the small angles between two frames the sine is nearly the angle.
                turn.xyz() * (2.0 * rate)
            };
            let of = |kind: usize| {
                let latest = velocity(before[kind], now[kind]);
                let change = (latest - velocity(earlier[kind], before[kind])) * rate;
                (latest.length(), change.length())
            };
            let (own, bent) = (of(0), of(1));
            let is_faster = bent.0 > limits.angular_velocity.max(own.0);
            let is_sharper = has_three && bent.1 > limits.angular_acceleration.max(own.1);
            if is_faster || is_sharper {
                return Err(Refused::TooFast);
            }
        }
        Ok(())
    }
}

/// Positions of the ankles.
struct Ankles([Option<Vec3>; Rig::LEGS]);

impl Ankles {
    fn of(graph: &MotionGraph, pose: &Pose) -> Self {
        let chain = Chain::of(graph.skeleton(), pose);
        let ankle = |limb: usize| {
            let leg = graph.rig().limbs()[limb]?;
            Some(chain.global(leg.foot).translation)
        };
        Self([ankle(0), ankle(1)])
    }
}

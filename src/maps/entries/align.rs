//! Aligns targets with the frame that is left, and excludes targets that are too far away.

use glam::Vec3;

use super::Stance;
use super::aligned::{Aligned, FOOT_APART, Leaving, Points, ROOT_APART};
use super::finder::{Departed, Finder};
use super::limits::DEPARTURES;
use super::targets::ClipFrame;
use crate::graph::Node;
use crate::math::Rigid2;

/// Number of frames after the target in which a foot must still stand to be preferred as the pin.
const STAYS: u32 = 4;

impl Finder<'_> {
    /// Prepares the frame after a frame of a clip as the one that is left.
    pub(super) fn leaving(&self, before: ClipFrame) -> Leaving {
        let (graph, clip) = (self.graph, before.clip);
        let at = (before.frame + 1).min(graph.clip(clip).frames() as u32 - 1);
        let legs = graph.feet().legs().len().min(Stance::LEGS);
        let standing = (0..legs).map(|leg| graph.feet().stands(clip, leg, at));
        Leaving {
            before,
            stance: Stance::of_frame(graph, self.facing, Node { clip, frame: at }),
            standing: standing.collect(),
            ways: [before.frame, at]
                .map(|frame| Points::of(graph, self.head, Node { clip, frame })),
        }
    }

    /// Writes for each target whether [`Finder::align`] may align it.
    pub(super) fn find_near(&self, from: &Departed, near: &mut Vec<bool>) {
        match self.near.is_empty() {
            false => self.near.find(&from.at.stance, &from.at.standing, near),
            // The body has no feet.
            true => {
                near.clear();
                near.resize(self.targets.len(), true);
            }
        }
    }

    /// Aligns a target. Returns `None` if it is within three frames of the frame that is left, or too far away.
    pub(super) fn align(&self, from: &Leaving, target: usize) -> Option<Aligned> {
        let at = &self.targets[target];
        let now = from.before.frame + 1;
        if at.clip == from.before.clip && at.frame.abs_diff(now) <= 3 {
            return None;
        }
        let (apart, pin) = self.pin(from, target)?;
        let align = from.stance.align(&self.stances[target], pin);
        let (departed, goes_on) = self.departed(from.ways, target, align);
        Some(Aligned {
            target,
            pin,
            align,
            cost: apart + departed,
            goes_on,
        })
    }

    /// Departure of hips and head from constant velocity, in metres, and whether it is within the limits. After the longest blend of an entry
    /// the body is where the target's clip has it, so no pose of the blend is needed.
    fn departed(&self, [before, now]: [Points; 2], target: usize, align: Rigid2) -> (f32, bool) {
        let last = DEPARTURES.len() - 1;
        let frames = (DEPARTURES[last] * self.graph.frame_rate() as f32).round();
        let then = self.points[target];
        let off = |before: Vec3, now: Vec3, then: Vec3| {
            align.point(then) - (now + (now - before) * frames)
        };
        let hip = off(before.hip, now.hip, then.hip).with_y(0.0).length();
        let head = off(before.head, now.head, then.head).length();
        let fits =
            hip <= self.limits.hip_departure[last] && head <= self.limits.head_departure[last];
        (hip + head, fits)
    }

    /// Cost of the best alignment, and the leg whose foot stays in place, or `None` for the root. Candidates are the feet that stand in both
    /// motions; if there are none, all feet that stand; if there are none, the root. The one that leaves root and other feet least far apart is
    /// chosen. Returns `None` if all leave them too far apart.
    fn pin(&self, from: &Leaving, target: usize) -> Option<(f32, Option<usize>)> {
        let (stance, standing) = (&from.stance, &from.standing);
        let (other, at) = (&self.stances[target], &self.targets[target]);
        let stays =
            |leg: usize| standing[leg] && self.graph.feet().stands(at.clip, leg, at.frame + STAYS);
        let any_stays = (0..standing.len()).any(stays);
        let standing_legs = (0..standing.len())
            .filter(|&leg| standing[leg] && (stays(leg) || !any_stays))
            .map(Some);
        let none = (!standing.contains(&true)).then_some(None);
        let pins = standing_legs.chain(none);
        let costs = pins.filter_map(|pin| {
            let (root, feet) = stance.apart(other, stance.align(other, pin));
            let furthest = feet[..standing.len()].iter().copied().fold(0.0, f32::max);
            (root <= ROOT_APART && furthest <= FOOT_APART).then_some((root + 0.3 * furthest, pin))
        });
        costs.min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

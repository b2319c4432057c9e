//! Inertialization: a cut from one motion to another, after which the offset between the two fades out.
//!
//! Source: Bollo, "Inertialization: High-Performance Animation Transitions in Gears of War" (GDC 2018): after the cut only the new
//! motion is evaluated. The offset of the old motion at the cut, with its velocity, is added as a quintic that decays to 0. Differs:
//! offsets of rotations are rotation vectors with three quintics each, not an angle about one axis, and their initial acceleration is 0.
//! Feet have offsets in the space of the motion, and the legs follow by inverse kinematics. The offset of a foot is that of its toe, about
//! which it also turns: a foot whose toe is planted at the same place in both motions pivots on it. A foot that has to move takes a step,
//! and no toe is lower than in the lower one of both motions.

use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

use super::{EdgeId, MotionGraph, Playhead};
use crate::anim::{Chain, JointTransform, Leg, Pose, Skeleton, reach};
use crate::math::Rigid2;

/// Position in the graph at which a motion continues without an edge that leads there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Edge to play.
    pub edge: EdgeId,
    /// Position on the edge, in frames.
    pub frame: f32,
    /// Transform from the space of the clip in which the edge starts to the world.
    pub clip_to_world: Rigid2,
    /// Playback rate of the edge and of the following edges of its clip, up to the end of the next event.
    pub rate: f32,
    /// Duration of the fade-out of the previous motion, in seconds. Above 0.
    pub blend: f32,
}

impl Entry {
    /// The position that it leads to.
    pub(crate) fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: self.frame,
            clip_to_world: self.clip_to_world,
        }
    }
}

/// An offset that decays to 0: its initial value and its initial rate of change per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Decay {
    value: Vec3,
    speed: Vec3,
}

impl Decay {
    /// Decay of an offset that is `now` at first and `then` after `step` seconds.
    fn new(now: Vec3, then: Vec3, seconds: f32) -> Self {
        Self {
            value: now,
            speed: (then - now) / seconds,
        }
    }

    fn at(&self, weights: Weights) -> Vec3 {
        self.value * weights.value + self.speed * weights.speed
    }

    /// The same in a space that is turned.
    fn turn(&mut self, by: Rigid2) {
        self.value = by.vector(self.value);
        self.speed = by.vector(self.speed);
    }

    fn is_finite(&self) -> bool {
        self.value.is_finite() && self.speed.is_finite()
    }
}

/// Weights of a decay's initial value and initial velocity at a moment. The latter is in seconds.
#[derive(Clone, Copy)]
struct Weights {
    value: f32,
    speed: f32,
    /// Weight of a foot's lift, 1 in the middle of the decay.
    lift: f32,
}

impl Weights {
    /// Weights at a share of a decay of a given duration: quintics whose velocity and acceleration are 0 at the end.
    fn new(share: f32, seconds: f32) -> Self {
        let s = share.clamp(0.0, 1.0);
        let cube = s * s * s;
        let flat = s * (1.0 - s);
        Self {
            value: 1.0 - cube * (10.0 - s * (15.0 - 6.0 * s)),
            speed: seconds * (s - cube * (6.0 - s * (8.0 - 3.0 * s))),
            lift: 16.0 * flat * flat,
        }
    }
}

/// Decaying offset of the position of a foot's toe and of the foot's rotation, in the space of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct FootDecay {
    place: Decay,
    rotation: Decay,
    /// Height to which the foot is lifted on its way, in metres.
    lift: f32,
    /// Height of the toe at the cut, in metres.
    floor: f32,
}

/// Decaying offsets after one cut of a motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Inertia {
    /// Time of the cut, in seconds since the motion's start. Negative if the motion is the remainder of another.
    pub(super) start: f32,
    pub(super) seconds: f32,
    root: Decay,
    /// Offset of each joint's rotation.
    joints: Vec<Decay>,
    /// Offset of each joint's translation, if one of the motions has translations.
    places: Vec<Decay>,
    /// Offset of each leg's foot.
    feet: Vec<FootDecay>,
}

/// Scratch: poses of both motions at the cut and a moment later.
#[derive(Clone, Debug, Default)]
pub(super) struct EntryScratch {
    pub(super) from: [Pose; 2],
    pub(super) to: [Pose; 2],
}

/// Minimum distance that a foot moves to be lifted, in metres.
const DRAGGED: f32 = 0.02;
/// Height of a step as a share of its length, and maximum height in metres.
const LIFT: (f32, f32) = (0.25, 0.12);

impl Inertia {
    /// Computes the offsets from `poses.to` to `poses.from` at `start`. The second pose of each is `step` seconds later.
    pub(super) fn measure(
        &mut self,
        graph: &MotionGraph,
        poses: &mut EntryScratch,
        (start, seconds, step): (f32, f32, f32),
    ) {
        let skeleton = graph.skeleton();
        let EntryScratch { from, to } = poses;
        (self.start, self.seconds) = (start, seconds);
        self.root = Decay::new(from[0].root - to[0].root, from[1].root - to[1].root, step);
        self.joints.clear();
        let turn = |at: usize, joint: usize| {
            rotation_vector(from[at].rotations[joint] * to[at].rotations[joint].conjugate())
        };
        let turns =
            (0..skeleton.len()).map(|joint| decay_of_turn([0, 1].map(|at| turn(at, joint)), step));
        self.joints.extend(turns);
        self.feet.clear();
        for leg in graph.feet().legs() {
            let foot = |pose: &Pose| Foot::of(skeleton, pose, leg).at_toe;
            let (from, to) = (
                [foot(&from[0]), foot(&from[1])],
                [foot(&to[0]), foot(&to[1])],
            );
            self.feet.push(FootDecay::new(from, to, step));
        }
        self.places.clear();
        let moved = |poses: &[Pose; 2]| poses.iter().any(|pose| !pose.translations.is_empty());
        if moved(from) || moved(to) {
            from.iter_mut()
                .chain(to.iter_mut())
                .for_each(|pose| pose.fill_translations(skeleton));
            let apart =
                |at: usize, joint: usize| from[at].translations[joint] - to[at].translations[joint];
            let places =
                (0..skeleton.len()).map(|joint| Decay::new(apart(0, joint), apart(1, joint), step));
            self.places.extend(places);
        }
    }

    /// Turns what stands in the space of the motion: root, root rotation and feet.
    pub(super) fn turn(&mut self, by: Rigid2) {
        self.root.turn(by);
        if let Some(root) = self.joints.first_mut() {
            root.turn(by);
        }
        for foot in &mut self.feet {
            foot.place.turn(by);
            foot.rotation.turn(by);
        }
    }

    /// Whether it fits a skeleton: asked of what is read from a file.
    pub(super) fn is_sound(&self, joints: usize, legs: usize) -> bool {
        let feet = self.feet.iter().all(|foot| {
            foot.place.is_finite()
                && foot.rotation.is_finite()
                && foot.lift.is_finite()
                && foot.floor.is_finite()
        });
        let lists = [&self.joints, &self.places];
        let finite = lists.iter().all(|list| list.iter().all(Decay::is_finite));
        self.start.is_finite()
            && self.seconds > 0.0
            && self.seconds.is_finite()
            && self.root.is_finite()
            && self.joints.len() == joints
            && (self.places.is_empty() || self.places.len() == joints)
            && self.feet.len() == legs
            && feet
            && finite
    }

    /// Whether the offsets are not yet 0 at `seconds` of the motion.
    pub(super) fn lasts(&self, seconds: f32) -> bool {
        seconds - self.start < self.seconds
    }

    /// End of the decay, in seconds since the motion's start.
    pub(super) fn end(&self) -> f32 {
        self.start + self.seconds
    }

    fn weights(&self, seconds: f32) -> Weights {
        Weights::new((seconds - self.start) / self.seconds, self.seconds)
    }

    /// Offset of the root from that of the new motion, in metres.
    pub(super) fn root(&self, seconds: f32) -> Vec3 {
        self.root.at(self.weights(seconds))
    }

    /// Adds the offsets at `seconds` to the pose of the new motion.
    pub(super) fn apply(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        /// Maximum number of legs.
        const MOST: usize = 8;
        let (skeleton, weights) = (graph.skeleton(), self.weights(seconds));
        let legs = graph.feet().legs();
        let mut feet = [JointTransform::IDENTITY; MOST];
        for ((leg, decay), foot) in legs.iter().zip(&self.feet).zip(&mut feet) {
            *foot = decay.foot(skeleton, pose, (leg, weights));
        }
        pose.root += self.root.at(weights);
        for (rotation, decay) in pose.rotations.iter_mut().zip(&self.joints) {
            *rotation = (turn_of(decay.at(weights)) * *rotation).normalize();
        }
        if !self.places.is_empty() {
            pose.fill_translations(skeleton);
            for (place, decay) in pose.translations.iter_mut().zip(&self.places) {
                *place += decay.at(weights);
            }
        }
        for (leg, foot) in legs.iter().zip(feet) {
            reach(skeleton, pose, leg, foot);
        }
    }
}

/// The frame of a foot with its origin at the toe, and the position of the toe in the ankle's frame.
struct Foot {
    at_toe: JointTransform,
    toe: Vec3,
}

impl Foot {
    fn of(skeleton: &Skeleton, pose: &Pose, leg: &Leg) -> Self {
        let chain = Chain::of(skeleton, pose);
        let toe = chain.within(leg.toe_or_foot(), leg.foot).translation;
        let ankle = chain.global(leg.foot);
        let at_toe = JointTransform {
            translation: ankle.point(toe),
            ..ankle
        };
        Self { at_toe, toe }
    }
}

impl FootDecay {
    fn new(from: [JointTransform; 2], to: [JointTransform; 2], step: f32) -> Self {
        let apart = |at: usize| from[at].translation - to[at].translation;
        let turn = |at: usize| rotation_vector(from[at].rotation * to[at].rotation.conjugate());
        let way = apart(0).with_y(0.0).length();
        let (share, most) = LIFT;
        Self {
            place: Decay::new(apart(0), apart(1), step),
            rotation: decay_of_turn([turn(0), turn(1)], step),
            lift: share * (way - DRAGGED).clamp(0.0, most / share),
            floor: from[0].translation.y,
        }
    }

    /// Frame of the ankle with the foot's offset added.
    fn foot(
        &self,
        skeleton: &Skeleton,
        pose: &Pose,
        (leg, weights): (&Leg, Weights),
    ) -> JointTransform {
        let Foot { at_toe, toe } = Foot::of(skeleton, pose, leg);
        let lift = Vec3::Y * (self.lift * weights.lift);
        let mut place = at_toe.translation + self.place.at(weights) + lift;
        place.y = place.y.max(at_toe.translation.y.min(self.floor));
        let rotation = (turn_of(self.rotation.at(weights)) * at_toe.rotation).normalize();
        JointTransform {
            rotation,
            translation: place - rotation * toe,
        }
    }
}

/// Rotation vector (axis times angle, in radians) of the shorter rotation.
fn rotation_vector(turn: Quat) -> Vec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let (axis, sin) = (turn.xyz(), turn.xyz().length());
    if sin < 1e-6 {
        return 2.0 * axis;
    }
    axis * (2.0 * sin.atan2(turn.w) / sin)
}

fn turn_of(vector: Vec3) -> Quat {
    Quat::from_scaled_axis(vector)
}

/// Rotation vectors near half a turn may differ by a whole turn. Then the velocity is unknown and taken as 0.
fn decay_of_turn([now, then]: [Vec3; 2], step: f32) -> Decay {
    match (then - now).length() > std::f32::consts::PI {
        true => Decay::new(now, now, step),
        false => Decay::new(now, then, step),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_decays_starts_as_it_was_and_comes_to_rest() {
        let seconds = 0.2;
        let decay = Decay {
            value: Vec3::new(0.3, -0.1, 0.0),
            speed: Vec3::new(1.0, 0.0, -2.0),
        };
        let at = |t: f32| decay.at(Weights::new(t / seconds, seconds));
        assert_eq!(at(0.0), decay.value);
        assert_eq!(at(seconds), Vec3::ZERO);
        let h = 1e-3;
        let first = (at(h) - at(0.0)) / h;
        assert!(first.distance(decay.speed) < 0.05, "{first}");
        let last = (at(seconds) - at(seconds - h)) / h;
        assert!(last.length() < 0.01, "{last}");
    }

    #[test]
    fn turns_come_back_from_their_vectors() {
        for turn in [
            Quat::from_rotation_x(0.4) * Quat::from_rotation_z(-2.0),
            Quat::from_rotation_y(3.0),
            Quat::IDENTITY,
            -Quat::from_rotation_y(1e-4),
        ] {
            let back = turn_of(rotation_vector(turn));
            assert!(back.dot(turn).abs() > 1.0 - 1e-6, "{turn}");
        }
    }
}

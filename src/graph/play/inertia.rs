//! Inertialization: a cut from one motion to another, after which the offset between the two fades out.
//!
//! Source: Bollo, "Inertialization: High-Performance Animation Transitions in Gears of War" (GDC 2018): after the cut only the new
//! motion is evaluated. The offset of the old motion at the cut, with its velocity, is added as a quintic that decays to 0. Differs:
//! offsets of rotations are rotation vectors with three quintics each, not an angle about one axis, and their initial acceleration is 0.
//! Feet have offsets in the space of the motion, and the legs follow by inverse kinematics. The offset of a foot is that of its toe, about
//! which it also turns: a foot whose toe is planted at the same place in both motions pivots on it. A foot that has to move takes a step,
//! and no toe is lower than in the lower one of both motions. A foot that stands can be held where it is until it is lifted. The root may
//! take longer than the rest, so that it accelerates the body less; meanwhile the knees bend a little, as feet that stand would be out of reach
//! of straight legs. No knee is bent the wrong way further than in one of both motions: offsets of fast legs would do that.

use crate::anim::{Chain, JointTransform, Knee, KneeLimit, Leg, Pose, Skeleton};
use crate::graph::motion_graph::{EdgeId, MotionGraph};
use crate::graph::play::playhead::Playhead;
use crate::math::Rigid2;
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

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
    pub(crate) fn playhead(&self) -> Playhead {
        Playhead {
            edge: self.edge,
            frame: self.frame,
            clip_to_world: self.clip_to_world,
        }
    }
}

/// Decaying offsets after one cut of a motion.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Inertia {
    /// Time of the cut, in seconds since the motion's start. Negative if the motion is the remainder of another.
    pub(crate) start: f32,
    pub(crate) seconds: f32,
    /// Duration of the decay of the root's position, which may be longer than that of the joints and feet.
    root_seconds: f32,
    root: Decay,
    /// Distance by which the root is lowered in the middle of its decay, in metres.
    dip: f32,
    /// Offset of each joint's rotation.
    joints: Vec<Decay>,
    /// Offset of each joint's translation, if one of the motions has translations.
    places: Vec<Decay>,
    feet: Vec<FootDecay>,
}

impl Clone for Inertia {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, other: &Self) {
        (self.start, self.seconds) = (other.start, other.seconds);
        (self.root_seconds, self.root, self.dip) = (other.root_seconds, other.root, other.dip);
        self.joints.clone_from(&other.joints);
        self.places.clone_from(&other.places);
        self.feet.clone_from(&other.feet);
    }
}

/// Scratch: poses of both motions at the cut and a moment later.
#[derive(Clone, Debug, Default)]
pub(crate) struct EntryScratch {
    /// Time between the two poses of each motion, in seconds.
    pub(crate) step: f32,
    pub(crate) from: [Pose; 2],
    pub(crate) to: [Pose; 2],
}

/// Maximum distance from a joint to a point that it carries, in metres.
pub(crate) const BESIDE: f32 = 0.1;

/// Maximum translation and rotation of a joint, in metres and radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointReach {
    moved: f32,
    turned: f32,
}

/// Distances by which offsets move points [beside](BESIDE) joints, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BlendReach {
    /// Upper limit for the body, reached if all joints rotate a point in the same direction. A knee that is nearly straight can move further.
    pub(crate) body: f32,
    /// Maximum over the feet, which have offsets of their own.
    pub(crate) feet: f32,
}

impl Inertia {
    /// Distances by which the offsets at `seconds` move the body.
    pub(crate) fn reach(
        &self,
        graph: &MotionGraph,
        seconds: f32,
        reaches: &mut Vec<JointReach>,
    ) -> BlendReach {
        let weights = self.weights(seconds);
        let length = |decay: &Decay| decay.at(weights).length();
        reaches.clear();
        let mut body = 0.0;
        let joints = graph.skeleton().joints().iter();
        for (index, (joint, decay)) in joints.zip(&self.joints).enumerate() {
            let (moved, turned) = match joint.parent.map(|parent| reaches[parent.index()]) {
                None => (self.root(seconds).length(), 0.0),
                Some(JointReach { moved, turned }) => {
                    (moved + turned.min(2.0) * joint.offset.length(), turned)
                }
            };
            let moved = moved + self.places.get(index).map_or(0.0, length);
            let turned = turned + length(decay);
            body = f32::max(body, moved + turned.min(2.0) * BESIDE);
            reaches.push(JointReach { moved, turned });
        }
        // Feet give way to each other by no more than both offsets.
        let offsets = self.feet.iter().map(|foot| foot.offset(weights).length());
        BlendReach {
            body,
            feet: self.feet_moved(seconds) + offsets.sum::<f32>(),
        }
    }

    /// The largest distance by which the offsets at `seconds` move a foot, unless it gives way to the other one, in metres.
    pub(crate) fn feet_moved(&self, seconds: f32) -> f32 {
        let weights = self.weights(seconds);
        let reaches = self.feet.iter().map(|foot| foot.reach(weights));
        reaches.fold(0.0, f32::max)
    }

    pub(crate) fn set_times(&mut self, start: f32, seconds: f32) {
        (self.start, self.seconds, self.root_seconds) = (start, seconds, seconds);
    }

    /// Lets all times pass `rate` times as fast.
    pub(crate) fn retime(&mut self, rate: f32) {
        for time in [&mut self.start, &mut self.seconds, &mut self.root_seconds] {
            *time /= rate;
        }
        self.root.speed *= rate;
        let others = self.joints.iter_mut().chain(&mut self.places);
        others.for_each(|decay| decay.speed *= rate);
        for foot in &mut self.feet {
            foot.place.speed *= rate;
            foot.rotation.speed *= rate;
            let held = &mut foot.held;
            for time in [&mut held.from, &mut held.until, &mut held.release] {
                *time /= rate;
            }
        }
    }

    /// Lets the offset of the root's position decay for longer than the others, so that it accelerates the body less.
    pub(crate) fn slow_root(&mut self, seconds: f32) {
        self.root_seconds = seconds.max(self.seconds);
    }

    /// Lowers the root while its offset decays, the more the longer the offset, so that legs reach feet that stand.
    pub(crate) fn bend_knees(&mut self) {
        /// Share of the offset over the ground, and the most, in metres.
        const SHARE: f32 = 0.15;
        const MOST: f32 = 0.06;
        /// Largest acceleration, in metres per second squared, and that of a dip of 1 within 1.
        const PUSH: f32 = 4.0;
        const PEAK: f32 = 24.0;
        let way = self.root.value.with_y(0.0).length();
        let gentle = PUSH / PEAK * self.root_seconds * self.root_seconds;
        self.dip = (SHARE * way).min(MOST).min(gentle);
    }

    /// Computes the offsets from `poses.to` to `poses.from` at the cut.
    pub(crate) fn measure(&mut self, graph: &MotionGraph, poses: &mut EntryScratch) {
        let skeleton = graph.skeleton();
        let EntryScratch { from, to, step } = poses;
        let step = *step;
        self.root = Decay::new(from[0].root - to[0].root, from[1].root - to[1].root, step);
        self.dip = 0.0;
        self.joints.clear();
        let rotations =
            |poses: &[Pose; 2], joint: usize| [0, 1].map(|at| poses[at].rotations[joint]);
        self.joints.extend(
            (0..skeleton.len()).map(|joint| {
                Decay::of_rotations(rotations(from, joint), rotations(to, joint), step)
            }),
        );
        self.feet.clear();
        for (leg, &knee) in graph.feet().legs().iter().zip(graph.knees()) {
            let foot = |pose: &Pose| LegPose::from_pose(skeleton, pose, leg);
            let (from, to) = (
                [foot(&from[0]), foot(&from[1])],
                [foot(&to[0]), foot(&to[1])],
            );
            self.feet.push(FootDecay::new(from, to, knee, step));
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

    /// Transforms the offsets that are in the space of the motion: those of root, root rotation and feet.
    pub(crate) fn turn(&mut self, by: Rigid2) {
        self.root.turn(by);
        if let Some(root) = self.joints.first_mut() {
            root.turn(by);
        }
        for foot in &mut self.feet {
            foot.turn(by);
        }
    }

    /// Whether the offsets fit a skeleton. It checks offsets that come from a file.
    pub(crate) fn is_sound(&self, joints: usize, legs: usize) -> bool {
        let feet = self.feet.iter().all(FootDecay::is_finite);
        let lists = [&self.joints, &self.places];
        let finite = lists.iter().all(|list| list.iter().all(Decay::is_finite));
        self.start.is_finite()
            && self.seconds > 0.0
            && self.root_seconds >= self.seconds
            && self.root_seconds.is_finite()
            && self.root.is_finite()
            && self.dip.is_finite()
            && self.joints.len() == joints
            && (self.places.is_empty() || self.places.len() == joints)
            && self.feet.len() == legs
            && feet
            && finite
    }

    /// Whether the offsets are not yet 0 at `seconds` of the motion.
    pub(crate) fn lasts(&self, seconds: f32) -> bool {
        seconds < self.end()
    }

    /// Whether the offsets of the body are not yet 0 at `seconds` of the motion. Those of feet that are held last longer.
    pub(crate) fn moves_body(&self, seconds: f32) -> bool {
        seconds - self.start < self.root_seconds
    }

    /// Time when all offsets are 0, in seconds since the motion's start.
    pub(crate) fn end(&self) -> f32 {
        let held = self.feet.iter().map(|foot| foot.held.end());
        self.start + held.fold(self.root_seconds, f32::max)
    }

    /// Holds feet where they are, unless they are too far from where they belong. `standing` has for each leg whose foot stands the time since the
    /// cut when it is lifted, in seconds. Where all would take a step, the one that has the shortest way carries the body meanwhile.
    pub(crate) fn hold_feet(&mut self, standing: &[Option<f32>]) {
        let feet = self.feet.iter_mut().zip(standing);
        let standing = feet.filter_map(|(foot, until)| Some((foot, (*until)?)));
        let way = |foot: &FootDecay| foot.place.value.with_y(0.0).length();
        let mut nearest: Option<(&mut FootDecay, f32)> = None;
        for (foot, until) in standing {
            foot.hold(until, HeldFoot::NEAR);
            if nearest
                .as_ref()
                .is_none_or(|(other, _)| way(foot) < way(other))
            {
                nearest = Some((foot, until));
            }
        }
        if let Some((foot, until)) = nearest {
            foot.hold(until, HeldFoot::MOST);
        }
    }

    /// Holds feet that stand where they are, and puts down the others where the root will be in the middle of their stances, as in
    /// [`Motion::shift_on_feet`](crate::graph::Motion::shift_on_feet).
    pub(crate) fn place_feet(&mut self, stances: &[Option<[f32; 2]>]) {
        for (leg, stance) in stances.iter().enumerate().take(self.feet.len()) {
            let Some([down, lifted]) = *stance else {
                continue;
            };
            let middle = self.root(self.start + 0.5 * (down + lifted));
            let foot = &mut self.feet[leg];
            if down == 0.0 {
                foot.hold(lifted, f32::INFINITY);
            } else {
                foot.step_to(middle.with_y(0.0), self.seconds, lifted);
            }
        }
    }

    /// Lets go of the feet that are held once they are lifted. `lifted` has for each leg the time since the motion's start when that is, in seconds.
    pub(crate) fn release_feet(&mut self, lifted: &[Option<f32>]) {
        for (foot, lifted) in self.feet.iter_mut().zip(lifted) {
            foot.held = foot.held.released(lifted.map(|lifted| lifted - self.start));
        }
    }

    /// Time when feet are held no more, in seconds since the motion's start, if they are released like that.
    pub(crate) fn held_until(&self, lifted: &[Option<f32>]) -> f32 {
        let ends = self.feet.iter().zip(lifted).map(|(foot, lifted)| {
            let lifted = lifted.map(|lifted| lifted - self.start);
            foot.held.released(lifted).end()
        });
        self.start + ends.fold(0.0, f32::max)
    }

    /// Keeps the foot of a leg that stands at `seconds` of the motion where it was before the motion was turned by `by`, until it is lifted, in
    /// seconds from then on. `toe` is where the new motion had its toe before.
    pub(crate) fn keep_foot(
        &mut self,
        leg: usize,
        seconds: f32,
        by: Rigid2,
        toe: Vec3,
        lifted: f32,
    ) {
        if let Some(foot) = self.feet.get_mut(leg) {
            foot.keep(seconds - self.start, by, toe, lifted, self.seconds);
        }
    }

    /// No offset, for feet that are held from `seconds` of the motion on. The knees keep to how they bend in this pose.
    pub(crate) fn restart_still(&mut self, graph: &MotionGraph, seconds: f32, pose: &Pose) {
        let skeleton = graph.skeleton();
        self.set_times(seconds, STEP);
        (self.root, self.dip) = (Decay::default(), 0.0);
        self.places.clear();
        self.joints.clear();
        self.joints.resize(skeleton.len(), Decay::default());
        self.feet.clear();
        let legs = graph.feet().legs().iter().zip(graph.knees());
        self.feet.extend(legs.map(|(leg, &knee)| {
            let foot = [LegPose::from_pose(skeleton, pose, leg); 2];
            FootDecay::new(foot, foot, knee, STEP)
        }));
    }

    fn weights(&self, seconds: f32) -> Weights {
        Weights::new((seconds - self.start) / self.seconds, self.seconds)
    }

    /// Offset of the root from that of the new motion, in metres.
    pub(crate) fn root(&self, seconds: f32) -> Vec3 {
        let share = (seconds - self.start) / self.root_seconds;
        let weights = Weights::new(share, self.root_seconds);
        self.root.at(weights) - Vec3::Y * (self.dip * weights.lift * weights.lift.sqrt())
    }

    /// Adds the offsets at `seconds` to the pose of the new motion.
    pub(crate) fn apply(&self, graph: &MotionGraph, seconds: f32, pose: &mut Pose) {
        let (skeleton, weights) = (graph.skeleton(), self.weights(seconds));
        let legs = graph.feet().legs();
        let mut feet = [LegPose::ORIGIN; MOST_LEGS];
        for (leg, foot) in legs.iter().zip(&mut feet) {
            *foot = LegPose::from_pose(skeleton, pose, leg);
        }
        let moves_body = self.moves_body(seconds);
        if moves_body {
            pose.root += self.root(seconds);
            for (rotation, decay) in pose.rotations.iter_mut().zip(&self.joints) {
                *rotation = decay.rotated(*rotation, weights);
            }
        }
        if moves_body && !self.places.is_empty() {
            pose.fill_translations(skeleton);
            for (place, decay) in pose.translations.iter_mut().zip(&self.places) {
                *place += decay.at(weights);
            }
        }
        let targets = leg_targets(&self.feet, &feet[..self.feet.len()], weights);
        for (leg, target) in legs.iter().zip(targets) {
            target.bend(leg, skeleton, pose);
        }
    }
}

// Offsets of points, rotations and feet that decay to 0.

/// An offset that decays to 0: its initial value and its initial rate of change per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Decay {
    value: Vec3,
    speed: Vec3,
}

impl Decay {
    /// Decay of an offset whose initial value is `now`, and which would be `then` after `seconds` without decay.
    pub(crate) fn new(now: Vec3, then: Vec3, seconds: f32) -> Self {
        Self {
            value: now,
            speed: (then - now) / seconds,
        }
    }

    /// Decay of the rotation vector from `to` to `from`, at the cut and `seconds` later. Vectors near half a turn may differ by a whole
    /// turn. Then the velocity is unknown and taken as 0.
    pub(crate) fn of_rotations(from: [Quat; 2], to: [Quat; 2], seconds: f32) -> Self {
        let [now, then] = [0, 1].map(|at| rotation_vector(from[at] * to[at].conjugate()));
        match (then - now).length() > std::f32::consts::PI {
            true => Self::new(now, now, seconds),
            false => Self::new(now, then, seconds),
        }
    }

    pub(crate) fn at(&self, weights: Weights) -> Vec3 {
        self.value * weights.value + self.speed * weights.speed
    }

    /// Adds the offset, a rotation vector, to a rotation.
    pub(crate) fn rotated(&self, rotation: Quat, weights: Weights) -> Quat {
        (Quat::from_scaled_axis(self.at(weights)) * rotation).normalize()
    }

    /// Transforms the offset to a space that is rotated by `by`.
    pub(crate) fn turn(&mut self, by: Rigid2) {
        self.value = by.vector(self.value);
        self.speed = by.vector(self.speed);
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.value.is_finite() && self.speed.is_finite()
    }
}

/// Weights of a decay's initial value and initial velocity at a moment. The latter is in seconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    value: f32,
    speed: f32,
    /// Weight of a foot's lift, 1 in the middle of the decay.
    lift: f32,
    /// Time since the cut, and the duration of the decay, in seconds.
    age: f32,
    seconds: f32,
}

impl Weights {
    /// Weights at a share of a decay of a given duration: quintics whose velocity and acceleration are 0 at the end.
    pub(crate) fn new(share: f32, seconds: f32) -> Self {
        let s = share.clamp(0.0, 1.0);
        let cube = s * s * s;
        let flat = s * (1.0 - s);
        Self {
            value: 1.0 - cube * (10.0 - s * (15.0 - 6.0 * s)),
            speed: seconds * (s - cube * (6.0 - s * (8.0 - 3.0 * s))),
            lift: 16.0 * flat * flat,
            age: share * seconds,
            seconds,
        }
    }
}

/// Decaying offset of the position of a foot's toe and of the foot's rotation, in the space of the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FootDecay {
    place: Decay,
    rotation: Decay,
    /// Height of the foot's step, in metres.
    lift: f32,
    /// Height of the toe at the cut, in metres.
    floor: f32,
    /// Limit of the knee from both motions at the cut. Its hinge is unknown if all knees are straight.
    knee: KneeLimit,
    held: HeldFoot,
}

/// A foot that stands: its offset does not decay until it is lifted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeldFoot {
    /// Time since the cut from which on the offset is kept, in seconds.
    from: f32,
    /// Time since the cut when the foot is lifted, in seconds; 0 for one that is not held.
    until: f32,
    /// Time in which the offset of the lifted foot fades out, in seconds.
    release: f32,
    /// What is added to the kept offset, in metres.
    shift: Vec3,
}

impl HeldFoot {
    /// Time in which the offset of a lifted foot fades out, in seconds.
    const RELEASE: f32 = 0.25;
    /// Longest offset of a foot, and of one that can take a step, in metres.
    pub(crate) const MOST: f32 = 0.25;
    const NEAR: f32 = 0.15;
    /// Fastest foot that stops where it is, in metres per second.
    const SLOW: f32 = 0.5;

    fn is_held(&self) -> bool {
        self.until > 0.0
    }

    /// The same foot, released where it is lifted, in seconds since the cut.
    fn released(self, lifted: Option<f32>) -> Self {
        Self {
            until: self.until.min(lifted.unwrap_or(f32::INFINITY)),
            ..self
        }
    }

    /// Time since the cut when the offset is 0, in seconds.
    fn end(&self) -> f32 {
        match self.is_held() {
            true => self.until + self.release,
            false => 0.0,
        }
    }
}

pub(crate) const MOST_LEGS: usize = 8;

/// Where the offsets of a blend move the feet of the new motion. Where they would bring two feet nearer to each other sideways than they are in
/// the new motion, the higher one gives way, so that the legs do not cross. Feet that pass each other, one ahead of the other, are left alone.
pub(crate) fn leg_targets(
    offsets: &[FootDecay],
    feet: &[LegPose],
    weights: Weights,
) -> [LegTarget; MOST_LEGS] {
    /// Difference of heights that is nothing, in metres: feet of one height share the way.
    const LEVEL: f32 = 0.002;
    let mut targets = [LegTarget::ORIGIN; MOST_LEGS];
    for ((decay, &foot), target) in offsets.iter().zip(feet).zip(&mut targets) {
        *target = decay.moved(foot, weights);
    }
    if let &[left, right] = feet {
        let before = left.at_toe.translation - right.at_toe.translation;
        let after = targets[0].at_toe.translation - targets[1].at_toe.translation;
        let sideways = (left.hip - right.hip).with_y(0.0).normalize_or_zero();
        // At the cut the pose is that of the old motion.
        let apart = keep_apart(before, after, sideways) * (1.0 - weights.value);
        let [left, right] = [after.y, -after.y].map(|higher| higher.max(0.0) + LEVEL);
        targets[0].at_toe.translation += apart * (left / (left + right));
        targets[1].at_toe.translation -= apart * (right / (left + right));
    }
    targets
}

/// What has to be added to the way from one foot to the other, which was `before` and would be `after`, in the direction from hip to hip.
fn keep_apart(before: Vec3, after: Vec3, sideways: Vec3) -> Vec3 {
    /// Feet that are further apart may come nearer, to this distance, in metres.
    const NEAR: f32 = 0.2;
    let least = before.dot(sideways).min(NEAR);
    sideways * (least - after.dot(sideways)).max(0.0)
}

/// Duration of offsets that are 0, in seconds.
const STEP: f32 = 1e-3;

/// Minimum distance that a foot moves to be lifted, in metres.
const DRAGGED: f32 = 0.02;
/// Height of a standing toe, in metres.
const STANDING: f32 = 0.05;
/// Height of a step as a share of its length, and maximum height in metres.
const LIFT: (f32, f32) = (0.25, 0.12);

/// Position of a leg's toe in the frame of its ankle.
fn toe_in_ankle(skeleton: &Skeleton, pose: &Pose, leg: &Leg) -> Vec3 {
    let chain = Chain::of(skeleton, pose);
    chain.within(leg.toe_or_foot(), leg.foot).translation
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LegPose {
    /// The foot's frame with its origin at the toe.
    pub(crate) at_toe: JointTransform,
    /// Hinge of the knee, as from [`Leg::knee_hinge`].
    pub(crate) hinge: Vec3,
    pub(crate) hip: Vec3,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LegTarget {
    /// The foot's frame with its origin at the toe.
    at_toe: JointTransform,
    knee: KneeLimit,
}

impl LegPose {
    pub(crate) const ORIGIN: Self = Self {
        at_toe: JointTransform::IDENTITY,
        hinge: Vec3::ZERO,
        hip: Vec3::ZERO,
    };

    pub(crate) fn from_pose(skeleton: &Skeleton, pose: &Pose, leg: &Leg) -> Self {
        let chain = Chain::of(skeleton, pose);
        let ankle = chain.global(leg.foot);
        Self {
            hip: chain.global(leg.hip).translation,
            at_toe: JointTransform {
                translation: ankle.point(toe_in_ankle(skeleton, pose, leg)),
                ..ankle
            },
            hinge: leg.knee_hinge(skeleton, pose),
        }
    }
}

impl LegTarget {
    const ORIGIN: Self = Self {
        at_toe: JointTransform::IDENTITY,
        knee: KneeLimit {
            hinge: Vec3::ZERO,
            flexion: 0.0,
        },
    };

    /// Bends a leg of `pose` to this target. A knee that the blend bends the wrong way is straightened first.
    pub(crate) fn bend(self, leg: &Leg, skeleton: &Skeleton, pose: &mut Pose) {
        leg.limit_knee(skeleton, pose, self.knee);
        let mut foot = self.at_toe;
        foot.translation -= foot.rotation * toe_in_ankle(skeleton, pose, leg);
        let knee = Knee::Forward(self.knee.hinge);
        leg.reach_by_knee(skeleton, pose, foot, knee);
    }
}

/// Minimum sum of the sines of the knees' flexions. Below it they do not tell their hinge.
const KNOWN: f32 = 0.4;

impl FootDecay {
    /// Decay from a leg in one motion to that in another, at the cut and `step` seconds later. `knee` tells where a straight knee
    /// bends to ([`MotionGraph::knees`]).
    pub(crate) fn new(left: [LegPose; 2], entered: [LegPose; 2], knee: Knee, step: f32) -> Self {
        let [from, to] = [left, entered].map(|legs| legs.map(|leg| leg.at_toe));
        let hinges = left.into_iter().chain(entered).map(|leg| leg.hinge);
        let hinge: Vec3 = hinges.clone().sum();
        let hinge = match knee {
            _ if hinge.length() > KNOWN => hinge.normalize(),
            Knee::Forward(known) => known,
            Knee::InPlane => Vec3::ZERO,
        };
        let flexion = hinges.fold(0.0, |least, other| f32::min(least, other.dot(hinge)));
        let apart = |at: usize| from[at].translation - to[at].translation;
        let way = apart(0).with_y(0.0).length();
        let (share, most) = LIFT;
        // A foot in the air needs no step.
        let height = f32::max(from[0].translation.y, to[0].translation.y);
        let up = (height - STANDING).max(0.0);
        Self {
            place: Decay::new(apart(0), apart(1), step),
            rotation: Decay::of_rotations(
                from.map(|foot| foot.rotation),
                to.map(|foot| foot.rotation),
                step,
            ),
            lift: (share * (way - DRAGGED).clamp(0.0, most / share) - up).max(0.0),
            floor: from[0].translation.y,
            knee: KneeLimit { hinge, flexion },
            held: HeldFoot::default(),
        }
    }

    /// Holds the foot where it is until it is lifted, in seconds since the cut, if the new motion puts it down nearby.
    fn hold(&mut self, until: f32, most: f32) {
        let Decay { value, speed } = self.place;
        let is_slow = speed.with_y(0.0).length() < HeldFoot::SLOW;
        if is_slow && value.with_y(0.0).length() <= most {
            self.held = HeldFoot {
                until,
                release: HeldFoot::RELEASE,
                ..self.held
            };
        }
    }

    /// Gives a foot in the air an offset that it has from `seconds` after the cut on, until it is lifted again, in seconds since the cut.
    fn step_to(&mut self, offset: Vec3, seconds: f32, lifted: f32) {
        self.place.value -= offset;
        self.held = HeldFoot {
            from: seconds,
            until: lifted,
            release: HeldFoot::RELEASE,
            shift: offset,
        };
    }

    /// Keeps a foot that stands `age` seconds after the cut where it was before all turned by `by`, until it is lifted, in seconds from then on. One
    /// that is taking a step is left alone. `toe` is the toe of the new motion before, `seconds` the duration of the decay.
    fn keep(&mut self, age: f32, by: Rigid2, toe: Vec3, lifted: f32, seconds: f32) {
        let now = Weights::new(age / seconds, seconds);
        let own = self.place.at(now).with_y(0.0);
        let steps = own.length() > HeldFoot::NEAR || self.lift(now) > 1e-4;
        if steps && !self.held.is_held() {
            return;
        }
        let before = self.offset(now).with_y(0.0);
        let stood = toe + by.inverse().vector(before);
        let offset = (stood - by.point(toe)).with_y(0.0);
        let most = HeldFoot::MOST.max(before.length());
        self.held = HeldFoot {
            from: age,
            until: age + lifted,
            release: HeldFoot::RELEASE,
            shift: offset.clamp_length_max(most) - own,
        };
    }

    /// Offset of the toe.
    fn offset(&self, weights: Weights) -> Vec3 {
        let decayed = self.place.at(weights);
        if !self.held.is_held() {
            return decayed;
        }
        let kept = weights.age.min(self.held.from) / weights.seconds;
        let kept = self.place.at(Weights::new(kept, weights.seconds));
        let released = (weights.age - self.held.until) / self.held.release;
        let left = Weights::new(released, self.held.release).value;
        ((kept + self.held.shift) * left).with_y(decayed.y)
    }

    /// Height by which the foot is lifted, in metres.
    fn lift(&self, weights: Weights) -> f32 {
        match self.held.is_held() {
            true => 0.0,
            false => self.lift * weights.lift,
        }
    }

    fn moved(&self, LegPose { at_toe, hinge, .. }: LegPose, weights: Weights) -> LegTarget {
        let lift = Vec3::Y * self.lift(weights);
        let mut place = at_toe.translation + self.offset(weights) + lift;
        place.y = place.y.max(at_toe.translation.y.min(self.floor));
        LegTarget {
            at_toe: JointTransform {
                rotation: self.rotation.rotated(at_toe.rotation, weights),
                translation: place,
            },
            knee: KneeLimit {
                flexion: self.knee.flexion.min(hinge.dot(self.knee.hinge)),
                ..self.knee
            },
        }
    }

    /// Maximum distance by which the decay moves a point [beside](BESIDE) the foot, in metres.
    pub(crate) fn reach(&self, weights: Weights) -> f32 {
        let turned = self.rotation.at(weights).length().min(2.0);
        self.offset(weights).length() + self.lift(weights) + turned * BESIDE
    }

    pub(crate) fn turn(&mut self, by: Rigid2) {
        self.place.turn(by);
        self.rotation.turn(by);
        self.held.shift = by.vector(self.held.shift);
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.place.is_finite()
            && self.rotation.is_finite()
            && self.lift.is_finite()
            && self.floor.is_finite()
            && self.held.shift.is_finite()
            && self.held.from.is_finite()
            && self.held.until.is_finite()
            && self.knee.is_sound()
    }
}

/// Rotation vector (axis times angle, in radians) of the shorter rotation.
pub(crate) fn rotation_vector(turn: Quat) -> Vec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let (axis, sin) = (turn.xyz(), turn.xyz().length());
    if sin < 1e-6 {
        return 2.0 * axis;
    }
    axis * (2.0 * sin.atan2(turn.w) / sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leg with the toe at a place.
    fn leg(x: f32, y: f32, z: f32) -> LegPose {
        LegPose {
            at_toe: JointTransform {
                translation: Vec3::new(x, y, z),
                ..JointTransform::IDENTITY
            },
            hinge: Vec3::ZERO,
            hip: Vec3::new(x.signum() * 0.1, 1.0, 0.0),
        }
    }

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
    fn a_foot_that_is_held_stays_where_it_is_while_the_motion_turns() {
        let (blend, by) = (0.3, Rigid2::new(0.01, 0.0, 0.0));
        let (stood, mut entered) = (leg(0.2, 0.02, 0.2), leg(0.1, 0.02, 0.2));
        let mut foot = FootDecay::new([stood; 2], [entered; 2], Knee::InPlane, 0.01);
        foot.hold(1.0, HeldFoot::MOST);
        for frame in 0..30 {
            let age = frame as f32 / 60.0;
            let toe = entered.at_toe.translation;
            foot.turn(by);
            foot.keep(age, by, toe, 1.0, blend);
            entered.at_toe.translation = by.point(toe);
            let posed = foot.moved(entered, Weights::new(age / blend, blend));
            let off = posed.at_toe.translation - stood.at_toe.translation;
            assert!(off.length() < 1e-4, "{frame}: {off}");
        }
    }

    #[test]
    fn feet_come_no_nearer_to_each_other_than_in_the_new_motion() {
        // The old motion has the standing foot further in, and the other one swings past it.
        let (stands, swings) = (leg(0.1, 0.0, 0.0), leg(-0.05, 0.1, 0.0));
        let inwards = leg(0.0, 0.0, 0.0);
        let offsets = [
            FootDecay::new([inwards; 2], [stands; 2], Knee::InPlane, 0.01),
            FootDecay::new([swings; 2], [swings; 2], Knee::InPlane, 0.01),
        ];
        let places = |seconds: f32| {
            let weights = Weights::new(seconds / 0.3, 0.3);
            let targets = leg_targets(&offsets, &[stands, swings], weights);
            [0, 1].map(|leg| targets[leg].at_toe.translation.x)
        };
        assert_eq!(places(0.0), [0.0, -0.05]);
        let [stands_at, swings_at] = places(0.15);
        let alone = offsets[0].moved(stands, Weights::new(0.5, 0.3));
        assert!((stands_at - alone.at_toe.translation.x).abs() < 0.01);
        assert!(swings_at < -0.06, "{swings_at}");
        assert_eq!(places(0.3), [0.1, -0.05]);
    }

    #[test]
    fn a_foot_passes_the_other_without_a_jump() {
        // In the new motion the foot swings past the other one at 4 m/s, in the old one it is still behind.
        let (swing, blend, step) = (4.0, 0.3, 1e-3);
        let swings = |t: f32| leg(0.02, 0.1, swing * (t - 0.1));
        let stands = leg(-0.02, 0.1, 0.0);
        let offsets = [
            FootDecay::new(
                [leg(0.02, 0.1, -0.7); 2],
                [swings(0.0); 2],
                Knee::InPlane,
                step,
            ),
            FootDecay::new([stands; 2], [stands; 2], Knee::InPlane, step),
        ];
        let place = |t: f32| {
            let weights = Weights::new(t / blend, blend);
            leg_targets(&offsets, &[swings(t), stands], weights)[0]
                .at_toe
                .translation
        };
        let fastest = (0..200).map(|frame| {
            let [before, after] = [frame, frame + 1].map(|frame| place(frame as f32 * step));
            before.distance(after) / step
        });
        let fastest = fastest.fold(0.0, f32::max);
        // The offset of 0.3 m alone has at most 1.875 times its mean velocity.
        let most = swing + 1.875 * 0.3 / blend;
        assert!(fastest < most + 0.1, "{fastest}");
    }

    #[test]
    fn turns_come_back_from_their_vectors() {
        for turn in [
            Quat::from_rotation_x(0.4) * Quat::from_rotation_z(-2.0),
            Quat::from_rotation_y(3.0),
            Quat::IDENTITY,
            -Quat::from_rotation_y(1e-4),
        ] {
            let back = Quat::from_scaled_axis(rotation_vector(turn));
            assert!(back.dot(turn).abs() > 1.0 - 1e-6, "{turn}");
        }
    }
}

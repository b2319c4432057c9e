//! Rounds a clip to a grid of steps, parents first, and measures the error in model space.
//!
//! Source: N. Frechette, "Animation Compression: Measuring Accuracy" (2016): points at a distance from each joint stand for the
//! skin. Differs: each joint is rounded against the parents as they will be decoded, so that rotations do not add up along a chain,
//! and a joint with one child is aimed at the place where that child should be, so that errors of places do not either.

use glam::{DQuat, DVec3};

use super::{PLACE_STEP, lanes};
use crate::anim::{ClipDesc, JointId, JointKind, Skeleton};

/// Distance of the points that stand for the skin from their joint, along each of its axes, in metres.
pub(super) const SKIN: f64 = 0.1;

/// Largest rotation that aims a joint at its child, in radians.
const MOST_AIM: f64 = 2e-3;

/// Shortest bone that is aimed, in metres.
const SHORTEST_AIMED: f64 = 0.02;

/// Largest distance of a joint's places from their mean that counts as constant, in metres.
const STILL: f64 = 1e-5;

/// Largest number of steps in a component of a rotation.
const MOST_STEPS: f64 = 32767.0;

/// A joint's frame in model space.
#[derive(Clone, Copy, Debug)]
struct Frame {
    rotation: DQuat,
    place: DVec3,
}

impl Frame {
    const IDENTITY: Self = Self {
        rotation: DQuat::IDENTITY,
        place: DVec3::ZERO,
    };

    fn point(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.place
    }
}

/// A clip in model space.
pub(super) struct Truth<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) lanes: Vec<u16>,
    pub(super) moves_joints: bool,
    frames: Vec<Frame>,
    /// Position of each joint in its parent's frame, or `None` if it moves.
    fixed: Vec<Option<DVec3>>,
    /// Length of the bone to each joint, in metres. The longest, if it changes.
    pub(super) bones: Vec<f64>,
    /// The joint's only child, if it is far enough away to be aimed at.
    aims: Vec<Option<usize>>,
}

/// A clip in steps.
pub(super) struct Quantised {
    pub(super) roots: Vec<[i32; 3]>,
    /// Frame by frame, in the order of lanes.
    pub(super) rotations: Vec<[i32; 4]>,
    /// Frame by frame, for all joints.
    pub(super) translations: Vec<[i32; 3]>,
    pub(super) errors: Vec<JointError>,
}

/// Bounds of a joint's error over all frames, in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct JointError {
    pub(super) place: f64,
    /// Bound of the error of the points around the joint, which stand for the skin, in metres.
    pub(super) skin: f64,
}

impl<'a> Truth<'a> {
    pub(super) fn new(skeleton: &'a Skeleton, desc: &ClipDesc) -> Self {
        let joints = skeleton.len();
        let mut truth = Self {
            skeleton,
            lanes: lanes(skeleton),
            moves_joints: !desc.translations.is_empty(),
            frames: Vec::with_capacity(desc.rotations.len()),
            fixed: Vec::new(),
            bones: vec![0.0; joints],
            aims: vec![None; joints],
        };
        truth.find_bones(desc);
        for (frame, root) in desc.roots.iter().enumerate() {
            let first = truth.frames.len();
            for (index, joint) in skeleton.joints().iter().enumerate() {
                let rotation = desc.rotations[frame * joints + index];
                let above = joint
                    .parent
                    .map(|parent| truth.frames[first + parent.index()]);
                let local = match desc.translations.get(frame * joints + index) {
                    Some(translation) => translation.as_dvec3(),
                    None => joint.offset.as_dvec3(),
                };
                let place = above.map_or(root.as_dvec3(), |above| above.point(local));
                let turn = rotation.as_dquat().normalize();
                let rotation = above.map_or(turn, |above| (above.rotation * turn).normalize());
                truth.frames.push(Frame { rotation, place });
            }
        }
        truth.find_aims();
        truth
    }

    fn find_bones(&mut self, desc: &ClipDesc) {
        let joints = self.skeleton.len();
        for (index, joint) in self.skeleton.joints().iter().enumerate() {
            let places = desc.translations.iter().skip(index).step_by(joints);
            let first = places
                .clone()
                .next()
                .copied()
                .unwrap_or(joint.offset)
                .as_dvec3();
            let is_still = places
                .clone()
                .all(|place| place.as_dvec3().distance(first) < STILL);
            let longest = places.map(|place| f64::from(place.length()));
            self.bones[index] = longest.fold(first.length(), f64::max);
            let kept = if self.moves_joints {
                rounded(first).1
            } else {
                first
            };
            self.fixed.push(is_still.then_some(kept));
        }
    }

    fn find_aims(&mut self) {
        let mut children = vec![Vec::new(); self.skeleton.len()];
        for (index, joint) in self.skeleton.joints().iter().enumerate() {
            if let Some(parent) = joint.parent {
                children[parent.index()].push(index);
            }
        }
        for (aim, children) in self.aims.iter_mut().zip(&children) {
            if let [only] = children[..]
                && self.fixed[only].is_some_and(|place| place.length() >= SHORTEST_AIMED)
            {
                *aim = Some(only);
            }
        }
    }

    pub(super) fn frames(&self) -> usize {
        self.frames.len() / self.skeleton.len()
    }

    /// Rounds all frames with a step for each joint's rotation. Returns `None` if a component takes too many steps, or if a joint turns
    /// by half a turn from one frame to the next.
    pub(super) fn quantised(&self, steps: &[f64]) -> Option<Quantised> {
        let (joints, frames) = (self.skeleton.len(), self.frames());
        let mut out = Quantised {
            roots: Vec::with_capacity(frames),
            rotations: Vec::with_capacity(frames * self.lanes.len()),
            translations: Vec::new(),
            errors: vec![JointError::default(); joints],
        };
        let mut rounding = Rounding {
            truth: self,
            decoded: vec![Frame::IDENTITY; joints],
            turns: vec![None; joints],
        };
        for truth in self.frames.chunks_exact(joints) {
            for (index, &step) in steps.iter().enumerate() {
                let place = rounding.joint(truth, index, step)?;
                out.errors[index].add(&truth[index], &rounding.decoded[index]);
                if index == JointId::ROOT.index() {
                    out.roots.push(place);
                }
                if self.moves_joints {
                    // The root's entry is unused.
                    let is_root = index == JointId::ROOT.index();
                    out.translations.push(if is_root { [0; 3] } else { place });
                }
            }
            let turns = &rounding.turns;
            let lanes = self.lanes.iter().map(|&joint| turns[usize::from(joint)]);
            out.rotations.extend(lanes.map(Option::unwrap_or_default));
        }
        Some(out)
    }

    /// A joint's rotation in model space, turned a little so that its child comes to where it should be though the joint is at `place`.
    fn aimed(&self, index: usize, truth: &[Frame], place: DVec3) -> DQuat {
        let rotation = truth[index].rotation;
        let Some(child) = self.aims[index] else {
            return rotation;
        };
        let is = truth[child].place - truth[index].place;
        let to = truth[child].place - place;
        let turn = is.cross(to) / (is.length() * to.length()).max(f64::MIN_POSITIVE);
        let half = turn.clamp_length_max(MOST_AIM) / 2.0;
        DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize() * rotation
    }
}

/// Joints as they will be decoded, up to the one that is rounded.
struct Rounding<'a> {
    truth: &'a Truth<'a>,
    decoded: Vec<Frame>,
    /// Rotation of each joint in the last frame that was rounded.
    turns: Vec<Option<[i32; 4]>>,
}

impl Rounding<'_> {
    /// Rounds a joint of a frame and returns its position in steps.
    fn joint(&mut self, frame: &[Frame], index: usize, step: f64) -> Option<[i32; 3]> {
        let joint = &self.truth.skeleton.joints()[index];
        let above = joint.parent.map(|parent| self.decoded[parent.index()]);
        let wanted = match above {
            Some(above) => above.rotation.conjugate() * (frame[index].place - above.place),
            None => frame[index].place,
        };
        let (whole, local) = match self.truth.fixed[index] {
            Some(place) if above.is_some() => (rounded(place).0, place),
            _ => rounded(wanted),
        };
        let place = above.map_or(local, |above| above.point(local));
        let mut rotation = above.map_or(DQuat::IDENTITY, |above| above.rotation);
        if joint.kind == JointKind::Moving {
            let wanted = self.truth.aimed(index, frame, place);
            let own = (rotation.conjugate() * wanted).normalize();
            let turn = in_steps(own, step, self.turns[index])?;
            self.turns[index] = Some(turn);
            let [x, y, z, w] = turn.map(f64::from);
            rotation = (rotation * DQuat::from_xyzw(x, y, z, w).normalize()).normalize();
        }
        self.decoded[index] = Frame { rotation, place };
        Some(whole)
    }
}

impl JointError {
    fn add(&mut self, truth: &Frame, decoded: &Frame) {
        let place = (decoded.place - truth.place).length();
        self.place = self.place.max(place);
        // A point on an axis moves by the part of a small rotation vector that is not along the axis.
        let turn = (truth.rotation.conjugate() * decoded.rotation).xyz();
        let squares = 4.0 * turn * turn;
        let most = (squares.element_sum() - squares.min_element())
            .max(0.0)
            .sqrt();
        self.skin = self.skin.max(place + SKIN * most);
    }
}

/// A rotation in steps, on the side of the one before.
fn in_steps(rotation: DQuat, step: f64, before: Option<[i32; 4]>) -> Option<[i32; 4]> {
    let dot = |a: [f64; 4], b: [f64; 4]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let mut rotation = rotation.to_array();
    let before = before.map(|before| before.map(f64::from));
    if dot(rotation, before.unwrap_or([0.0, 0.0, 0.0, 1.0])) < 0.0 {
        rotation = rotation.map(|value| -value);
    }
    let whole = rotation.map(|value| (value / step).round());
    let fits = whole.iter().all(|value| value.abs() <= MOST_STEPS)
        && dot(whole, whole) > 0.0
        && before.is_none_or(|before| dot(whole, before) > 0.0);
    fits.then(|| whole.map(|value| value as i32))
}

/// A place in steps, and where that is.
fn rounded(place: DVec3) -> ([i32; 3], DVec3) {
    let step = f64::from(PLACE_STEP);
    // Casts saturate: a place out of range has a large error, and the clip is not compressed.
    let whole = (place / step).round().to_array().map(|value| value as i32);
    (whole, DVec3::from_array(whole.map(f64::from)) * step)
}

//! Compresses a clip: searches the coarsest step of each joint that holds the error, rounds all frames to these steps, and writes
//! them as bytes.
//!
//! Source of the search: N. Frechette, "Animation Compression: Variable Bit Rates" (2017): the bit rate of each track is the least
//! that holds an error in model space. Differs: steps need not be powers of two, and those of all joints are changed together, each
//! by the error of what it carries.

use glam::{DQuat, DVec3};

use super::{Groups, MOST_ROOT_BITS, PLACE_STEP, PackedClip, SEGMENT, StoredPacked, lanes};
use crate::anim::{
    Clip, ClipDesc, JointId, JointKind, JointTransform, Pose, Skeleton, forward_kinematics,
};
use crate::math::code_rows::{CODES, MOST_BITS, ROW_BYTES};

/// Errors that compressing a clip may cause.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CompressionSettings {
    /// Largest distance of a joint from where it was, in metres. Default 0.0001.
    pub joint_error: f32,
    /// Largest distance of an end site, and of the points that stand for the skin (0.1 m from each joint that rotates, along its
    /// axes), from where it was, in metres. Default 0.0003.
    pub end_error: f32,
}

impl Default for CompressionSettings {
    fn default() -> Self {
        Self {
            joint_error: 1e-4,
            end_error: 3e-4,
        }
    }
}

impl PackedClip {
    /// Compresses a sound clip of the skeleton. Returns `None` if the error cannot be held.
    pub(in crate::anim) fn new(
        skeleton: &Skeleton,
        desc: &ClipDesc,
        settings: &CompressionSettings,
    ) -> Option<Self> {
        let truth = Truth::new(skeleton, desc);
        let quantised = tuned(&truth, settings)?;
        let bytes = bytes(&truth, &quantised)?;
        let stored = StoredPacked {
            name: desc.name.clone(),
            frame_rate: desc.frame_rate,
            frames: u32::try_from(desc.roots.len()).ok()?,
            joints: u16::try_from(skeleton.len()).ok()?,
            moves_joints: truth.moves_joints,
            errors: [0.0; 2],
            lanes: truth.lanes,
            bytes,
        };
        Self::try_from(stored)
            .ok()
            .filter(|clip| clip.fits(skeleton))
    }

    pub(in crate::anim) fn set_errors(&mut self, errors: [f32; 2]) {
        self.stored.errors = errors;
    }
}

/// Largest distances between two clips' joints, and between their end sites and the points that stand for the skin, in metres.
pub(in crate::anim) fn largest_errors(skeleton: &Skeleton, a: &Clip, b: &Clip) -> [f32; 2] {
    let (mut pose, mut joints) = (Pose::default(), [Vec::new(), Vec::new()]);
    let mut errors = [0.0; 2];
    for frame in 0..a.frames().min(b.frames()) {
        for (clip, joints) in [a, b].into_iter().zip(&mut joints) {
            clip.pose(frame, &mut pose);
            forward_kinematics(skeleton, &pose, joints);
        }
        let both = joints[0].iter().zip(&joints[1]);
        for (joint, (a, b)) in skeleton.joints().iter().zip(both) {
            let place = (b.translation - a.translation).as_dvec3();
            if joint.kind == JointKind::EndSite {
                errors[1] = place.length().max(errors[1]);
                continue;
            }
            errors[0] = place.length().max(errors[0]);
            let point = |joint: &JointTransform, axis| joint.rotation.as_dquat().normalize() * axis;
            for axis in DVec3::AXES {
                let turned = point(b, axis) - point(a, axis);
                errors[1] = (place + SKIN * turned).length().max(errors[1]);
            }
        }
    }
    errors.map(|error| error as f32)
}

/// Number of times that each step is made coarser or finer by the error.
const ROUNDS: usize = 3;

/// Number of times after these that steps are made finer where the error is too large.
const FINER: usize = 9;

/// Share of the error that is aimed at. The rest is for single precision.
const SHARE: f64 = 0.995;

/// Steps of rotations: the smallest that leaves room for 16 bits, and one that is coarse for any joint.
const STEPS: [f64; 2] = [1.0 / 32766.0, 1.0 / 32.0];

/// The clip with the coarsest steps found that hold the error, or `None` if none do.
pub(super) fn tuned(truth: &Truth<'_>, settings: &CompressionSettings) -> Option<Quantised> {
    let bounds = [settings.joint_error, settings.end_error].map(|bound| SHARE * f64::from(bound));
    let tuning = Tuning { truth, bounds };
    let mut steps = tuning.first();
    let mut best: Option<(f64, Quantised)> = None;
    for round in 0..ROUNDS + FINER {
        let Some(found) = truth.quantised(&steps) else {
            break;
        };
        let loads = tuning.loads(&found);
        let coarseness: f64 = steps.iter().map(|step| step.log2()).sum();
        if loads.iter().all(|load| *load <= 1.0) {
            if best.as_ref().is_none_or(|(most, _)| coarseness > *most) {
                best = Some((coarseness, found));
            }
            if round >= ROUNDS {
                break;
            }
        }
        for (step, load) in steps.iter_mut().zip(&loads) {
            *step *= match round < ROUNDS {
                true => (0.9 / load.max(1e-3)).clamp(0.6, 1.5),
                false if *load > 1.0 => 0.9 / load.min(2.0),
                false => 1.0,
            };
            *step = step.clamp(STEPS[0], STEPS[1]);
        }
    }
    best.map(|(_, found)| found)
}

struct Tuning<'a> {
    truth: &'a Truth<'a>,
    /// Errors at the joints and at the ends, in metres.
    bounds: [f64; 2],
}

impl Tuning<'_> {
    /// First steps: each joint's own error is about the largest that the joints and points it carries allow.
    fn first(&self) -> Vec<f64> {
        let mut steps = vec![self.bounds[1] / (2.0 * SKIN); self.truth.skeleton.len()];
        for (joint, &bone) in self.truth.skeleton.joints().iter().zip(&self.truth.bones) {
            if let Some(parent) = joint.parent {
                let step = &mut steps[parent.index()];
                *step = step.min(self.bound(joint.kind) / (2.0 * bone.max(1e-3)));
            }
        }
        let range = |step: f64| step.clamp(STEPS[0], STEPS[1]);
        steps.into_iter().map(range).collect()
    }

    fn bound(&self, kind: JointKind) -> f64 {
        match kind {
            JointKind::Moving => self.bounds[0],
            JointKind::EndSite => self.bounds[1],
        }
    }

    /// Largest error of the joints and points that each joint carries, as a share of the allowed error.
    fn loads(&self, found: &Quantised) -> Vec<f64> {
        let mut loads = vec![0.0; found.errors.len()];
        for (index, (joint, error)) in self
            .truth
            .skeleton
            .joints()
            .iter()
            .zip(&found.errors)
            .enumerate()
        {
            if joint.kind == JointKind::Moving {
                loads[index] = f64::max(loads[index], error.skin / self.bounds[1]);
            }
            let load = error.place / self.bound(joint.kind);
            let carrier = joint.parent.map_or(0, |parent| parent.index());
            loads[carrier] = loads[carrier].max(load);
        }
        loads
    }
}

// Rounding. Source: N. Frechette, "Animation Compression: Measuring Accuracy" (2016): points at a distance from each joint stand
// for the skin. Differs: each joint is rounded against the parents as they will be decoded, so that rotations do not add up along a
// chain, and a joint with one child is aimed at the place where that child should be, so that errors of places do not either.

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

/// The bytes of a clip, or `None` if a code is too wide.
pub(super) fn bytes(truth: &Truth<'_>, quantised: &Quantised) -> Option<Vec<u8>> {
    let source = Source { truth, quantised };
    let mut writer = BitWriter::default();
    for segment in source.segments() {
        let (rows, root) = segment.widths.split_at(segment.widths.len() - 3);
        let fits = rows.iter().all(|&width| width <= MOST_BITS)
            && root.iter().all(|&width| width <= MOST_ROOT_BITS);
        if !fits {
            return None;
        }
        segment.write(&mut writer);
    }
    writer.extend(&[0; ROW_BYTES]);
    Some(writer.finish())
}

struct Source<'a> {
    truth: &'a Truth<'a>,
    quantised: &'a Quantised,
}

/// Frames of a segment: all rows' values, then the root's.
struct Segment {
    groups: Groups,
    widths: Vec<u8>,
    bases: Vec<i32>,
    /// Values of each frame, in the order of `bases`.
    frames: Vec<Vec<i32>>,
}

impl Source<'_> {
    fn groups(&self) -> Groups {
        let truth = self.truth;
        let joints = truth.skeleton.len();
        Groups::new(
            truth.lanes.len(),
            if truth.moves_joints { joints } else { 0 },
        )
    }

    fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        let frames = self.quantised.roots.len();
        let firsts = (0..frames).step_by(SEGMENT);
        firsts.map(move |first| {
            let frames = (first..frames.min(first + SEGMENT)).map(|frame| self.values(frame));
            Segment::new(self.groups(), frames.collect())
        })
    }

    /// All values of a frame: rows of rotations, rows of translations, the root.
    fn values(&self, frame: usize) -> Vec<i32> {
        let lanes = self.truth.lanes.len();
        let mut values = Vec::new();
        let rotations = &self.quantised.rotations[frame * lanes..(frame + 1) * lanes];
        push_rows(rotations, &mut values);
        if self.truth.moves_joints {
            let joints = self.truth.skeleton.len();
            let places = &self.quantised.translations[frame * joints..(frame + 1) * joints];
            push_rows(places, &mut values);
        }
        values.extend(self.quantised.roots[frame]);
        values
    }
}

/// Appends values row by row to `out`, with 0 in unused lanes.
fn push_rows<const ROWS: usize>(values: &[[i32; ROWS]], out: &mut Vec<i32>) {
    for group in values.chunks(CODES) {
        for row in 0..ROWS {
            let lanes = (0..CODES).map(|lane| group.get(lane).map_or(0, |value| value[row]));
            out.extend(lanes);
        }
    }
}

impl Segment {
    fn new(groups: Groups, frames: Vec<Vec<i32>>) -> Self {
        let of_all = |choose: fn(i32, i32) -> i32| -> Vec<i32> {
            let mut values = frames[0].clone();
            for frame in &frames[1..] {
                for (value, other) in values.iter_mut().zip(frame) {
                    *value = choose(*value, *other);
                }
            }
            values
        };
        let (bases, most) = (of_all(i32::min), of_all(i32::max));
        let ranges: Vec<u32> = bases
            .iter()
            .zip(&most)
            .map(|(base, most)| most.abs_diff(*base))
            .collect();
        let (rows, root) = ranges.split_at(ranges.len() - 3);
        let rows = rows
            .chunks(CODES)
            .map(|row| row.iter().copied().max().unwrap_or(0));
        let widths = rows.chain(root.iter().copied()).map(width_of).collect();
        Self {
            groups,
            widths,
            bases,
            frames,
        }
    }

    fn write(&self, writer: &mut BitWriter) {
        writer.extend(&self.widths);
        let rotations = CODES * self.groups.rows()[0];
        for &base in &self.bases[..rotations] {
            writer.extend(&(base as i16).to_le_bytes());
        }
        for base in &self.bases[rotations..] {
            writer.extend(&base.to_le_bytes());
        }
        let rows = self.bases.len() - 3;
        for frame in &self.frames {
            for (index, (value, base)) in frame.iter().zip(&self.bases).enumerate() {
                let width = match index < rows {
                    true => self.widths[index / CODES],
                    false => self.widths[rows / CODES + index - rows],
                };
                writer.push(value.abs_diff(*base), width);
            }
            writer.align();
        }
    }
}

/// Number of bits of codes from 0 to `range`.
pub(super) fn width_of(range: u32) -> u8 {
    (u32::BITS - range.leading_zeros()) as u8
}

/// Appends codes to bytes, bit by bit from the lowest.
#[derive(Debug, Default)]
pub(super) struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet.
    rest: u64,
    bits: u32,
}

impl BitWriter {
    pub(super) fn push(&mut self, code: u32, width: u8) {
        self.rest |= u64::from(code) << self.bits;
        self.bits += u32::from(width);
        while self.bits >= 8 {
            self.bytes.push(self.rest as u8);
            self.rest >>= 8;
            self.bits -= 8;
        }
    }

    /// Fills the last byte with zeros.
    pub(super) fn align(&mut self) {
        if self.bits > 0 {
            self.push(0, (8 - self.bits) as u8);
        }
    }

    pub(super) fn extend(&mut self, bytes: &[u8]) {
        self.align();
        self.bytes.extend_from_slice(bytes);
    }

    pub(super) fn finish(mut self) -> Vec<u8> {
        self.align();
        self.bytes
    }
}

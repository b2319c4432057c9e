//! Compresses a clip: searches the coarsest step of each joint that holds the error, rounds all frames to these steps, and writes
//! them as bytes.
//!
//! Source of the search: N. Frechette, "Animation Compression: Variable Bit Rates" (2017): the bit rate of each track is the least
//! that holds an error in model space. Differs: steps need not be powers of two, and those of all joints are changed together, each
//! by the error of what it carries.

use glam::{DQuat, DVec3};

use super::{MOST_ROOT_BITS, PLACE_STEP, PackedClip, SEGMENT, StoredPacked, lanes};
use crate::anim::{
    Clip, ClipDesc, JointKind, JointTransform, Place, Pose, Skeleton, forward_kinematics, place_all,
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
    /// Compresses a sound clip of the skeleton, which has this description. Returns `None` if the error cannot be held.
    pub(in crate::anim) fn new(
        skeleton: &Skeleton,
        clip: &Clip,
        desc: &ClipDesc,
        settings: &CompressionSettings,
    ) -> Option<Self> {
        let truth = Truth::new(skeleton, clip, desc);
        let quantised = tuned(&truth, settings)?;
        let rotations = 4 * truth.lanes.len().next_multiple_of(CODES);
        let frames = 0..desc.roots.len();
        let frames: Vec<Vec<i32>> = frames
            .map(|frame| truth.values(&quantised, frame))
            .collect();
        let bytes = bytes(rotations, &frames)?;
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

/// Number of times after these that steps are made finer where the error is too large, and then also above, where it comes from there.
const FINER: usize = 9;

/// Share of the error that is aimed at. The rest is for single precision.
const SHARE: f64 = 0.995;

/// Steps of rotations: the smallest that leaves room for 16 bits, and one that is coarse for any joint.
const STEPS: [f64; 2] = [1.0 / 32766.0, 1.0 / 32.0];

/// The clip with the coarsest steps found that hold the error, or `None` if none do.
fn tuned(truth: &Truth<'_>, settings: &CompressionSettings) -> Option<Quantised> {
    let bounds = [settings.joint_error, settings.end_error].map(|bound| SHARE * f64::from(bound));
    let mut steps = first_steps(truth, bounds);
    let mut best: Option<(f64, Quantised)> = None;
    for round in 0..ROUNDS + 2 * FINER {
        let Some(found) = truth.quantised(&steps) else {
            break;
        };
        let loads = loads(truth, bounds, &found, round >= ROUNDS + FINER);
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

/// First steps: each joint's own error is about the largest that the joints and points it carries allow. `bounds` are those of the errors
/// at the joints and at the ends, in metres.
fn first_steps(truth: &Truth<'_>, bounds: [f64; 2]) -> Vec<f64> {
    let mut steps = vec![bounds[1] / (2.0 * SKIN); truth.skeleton.len()];
    for (joint, &bone) in truth.skeleton.joints().iter().zip(&truth.bones) {
        if let Some(parent) = joint.parent {
            let step = &mut steps[parent.index()];
            *step = step.min(bound(joint.kind, bounds) / (2.0 * bone.max(1e-3)));
        }
    }
    let range = |step: f64| step.clamp(STEPS[0], STEPS[1]);
    steps.into_iter().map(range).collect()
}

fn bound(kind: JointKind, [joints, ends]: [f64; 2]) -> f64 {
    match kind {
        JointKind::Moving => joints,
        JointKind::EndSite => ends,
    }
}

/// Largest error of the joints and points that each joint carries, as a share of the allowed error. With `spread`, an error that is too
/// large counts for the joints above, too, as long as their own places are off by half of what is allowed.
fn loads(truth: &Truth<'_>, bounds: [f64; 2], found: &Quantised, spread: bool) -> Vec<f64> {
    const INHERITED: f64 = 0.5;
    let mut loads = vec![0.0; found.errors.len()];
    let joints = truth.skeleton.joints().iter().zip(&found.errors);
    for (index, (joint, error)) in joints.enumerate() {
        if joint.kind == JointKind::Moving {
            loads[index] = f64::max(loads[index], error.skin / bounds[1]);
        }
        let load = error.place / bound(joint.kind, bounds);
        let mut carrier = joint.parent;
        loop {
            let at = carrier.map_or(0, |parent| parent.index());
            loads[at] = loads[at].max(load);
            let inherits = found.errors[at].place > INHERITED * bounds[0];
            if !(spread && load > 1.0 && inherits && at > 0) {
                break;
            }
            carrier = truth.skeleton.joints()[at].parent;
        }
    }
    loads
}

// Rounding. Source: N. Frechette, "Animation Compression: Measuring Accuracy" (2016): points at a distance from each joint stand
// for the skin. Differs: each joint is rounded against the parents as they will be decoded, so that rotations do not add up along a
// chain, and a joint with one child is aimed at the place where that child should be, so that errors of places do not either.

/// Distance of the points that stand for the skin from their joint, along each of its axes, in metres.
const SKIN: f64 = 0.1;

/// Largest rotation that aims a joint at its child, in radians.
const MOST_AIM: f64 = 2e-3;

/// Shortest bone that is aimed, in metres.
const SHORTEST_AIMED: f64 = 0.02;

/// Largest distance of a joint's places from their mean that counts as constant, in metres.
const STILL: f64 = 1e-5;

/// Largest number of steps in a component of a rotation.
const MOST_STEPS: f64 = 32767.0;

/// A clip in model space.
struct Truth<'a> {
    skeleton: &'a Skeleton,
    lanes: Vec<u16>,
    moves_joints: bool,
    /// Joint transforms, `[frame][joint]`.
    frames: Vec<Place>,
    /// Position of each joint in its parent's frame, or `None` if it moves.
    fixed: Vec<Option<DVec3>>,
    /// Length of the bone to each joint, in metres. The longest, if it changes.
    bones: Vec<f64>,
    /// The joint's only child, if it is far enough away to be aimed at.
    aims: Vec<Option<usize>>,
}

/// A clip in steps.
struct Quantised {
    /// Frame by frame, in the order of lanes.
    rotations: Vec<[i32; 4]>,
    /// Frame by frame, for all joints.
    places: Vec<[i32; 3]>,
    errors: Vec<JointError>,
}

/// Bounds of a joint's error over all frames, in metres.
#[derive(Clone, Copy, Debug, Default)]
struct JointError {
    place: f64,
    /// Bound of the error of the points around the joint, which stand for the skin, in metres.
    skin: f64,
}

impl<'a> Truth<'a> {
    fn new(skeleton: &'a Skeleton, clip: &Clip, desc: &ClipDesc) -> Self {
        let joints = skeleton.len();
        let mut truth = Self {
            skeleton,
            lanes: lanes(skeleton),
            moves_joints: clip.moves_joints(),
            frames: Vec::with_capacity(desc.rotations.len()),
            fixed: Vec::new(),
            bones: vec![0.0; joints],
            aims: vec![None; joints],
        };
        truth.find_bones(desc);
        let mut places = Vec::new();
        for frame in 0..clip.frames() {
            place_all(skeleton, clip.moment(frame, 0.0), &mut places);
            truth.frames.extend_from_slice(&places);
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

    /// Rounds all frames with a step for each joint's rotation. Returns `None` if a component takes too many steps, or if a joint turns
    /// by half a turn from one frame to the next.
    fn quantised(&self, steps: &[f64]) -> Option<Quantised> {
        let joints = self.skeleton.joints();
        let mut out = Quantised {
            rotations: Vec::with_capacity(self.frames.len()),
            places: Vec::with_capacity(self.frames.len()),
            errors: vec![JointError::default(); joints.len()],
        };
        // Joints as they will be decoded, and their rotations in the last frame that was rounded.
        let (mut decoded, mut turns) = (
            vec![Place::IDENTITY; joints.len()],
            vec![None; joints.len()],
        );
        for truth in self.frames.chunks_exact(joints.len()) {
            for (index, joint) in joints.iter().enumerate() {
                let above = joint.parent.map(|parent| decoded[parent.index()]);
                let wanted = match above {
                    Some(above) => above.sees(&truth[index]).translation,
                    None => truth[index].translation,
                };
                let (whole, local) = match self.fixed[index] {
                    Some(place) if above.is_some() => (rounded(place).0, place),
                    _ => rounded(wanted),
                };
                let above = above.unwrap_or(Place::IDENTITY);
                let (translation, mut rotation) = (above.point(local), above.rotation);
                if joint.kind == JointKind::Moving {
                    let wanted = self.aimed(index, truth, translation);
                    let own = (rotation.conjugate() * wanted).normalize();
                    let turn = in_steps(own, steps[index], turns[index])?;
                    turns[index] = Some(turn);
                    let [x, y, z, w] = turn.map(f64::from);
                    rotation = (rotation * DQuat::from_xyzw(x, y, z, w).normalize()).normalize();
                }
                decoded[index] = Place {
                    rotation,
                    translation,
                };
                out.places.push(whole);
                out.errors[index].add(&truth[index], &decoded[index]);
            }
            let lanes = self.lanes.iter().map(|&joint| turns[usize::from(joint)]);
            out.rotations.extend(lanes.map(Option::unwrap_or_default));
        }
        Some(out)
    }

    /// All values of a frame: rows of rotations, rows of translations, the root.
    fn values(&self, quantised: &Quantised, frame: usize) -> Vec<i32> {
        let (lanes, joints) = (self.lanes.len(), self.skeleton.len());
        let mut values = Vec::new();
        push_rows(&quantised.rotations[frame * lanes..][..lanes], &mut values);
        let mut places = quantised.places[frame * joints..][..joints].to_vec();
        // The root's entry is unused.
        let root = std::mem::take(&mut places[0]);
        if self.moves_joints {
            push_rows(&places, &mut values);
        }
        values.extend(root);
        values
    }

    /// A joint's rotation in model space, turned a little so that its child comes to where it should be though the joint is at `place`.
    fn aimed(&self, index: usize, truth: &[Place], place: DVec3) -> DQuat {
        let rotation = truth[index].rotation;
        let Some(child) = self.aims[index] else {
            return rotation;
        };
        let is = truth[child].translation - truth[index].translation;
        let to = truth[child].translation - place;
        let turn = is.cross(to) / (is.length() * to.length()).max(f64::MIN_POSITIVE);
        let half = turn.clamp_length_max(MOST_AIM) / 2.0;
        DQuat::from_xyzw(half.x, half.y, half.z, 1.0).normalize() * rotation
    }
}

impl JointError {
    fn add(&mut self, truth: &Place, decoded: &Place) {
        let place = (decoded.translation - truth.translation).length();
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

/// The bytes of a clip, or `None` if a code is too wide. The first values of each frame are those of `rotations`.
fn bytes(rotations: usize, frames: &[Vec<i32>]) -> Option<Vec<u8>> {
    let mut writer = BitWriter::default();
    for segment in frames.chunks(SEGMENT) {
        write_segment(rotations, segment, &mut writer)?;
    }
    writer.extend(&[0; ROW_BYTES]);
    Some(writer.finish())
}

fn write_segment(rotations: usize, frames: &[Vec<i32>], writer: &mut BitWriter) -> Option<()> {
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
    let ranges = bases.iter().zip(&most);
    let widths: Vec<u8> = ranges
        .map(|(base, most)| width_of(most.abs_diff(*base)))
        .collect();
    let (rows, root) = widths.split_at(widths.len() - 3);
    let rows = rows.chunks(CODES).map(|row| row.iter().max().copied());
    let rows: Vec<u8> = rows.map(Option::unwrap_or_default).collect();
    if rows.iter().any(|&width| width > MOST_BITS)
        || root.iter().any(|&width| width > MOST_ROOT_BITS)
    {
        return None;
    }
    writer.extend(&rows);
    writer.extend(root);
    for &base in &bases[..rotations] {
        writer.extend(&(base as i16).to_le_bytes());
    }
    for base in &bases[rotations..] {
        writer.extend(&base.to_le_bytes());
    }
    for frame in frames {
        let widths = rows.iter().flat_map(|&width| [width; CODES]);
        let values = frame.iter().zip(&bases);
        for ((value, base), width) in values.zip(widths.chain(root.iter().copied())) {
            writer.push(value.abs_diff(*base), width);
        }
        writer.align();
    }
    Some(())
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

/// Number of bits of codes from 0 to `range`.
fn width_of(range: u32) -> u8 {
    (u32::BITS - range.leading_zeros()) as u8
}

/// Appends codes to bytes, bit by bit from the lowest.
#[derive(Debug, Default)]
struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet.
    rest: u64,
    bits: u32,
}

impl BitWriter {
    fn push(&mut self, code: u32, width: u8) {
        self.rest |= u64::from(code) << self.bits;
        self.bits += u32::from(width);
        while self.bits >= 8 {
            self.bytes.push(self.rest as u8);
            self.rest >>= 8;
            self.bits -= 8;
        }
    }

    /// Fills the last byte with zeros.
    fn align(&mut self) {
        if self.bits > 0 {
            self.push(0, (8 - self.bits) as u8);
        }
    }

    fn extend(&mut self, bytes: &[u8]) {
        self.align();
        self.bytes.extend_from_slice(bytes);
    }

    fn finish(mut self) -> Vec<u8> {
        self.align();
        self.bytes
    }
}

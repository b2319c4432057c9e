//! A clip in few bytes, of which any frame is read directly.
//!
//! Source: N. Frechette, "Animation Compression" (the articles and documentation of the Animation Compression Library, 2016–2024):
//! uniformly quantised tracks, ranges by segment, a bit rate by track that is the smallest to hold an error measured in model
//! space. Differs: the grid of a track is one for the whole clip, and a segment stores each component's smallest point (frame of
//! reference coding; J. Goldstein, R. Ramakrishnan & U. Shaft, 1998). All four components of a quaternion are stored in units of
//! one step, so that decoding is two integer operations and the normalisation that interpolation needs anyway: no fourth
//! component is computed by a square root, and no step is read. Eight joints share the width of a component, so that rows of a frame begin at bytes.
//!
//! ```text
//! clip     segments of 16 frames, then 16 bytes of 0
//! segment  widths: a byte for each row of rotations, each row of translations, and x, y, z of the root
//!          bases: eight i16 for each row of rotations, eight i32 for each of translations, three i32 for the root
//!          its frames
//! frame    the rows' codes, eight of `width` bits; the root's, filled up to a byte
//! row      x, y, z or w of the rotations of eight lanes; x, y or z of the translations of eight joints
//! value    base + code, in units of the step
//! ```

mod check;
mod read;
mod write;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{JointKind, Skeleton};
use crate::math::byte_list;
use crate::math::code_rows::CODES;
pub(super) use read::{PackedGroups, PackedMoment, scatter};
pub use write::CompressionSettings;
pub(super) use write::largest_errors;

/// Number of frames of a segment; the last one may have fewer.
const SEGMENT: usize = 16;

/// Step of positions, in metres.
const PLACE_STEP: f32 = 1.0 / 32768.0;

/// Maximum width of a coordinate of the root, in bits.
const MOST_ROOT_BITS: u8 = 24;

/// Entry of `lane_of` for joints that do not rotate.
const NO_LANE: u16 = u16::MAX;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredPacked", into = "StoredPacked")]
pub(super) struct PackedClip {
    pub(super) stored: StoredPacked,
    lane_of: Vec<u16>,
    segments: Vec<Segment>,
    /// Position of the root in each frame, which is read more often than all else.
    pub(super) roots: Vec<Vec3>,
}

/// The part of a compressed clip that files store.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredPacked {
    pub(super) name: String,
    pub(super) frame_rate: f64,
    frames: u32,
    joints: u16,
    /// Whether the clip has translations.
    moves_joints: bool,
    /// Largest errors that were measured, at the joints and at the ends, in metres.
    pub(super) errors: [f32; 2],
    /// Joint of each lane of the rotations.
    lanes: Vec<u16>,
    #[serde(with = "byte_list")]
    bytes: Vec<u8>,
}

/// Position of a segment in the bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    start: u32,
    /// Bytes of a frame.
    stride: u32,
    /// Bytes of a frame's rows, after which the root's codes follow.
    rows: u32,
}

/// Numbers of groups of eight lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Groups {
    rotations: usize,
    translations: usize,
}

impl Groups {
    /// Groups of the rotations of `lanes` joints and the translations of `moving` joints.
    fn new(lanes: usize, moving: usize) -> Self {
        Self {
            rotations: lanes.div_ceil(CODES),
            translations: moving.div_ceil(CODES),
        }
    }

    fn rows(self) -> [usize; 2] {
        [4 * self.rotations, 3 * self.translations]
    }

    /// Number of bytes that hold the widths of a segment.
    fn widths(self) -> usize {
        let [rotations, translations] = self.rows();
        rotations + translations + 3
    }

    /// Number of bytes before a segment's first frame.
    fn header(self) -> usize {
        let [rotations, translations] = self.rows();
        self.widths() + 2 * CODES * rotations + 4 * CODES * translations + 4 * 3
    }
}

/// Joints that rotate, those that carry the longest bones first: they need the finest steps, and eight joints share their widths.
fn lanes(skeleton: &Skeleton) -> Vec<u16> {
    let mut bones = vec![0f32; skeleton.len()];
    for joint in skeleton.joints() {
        if let Some(parent) = joint.parent {
            let bone = &mut bones[parent.index()];
            *bone = bone.max(joint.offset.length());
        }
    }
    let moving = |id: &u16| skeleton.joints()[usize::from(*id)].kind == JointKind::Moving;
    let mut lanes: Vec<u16> = (0..skeleton.len() as u16).filter(moving).collect();
    lanes.sort_by(|&a, &b| bones[usize::from(b)].total_cmp(&bones[usize::from(a)]));
    lanes
}

impl PackedClip {
    pub(super) fn frames(&self) -> usize {
        self.stored.frames as usize
    }

    pub(super) fn moves_joints(&self) -> bool {
        self.stored.moves_joints
    }

    pub(super) fn lanes(&self) -> &[u16] {
        &self.stored.lanes
    }

    pub(super) fn joints(&self) -> usize {
        usize::from(self.stored.joints)
    }

    /// Bytes that the clip takes in a file.
    pub(super) fn stored_bytes(&self) -> usize {
        self.stored.bytes.len() + size_of_val(self.stored.lanes.as_slice())
    }

    fn groups(&self) -> Groups {
        self.stored.groups()
    }
}

impl StoredPacked {
    fn groups(&self) -> Groups {
        let joints = usize::from(self.joints);
        Groups::new(self.lanes.len(), if self.moves_joints { joints } else { 0 })
    }
}

//! Reads single values and whole poses from a compressed clip.

use glam::{Quat, Vec3};

use super::bits;
use super::groups::{EachRotation, PackedGroups, WholePose};
use super::{NO_LANE, PLACE_STEP, PackedClip, SEGMENT};
use crate::anim::Pose;
use crate::anim::rows::Rows;
use crate::math::Isa;
use crate::math::code_rows::{CODES, CodeRow, ROW_BYTES, RowReader, unit, unit_lerp};

/// A moment of a compressed clip.
#[derive(Clone, Copy, Debug)]
pub struct PackedMoment<'a> {
    clip: &'a PackedClip,
    /// The frames around the moment.
    pub(super) frames: [FrameBytes<'a>; 2],
    /// Weight of the second frame.
    pub(super) weight: f32,
}

/// A frame in the bytes of its segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameBytes<'a> {
    widths: &'a [u8],
    /// Bases of the rotations.
    bases: &'a [u8],
    /// Bases of the translations and of the root.
    place_bases: &'a [u8],
    /// Bytes from the start of the frame to the end of the clip.
    codes: &'a [u8],
    /// Start of the root's codes.
    root: usize,
}

impl PackedClip {
    /// The moment at `lower` or, with a weight above 0, between that frame and the next.
    #[inline]
    pub(in crate::anim) fn at(&self, lower: usize, weight: f32) -> PackedMoment<'_> {
        let upper = if weight > 0.0 { lower + 1 } else { lower };
        PackedMoment {
            clip: self,
            frames: [self.frame(lower), self.frame(upper)],
            weight,
        }
    }

    #[inline]
    pub(super) fn frame(&self, frame: usize) -> FrameBytes<'_> {
        let segment = self.segments[frame / SEGMENT];
        let (start, groups) = (segment.start as usize, self.groups());
        let bytes = &self.stored.bytes[start..];
        let (widths, rest) = bytes.split_at(groups.widths());
        let (bases, place_bases) = rest.split_at(2 * CODES * groups.rows()[0]);
        let at = groups.header() + frame % SEGMENT * segment.stride as usize;
        FrameBytes {
            widths,
            bases,
            place_bases,
            codes: &bytes[at..],
            root: segment.rows as usize,
        }
    }
}

impl FrameBytes<'_> {
    /// The codes of a lane in rows from `first` on.
    #[inline(always)]
    fn codes_of<const ROWS: usize>(&self, first: usize, lane: usize) -> [i32; ROWS] {
        let mut codes = [0; ROWS];
        let mut at = self.before(first);
        for (code, &width) in codes.iter_mut().zip(&self.widths[first..first + ROWS]) {
            *code = bits::code(self.codes, 8 * at + lane * usize::from(width), width);
            at += usize::from(width);
        }
        codes
    }

    /// Number of bytes before a row's codes.
    #[inline]
    fn before(&self, row: usize) -> usize {
        let widths = self.widths[..row].iter();
        widths.map(|&width| usize::from(width)).sum()
    }

    #[inline]
    fn place_base(&self, index: usize) -> i32 {
        let mut base = [0; 4];
        base.copy_from_slice(&self.place_bases[4 * index..4 * index + 4]);
        i32::from_le_bytes(base)
    }

    /// A rotation in units of the step.
    #[inline(always)]
    fn rotation(&self, lane: usize) -> Rows<1> {
        let (first, lane) = (4 * (lane / CODES), lane % CODES);
        let bases = &self.bases[2 * CODES * first..][..8 * CODES];
        let codes: [i32; 4] = self.codes_of(first, lane);
        let mut out = [[0.0]; 4];
        for ((out, code), bases) in out.iter_mut().zip(codes).zip(bases.chunks_exact(2 * CODES)) {
            let base = i16::from_le_bytes([bases[2 * lane], bases[2 * lane + 1]]);
            *out = [(code + i32::from(base)) as f32];
        }
        out
    }

    #[inline]
    fn translation(&self, rotations: usize, joint: usize) -> Vec3 {
        let (first, lane) = (3 * (joint / CODES), joint % CODES);
        let codes: [i32; 3] = self.codes_of(rotations + first, lane);
        let coordinate = |row: usize| {
            let base = self.place_base(CODES * (first + row) + lane);
            place(base.wrapping_add(codes[row]))
        };
        Vec3::from_array(std::array::from_fn(coordinate))
    }

    /// `rows` are the numbers of rows of rotations and of translations.
    #[inline]
    fn root(&self, [rotations, translations]: [usize; 2]) -> Vec3 {
        let first = rotations + translations;
        let mut bit = 8 * self.root;
        let coordinate = |axis: usize| {
            let width = self.widths[first + axis];
            let code = bits::code(self.codes, bit, width);
            bit += usize::from(width);
            place(
                self.place_base(CODES * translations + axis)
                    .wrapping_add(code),
            )
        };
        Vec3::from_array([0, 1, 2].map(coordinate))
    }

    /// The rotations of a group, in units of the step. Its codes begin at `at`, which becomes their end.
    #[inline(always)]
    pub(super) fn group<R: RowReader>(
        &self,
        reader: R,
        group: usize,
        at: &mut usize,
    ) -> Rows<CODES> {
        let widths = &self.widths[4 * group..4 * group + 4];
        let bases = &self.bases[8 * CODES * group..][..8 * CODES];
        let (bases, _) = bases.as_chunks::<{ 2 * CODES }>();
        let mut out = [[0.0; CODES]; 4];
        for ((row, &width), bases) in out.iter_mut().zip(widths).zip(bases) {
            // A row's bytes are always followed by as many as a row is read with.
            if let Some(bytes) = self.codes[*at..].first_chunk::<ROW_BYTES>() {
                *row = reader.read(CodeRow {
                    bytes,
                    bases,
                    width,
                });
            }
            *at += usize::from(width);
        }
        out
    }
}

#[inline(always)]
fn place(steps: i32) -> f32 {
    steps as f32 * PLACE_STEP
}

impl<'a> PackedMoment<'a> {
    #[inline]
    pub(crate) fn root(&self) -> Vec3 {
        let rows = self.clip.groups().rows();
        self.between(|frame| frame.root(rows))
    }

    #[inline]
    pub(crate) fn translation(&self, joint: usize) -> Vec3 {
        let [rotations, _] = self.clip.groups().rows();
        self.between(|frame| frame.translation(rotations, joint))
    }

    #[inline]
    fn between(&self, of: impl Fn(&FrameBytes<'_>) -> Vec3) -> Vec3 {
        let [from, to] = &self.frames;
        match self.weight {
            0.0 => of(from),
            weight => of(from).lerp(of(to), weight),
        }
    }

    #[inline]
    pub(crate) fn rotation(&self, joint: usize) -> Quat {
        let lane = self.clip.lane_of[joint];
        if lane == NO_LANE {
            return Quat::IDENTITY;
        }
        let (lane, [from, to]) = (usize::from(lane), &self.frames);
        let here = from.rotation(lane);
        let [[x], [y], [z], [w]] = match self.weight {
            0.0 => unit(&here),
            weight => unit_lerp(&here, &to.rotation(lane), weight),
        };
        Quat::from_xyzw(x, y, z, w)
    }

    /// Reads groups of eight lanes, from the first on.
    #[inline(always)]
    pub fn groups<R: RowReader>(&self, reader: R) -> PackedGroups<'_, R> {
        PackedGroups::new(self, reader)
    }

    /// Writes the whole pose to `out`.
    pub(in crate::anim) fn pose(&self, isa: Isa, out: &mut Pose) {
        let joints = self.clip.joints();
        out.root = self.root();
        // End sites do not rotate.
        out.rotations.clear();
        out.rotations.resize(joints, Quat::IDENTITY);
        isa.read_rows(WholePose {
            moment: self,
            out: &mut out.rotations,
        });
        out.translations.clear();
        if self.moves_joints() {
            let places = (0..joints).map(|joint| self.translation(joint));
            out.translations.extend(places);
        }
    }

    /// Hands out the rotations of all joints but end sites.
    pub(in crate::anim) fn each_rotation(&self, visit: impl FnMut(usize, Quat)) {
        Isa::best().read_rows(EachRotation {
            moment: self,
            visit,
        });
    }

    /// Whether the clip has translations for its joints.
    pub(crate) fn moves_joints(&self) -> bool {
        self.clip.moves_joints()
    }

    /// Joint of each lane.
    pub fn lanes(&self) -> &'a [u16] {
        self.clip.lanes()
    }
}

//! Reads single values and whole poses from a compressed clip, eight lanes at a time.

use glam::{Quat, Vec3};

use super::{Groups, NO_LANE, PLACE_STEP, PackedClip, SEGMENT};
use crate::anim::Pose;
use crate::anim::moment::root_between;
use crate::anim::rows::{Block, LANES, Rows};
use crate::math::Isa;
use crate::math::code_rows::{CODES, CodeRow, ROW_BYTES, RowKernel, RowReader, unit, unit_lerp};

/// A moment of a compressed clip.
#[derive(Clone, Copy, Debug)]
pub(in crate::anim) struct PackedMoment<'a> {
    pub(in crate::anim) clip: &'a PackedClip,
    /// Roots from the first frame on.
    roots: &'a [Vec3],
    /// The frames around the moment.
    pub(super) frames: [FrameBytes<'a>; 2],
    /// Weight of the second frame.
    pub(super) weight: f32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FrameBytes<'a> {
    widths: &'a [u8],
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
            roots: &self.roots[lower..],
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
    #[inline(always)]
    fn codes_of<const ROWS: usize>(&self, first: usize, lane: usize) -> [i32; ROWS] {
        let mut codes = [0; ROWS];
        let mut at = self.before(first);
        for (code, &width) in codes.iter_mut().zip(&self.widths[first..first + ROWS]) {
            *code = read_code(self.codes, 8 * at + lane * usize::from(width), width);
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

    pub(super) fn root(&self, groups: Groups) -> Vec3 {
        let [rotations, translations] = groups.rows();
        let first = rotations + translations;
        let mut bit = 8 * self.root;
        let coordinate = |axis: usize| {
            let width = self.widths[first + axis];
            let code = read_code(self.codes, bit, width);
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
    pub(in crate::anim) fn root(&self) -> Vec3 {
        root_between(self.roots, self.weight)
    }

    #[inline]
    pub(in crate::anim) fn translation(&self, joint: usize) -> Vec3 {
        let ([rotations, _], [from, to]) = (self.clip.groups().rows(), &self.frames);
        let here = from.translation(rotations, joint);
        match self.weight {
            0.0 => here,
            weight => here.lerp(to.translation(rotations, joint), weight),
        }
    }

    #[inline]
    pub(in crate::anim) fn rotation(&self, joint: usize) -> Quat {
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

    pub(in crate::anim) fn pose(&self, isa: Isa, out: &mut Pose) {
        let joints = self.clip.joints();
        out.root = self.root();
        // End sites do not rotate.
        out.rotations.clear();
        out.rotations.resize(joints, Quat::IDENTITY);
        isa.read_rows(EachRotation {
            moment: self,
            visit: |joint, rotation| out.rotations[joint] = rotation,
        });
        out.translations.clear();
        if self.clip.moves_joints() {
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
}

/// The code of `width` bits, at most 24, that begins at a bit. Four bytes from its first one on are read.
#[inline(always)]
fn read_code(bytes: &[u8], bit: usize, width: u8) -> i32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[bit / 8..bit / 8 + 4]);
    (u32::from_le_bytes(word) >> (bit % 8) & ((1 << width) - 1)) as i32
}

/// Hands out all rotations but those of end sites.
struct EachRotation<'a, V> {
    moment: &'a PackedMoment<'a>,
    visit: V,
}

impl<V: FnMut(usize, Quat)> RowKernel for EachRotation<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<R: RowReader>(mut self, reader: R) {
        let mut groups = PackedGroups::new(self.moment, reader);
        for lanes in self.moment.clip.lanes().chunks(CODES) {
            let [x, y, z, w] = groups.next_group();
            for (lane, &joint) in lanes.iter().take(CODES).enumerate() {
                let rotation = Quat::from_xyzw(x[lane], y[lane], z[lane], w[lane]);
                (self.visit)(usize::from(joint), rotation);
            }
        }
    }
}

/// Groups of eight lanes of a moment, one after another.
pub(in crate::anim) struct PackedGroups<'a, R> {
    reader: R,
    moment: &'a PackedMoment<'a>,
    group: usize,
    /// Start of the next group's codes in the frames around the moment.
    at: [usize; 2],
}

impl<'a, R: RowReader> PackedGroups<'a, R> {
    #[inline(always)]
    pub(in crate::anim) fn new(moment: &'a PackedMoment<'a>, reader: R) -> Self {
        Self {
            reader,
            moment,
            group: 0,
            at: [0; 2],
        }
    }

    /// The next eight rotations.
    #[inline(always)]
    pub(in crate::anim) fn next_group(&mut self) -> Rows<CODES> {
        let [from, to] = &self.moment.frames;
        let (reader, group) = (self.reader, self.group);
        self.group += 1;
        let first = from.group(reader, group, &mut self.at[0]);
        match self.moment.weight {
            0.0 => reader.unit(&first),
            weight => {
                let second = to.group(reader, group, &mut self.at[1]);
                reader.unit_lerp(&first, &second, weight)
            }
        }
    }

    /// The next 16 rotations; where no more than 8 lanes are left, the second half is 0.
    #[inline(always)]
    pub(in crate::anim) fn next_block(&mut self, lanes: usize) -> Block {
        let mut block = [[0.0; LANES]; 4];
        for half in 0..lanes.min(LANES).div_ceil(CODES) {
            let group = self.next_group();
            for (row, eight) in block.iter_mut().zip(&group) {
                row[half * CODES..(half + 1) * CODES].copy_from_slice(eight);
            }
        }
        block
    }
}

/// Writes the rotations of lanes to their joints.
#[inline(always)]
pub(in crate::anim) fn scatter<const N: usize>(
    [x, y, z, w]: &Rows<N>,
    lanes: &[u16],
    out: &mut [Quat],
) {
    for (lane, &joint) in lanes.iter().take(N).enumerate() {
        out[usize::from(joint)] = Quat::from_xyzw(x[lane], y[lane], z[lane], w[lane]);
    }
}

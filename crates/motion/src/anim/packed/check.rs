//! Checks a compressed clip from a file. Nothing in it is trusted.

use super::{MOST_ROOT_BITS, NO_LANE, PackedClip, SEGMENT, Segment, StoredPacked, lanes};
use crate::anim::Skeleton;
use crate::math::Isa;
use crate::math::code_rows::{CODES, MOST_BITS, ROW_BYTES, RowKernel, RowReader, Vectors};

impl From<PackedClip> for StoredPacked {
    fn from(clip: PackedClip) -> Self {
        clip.stored
    }
}

impl TryFrom<StoredPacked> for PackedClip {
    type Error = &'static str;

    /// Checks that every frame lies within the bytes.
    fn try_from(stored: StoredPacked) -> Result<Self, Self::Error> {
        let joints = usize::from(stored.joints);
        let mut lane_of = vec![NO_LANE; joints];
        for (lane, &joint) in (0..NO_LANE).zip(&stored.lanes) {
            match lane_of.get_mut(usize::from(joint)) {
                Some(of) if *of == NO_LANE => *of = lane,
                _ => return Err("a compressed clip names a joint that is none, or one twice"),
            }
        }
        // The root exists, so this many lanes are joints.
        if stored.lanes.is_empty() || stored.frames == 0 || stored.bytes.len() > u32::MAX as usize {
            return Err("a compressed clip is empty or too long");
        }
        let segments = stored.segments()?;
        let mut clip = Self {
            stored,
            lane_of,
            segments,
            roots: Vec::new(),
        };
        clip.roots = (0..clip.frames())
            .map(|frame| clip.frame(frame).root(clip.groups()))
            .collect();
        Ok(clip)
    }
}

impl StoredPacked {
    fn segments(&self) -> Result<Vec<Segment>, &'static str> {
        const SHORT: &str = "a compressed clip is shorter or longer than its frames";
        let (groups, frames) = (self.groups(), self.frames as usize);
        let mut segments = Vec::new();
        let mut start = 0;
        for first in (0..frames).step_by(SEGMENT) {
            let widths = self
                .bytes
                .get(start..start + groups.widths())
                .ok_or(SHORT)?;
            let (rows, root) = widths.split_at(groups.widths() - 3);
            if rows.iter().any(|&width| width > MOST_BITS)
                || root.iter().any(|&width| width > MOST_ROOT_BITS)
            {
                return Err("a compressed clip has codes that are too wide");
            }
            let sum = |widths: &[u8]| {
                widths
                    .iter()
                    .map(|&width| usize::from(width))
                    .sum::<usize>()
            };
            let (rows, root) = (sum(rows), sum(root));
            let stride = rows + root.div_ceil(8);
            segments.push(Segment {
                start: start as u32,
                stride: stride as u32,
                rows: rows as u32,
            });
            start += groups.header() + stride * SEGMENT.min(frames - first);
            if start > self.bytes.len() {
                return Err(SHORT);
            }
        }
        let rest = self.bytes.get(start..).ok_or(SHORT)?;
        let is_end = rest.len() == ROW_BYTES && rest.iter().all(|&byte| byte == 0);
        if is_end { Ok(segments) } else { Err(SHORT) }
    }
}

impl PackedClip {
    /// Whether the clip is one of this skeleton: its lanes are the skeleton's, each rotation can be normalised, and neighbouring
    /// frames have quaternions on the same side, between which interpolation does not pass zero.
    pub(in crate::anim) fn fits(&self, skeleton: &Skeleton) -> bool {
        usize::from(self.stored.joints) == skeleton.len()
            && self.stored.frame_rate.is_finite()
            && self.stored.frame_rate > 0.0
            && self.stored.errors.iter().all(|error| error.is_finite())
            && self.stored.lanes == lanes(skeleton)
            && Isa::best().read_rows(SoundRotations(self))
            && self.has_near_places()
    }

    fn has_near_places(&self) -> bool {
        (0..self.frames()).all(|frame| {
            let moment = self.at(frame, 0.0);
            let joints = if self.moves_joints() {
                self.stored.joints
            } else {
                0
            };
            Skeleton::is_near(moment.root())
                && (0..usize::from(joints))
                    .all(|joint| Skeleton::is_near(moment.translation(joint)))
        })
    }
}

/// Whether no rotation is 0, and none lies on the other side of the one before it.
struct SoundRotations<'a>(&'a PackedClip);

impl RowKernel for SoundRotations<'_> {
    type Out = bool;

    #[inline(always)]
    fn run<R: RowReader>(self, reader: R) -> bool {
        let Self(clip) = self;
        let groups = clip.groups().rotations;
        let mut before: Vec<Vectors<CODES>> = vec![[[0f32; CODES]; 4]; groups];
        let mut is_sound = true;
        for frame in 0..clip.frames() {
            let frame_bytes = clip.frame(frame);
            let mut at = 0;
            for (group, before) in before.iter_mut().enumerate() {
                let here = frame_bytes.group(reader, group, &mut at);
                let last = if frame == 0 { here } else { *before };
                *before = here;
                let used = clip.lanes().len() - CODES * group;
                let (own, turned) = (products(&here, &here), products(&last, &here));
                for lane in 0..CODES {
                    is_sound &= lane >= used || (own[lane] > 0.0 && turned[lane] > 0.0);
                }
            }
        }
        is_sound
    }
}

#[inline(always)]
fn products(a: &Vectors<CODES>, b: &Vectors<CODES>) -> [f32; CODES] {
    let mut out = [0.0; CODES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..CODES {
            out[lane] += a[lane] * b[lane];
        }
    }
    out
}

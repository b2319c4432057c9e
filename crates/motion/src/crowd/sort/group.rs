//! Groups: sixteen characters that are posed together. A character's slot is its group and lane, as one number.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use crate::anim::ClipId;
use crate::crowd::character::{CharacterState, LaneClip};
use crate::crowd::keys::clip_times::{ClipRange, Cycle, Moment};
use crate::lod::LevelId;
use crate::math::{F32x16, Lanes};

/// All characters are sorted once one in this many was moved to another group.
pub(crate) const MOST_LATE: usize = 16;

/// The slot of a character that is in no group.
pub(crate) const NOWHERE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    pub(crate) group: usize,
    pub(crate) lane: usize,
}

impl Slot {
    pub(crate) fn from_number(number: u32) -> Self {
        let number = number as usize;
        Self {
            group: number / F32x16::LANES,
            lane: number % F32x16::LANES,
        }
    }

    pub(crate) fn number(self) -> u32 {
        (self.group * F32x16::LANES + self.lane) as u32
    }
}

/// The properties that all characters of a group share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct GroupKind {
    /// The finest level that a character of the group needs.
    pub(crate) level: LevelId,
    /// The clip of all characters if they are near each other in time, else `None`.
    pub(crate) near: Option<ClipId>,
    /// Whether the characters may cross-fade to second clips.
    pub(crate) fades: bool,
}

/// Consecutive groups of one level that all cross-fade or do not, whatever their clips: all of them, or those that belong to one chunk.
#[derive(Clone, Debug)]
pub(crate) struct Bucket {
    pub(crate) level: LevelId,
    pub(crate) fades: bool,
    pub(crate) groups: Range<usize>,
    pub(crate) offset: usize,
    /// Number of [`F32x16`]s of each group in the output.
    pub(crate) lines: usize,
}

impl Bucket {
    /// Number of [`F32x16`]s of all groups.
    pub(crate) fn output_len(&self) -> usize {
        self.groups.len() * self.lines
    }
}

impl GroupKind {
    /// Whether a character can be in a group of this kind.
    pub(crate) fn takes(self, state: &CharacterState) -> bool {
        self.level <= state.level()
            && self.near.is_none_or(|clip| clip == state.own.clip)
            && (self.fades || !state.fades)
    }
}

/// Sixteen characters that are posed together, field by field.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Group {
    pub(crate) clock: Clock,
    cos: F32x16,
    sin: F32x16,
    pub(crate) x: F32x16,
    pub(crate) y: F32x16,
    pub(crate) z: F32x16,
    /// Level plus blend of each character.
    pub(crate) detail: F32x16,
}

/// Positions in clips, as linear functions of the groups' clock.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Clock {
    /// Position when the groups' clock is 0, in frames.
    start: F32x16,
    /// Speed, in frames of the clip per second.
    speed: F32x16,
}

/// The fields of a group that posing reads only if its characters play several clips.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GroupCold {
    pub(crate) kind: GroupKind,
    /// Start of the group in the output, in [`F32x16`]s.
    pub(crate) offset: usize,
    /// Numbers of the characters; [`Group::NOBODY`] for unused lanes, which repeat another lane, so that they stay near it in time.
    pub(crate) ids: [u32; F32x16::LANES],
    /// Each character's own clip.
    pub(crate) own: LaneRanges,
    pub(crate) fade: FadeLines,
}

#[derive(Clone, Copy, Debug, Zeroable)]
pub(crate) struct LaneRanges {
    /// For each lane, number of rows of all clips before the character's own.
    pub(crate) rows: [u32; F32x16::LANES],
    /// For each lane, number of frames of all clips before the character's own.
    pub(crate) frames: [u32; F32x16::LANES],
    /// Number of intervals between frames of each clip.
    pub(crate) length: F32x16,
    /// Whether one of these clips does not have one key per frame.
    pub(crate) is_uneven: bool,
}

/// Second clips. For a character without one, its own clip with a weight of 0.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(crate) struct FadeLines {
    pub(crate) weight: F32x16,
    pub(crate) clock: Clock,
    pub(crate) clips: LaneRanges,
}

impl Group {
    pub(crate) const NOBODY: u32 = u32::MAX;

    /// Writes a character and its own clip into a lane.
    pub(crate) fn write(&mut self, lane: usize, state: &CharacterState, clip: &LaneClip<'_>) {
        self.clock.write(lane, clip);
        self.cos.0[lane] = state.cos;
        self.sin.0[lane] = state.sin;
        self.x.0[lane] = state.x;
        self.y.0[lane] = state.y;
        self.z.0[lane] = state.z;
        self.detail.0[lane] = state.detail;
    }

    #[inline(always)]
    pub(crate) fn placement<L: Lanes>(&self, part: usize) -> [L; 5] {
        [
            L::load(&self.cos, part),
            L::load(&self.sin, part),
            L::load(&self.x, part),
            L::load(&self.y, part),
            L::load(&self.z, part),
        ]
    }
}

impl GroupCold {
    pub(crate) fn empty(kind: GroupKind, offset: usize) -> Self {
        Self {
            kind,
            offset,
            ids: [Group::NOBODY; F32x16::LANES],
            own: LaneRanges::zeroed(),
            fade: FadeLines::zeroed(),
        }
    }

    /// Writes a character's own clip into a lane, and its second clip if the group cross-fades.
    pub(crate) fn write(&mut self, lane: usize, [own, fade]: &[LaneClip<'_>; 2]) {
        self.own.write(lane, own.range);
        if self.kind.fades {
            self.fade.write(lane, fade);
        }
    }
}

impl LaneRanges {
    fn write(&mut self, lane: usize, range: &ClipRange) {
        self.rows[lane] = range.row as u32;
        self.frames[lane] = range.frame as u32;
        self.length.0[lane] = range.frames as f32;
        self.is_uneven |= !range.is_even();
    }
}

impl FadeLines {
    fn write(&mut self, lane: usize, clip: &LaneClip<'_>) {
        self.weight.0[lane] = clip.weight;
        self.clock.write(lane, clip);
        self.clips.write(lane, clip.range);
    }
}

impl Clock {
    fn write(&mut self, lane: usize, clip: &LaneClip<'_>) {
        self.start.0[lane] = clip.start;
        self.speed.0[lane] = clip.range.per_second(clip.speed) as f32;
    }

    #[inline(always)]
    pub(crate) fn moment<L: Lanes>(&self, part: usize, now: f32, cycle: Cycle<L>) -> Moment<L> {
        let speed = L::load(&self.speed, part);
        cycle.moment(L::load(&self.start, part) + speed * L::splat(now))
    }
}

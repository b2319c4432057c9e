use super::bucket::GroupKind;
use super::character::CharacterState;
use super::lane_clip::{LaneClip, LaneClips};
use super::mix::Mix;
use super::moment::{Cycle, Moment};
use crate::anim::ClipId;
use crate::lod::LevelId;
use crate::math::{F32x16, Lanes};

/// Sixteen characters that are posed together, field by field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub(super) clock: Clock,
    cos: F32x16,
    sin: F32x16,
    pub(super) x: F32x16,
    pub(super) y: F32x16,
    pub(super) z: F32x16,
    /// Level plus blend of each character.
    pub(super) detail: F32x16,
}

/// Positions in clips, as linear functions of the groups' clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// Position when the groups' clock is 0, in frames.
    start: F32x16,
    /// Speed, in frames of the clip per second.
    speed: F32x16,
}

/// The fields of a group that posing reads only if its characters play several clips.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroupCold {
    pub(super) kind: GroupKind,
    /// Start of the group in the output, in [`F32x16`]s.
    pub(super) offset: usize,
    /// Numbers of the characters; [`Group::NOBODY`] for unused lanes.
    pub(super) ids: [u32; F32x16::LANES],
    /// For each lane, number of rows of all clips before the character's own.
    pub(super) rows: [u32; F32x16::LANES],
    /// For each lane, number of frames of all clips before the character's own.
    pub(super) frames: [u32; F32x16::LANES],
    /// Number of intervals between frames of each character's clip.
    pub(super) length: F32x16,
    /// Whether each of these clips has one key per frame.
    pub(super) is_even: bool,
    pub(super) fade: ClipLines,
    pub(super) layer: ClipLines,
}

/// Clips that are mixed in. For a character without one, its own clip with a weight of 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClipLines {
    pub(super) shared: SharedClip,
    pub(super) weight: F32x16,
    pub(super) clock: Clock,
    pub(super) rows: [u32; F32x16::LANES],
    pub(super) frames: [u32; F32x16::LANES],
    pub(super) length: F32x16,
    pub(super) is_even: bool,
}

/// The clip that all lanes play.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SharedClip {
    /// No lane has been written.
    Unknown,
    One(ClipId),
    /// Lanes play different clips.
    None,
}

impl SharedClip {
    /// The common clip after one more lane plays `clip`.
    fn with(self, clip: ClipId) -> Self {
        match self {
            Self::Unknown => Self::One(clip),
            Self::One(own) if own == clip => self,
            _ => Self::None,
        }
    }
}

impl Group {
    pub(super) const NOBODY: u32 = u32::MAX;

    pub(super) const EMPTY: Self = Self {
        clock: Clock::STOPPED,
        cos: F32x16([1.0; F32x16::LANES]),
        sin: F32x16::ZERO,
        x: F32x16::ZERO,
        y: F32x16::ZERO,
        z: F32x16::ZERO,
        detail: F32x16::ZERO,
    };

    /// Writes a character and its own clip into a lane.
    pub(super) fn write(&mut self, lane: usize, state: &CharacterState, clip: &LaneClip<'_>) {
        self.clock.start.0[lane] = clip.start;
        self.clock.speed.0[lane] = clip.range.per_second(clip.speed) as f32;
        self.cos.0[lane] = state.cos;
        self.sin.0[lane] = state.sin;
        self.x.0[lane] = state.x;
        self.y.0[lane] = state.y;
        self.z.0[lane] = state.z;
        self.detail.0[lane] = state.detail;
    }

    /// Copies everything that a lane holds to another lane.
    pub(super) fn copy_lane(&mut self, from: usize, to: usize) {
        for line in [
            &mut self.clock.start,
            &mut self.clock.speed,
            &mut self.cos,
            &mut self.sin,
            &mut self.x,
            &mut self.y,
            &mut self.z,
            &mut self.detail,
        ] {
            line.0[to] = line.0[from];
        }
    }

    #[inline(always)]
    pub(super) fn placement<L: Lanes>(&self, part: usize) -> [L; 5] {
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
    pub(super) const EMPTY: Self = Self {
        kind: GroupKind {
            level: LevelId(0),
            near: None,
            mix: Mix {
                fades: false,
                is_layered: false,
            },
        },
        offset: 0,
        ids: [Group::NOBODY; F32x16::LANES],
        rows: [0; F32x16::LANES],
        frames: [0; F32x16::LANES],
        length: F32x16([1.0; F32x16::LANES]),
        is_even: true,
        fade: ClipLines::EMPTY,
        layer: ClipLines::EMPTY,
    };

    /// Writes those clips of a character that the group mixes into a lane.
    pub(super) fn write(&mut self, lane: usize, clips: &LaneClips<'_>) {
        self.rows[lane] = clips.own.range.row as u32;
        self.frames[lane] = clips.own.range.frame as u32;
        self.length.0[lane] = clips.own.range.frames as f32;
        self.is_even &= clips.own.range.is_even();
        if self.kind.mix.fades {
            self.fade.write(lane, &clips.fade);
        }
        if self.kind.mix.is_layered {
            self.layer.write(lane, &clips.layer);
        }
    }

    /// Copies everything that a lane holds to another lane.
    pub(super) fn copy_lane(&mut self, from: usize, to: usize) {
        self.rows[to] = self.rows[from];
        self.frames[to] = self.frames[from];
        self.length.0[to] = self.length.0[from];
        self.fade.copy_lane(from, to);
        self.layer.copy_lane(from, to);
    }

    /// Whether a lane has a character. Unused lanes repeat another lane, so that they stay near it in time.
    pub(super) fn is_used(&self, lane: usize) -> bool {
        self.ids[lane] != Group::NOBODY
    }
}

impl ClipLines {
    const EMPTY: Self = Self {
        shared: SharedClip::Unknown,
        weight: F32x16::ZERO,
        clock: Clock::STOPPED,
        rows: [0; F32x16::LANES],
        frames: [0; F32x16::LANES],
        length: F32x16([1.0; F32x16::LANES]),
        is_even: true,
    };

    fn write(&mut self, lane: usize, clip: &LaneClip<'_>) {
        self.shared = self.shared.with(clip.clip);
        self.weight.0[lane] = clip.weight;
        self.clock.start.0[lane] = clip.start;
        self.clock.speed.0[lane] = clip.range.per_second(clip.speed) as f32;
        self.rows[lane] = clip.range.row as u32;
        self.frames[lane] = clip.range.frame as u32;
        self.length.0[lane] = clip.range.frames as f32;
        self.is_even &= clip.range.is_even();
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        self.rows[to] = self.rows[from];
        self.frames[to] = self.frames[from];
        for line in [
            &mut self.weight,
            &mut self.clock.start,
            &mut self.clock.speed,
            &mut self.length,
        ] {
            line.0[to] = line.0[from];
        }
    }
}

impl Clock {
    const STOPPED: Self = Self {
        start: F32x16::ZERO,
        speed: F32x16::ZERO,
    };

    #[inline(always)]
    pub(super) fn moment<L: Lanes>(&self, part: usize, now: f32, cycle: Cycle<L>) -> Moment<L> {
        let speed = L::load(&self.speed, part);
        cycle.moment(L::load(&self.start, part) + speed * L::splat(now))
    }
}

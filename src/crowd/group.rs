use super::character::{Being, LevelId};
use super::sample::{Cycle, Moment};
use super::schedule::Kind;
use crate::math::{Lanes, Line};

/// Sixteen characters who are posed together, field by field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub(super) clock: Clock,
    cos: Line,
    sin: Line,
    x: Line,
    y: Line,
    z: Line,
    /// The level that each looks like, and how far on the way to the next.
    pub(super) detail: Line,
}

/// Where they are in their clips, in intervals between keys.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// When the crowd's clock stands at 0.
    start: Line,
    /// Intervals per second.
    speed: Line,
}

/// What is only read, where frames are posed, of groups whose characters play several clips.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aside {
    pub(super) kind: Kind,
    /// Of its part of the output.
    pub(super) first_line: usize,
    /// Who they are; [`Group::NOBODY`] for lanes that are not used.
    pub(super) ids: [u32; Line::LANES],
    /// Rows of all clips before each one's own.
    pub(super) rows: [u32; Line::LANES],
    /// Intervals of each one's clip.
    pub(super) length: Line,
    pub(super) fade: FadeLines,
}

/// Their second clips; the first again, and nothing of it, for those who have none.
#[derive(Clone, Copy, Debug)]
pub(super) struct FadeLines {
    pub(super) weight: Line,
    pub(super) clock: Clock,
    pub(super) rows: [u32; Line::LANES],
    pub(super) length: Line,
}

impl Group {
    pub(super) const NOBODY: u32 = u32::MAX;

    pub(super) const EMPTY: Self = Self {
        clock: Clock::STOPPED,
        cos: Line([1.0; Line::LANES]),
        sin: Line::ZERO,
        x: Line::ZERO,
        y: Line::ZERO,
        z: Line::ZERO,
        detail: Line::ZERO,
    };

    pub(super) fn write(&mut self, lane: usize, being: &Being) {
        self.clock.start.0[lane] = being.start;
        self.clock.speed.0[lane] = being.speed;
        self.cos.0[lane] = being.cos;
        self.sin.0[lane] = being.sin;
        self.x.0[lane] = being.x;
        self.y.0[lane] = being.y;
        self.z.0[lane] = being.z;
        self.detail.0[lane] = being.detail;
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

impl Aside {
    pub(super) const EMPTY: Self = Self {
        kind: Kind {
            level: LevelId(0),
            near: None,
            is_fading: false,
        },
        first_line: 0,
        ids: [Group::NOBODY; Line::LANES],
        rows: [0; Line::LANES],
        length: Line([1.0; Line::LANES]),
        fade: FadeLines {
            weight: Line::ZERO,
            clock: Clock::STOPPED,
            rows: [0; Line::LANES],
            length: Line([1.0; Line::LANES]),
        },
    };

    /// `first` and `second`: the rows before its clips, and how many they have.
    pub(super) fn write(
        &mut self,
        lane: usize,
        being: &Being,
        [first, second]: [(usize, usize); 2],
    ) {
        self.rows[lane] = first.0 as u32;
        self.length.0[lane] = first.1 as f32;
        self.fade.weight.0[lane] = being.fade_weight;
        self.fade.clock.start.0[lane] = being.fade_start;
        self.fade.clock.speed.0[lane] = being.fade_speed;
        self.fade.rows[lane] = second.0 as u32;
        self.fade.length.0[lane] = second.1 as f32;
    }

    /// A lane that is not used repeats another: it stays near in time.
    pub(super) fn is_used(&self, lane: usize) -> bool {
        self.ids[lane] != Group::NOBODY
    }
}

impl Clock {
    const STOPPED: Self = Self {
        start: Line::ZERO,
        speed: Line::ZERO,
    };

    #[inline(always)]
    pub(super) fn moment<L: Lanes>(&self, part: usize, now: f32, cycle: Cycle<L>) -> Moment<L> {
        let speed = L::load(&self.speed, part);
        cycle.moment(L::load(&self.start, part) + speed * L::splat(now))
    }
}

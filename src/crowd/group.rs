use super::bank::Span;
use super::character::Placement;
use super::sample::{Mixed, Moment, Playing, Scattered};
use crate::math::{Lanes, Line};

/// Sixteen characters that play one clip on one level, field by field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    /// Who they are; [`Group::NOBODY`] for lanes that are not used.
    pub(super) ids: [u32; Line::LANES],
    pub(super) clock: Clock,
    cos: Line,
    sin: Line,
    x: Line,
    y: Line,
    z: Line,
    /// Not read where nobody fades.
    pub(super) fade: FadeLines,
}

/// Where they are in the clip, in intervals between keys.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    /// When the crowd's clock stands at 0.
    start: Line,
    /// Intervals per second.
    speed: Line,
}

/// Where they are in their second clips, which may be one for each.
#[derive(Clone, Copy, Debug)]
pub(super) struct FadeLines {
    pub(super) weight: Line,
    pub(super) clock: Clock,
    /// Intervals of the second clip.
    pub(super) length: Line,
    /// Its columns, as words.
    pub(super) base: Line,
    pub(super) stride: Line,
}

impl Group {
    pub(super) const NOBODY: u32 = u32::MAX;

    pub(super) const EMPTY: Self = Self {
        ids: [Self::NOBODY; Line::LANES],
        clock: Clock::STOPPED,
        cos: Line([1.0; Line::LANES]),
        sin: Line::ZERO,
        x: Line::ZERO,
        y: Line::ZERO,
        z: Line::ZERO,
        fade: FadeLines {
            weight: Line::ZERO,
            clock: Clock::STOPPED,
            length: Line([1.0; Line::LANES]),
            base: Line::ZERO,
            stride: Line::ZERO,
        },
    };

    /// All of one lane of `from` goes to a lane of this one.
    pub(super) fn take(&mut self, lane: usize, from: &Self, other: usize) {
        self.ids[lane] = from.ids[other];
        let mine = self.lines_mut();
        for (mine, theirs) in mine.into_iter().zip(from.lines()) {
            mine.0[lane] = theirs.0[other];
        }
    }

    fn lines(&self) -> [&Line; 13] {
        let fade = &self.fade;
        [
            &self.clock.start,
            &self.clock.speed,
            &self.cos,
            &self.sin,
            &self.x,
            &self.y,
            &self.z,
            &fade.weight,
            &fade.clock.start,
            &fade.clock.speed,
            &fade.length,
            &fade.base,
            &fade.stride,
        ]
    }

    fn lines_mut(&mut self) -> [&mut Line; 13] {
        let fade = &mut self.fade;
        [
            &mut self.clock.start,
            &mut self.clock.speed,
            &mut self.cos,
            &mut self.sin,
            &mut self.x,
            &mut self.y,
            &mut self.z,
            &mut fade.weight,
            &mut fade.clock.start,
            &mut fade.clock.speed,
            &mut fade.length,
            &mut fade.base,
            &mut fade.stride,
        ]
    }

    pub(super) fn place(&mut self, lane: usize, placement: &Placement) {
        self.cos.0[lane] = placement.ground.cos();
        self.sin.0[lane] = placement.ground.sin();
        self.x.0[lane] = placement.ground.x;
        self.y.0[lane] = placement.height;
        self.z.0[lane] = placement.ground.z;
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

impl FadeLines {
    /// The second clips mixed into the first.
    #[inline(always)]
    pub(super) fn mixed<L: Lanes, A>(
        &self,
        first: A,
        part: usize,
        now: f32,
    ) -> Mixed<L, A, Playing<L, Scattered<L>>> {
        let moment = self.clock.moment(part, now, L::load(&self.length, part));
        let base = L::load_words(&self.base, part);
        let columns = Scattered {
            places: L::sum(base, moment.interval.truncated()),
            stride: L::load_words(&self.stride, part),
        };
        Mixed {
            first,
            second: Playing::new(columns, moment.share),
            weight: L::load(&self.weight, part),
        }
    }

    /// Which clip it is.
    pub(super) fn set_span(&mut self, lane: usize, span: &Span) {
        self.length.0[lane] = span.intervals as f32;
        self.base.0[lane] = f32::from_bits(span.base as u32);
        self.stride.0[lane] = f32::from_bits(span.stride as u32);
    }
}

impl Clock {
    const STOPPED: Self = Self {
        start: Line::ZERO,
        speed: Line::ZERO,
    };

    /// `at` and `speed` in intervals, when the crowd's clock stands at `now`.
    pub(super) fn set(&mut self, lane: usize, at: f32, speed: f32, now: f32) {
        self.start.0[lane] = at - speed * now;
        self.speed.0[lane] = speed;
    }

    /// As many more intervals for each one.
    pub(super) fn scale(&mut self, lane: usize, factor: f32) {
        self.start.0[lane] *= factor;
        self.speed.0[lane] *= factor;
    }

    /// In intervals, when the crowd's clock stands at `now`.
    pub(super) fn at(&self, lane: usize, now: f32) -> f32 {
        self.start.0[lane] + self.speed.0[lane] * now
    }

    #[inline(always)]
    pub(super) fn moment<L: Lanes>(&self, part: usize, now: f32, length: L) -> Moment<L> {
        let speed = L::load(&self.speed, part);
        Moment::of(L::load(&self.start, part) + speed * L::splat(now), length)
    }

    /// Lets the crowd's clock start again: what stood at `now` stands at 0.
    pub(super) fn set_back(&mut self, now: f32, length: impl Fn(usize) -> f32) {
        for lane in 0..Line::LANES {
            let at = self.at(lane, now);
            self.start.0[lane] = if at.is_finite() {
                at.rem_euclid(length(lane))
            } else {
                0.0
            };
        }
    }
}

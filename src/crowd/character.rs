use super::level_clips::ClipRange;
use crate::lod::LevelId;
use crate::math::Rigid2;

/// A clip of a [`AnimationSet`](super::AnimationSet), by its place there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClipId(pub u16);

/// A character of a [`Crowd`](super::Crowd), in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CharacterId(pub u32);

impl ClipId {
    pub(super) fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl CharacterId {
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Where a character stands in the world: the space of its clip goes there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// On the ground.
    pub ground: Rigid2,
    /// Above it, metres.
    pub height: f32,
}

impl Placement {
    /// The world is the space of the clip.
    pub const IDENTITY: Self = Self {
        ground: Rigid2::IDENTITY,
        height: 0.0,
    };
}

impl Default for Placement {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// What one character of a crowd does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Character {
    /// What it plays, over and over.
    pub clip: ClipId,
    /// With how many joints.
    pub level: LevelId,
    /// How far it is on the way to the next level, from 0 to 1: joints that go there are blended to
    /// where they ride then, so that nothing jumps.
    pub blend: f32,
    /// Where in the clip it is, seconds; any number: it counts from the clip's start again at its
    /// end. NaN and infinities are the start.
    pub time: f32,
    /// Seconds of the clip for each second; 0 stands still, as what is no finite number does; below 0 goes backwards.
    pub speed: f32,
    /// Where it stands.
    pub placement: Placement,
    /// A second clip that it is going over to or coming from.
    pub fade: Option<Fade>,
}

/// A second motion, mixed into the first: rotations along the straight line between the two and
/// normalised, places in a straight line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fade {
    /// The second clip.
    pub clip: ClipId,
    /// Where in it, seconds, as [`Character::time`].
    pub time: f32,
    /// As [`Character::speed`].
    pub speed: f32,
    /// How much of it: 0 none, 1 nothing but it.
    pub weight: f32,
}

/// A character as a crowd keeps it; as long as a line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct CharacterState {
    /// Where in the clip it is when the crowd's clock stands at 0, in intervals between keys.
    pub(super) start: f32,
    /// Intervals per second.
    pub(super) speed: f32,
    pub(super) cos: f32,
    pub(super) sin: f32,
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
    /// The level, and how far it is on the way to the next.
    pub(super) detail: f32,
    pub(super) fade_start: f32,
    pub(super) fade_speed: f32,
    pub(super) fade_weight: f32,
    pub(super) clip: ClipId,
    pub(super) second: ClipId,
    pub(super) is_fading: bool,
    /// Not posed.
    pub(super) is_inactive: bool,
}

impl CharacterState {
    /// A character whose clips are there, when the crowd's clock stands at `now`. `last`: there is no
    /// level after it.
    pub(super) fn new<'a>(
        character: &Character,
        range: impl Fn(ClipId) -> &'a ClipRange,
        (last, now): (LevelId, f32),
    ) -> Self {
        let own = Fade {
            clip: character.clip,
            time: character.time,
            speed: character.speed,
            weight: 0.0,
        };
        let fade = character.fade.unwrap_or(own);
        let (start, speed) = started(range(own.clip), &own, now);
        let (fade_start, fade_speed) = started(range(fade.clip), &fade, now);
        let mut state = Self {
            start,
            speed,
            cos: 1.0,
            sin: 0.0,
            x: 0.0,
            y: 0.0,
            z: 0.0,
            detail: 0.0,
            fade_start,
            fade_speed,
            // NaN is nothing of it, which `clamp` would keep.
            fade_weight: if fade.weight > 0.0 {
                fade.weight.min(1.0)
            } else {
                0.0
            },
            clip: own.clip,
            second: fade.clip,
            is_fading: character.fade.is_some(),
            is_inactive: false,
        };
        state.place(&character.placement);
        state.set_detail((character.level, character.blend), last);
        state
    }

    /// What it does at this moment.
    pub(super) fn character(&self, [first, second]: [&ClipRange; 2], now: f32) -> Character {
        let fade = Fade {
            clip: self.second,
            time: (self.fade_start + self.fade_speed * now) / second.rate,
            speed: self.fade_speed / second.rate,
            weight: self.fade_weight,
        };
        Character {
            clip: self.clip,
            level: self.level(),
            blend: self.detail.fract(),
            time: self.at(now) / first.rate,
            speed: self.speed / first.rate,
            placement: Placement {
                ground: Rigid2::new(self.sin.atan2(self.cos), self.x, self.z),
                height: self.y,
            },
            fade: self.is_fading.then_some(fade),
        }
    }

    pub(super) fn place(&mut self, placement: &Placement) {
        (self.cos, self.sin) = (placement.ground.cos(), placement.ground.sin());
        (self.x, self.y, self.z) = (placement.ground.x, placement.height, placement.ground.z);
    }

    /// `last`: there is no level after it.
    pub(super) fn set_detail(&mut self, (level, blend): (LevelId, f32), last: LevelId) {
        // NaN is nothing of it, which `clamp` would keep.
        let blend = if blend > 0.0 { blend.min(1.0) } else { 0.0 };
        self.detail = (f32::from(level.0) + blend).min(f32::from(last.0));
    }

    /// The level that it must have at least.
    pub(super) fn level(&self) -> LevelId {
        LevelId(self.detail as u16)
    }

    /// Where in its clip it is, in intervals, counted on.
    pub(super) fn at(&self, now: f32) -> f32 {
        self.start + self.speed * now
    }

    /// Lets the crowd's clock start again: what stood at `now` stands at 0.
    pub(super) fn set_back(&mut self, now: f32, [first, second]: [&ClipRange; 2]) {
        let back = |at: f32, range: &ClipRange| {
            if at.is_finite() {
                at.rem_euclid(range.intervals as f32)
            } else {
                0.0
            }
        };
        self.start = back(self.at(now), first);
        self.fade_start = back(self.fade_start + self.fade_speed * now, second);
    }
}

/// In intervals, when the crowd's clock stands at 0; 0 for what is no finite number.
fn started(range: &ClipRange, played: &Fade, now: f32) -> (f32, f32) {
    let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
    let at = finite(played.time * range.rate);
    let speed = finite(played.speed * range.rate);
    (at - speed * now, speed)
}

use super::key_bank::ClipRange;
use crate::lod::LevelId;
use crate::math::Rigid2;

/// A clip by its index in an [`AnimationSet`](super::AnimationSet).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClipId(pub u16);

/// A character of a [`Crowd`](super::Crowd): characters are numbered in the order in which they were added.
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

/// Position and heading of a character: the transform from the space of its clip to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Heading, and position on the ground.
    pub ground: Rigid2,
    /// Height above the ground, in metres.
    pub height: f32,
}

impl Placement {
    /// The origin, facing +Z.
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

/// What one character of a crowd plays, and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Character {
    /// The clip, which is played in a loop.
    pub clip: ClipId,
    /// The level of detail.
    pub level: LevelId,
    /// Progress towards the next level, from 0 to 1. Joints that the next level removes are blended to where that level
    /// draws them.
    pub blend: f32,
    /// Time in the clip, in seconds. It wraps at the clip's end; NaN and infinities are the start.
    pub time: f32,
    /// Playback rate: seconds of the clip per second, 1 by default. 0 stands still, below 0 plays backwards; NaN and
    /// infinities stand still.
    pub speed: f32,
    /// Position and heading in the world.
    pub placement: Placement,
    /// A second clip to mix in; `None` by default.
    pub fade: Option<Fade>,
}

impl Default for Character {
    /// The first clip from its start at normal speed, with all joints, at the origin.
    fn default() -> Self {
        Self {
            clip: ClipId(0),
            level: LevelId(0),
            blend: 0.0,
            time: 0.0,
            speed: 1.0,
            placement: Placement::IDENTITY,
            fade: None,
        }
    }
}

/// A second clip that is mixed into the first: rotations by normalised linear interpolation along the shorter arc, places
/// linearly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fade {
    /// The second clip.
    pub clip: ClipId,
    /// Time in it, in seconds, as [`Character::time`].
    pub time: f32,
    /// Its playback rate, as [`Character::speed`].
    pub speed: f32,
    /// Share of the second clip, from 0 to 1.
    pub weight: f32,
}

/// A character as the crowd stores it: 64 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct CharacterState {
    /// Position in the clip at crowd time 0, in intervals between keys. Double precision, so that no error adds up.
    pub(super) phase: f64,
    pub(super) fade_phase: f64,
    /// Seconds of the clip per second.
    pub(super) speed: f32,
    pub(super) cos: f32,
    pub(super) sin: f32,
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
    /// Level plus blend. While the character is in a group, the group's lane is newer.
    pub(super) detail: f32,
    pub(super) fade_speed: f32,
    pub(super) fade_weight: f32,
    pub(super) clip: ClipId,
    pub(super) second: ClipId,
    pub(super) is_fading: bool,
    pub(super) is_inactive: bool,
    /// Outside the frustum of the last frame.
    pub(super) is_culled: bool,
    /// Waits for a group: the state is newer than the group's lane.
    pub(super) is_late: bool,
}

impl CharacterState {
    /// `range` gives the ranges of clips that exist; `last` is the coarsest level; `now` is the crowd's time.
    pub(super) fn new<'a>(
        character: &Character,
        range: impl Fn(ClipId) -> &'a ClipRange,
        (last, now): (LevelId, f64),
    ) -> Self {
        let own = Fade {
            clip: character.clip,
            time: character.time,
            speed: character.speed,
            weight: 0.0,
        };
        let fade = character.fade.unwrap_or(own);
        let (phase, speed) = started(range(own.clip), &own, now);
        let (fade_phase, fade_speed) = started(range(fade.clip), &fade, now);
        let mut state = Self {
            phase,
            fade_phase,
            speed,
            cos: 1.0,
            sin: 0.0,
            x: 0.0,
            y: 0.0,
            z: 0.0,
            detail: 0.0,
            fade_speed,
            fade_weight: clamped_share(fade.weight),
            clip: own.clip,
            second: fade.clip,
            is_fading: character.fade.is_some(),
            is_inactive: false,
            is_culled: false,
            is_late: false,
        };
        state.place(&character.placement);
        state.set_detail((character.level, character.blend), last);
        state
    }

    /// What the character plays at this moment.
    pub(super) fn character(&self, [first, second]: [&ClipRange; 2], now: f64) -> Character {
        let fade = Fade {
            clip: self.second,
            time: second.seconds(self.fade_start(second, now)),
            speed: self.fade_speed,
            weight: self.fade_weight,
        };
        Character {
            clip: self.clip,
            level: self.level(),
            blend: self.detail.fract(),
            time: first.seconds(self.start(first, now)),
            speed: self.speed,
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

    /// `last` is the coarsest level.
    pub(super) fn set_detail(&mut self, (level, blend): (LevelId, f32), last: LevelId) {
        self.detail = (f32::from(level.0) + clamped_share(blend)).min(f32::from(last.0));
    }

    /// The coarsest level that still has all the joints that the character needs.
    pub(super) fn level(&self) -> LevelId {
        LevelId(self.detail as u16)
    }

    /// Position in the clip at a time, in intervals, within the clip.
    pub(super) fn start(&self, range: &ClipRange, now: f64) -> f32 {
        range.wrapped(self.phase + range.per_second(self.speed) * now)
    }

    /// The same of the second clip.
    pub(super) fn fade_start(&self, range: &ClipRange, now: f64) -> f32 {
        range.wrapped(self.fade_phase + range.per_second(self.fade_speed) * now)
    }
}

/// From 0 to 1; 0 for NaN, which `clamp` would keep.
fn clamped_share(share: f32) -> f32 {
    if share > 0.0 { share.min(1.0) } else { 0.0 }
}

/// Phase at time 0 in intervals, and speed; 0 for what is not finite.
fn started(range: &ClipRange, played: &Fade, now: f64) -> (f64, f32) {
    let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
    let (at, speed) = (finite(played.time), finite(played.speed));
    (range.per_second(at) - range.per_second(speed) * now, speed)
}

use glam::Vec3;

use super::keys::animation_set::AnimationSet;
use super::keys::clip_times::ClipRange;
use crate::anim::ClipId;
use crate::lod::LevelId;
use crate::math::Rigid2;

/// A member of a [`Crowd`](super::Crowd): characters are numbered in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MemberId(pub u32);

impl MemberId {
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

    /// The position in the world, in metres.
    pub fn position(&self) -> Vec3 {
        Vec3::new(self.ground.x, self.height, self.ground.z)
    }
}

impl Default for Placement {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The motion, level of detail and placement of one character of a crowd.
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
    /// A second clip to cross-fade to: rotations by normalised linear interpolation along the shorter arc, positions
    /// linearly. Its weight is its share, from 0 to 1. `None` by default.
    pub fade: Option<ClipMix>,
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

/// A clip that is mixed into a character's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClipMix {
    /// The clip.
    pub clip: ClipId,
    /// Time in the clip, in seconds, as [`Character::time`].
    pub time: f32,
    /// Playback rate of the clip, as [`Character::speed`].
    pub speed: f32,
    /// Weight of the clip: see [`Character::fade`].
    pub weight: f32,
}

/// A character as the crowd stores it: 128 bytes. Sorting reads only the first 64.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct CharacterState {
    pub(super) own: MixState,
    pub(super) cos: f32,
    pub(super) sin: f32,
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
    /// Level plus blend. The lane of a character that is in a group holds a newer value.
    pub(super) detail: f32,
    /// Whether a second clip is cross-faded to.
    pub(super) fades: bool,
    pub(super) is_inactive: bool,
    /// Whether the character waits for a group. Its state is then newer than the group's lane.
    pub(super) is_late: bool,
    /// The second clip; the character's own clip with a weight of 0 if nothing is mixed in.
    fade: MixState,
}

/// State of a clip that a character plays.
#[derive(Clone, Copy, Debug)]
pub(super) struct MixState {
    /// Position in the clip at crowd time 0, in frames. Double precision, so that no error adds up.
    phase: f64,
    /// Playback rate, in seconds of the clip per second.
    speed: f32,
    /// Weight of a second clip.
    weight: f32,
    pub(super) clip: ClipId,
}

impl MixState {
    fn new(mix: &ClipMix, animations: &AnimationSet, now: f64) -> Self {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let (at, speed) = (finite(mix.time), finite(mix.speed));
        let range = animations.range(mix.clip);
        Self {
            phase: range.per_second(at) - range.per_second(speed) * now,
            speed,
            weight: mix.weight,
            clip: mix.clip,
        }
    }

    fn lane<'a>(&self, animations: &'a AnimationSet, base: f64) -> LaneClip<'a> {
        let range = animations.range(self.clip);
        LaneClip {
            range,
            start: range.wrapped(self.phase + range.per_second(self.speed) * base),
            speed: self.speed,
            weight: self.weight,
        }
    }

    fn clip_mix(&self, animations: &AnimationSet, now: f64) -> ClipMix {
        let LaneClip { range, start, .. } = self.lane(animations, now);
        ClipMix {
            clip: self.clip,
            time: range.seconds(start),
            speed: self.speed,
            weight: self.weight,
        }
    }
}

impl CharacterState {
    /// Creates the state of a character whose clips exist, at the crowd's time `now`, in seconds.
    pub(super) fn new(character: &Character, animations: &AnimationSet, now: f64) -> Self {
        let own = ClipMix {
            clip: character.clip,
            time: character.time,
            speed: character.speed,
            weight: 0.0,
        };
        let fade = character.fade.unwrap_or(own);
        let fade = ClipMix {
            weight: clamped(fade.weight),
            ..fade
        };
        let mut state = Self {
            own: MixState::new(&own, animations, now),
            cos: 1.0,
            sin: 0.0,
            x: 0.0,
            y: 0.0,
            z: 0.0,
            detail: 0.0,
            fades: character.fade.is_some(),
            is_inactive: false,
            is_late: false,
            fade: MixState::new(&fade, animations, now),
        };
        state.place(&character.placement);
        let detail = f32::from(character.level.0) + clamped(character.blend);
        state.set_detail(detail, animations.last());
        state
    }

    /// The description of the character at the crowd's time `now`, in seconds.
    pub(super) fn character(&self, animations: &AnimationSet, now: f64) -> Character {
        let own = self.own.clip_mix(animations, now);
        let fade = self.fade.clip_mix(animations, now);
        Character {
            clip: own.clip,
            level: self.level(),
            blend: self.detail.fract(),
            time: own.time,
            speed: own.speed,
            placement: Placement {
                ground: Rigid2::new(self.sin.atan2(self.cos), self.x, self.z),
                height: self.y,
            },
            fade: self.fades.then_some(fade),
        }
    }

    pub(super) fn place(&mut self, placement: &Placement) {
        (self.cos, self.sin) = (placement.ground.cos(), placement.ground.sin());
        (self.x, self.y, self.z) = (placement.ground.x, placement.height, placement.ground.z);
    }

    /// Sets level plus blend. `last` is the coarsest level.
    pub(super) fn set_detail(&mut self, detail: f32, last: LevelId) {
        self.detail = detail.min(f32::from(last.0));
    }

    /// The coarsest level that still has all the joints that the character needs.
    pub(super) fn level(&self) -> LevelId {
        LevelId(self.detail as u16)
    }

    /// Position among the keys of the clip at a time, as a share of all of them.
    pub(super) fn share(&self, animations: &AnimationSet, now: f64) -> f32 {
        let LaneClip { range, start, .. } = self.own.lane(animations, now);
        animations.keys.frames.position(range, start) / range.intervals as f32
    }

    /// The character's own clip and its second one as lanes of a group whose clock is 0 at the crowd's time `base`, in seconds.
    pub(super) fn lane<'a>(&self, animations: &'a AnimationSet, base: f64) -> [LaneClip<'a>; 2] {
        let own = self.own.lane(animations, base);
        let fade = match self.fades {
            true => self.fade.lane(animations, base),
            false => own,
        };
        [own, fade]
    }
}

/// `share` clamped to `0..=1`; 0 for NaN, which `clamp` would keep.
pub(super) fn clamped(share: f32) -> f32 {
    if share.is_nan() {
        0.0
    } else {
        share.clamp(0.0, 1.0)
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct LaneClip<'a> {
    pub(super) range: &'a ClipRange,
    /// Position in the clip when the groups' clock is 0, in frames.
    pub(super) start: f32,
    /// Playback rate, in seconds of the clip per second.
    pub(super) speed: f32,
    pub(super) weight: f32,
}

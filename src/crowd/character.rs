use crate::math::Rigid2;

/// A clip of a [`Repertoire`](super::Repertoire), by its place there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClipId(pub u16);

/// A level of a [`Repertoire`](super::Repertoire): 0 keeps all joints. One beyond the last is the
/// last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LevelId(pub u16);

/// A character of a [`Crowd`](super::Crowd), in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CharacterId(pub u32);

impl ClipId {
    pub(super) fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl LevelId {
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
    /// Where in the clip it is, seconds; any number: it counts from the clip's start again at its
    /// end. NaN and infinities are the start.
    pub time: f32,
    /// Seconds of the clip for each second; 0 stands still, below 0 goes backwards.
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

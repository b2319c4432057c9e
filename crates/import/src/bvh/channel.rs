use glam::{DQuat, DVec3};

/// One number of a joint in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The joint's place along an axis (0 = X), in the file's unit, instead of its offset.
    Position(usize),
    /// A turn about an axis (0 = X), degrees. Turns are multiplied in the channels' order.
    Rotation(usize),
}

impl Channel {
    const NAMES: [(&'static str, Self); 6] = [
        ("Xposition", Self::Position(0)),
        ("Yposition", Self::Position(1)),
        ("Zposition", Self::Position(2)),
        ("Xrotation", Self::Rotation(0)),
        ("Yrotation", Self::Rotation(1)),
        ("Zrotation", Self::Rotation(2)),
    ];

    /// By its BVH name, in any case.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|&(_, channel)| channel)
    }

    /// Its BVH name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES
            .iter()
            .find(|&&(_, channel)| channel == self)
            .map_or("", |&(name, _)| name)
    }
}

/// A joint's rotation from its parent, and its place in the parent's frame, from its values of one frame.
pub(super) fn local_transform(
    channels: &[Channel],
    values: &[f64],
    offset: DVec3,
) -> (DQuat, DVec3) {
    let (mut rotation, mut place) = (DQuat::IDENTITY, offset);
    for (&channel, &value) in channels.iter().zip(values) {
        match channel {
            Channel::Position(axis) => place[axis] = value,
            Channel::Rotation(axis) => {
                rotation *= DQuat::from_axis_angle(DVec3::AXES[axis], value.to_radians());
            }
        }
    }
    (rotation.normalize(), place)
}

use glam::{DQuat, DVec3};

/// A value that a joint has in every frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The joint's position along an axis (0 = X), in the file's unit. It replaces the offset.
    Position(usize),
    /// A rotation about an axis (0 = X), in degrees. Rotations are multiplied in the order of the
    /// channels.
    Rotation(usize),
    /// A scale along an axis (0 = X). Joints have no scale, so it is ignored.
    Scale(usize),
}

impl Channel {
    const NAMES: [(&'static str, Self); 9] = [
        ("Xposition", Self::Position(0)),
        ("Yposition", Self::Position(1)),
        ("Zposition", Self::Position(2)),
        ("Xrotation", Self::Rotation(0)),
        ("Yrotation", Self::Rotation(1)),
        ("Zrotation", Self::Rotation(2)),
        ("Xscale", Self::Scale(0)),
        ("Yscale", Self::Scale(1)),
        ("Zscale", Self::Scale(2)),
    ];

    /// Finds a channel by its BVH name, ignoring case.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::NAMES
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|&(_, channel)| channel)
    }

    /// BVH name of the channel.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES
            .iter()
            .find(|&&(_, channel)| channel == self)
            .map_or("", |&(name, _)| name)
    }
}

/// Rotation of a joint and its position in its parent's frame, from its values in one frame.
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
            Channel::Scale(_) => {}
        }
    }
    (rotation.normalize(), place)
}

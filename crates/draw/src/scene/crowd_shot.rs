use std::sync::Arc;

use super::{Figure, Skin};

/// Mesh resolution of a crowd's bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The resolution of a single fighter.
    Fine,
    /// Resolution for some tens of pixels.
    Medium,
    /// Resolution for a few pixels.
    Coarse,
    /// Resolution of meshes for fewer pixels.
    Tiny,
}

/// A character of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdMember {
    /// Index of the pose's first value in the crowd's output.
    pub first: u32,
    /// Distance between the pose's values in the crowd's output.
    pub stride: u32,
    /// Tint colour, and its weight from 0 to 1.
    pub tint: [f32; 4],
}

/// Members of a crowd that one draw call draws.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberGroup {
    /// Index in [`CrowdShot::skins`] if there are skins, otherwise in [`CrowdShot::figures`].
    pub figure: usize,
    /// Range of the members.
    pub members: std::ops::Range<u32>,
    /// Mesh resolution.
    pub detail: Detail,
    /// Whether the members cast shadows.
    pub casts: bool,
}

/// A crowd whose poses are in device memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrowdShot {
    /// Figures, one for each level of detail.
    pub figures: Vec<Figure>,
    /// Meshes that are drawn in place of figures, one for each level of detail. Empty for figures.
    pub skins: Vec<Arc<Skin>>,
    /// All members.
    pub members: Vec<CrowdMember>,
    /// Groups of members that are drawn.
    pub groups: Vec<MemberGroup>,
}

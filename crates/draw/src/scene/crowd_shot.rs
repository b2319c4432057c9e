use super::Figure;

/// Mesh resolution of a crowd's bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The resolution of a single fighter.
    Fine,
    /// Resolution for some tens of pixels.
    Medium,
    /// Resolution for a few pixels.
    Coarse,
}

/// A character of a crowd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrowdMember {
    /// Index of the pose's first number in the crowd's output.
    pub first: u32,
    /// Distance between the pose's numbers in the crowd's output.
    pub stride: u32,
    /// Tint colour, and its weight from 0 to 1.
    pub tint: [f32; 4],
}

/// Members of a crowd that are drawn with the same figure and mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberGroup {
    /// Index of the figure in [`CrowdShot::figures`].
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
    /// All members.
    pub members: Vec<CrowdMember>,
    /// Groups of members that are drawn.
    pub groups: Vec<MemberGroup>,
}

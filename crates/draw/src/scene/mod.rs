//! Scenes as plain data: bodies, ghosts, maps, crowds, camera and light.
//!
//! Architecture invariant: scenes do not depend on a renderer. They are deterministic.

mod camera;
mod dodge;
mod duel;
mod figure;
mod formation;
mod mesh;
mod rigged;
mod shot;
mod simplify;

/// Functions on poses and meshes that the bodies made by code use.
pub(crate) mod internal {
    pub(crate) use super::mesh::{inverse, whole};
    pub(crate) use super::rigged::straightened;
    pub(crate) use super::simplify::simplified;
}

pub use camera::{Camera, Orbit};
pub use dodge::{AnsweredAttack, Dodge, DodgeSettings, MapStyle, Nearest};
pub use duel::{Cut, DuelPlayback, DuelPlaybackSettings, RecordedDuel};
pub use figure::{Actor, Figure, FigurePart, Look};
pub use formation::{Formation, FormationError, FormationSettings, Performer, level_colour};
pub use mesh::{
    Mesh, MeshBone, MeshTexture, MeshVertex, Outfit, Skin, SkinnedBody, skinned_positions,
};
pub use rigged::{
    BindTarget, BoundMesh, JointNames, MeshJoint, NotBound, RiggedMesh, standing_pose,
};
pub use shot::{Capsule, CrowdMember, CrowdShot, Detail, Layer, Light, MemberGroup, Shot};

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

pub use camera::{Camera, Orbit};
pub use dodge::{Dodge, DodgeSettings, MapStyle, Nearest};
pub use duel::{Cut, DuelPlayback, DuelPlaybackSettings};
pub use figure::{Actor, Figure, FigurePart, Look};
pub use formation::{Formation, FormationError, FormationSettings, level_colour};
pub use mesh::{
    Mesh, MeshBone, MeshTexture, MeshVertex, Outfit, Skin, SkinnedBody, skinned_positions,
};
pub(crate) use mesh::{inverse, whole};
pub(crate) use rigged::straightened;
pub use rigged::{BoundMesh, JointNames, MeshJoint, NotBound, RiggedMesh, standing_pose};
pub use shot::{Capsule, CrowdMember, CrowdShot, Detail, Layer, Light, MemberGroup, Shot};
pub(crate) use simplify::simplified;

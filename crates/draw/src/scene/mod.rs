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

pub use camera::{Camera, Orbit};
pub use dodge::{Dodge, DodgeSettings, Nearest};
pub use duel::{Cut, DuelPlayback, Exchange, Played};
pub use figure::{Actor, Figure, Look};
pub use formation::{Formation, FormationSettings, level_colour};
pub use mesh::{
    Mesh, MeshBone, MeshTexture, MeshVertex, Outfit, Skin, SkinnedBody, skinned_positions,
};
pub(crate) use mesh::{inverse, simplified, whole};
pub(crate) use rigged::straightened;
pub use rigged::{BoundMesh, JointNames, MeshJoint, NotBound, RiggedMesh, standing_pose};
pub use shot::{Capsule, CrowdMember, CrowdShot, Detail, Layer, Light, MemberGroup, Shot};

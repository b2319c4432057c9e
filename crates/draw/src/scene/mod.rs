//! Scenes as plain data: bodies, ghosts, maps, crowds, camera and light.
//!
//! Architecture invariant: scenes do not depend on a renderer. They are deterministic.

mod camera;
mod crowd_shot;
mod dodge;
mod dodge_shot;
mod duel_playback;
mod figure;
mod film_times;
mod formation;
mod formation_view;
mod lead_in;
mod maps;
mod mesh;
mod pose_fit;
mod rigged;
mod shot;
mod simplify;
mod skinning;

/// Functions on poses and meshes that the bodies made by code use.
pub(crate) mod internal {
    pub(crate) use super::mesh::{inverse, whole};
    pub(crate) use super::pose_fit::straightened;
    pub(crate) use super::simplify::simplified;
}

pub use camera::{Camera, Orbit};
pub use crowd_shot::{CrowdMember, CrowdShot, Detail, MemberGroup};
pub use dodge::{AnsweredAttack, Dodge, DodgeSettings, Nearest};
pub use duel_playback::{Cut, DuelPlayback, DuelPlaybackSettings, RecordedDuel};
pub use figure::{Actor, Figure, FigurePart, Look};
pub use formation::{Formation, FormationError, FormationSettings, Performer};
pub use formation_view::level_colour;
pub use maps::MapStyle;
pub use mesh::{Mesh, MeshBone, MeshTexture, MeshVertex, Outfit, Skin, SkinnedBody};
pub use pose_fit::standing_pose;
pub use rigged::{BindTarget, BoundMesh, JointNames, MeshJoint, NotBound, RiggedMesh};
pub use shot::{Capsule, Layer, Light, Shot};
pub use skinning::skinned_positions;

//! Scenes as plain data: bodies, ghosts, maps, crowds, camera and light.
//!
//! Architecture invariant: scenes do not depend on a renderer. They are deterministic.

mod camera;
mod crowd;
mod crowd_shot;
mod dodge;
mod duel;
mod figure;
mod maps;
mod shot;

pub use camera::Camera;
pub use crowd::{Crowd, FormationError, FormationSettings, level_colour};
pub use crowd_shot::{CrowdMember, CrowdShot, Detail, MemberGroup};
pub use dodge::{Dodge, DodgeSettings, Nearest};
pub use duel::{Bout, BoutSettings, Cut};
pub use figure::{Figure, FigurePart, Look};
pub use maps::{MapStyle, SlabPicture};
pub use shot::{Capsule, Layer, Light, Shot};

//! What there is to see, as plain data: bodies, ghosts, maps, crowds, camera and light.
//!
//! Architecture invariant: nothing here knows what draws it. The same scene gives the same numbers each time.

mod camera;
mod crowd;
mod dodge;
mod duel;
mod figure;
mod maps;
mod shot;

pub use camera::Camera;
pub use crowd::{Crowd, FormationError, FormationSettings, level_colour};
pub use dodge::{Dodge, DodgeSettings, Nearest};
pub use duel::{Bout, BoutSettings, Cut};
pub use figure::{Figure, FigurePart, Look};
pub use maps::{MapStyle, SlabPicture};
pub use shot::{Capsule, CrowdMember, CrowdShot, Detail, Layer, Light, MemberGroup, Shot};

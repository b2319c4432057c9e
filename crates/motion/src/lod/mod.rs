//! Level of detail of motion: the order in which joints are removed, and the distances at which they are.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! Architecture invariant: the joints that a level keeps move in model space as they do in the full skeleton. Only the motion of the
//! removed joints is lost.

mod attach;
mod budget;
mod build;
mod displacement;
mod energy;
mod error;
mod level;
mod mass;
mod settings;
mod switching;

pub use budget::{Budget, Cost, CostMonitor, Plan, Planner};
pub use error::LodError;
pub use level::{
    Attachment, Blend, Level, LevelError, LevelId, LevelMotion, LevelTrack, Levels, Translations,
    affine,
};
pub use mass::Masses;
pub use settings::{Flexion, LevelSettings, Order};
pub use switching::{Band, Choice, Measure, Rule, SwitchSettings, Switching, View};

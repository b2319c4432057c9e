//! Level of detail of motion: the order in which joints are removed, and the distances at which they are.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! Architecture invariant: the joints that a level keeps move in model space as they do in the full skeleton. Only the motion of the
//! removed joints is lost.

mod attach;
pub(crate) mod blend;
mod budget;
mod build;
mod cost_monitor;
pub(crate) mod displacement;
mod drawn;
pub(crate) mod energy;
mod error;
mod frames;
pub(crate) mod level;
pub(crate) mod mass;
pub(crate) mod motion;
mod popping;
mod samples;
pub(crate) mod settings;
mod skin;
pub(crate) mod switching;
mod view;

pub(crate) use blend::affine;
pub use budget::{Budget, Cost, Plan, Planner};
pub use cost_monitor::CostMonitor;
pub use displacement::LevelError;
pub use error::LodError;
pub use level::{Level, LevelId, Levels};
pub use mass::Masses;
pub(crate) use motion::{LevelMotion, LevelTrack, Translations};
pub use settings::{LevelSettings, Order};
pub use switching::{Choice, Measure, Rule, SwitchSettings, Switching};
pub use view::View;

//! Level of detail of motion: the order in which joints are removed, and the distances at which they are.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! Architecture invariant: the joints that a level keeps move in model space as they do in the full skeleton. Only the motion of the
//! removed joints is lost.

mod attach;
mod blend;
mod budget;
mod build;
mod cost_monitor;
mod displacement;
mod drawn;
mod energy;
mod error;
mod frames;
mod level;
mod mass;
mod motion;
mod popping;
mod samples;
mod settings;
mod skin;
mod switching;
mod view;

pub use blend::{Blend, affine};
pub use budget::{Budget, Cost, Plan, Planner};
pub use cost_monitor::CostMonitor;
pub use displacement::LevelError;
pub use error::LodError;
pub use level::{Attachment, Level, LevelId, Levels};
pub use mass::{BoneShape, Masses};
pub use motion::{LevelMotion, LevelTrack, Translations};
pub use settings::{Branch, Carrier, Flexion, Inertia, LevelSettings, Order};
pub use switching::{Band, Choice, Measure, Rule, SwitchSettings, Switching};
pub use view::View;

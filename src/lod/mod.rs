//! Level of detail of motion: which joints may go, and what is left moves as before.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! Architecture invariant: what hangs on a removed joint keeps its motion in model space; a level
//! never moves a joint that it keeps.

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
mod skin;
mod switching;
mod view;

pub use blend::{Blend, affine};
pub use budget::{Budget, Cost, Plan, Planner};
pub use build::{Carrier, LevelSettings, Order};
pub use cost_monitor::CostMonitor;
pub use displacement::LevelError;
pub use energy::{Branch, EnergySettings, Flexion, Inertia, joint_energies};
pub use error::LodError;
pub use level::{Level, LevelId, Levels, Seated};
pub use mass::{BoneShape, Masses};
pub use motion::{LevelMotion, LevelTrack, Translations, rehang};
pub use switching::{Band, BlendSettings, Choice, Measure, Rule, SwitchSettings, Switching};
pub use view::View;

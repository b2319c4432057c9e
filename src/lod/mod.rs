//! Level of detail of motion: which joints may go, and what is left moves as before.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! Architecture invariant: what hangs on a removed joint keeps its motion in model space; a level
//! never moves a joint that it keeps.

mod error;
mod level;
mod motion;

pub use error::LodError;
pub use level::{Level, Levels};
pub use motion::{LevelMotion, LevelTrack, Translations, rehang};

//! Levels of detail of motion: which joints can be removed, and from which distance on nobody sees that they are.
//!
//! Source: Hasegawa, Nishio & Kobori, "Level-of-Detail of Motion on Crowd Scene".
//!
//! 1. [`Levels::build`] removes one joint after the other, the one with the least energy first, and measures how far each level
//!    displaces the body. It is called once for a skeleton and its clips.
//! 2. [`Switching::new`] turns the levels into distances from the camera: linear in the energy, or by the error on the screen.
//! 3. Every frame, [`Switching::choose`] gives the level of a character. A [`Crowd`](crate::crowd::Crowd) does this for all of its
//!    characters. [`Level::attachments`] draw a mesh that is bound to the full skeleton.
//!
//! A [`Planner`] finds the smallest error on the screen that a budget in milliseconds allows.
//!
//! ```
//! use sabaki_motion::anim::{Clip, Skeleton};
//! use sabaki_motion::lod::{LevelSettings, Levels, LodError, SwitchSettings, Switching};
//!
//! fn joints_at(skeleton: &Skeleton, clips: &[Clip], metres: f32) -> Result<usize, LodError> {
//!     let levels = Levels::build(skeleton, clips, &LevelSettings::default())?;
//!     let switching = Switching::new(&levels, &SwitchSettings::default())?;
//!     // Every frame; a game passes the level of the frame before.
//!     let choice = switching.choose(metres, None);
//!     let level = &levels.levels[choice.level.index()];
//!     println!("{} mm off at most", 1e3 * level.error.max);
//!     Ok(level.kept.len())
//! }
//! ```
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

pub use budget::{Budget, Cost, Plan, Planner};
pub use error::LodError;
pub use level::{
    Attachment, Blend, Level, LevelError, LevelId, LevelMotion, LevelTrack, Levels, Translations,
    affine,
};
pub use mass::Masses;
pub use settings::{Flexion, LevelSettings, Order};
pub use switching::{Band, Choice, Measure, Rule, SwitchSettings, Switching, View};

//! What goes on in a window, without the window: a fighter who walks until a ball is thrown, a crowd on the march, the camera, the
//! clock. [`window`](super::window) shows it; a window of somebody else's can as well, with a [`Stage`](super::Stage).
//!
//! Architecture invariant: nothing here knows of a window system, and nothing draws.

mod aim;
mod asker;
mod clock;
mod cullers;
mod event;
mod fighter;
mod map_choices;
mod march;
mod orbit;
mod sparring;
mod throw;
mod walker;

pub use aim::{Ball, BallSettings, aim};
pub use asker::{Asker, AskerDesc, Question, Reply, with_asker};
pub use clock::Clock;
pub use event::Event;
pub use fighter::{Fighter, FighterSettings};
pub use map_choices::{MapChoice, MapChoices, map_name};
pub use march::{CameraPath, March, MarchError};
pub use orbit::Orbit;
pub use sparring::Sparring;
pub use throw::Throw;
pub use walker::Walker;

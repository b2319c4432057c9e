//! A game without a window: what characters do is measured from outside, by their poses and events.

mod crowded;
mod fight;
mod idle;
mod obstacles;
mod recording;
mod steering;
mod threats;

use sabaki::anim::JointTransform;
use sabaki::character::{CharacterError, CharacterId, Characters};
use sabaki::graph::{EdgeMotion, MotionGraph, Playhead};
use sabaki::query::ObstacleError;
use thiserror::Error;

pub use crowded::{CROWD, CrowdTimes, CrowdedTimes, PLAN_MILLISECONDS, PLANS_PER_STEP, crowded};
pub use fight::{APART, Fight, PATIENCE, score};
pub use idle::{IdleReport, idle};
pub use obstacles::Surroundings;
pub use steering::SteerReport;
pub use threats::{Outcome, Scenario, Scenarios, Sight};

/// Why a game could not be played.
#[derive(Debug, Error)]
pub enum PlayError {
    /// A call to the characters.
    #[error(transparent)]
    Character(#[from] CharacterError),
    /// A wall or a piece of furniture.
    #[error(transparent)]
    Obstacle(#[from] ObstacleError),
    /// A recording that was not written.
    #[error(transparent)]
    File(#[from] std::io::Error),
}

/// Duration of a frame, in seconds.
pub const FRAME: f32 = 1.0 / 60.0;

/// The joints of a character.
pub(crate) fn joints_of(
    characters: &mut Characters,
    id: CharacterId,
    joints: &mut Vec<JointTransform>,
) -> Result<(), CharacterError> {
    let count = characters.baked().graph().skeleton().len();
    joints.resize(count, JointTransform::IDENTITY);
    characters.pose(id, joints)
}

/// Clip and frame that a playhead plays; `None` in a transition.
fn clip_frame(graph: &MotionGraph, playhead: Playhead) -> Option<(u32, f32)> {
    let edge = graph.edge(playhead.edge);
    let node = graph.node(edge.from);
    let is_clip = edge.motion == EdgeMotion::Clip;
    is_clip.then_some((node.clip.0, node.frame as f32 + playhead.frame))
}

/// [`percentile::percentile`](crate::percentile::percentile) in single precision.
fn percentile(values: Vec<f32>, share: f64) -> f32 {
    let values = values.into_iter().map(f64::from).collect();
    crate::percentile::percentile(values, share) as f32
}

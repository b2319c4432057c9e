//! A game without a window: what characters do is measured from outside, by their poses and events.

mod fight;
mod idle;
mod obstacles;
mod recording;
mod steering;
mod threats;

use std::path::PathBuf;

use glam::Vec3;
use sabaki::anim::JointTransform;
use sabaki::character::{CharacterError, CharacterId, Characters, Threat};
use sabaki::graph::{EdgeMotion, MotionGraph, Playhead};
use sabaki::query::clearance::closest;
use sabaki::query::{Obstacle, ObstacleError};
use thiserror::Error;

pub use fight::{APART, Fight, PATIENCE, clip_of, score};
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
    #[error("{}: {error}", place.display())]
    File {
        /// The file or folder.
        place: PathBuf,
        /// The reason.
        error: std::io::Error,
    },
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

/// The body of a character, compared from frame to frame.
#[derive(Default)]
pub(crate) struct WatchedBody {
    /// The joints at the end of the last frame.
    pub(crate) joints: Vec<JointTransform>,
    /// The body's spheres at the start and at the end of the last frame.
    centres: [Vec<Vec3>; 2],
}

impl WatchedBody {
    /// Looks at the body at the end of a frame.
    pub(crate) fn look(
        &mut self,
        characters: &mut Characters,
        id: CharacterId,
    ) -> Result<(), CharacterError> {
        joints_of(characters, id, &mut self.joints)?;
        let [before, after] = &mut self.centres;
        std::mem::swap(before, after);
        characters.baked().body().centres(&self.joints, after);
        if before.len() != after.len() {
            before.clone_from(after);
        }
        Ok(())
    }

    /// Smallest distance from a ball in the frame that began at `from`, in metres; negative for a hit.
    pub(crate) fn nearest(&self, characters: &Characters, ball: &Threat, from: f64) -> f32 {
        let ends = [from, characters.now()].map(|time| ball.at(time));
        let [before, after] = &self.centres;
        let spheres = &characters.baked().body().spheres;
        let each = before.iter().zip(after).zip(spheres);
        let apart = each.map(|((a, b), sphere)| {
            let radii = [ball.spheres[0].radius + sphere.radius; 2];
            closest([ends[0] - *a, ends[1] - *b], radii).1
        });
        apart.fold(f32::INFINITY, f32::min)
    }

    /// Largest depth in an obstacle, in metres; negative outside of all.
    pub(crate) fn depth(&self, characters: &Characters, obstacles: &[Obstacle]) -> f32 {
        let spheres = &characters.baked().body().spheres;
        let each = self.centres[1].iter().zip(spheres);
        let depths = each.flat_map(|(centre, sphere)| {
            let depth = |obstacle: &Obstacle| sphere.radius - obstacle.distance(*centre, 0.0);
            obstacles.iter().map(depth)
        });
        depths.fold(f32::NEG_INFINITY, f32::max)
    }
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

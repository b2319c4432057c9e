//! Input of [`AnimationSet::build`](super::AnimationSet::build).

use super::error::CrowdError;
use super::slot::MOST_MOTIONS;
use crate::anim::{Clip, Skeleton};
use crate::lod::Level;

/// The skeleton, clips, layers and levels of an [`AnimationSet`](super::AnimationSet).
#[derive(Clone, Copy, Debug)]
pub struct AnimationSetDesc<'a> {
    /// The skeleton of all clips.
    pub skeleton: &'a Skeleton,
    /// The clips that characters play.
    pub clips: &'a [Clip],
    /// Clips that are added to others, such as breathing: each adds what it differs in from its own first frame. They turn
    /// joints, and move those that move in some clip, such as the root. On a level that lacks a joint, its layer's motion is
    /// that of the chain in the layer's first frame.
    pub layers: &'a [Clip],
    /// The levels of detail, finest first.
    pub levels: &'a [Level],
}

impl AnimationSetDesc<'_> {
    pub(super) fn check(&self) -> Result<(), CrowdError> {
        let (clips, levels) = (self.clips.len() + self.layers.len(), self.levels.len());
        if levels == 0 {
            return Err(CrowdError::NoLevel);
        }
        if clips.saturating_mul(levels) > MOST_MOTIONS {
            return Err(CrowdError::TooManyMotions { clips, levels });
        }
        if self.clips.is_empty() {
            return Err(CrowdError::NoClip);
        }
        Ok(())
    }
}

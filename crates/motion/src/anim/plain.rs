//! A clip that is not compressed.

use glam::Quat;
use serde::{Deserialize, Serialize};

use super::rows::{Block, LANES, block};
use super::{ClipDesc, ClipError, Skeleton};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlainClip {
    pub(super) desc: ClipDesc,
    pub(super) joints: usize,
}

impl PlainClip {
    /// Rotations of 16 joints in a frame, from joint `16 * index` on. Unused lanes hold the identity.
    #[inline(always)]
    pub(super) fn block(&self, frame: usize, index: usize) -> Block {
        let of_frame = &self.desc.rotations[frame * self.joints..(frame + 1) * self.joints];
        let end = of_frame.len().min(LANES * (index + 1));
        block(&of_frame[LANES * index..end])
    }

    fn first_bad_value(&self) -> Option<(usize, usize)> {
        let place = |index: usize| (index / self.joints, index % self.joints);
        let root = self
            .desc
            .roots
            .iter()
            .position(|&root| !Skeleton::is_near(root))
            .map(|frame| (frame, 0));
        // The comparison is false for NaN.
        let unit = |q: &Quat| (q.length_squared() - 1.0).abs() < 1e-3;
        let rotation = self.desc.rotations.iter().position(|q| !unit(q)).map(place);
        let translation = self
            .desc
            .translations
            .iter()
            .position(|&t| !Skeleton::is_near(t))
            .map(place);
        [root, rotation, translation].into_iter().flatten().min()
    }

    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), ClipError> {
        let (desc, joints) = (&self.desc, skeleton.len());
        let (frames, clip) = (desc.roots.len(), desc.name.clone());
        if frames == 0 {
            return Err(ClipError::Empty(clip));
        }
        if !(desc.frame_rate.is_finite() && desc.frame_rate > 0.0) {
            let rate = desc.frame_rate;
            return Err(ClipError::FrameRate { clip, rate });
        }
        let expected = frames * joints;
        let lengths = [
            ("rotations", desc.rotations.len(), false),
            ("translations", desc.translations.len(), true),
        ];
        for (what, found, may_be_empty) in lengths {
            if found != expected && !(may_be_empty && found == 0) {
                return Err(ClipError::Length {
                    clip,
                    what,
                    found,
                    expected,
                    frames,
                    joints,
                });
            }
        }
        match self.first_bad_value() {
            Some((frame, joint)) => {
                let joint = skeleton.joints()[joint].name.clone();
                Err(ClipError::NotFinite { clip, frame, joint })
            }
            None => Ok(()),
        }
    }
}

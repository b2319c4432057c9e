use serde::{Deserialize, Serialize};

use super::{LodError, Masses};
use crate::anim::{JointId, Skeleton, details};

/// Settings of [`Levels::build`](super::Levels::build).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LevelSettings {
    /// Order in which joints are removed. Default: [`Order::Energy`].
    pub order: Order,
    /// Masses of the joints. Default: 70 kg in all, distributed by bone length.
    pub masses: Masses,
    /// Weight of bending in a joint's energy. Default: [`Flexion::Raised`].
    pub flexion: Flexion,
    /// Angle a between a joint's bones, below which the joint counts as bent, in radians. Default π/2.
    pub bend_threshold: f32,
    /// Smaller angles between a joint's bones count as this one, in radians. Default π/18.
    pub least_angle: f32,
    /// Joints that are never removed, besides the root and the ends: for example a weapon's, or those that inverse kinematics moves.
    /// Default: none.
    pub locked: Vec<JointId>,
    /// Ends that are never removed. Default `None`: all joints without children, end sites included; of a hand with fingers, the hand. Fingers,
    /// helpers and carried things ([`details`]) may be removed.
    pub ends: Option<Vec<JointId>>,
    /// Thickness of the body around its bones, in metres. Without it a twist would count as no error. Default 0.05.
    pub skin: f32,
    /// Largest number of frames, spread evenly, to which attachments are fitted. Errors are measured on all frames. Default 500.
    pub samples: usize,
}

/// Order in which joints are removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Least energy first, as in the paper.
    Energy,
    /// Least increase of the body's squared displacement first.
    Error,
}

/// Weight of bending in a joint's energy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flexion {
    /// max(1, a / theta): raised beyond the threshold.
    Raised,
    /// a / theta, as in the equation: a straight joint counts half.
    Literal,
}

impl Default for LevelSettings {
    fn default() -> Self {
        Self {
            order: Order::Energy,
            masses: Masses::default(),
            flexion: Flexion::Raised,
            bend_threshold: 0.5 * std::f32::consts::PI,
            least_angle: std::f32::consts::PI / 18.0,
            locked: Vec::new(),
            ends: None,
            skin: 0.05,
            samples: 500,
        }
    }
}

impl LevelSettings {
    /// Largest number of joints of a skeleton. There is one level for each joint, and each visits all joints.
    pub const MOST_JOINTS: usize = 1024;

    /// Largest product of joints, joints and frames: about a quarter of an hour on one core.
    pub const MOST_WORK: u64 = 1 << 32;

    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), LodError> {
        self.check_angles()?;
        if !(self.skin.is_finite() && self.skin > 0.0) {
            return Err(LodError::setting("skin", self.skin, "above 0"));
        }
        let mut named = self.locked.iter().chain(self.ends.iter().flatten());
        match named.find(|id| id.index() >= skeleton.len()) {
            Some(unknown) => Err(LodError::UnknownJoint(unknown.0)),
            None => Ok(()),
        }
    }

    /// Checks the settings of energies.
    pub(super) fn check_angles(&self) -> Result<(), LodError> {
        let angles = [
            ("bend_threshold", self.bend_threshold),
            ("least_angle", self.least_angle),
        ];
        for (setting, value) in angles {
            if !(value > 0.0 && value <= std::f32::consts::PI) {
                return Err(LodError::setting(setting, value, "above 0 and at most pi"));
            }
        }
        Ok(())
    }

    /// Whether each joint may be removed.
    pub(super) fn removable(&self, skeleton: &Skeleton) -> Vec<bool> {
        let mut removable = match self.ends {
            Some(_) => vec![true; skeleton.len()],
            None => {
                let is_detail = details(skeleton);
                let mut removable = is_detail.clone();
                for id in skeleton.ids() {
                    let parent = skeleton.joint(id).parent;
                    if let Some(parent) = parent.filter(|_| !is_detail[id.index()]) {
                        removable[parent.index()] = true;
                    }
                }
                removable
            }
        };
        let stay = self.locked.iter().chain(self.ends.iter().flatten());
        for id in stay.chain([&JointId::ROOT]) {
            removable[id.index()] = false;
        }
        removable
    }
}

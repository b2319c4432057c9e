use super::LodError;
use crate::anim::{JointId, Skeleton};

/// One level of detail: the joints that are kept, and of whom each hangs.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Parents first, breadth-first; the root is the first.
    pub kept: Vec<JointId>,
    /// Of each kept joint the nearest kept one above it, as an index into `kept`; `None` for the
    /// root alone.
    pub parents: Vec<Option<u16>>,
    /// The joint that this level has lost against the one before; `None` at level 0.
    pub removed: Option<JointId>,
    /// The energy that `removed` had when it was taken out, joules; 0 at level 0.
    pub energy: f32,
}

/// The levels of a skeleton: each has one joint less than the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    /// The first keeps all joints.
    pub levels: Vec<Level>,
}

impl Level {
    /// The level of `skeleton` that keeps the joints for which `keeps` is true; the root stays in any case.
    fn of(skeleton: &Skeleton, keeps: &[bool]) -> Self {
        let mut children: Vec<Vec<JointId>> = vec![Vec::new(); skeleton.len()];
        for id in skeleton.ids().skip(1).filter(|id| keeps[id.index()]) {
            let above = skeleton
                .ancestry(id)
                .skip(1)
                .find(|&above| keeps[above.index()]);
            children[above.unwrap_or(JointId::ROOT).index()].push(id);
        }
        let (mut kept, mut parents) = (vec![JointId::ROOT], vec![None]);
        let mut next = 0;
        while next < kept.len() {
            for &child in &children[kept[next].index()] {
                kept.push(child);
                parents.push(Some(next as u16));
            }
            next += 1;
        }
        Self {
            kept,
            parents,
            removed: None,
            energy: 0.0,
        }
    }

    /// Where a joint stands in `kept`.
    #[must_use]
    pub fn index_of(&self, joint: JointId) -> Option<usize> {
        self.kept.iter().position(|&kept| kept == joint)
    }
}

impl Levels {
    /// The levels that come of removing joints in this order; each joint with its energy in joules.
    ///
    /// # Errors
    /// A joint that is the root, none of the skeleton, or named twice.
    pub fn in_order(skeleton: &Skeleton, order: &[(JointId, f32)]) -> Result<Self, LodError> {
        let mut keeps = vec![true; skeleton.len()];
        let mut levels = vec![Level::of(skeleton, &keeps)];
        for &(joint, energy) in order {
            match keeps.get_mut(joint.index()) {
                Some(kept) if *kept && joint != JointId::ROOT => *kept = false,
                _ => return Err(LodError::NotRemovable(joint.0)),
            }
            levels.push(Level {
                removed: Some(joint),
                energy,
                ..Level::of(skeleton, &keeps)
            });
        }
        Ok(Self { levels })
    }
}

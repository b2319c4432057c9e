//! Assigns joints to limbs.

use sabaki::anim::JointId;
use sabaki::graph::MotionGraph;

/// Number of legs; they come before the arms.
pub(super) const LEGS: usize = 2;

/// Position in [`MotionGraph::limbs`] of the limb that carries a joint.
pub(super) fn limb_of(graph: &MotionGraph, joint: JointId) -> Option<usize> {
    let parent = |joint: &JointId| graph.skeleton().joints()[joint.index()].parent;
    let above: Vec<JointId> = std::iter::successors(Some(joint), parent).collect();
    let mut limbs = graph.limbs().iter();
    limbs.position(|limb| limb.is_some_and(|limb| above.contains(&limb.hip)))
}

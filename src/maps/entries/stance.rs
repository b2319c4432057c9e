//! Position, facing direction and feet of a body, by which entries are aligned.

use crate::anim::{Facing, JointId, JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, MotionGraph, Node};
use crate::maps::entries::table::EntryTable;
use crate::maps::entries::targets::ClipFrame;
use crate::math::{Rigid2, in_parallel};
use glam::Vec3;

/// Position and facing direction of a body, and positions of its root and feet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stance {
    /// The character's frame (root on the ground, facing +Z).
    pub placement: Rigid2,
    /// Position of the root.
    pub root: Vec3,
    /// Positions of the toes of the first four legs.
    pub toes: [Vec3; Self::LEGS],
    /// Positions of the ankles of the first four legs.
    pub ankles: [Vec3; Self::LEGS],
}

impl Stance {
    /// Maximum number of legs.
    pub(crate) const LEGS: usize = 4;

    /// Stance of a body, in the space of `joints`.
    pub(crate) fn from_joints(
        graph: &MotionGraph,
        facing: Facing,
        joints: &[JointTransform],
    ) -> Self {
        let [mut toes, mut ankles] = [[Vec3::ZERO; Self::LEGS]; 2];
        for (index, leg) in graph.feet().legs().iter().take(Self::LEGS).enumerate() {
            let place = |joint: JointId| joints[joint.index()].translation;
            toes[index] = place(leg.toe_or_foot());
            ankles[index] = place(leg.foot);
        }
        Self {
            placement: facing.placement(joints),
            root: joints[0].translation,
            toes,
            ankles,
        }
    }

    /// Stance at a frame of a clip, in the clip's space.
    pub(crate) fn at_frame(graph: &MotionGraph, facing: Facing, at: Node) -> Self {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        graph.clip(at.clip).pose(at.frame as usize, &mut pose);
        forward_kinematics(graph.skeleton(), &pose, &mut joints);
        Self::from_joints(graph, facing, &joints)
    }

    /// Transform from the space of `target` to that of this stance that makes the facing directions equal and the positions of a foot (or,
    /// without one, of the root) equal.
    pub(crate) fn align(&self, target: &Self, pin: Option<usize>) -> Rigid2 {
        let place =
            |stance: &Self| pin.map_or(stance.root, |leg| stance.toes[leg.min(Self::LEGS - 1)]);
        let turn = self.placement * target.placement.inverse();
        let off = place(self) - turn.point(place(target));
        Rigid2::new(0.0, off.x, off.z) * turn
    }

    /// Horizontal distance of the roots, and of each leg's feet, after the alignment, in metres.
    pub(crate) fn apart(&self, target: &Self, align: Rigid2) -> (f32, [f32; Self::LEGS]) {
        let apart = |a: Vec3, b: Vec3| (a - align.point(b)).with_y(0.0).length();
        let feet = std::array::from_fn(|leg| apart(self.toes[leg], target.toes[leg]));
        (apart(self.root, target.root), feet)
    }
}

/// The stance at each target, in the space of its clip. Files do not store it.
#[derive(Clone, Debug, Default)]
pub(crate) struct TargetStances {
    pub(crate) entries: Vec<Stance>,
    pub(crate) exits: Vec<Stance>,
    /// Joints that determine the facing direction.
    pub(crate) facing: Option<Facing>,
}

impl TargetStances {
    pub(crate) fn new(graph: &MotionGraph, table: &EntryTable) -> Self {
        let facing = Facing::of(graph.skeleton());
        let at = |edge: EdgeId, edge_frame: u32| {
            let at = ClipFrame::new(graph, edge, edge_frame);
            Stance::at_frame(graph, facing, at.node())
        };
        let (entries, exits) = (&table.targets, &table.exit_targets);
        let entry = |target: usize| at(entries[target].edge, entries[target].edge_frame);
        let exit = |target: usize| at(exits[target].edge, exits[target].edge_frame);
        Self {
            entries: in_parallel(0, entries.len(), entry),
            exits: in_parallel(0, exits.len(), exit),
            facing: Some(facing),
        }
    }
}

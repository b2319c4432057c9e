//! Stances that are derived from the entries, and that files do not store.

use crate::anim::Facing;
use crate::graph::{EdgeId, MotionGraph};
use crate::maps::entries::stance::Stance;
use crate::maps::entries::table::EntryTable;
use crate::maps::entries::targets::ClipFrame;
use crate::math::in_parallel;

/// The stance at each target, in the space of its clip.
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

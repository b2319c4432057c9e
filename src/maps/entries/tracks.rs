//! Body tracks and stances that are derived from the entries, and that files do not store.

use crate::anim::Facing;
use crate::graph::{EdgeId, MotionGraph, Playhead};
use crate::maps::entries::stance::Stance;
use crate::maps::entries::table::{EntryTable, EntryTarget};
use crate::maps::entries::targets::ClipFrame;
use crate::maps::regions::{Body, BodyTrack, Evasion};
use crate::math::{Rigid2, in_parallel};
use std::sync::OnceLock;

/// Body spheres from the first frame at which an evasion can be entered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EntryTrack {
    /// Spheres in the character's frame at that time.
    pub track: BodyTrack,
    /// Frame of the clip at which the track starts.
    pub first: u32,
    /// The character's frame at the track's start, in the space of the clip.
    pub placement: Rigid2,
}

/// Data derived from the entries, which files do not store.
#[derive(Clone, Debug, Default)]
pub(crate) struct EntryTracks {
    /// Track of each evasion, or `None` if it cannot be entered.
    pub(crate) tracks: Vec<OnceLock<Option<EntryTrack>>>,
    /// Stance at each target, in the space of its clip.
    pub(crate) stances: Vec<Stance>,
    /// Stance at each target of an exit, in the space of its clip.
    pub(crate) exit_stances: Vec<Stance>,
    /// Joints that determine the facing direction, or `None` if no evasion can be entered.
    pub(crate) facing: Option<Facing>,
}

impl EntryTrack {
    /// The track of an evasion from its first target on, at which the character has a placement.
    pub(crate) fn new(
        graph: &MotionGraph,
        body: &Body,
        evasion: &Evasion,
        first: &EntryTarget,
        placement: Rigid2,
    ) -> Self {
        let playhead = Playhead {
            edge: first.edge,
            frame: first.edge_frame as f32,
            clip_to_world: placement.inverse(),
        };
        let seconds = EntryTracks::seconds(graph, evasion, first);
        Self {
            track: BodyTrack::along(graph, body, playhead, seconds),
            first: first.frame,
            placement,
        }
    }
}

impl EntryTracks {
    /// Duration of a track after the evasion's end, in seconds.
    const BEYOND: f32 = 0.5;

    pub(crate) fn new(graph: &MotionGraph, evasions: usize, table: &EntryTable) -> Self {
        let facing = Facing::of(graph.skeleton());
        let at = |edge: EdgeId, edge_frame: u32| {
            let at = ClipFrame::new(graph, edge, edge_frame);
            Stance::at_frame(graph, facing, at.node())
        };
        let stance = |target: usize| {
            let target = &table.targets[target];
            at(target.edge, target.edge_frame)
        };
        let exits = table.exits.targets();
        let exit_stance = |target: usize| at(exits[target].edge, exits[target].edge_frame);
        Self {
            tracks: (0..evasions).map(|_| OnceLock::new()).collect(),
            stances: in_parallel(0, table.targets.len(), stance),
            exit_stances: in_parallel(0, exits.len(), exit_stance),
            facing: Some(facing),
        }
    }

    /// Duration of a track, in seconds.
    fn seconds(graph: &MotionGraph, evasion: &Evasion, first: &EntryTarget) -> f32 {
        let end = graph.node(graph.edge(evasion.edge).to).frame;
        let frames = f64::from(end.saturating_sub(first.frame));
        (frames / graph.frame_rate()) as f32 + Self::BEYOND
    }

    /// Estimated memory of the tracks, in bytes.
    pub(crate) fn bytes(
        graph: &MotionGraph,
        body: &Body,
        evasions: &[Evasion],
        table: &EntryTable,
    ) -> u64 {
        let stances = table.targets.len() + table.exits.targets().len();
        let mut bytes = (stances * size_of::<Stance>()) as u64;
        let mut last = None;
        for target in &table.targets {
            let Some(evasion) = evasions.get(usize::from(target.evasion)) else {
                continue;
            };
            if last.replace(target.evasion) != Some(target.evasion) {
                let ticks = Self::seconds(graph, evasion, target) * BodyTrack::RATE + 2.0;
                bytes += ticks as u64 * BodyTrack::tick_bytes(body) as u64;
            }
        }
        bytes
    }
}

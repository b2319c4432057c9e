//! Entries and exits: cuts into evasions from any moment of the clips, and from any moment back into natural motion, without an edge that
//! leads there.
//!
//! Source: the cut is that of [`Entry`](crate::graph::Entry) (Bollo, GDC 2018). The table is computed by the bake: each moment of the
//! clips is paired with each moment of each evasion and of its lead-in. A pair is kept if the blended motion stays within the limits that
//! are measured in the clips ([`MotionLimits`]). An entry takes four bytes.

mod align;
mod examine;
mod exits;
mod find;
mod find_exits;
mod finder;
mod frames;
mod joint_steps;
mod layer_test;
mod layers;
mod limits;
mod moment_lists;
mod moment_search;
mod near_stances;
mod record;
mod report;
mod slack;
mod spread;
mod stance;
mod stretches;
mod targets;
#[cfg(test)]
mod tests;

use std::ops::Range;

use serde::{Deserialize, Serialize};

use exits::ExitTable;
pub(crate) use find::EntrySearch;
pub(crate) use limits::MotionLimits;
pub use limits::PlausibilitySettings;
use moment_lists::MomentLists;
pub(crate) use record::EarlierEntries;
pub use record::EntryRecord;
pub use report::EntryReport;
pub(crate) use stance::Stance;
pub use stretches::Stretches;
use targets::ClipFrame;

use super::{Body, BodyTrack, Evasion, OnFirstUse, TrackStart};
use crate::anim::Facing;
use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Playhead};
use crate::math::byte_list::Bytes;
use crate::math::{Rigid2, in_parallel};

/// Settings of the search for entries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntrySettings {
    /// Interval of the moments at which entries start, in frames. Default 3. 0 means no entries, as in the paper.
    pub moment_step: u32,
    /// Interval of the frames of an evasion that can be entered, in frames. Default 2.
    pub target_step: u32,
    /// Longest time before its start at which an evasion can be entered, in seconds. Default 0.4.
    pub lead_in: f32,
    /// Longest time after its start at which an evasion can be entered, in seconds. Default 1.2.
    pub late: f32,
    /// Maximum number of targets. Their interval grows if there would be more. Default 256.
    pub most_targets: u32,
    /// Maximum number of entries of a moment. Default 64.
    pub most: u32,
    /// Duration of a stretch of a clip without an entry, an exit, or a choice of edges, in seconds, beyond which exits may do what the
    /// clips show at least once, whatever the percentiles of `plausible`. Default 0.8.
    pub unbranched: f32,
    /// Limits of plausible motion.
    pub plausible: PlausibilitySettings,
}

impl Default for EntrySettings {
    fn default() -> Self {
        Self {
            moment_step: 3,
            target_step: 2,
            lead_in: 0.4,
            late: 1.2,
            most_targets: 256,
            most: 64,
            unbranched: 0.8,
            plausible: PlausibilitySettings::default(),
        }
    }
}

/// Durations of an entry's blend, in seconds. The shortest plausible one is used.
pub(crate) const BLENDS: [f32; 3] = [0.15, 0.2, 0.25];
/// Durations of an exit's blend, in seconds. Nothing has to be reached in time, and a body that moves fast has to slow down.
pub(crate) const EXIT_BLENDS: [f32; 4] = [0.2, 0.3, 0.45, 0.65];

/// Playback rates of an entry. Rates up to the fastest plausible one are used.
pub(crate) const RATES: [f32; 3] = [1.0, 1.25, 1.5];

/// A frame of an evasion, or of its lead-in, that can be entered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTarget {
    /// Position in [`BakedGraph::evasions`](super::BakedGraph::evasions).
    pub evasion: u16,
    /// Frame of the evasion's clip.
    pub frame: u32,
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

/// One entry of a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct KnownEntry {
    /// Index in [`EntryTable::targets`].
    pub target: u16,
    how: u8,
}

impl Bytes<3> for KnownEntry {
    fn to_bytes(self) -> [u8; 3] {
        let [low, high] = self.target.to_le_bytes();
        [low, high, self.how]
    }

    fn from_bytes([low, high, how]: [u8; 3]) -> Self {
        let target = u16::from_le_bytes([low, high]);
        Self { target, how }
    }
}

impl KnownEntry {
    fn new(target: u16, (blend, pin, rate): (usize, Option<usize>, usize)) -> Self {
        let pin = pin.map_or(0, |leg| leg + 1);
        let how = blend | pin << 2 | rate << 6;
        Self {
            target,
            how: how as u8,
        }
    }

    /// Duration of an entry's blend, in seconds.
    #[must_use]
    pub(crate) fn blend(self) -> f32 {
        BLENDS[usize::from(self.how & 3).min(BLENDS.len() - 1)]
    }

    /// Duration of an exit's blend, in seconds.
    #[must_use]
    pub(crate) fn exit_blend(self) -> f32 {
        EXIT_BLENDS[usize::from(self.how & 3)]
    }

    /// Leg whose foot is kept in place, or `None` if the root is kept.
    #[must_use]
    pub(crate) fn pin(self) -> Option<usize> {
        usize::from(self.how >> 2 & 15).checked_sub(1)
    }

    /// Fastest plausible playback rate.
    #[must_use]
    pub(crate) fn fastest(self) -> f32 {
        RATES[usize::from(self.how >> 6).min(RATES.len() - 1)]
    }
}

/// Entries of all moments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTable {
    limits: MotionLimits,
    /// Interval of moments, in frames.
    step: u32,
    targets: Vec<EntryTarget>,
    /// First moment of each clip. The last item is the number of moments.
    first_moment: Vec<u32>,
    entries: MomentLists,
    /// Number of moments with the maximum number of entries.
    cut: u64,
    exits: ExitTable,
    /// Layered evasions. Their targets are those of the entries.
    layers: MomentLists,
}

impl EntryTable {
    /// Limits of motion, measured in the clips.
    #[must_use]
    pub(crate) fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// All frames that can be entered, sorted by evasion and frame.
    #[must_use]
    pub(crate) fn targets(&self) -> &[EntryTarget] {
        &self.targets
    }

    /// Index of an evasion's first target, or `None` if it cannot be entered.
    pub(super) fn first_target(&self, evasion: usize) -> Option<usize> {
        let of = |target: &EntryTarget| usize::from(target.evasion);
        let first = self.targets.partition_point(|target| of(target) < evasion);
        (self.targets.get(first).map(of) == Some(evasion)).then_some(first)
    }

    /// Whether the table is empty.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        self.entries.len() == 0
    }

    /// Entries of the moment that is nearest to a playhead. In a transition the side with the larger weight determines the moment.
    #[must_use]
    pub(crate) fn at(&self, graph: &MotionGraph, playhead: Playhead) -> &[KnownEntry] {
        let moment = self.moment(graph, playhead);
        moment.map_or(&[], |moment| self.entries.of(moment))
    }

    /// The frames that exits lead to.
    #[must_use]
    pub(crate) fn exits(&self) -> &ExitTable {
        &self.exits
    }

    /// Exits of the moment that is nearest to a playhead, the least departure first.
    #[must_use]
    pub(crate) fn exits_at(&self, graph: &MotionGraph, playhead: Playhead) -> &[KnownEntry] {
        let moment = self.moment(graph, playhead);
        moment.map_or(&[], |moment| self.exits.lists.of(moment))
    }

    /// Whether any moment has a layered evasion.
    #[must_use]
    pub(crate) fn has_layers(&self) -> bool {
        self.layers.len() > 0
    }

    /// Layered evasions of the moment that is nearest to a playhead.
    #[must_use]
    pub(crate) fn layers_at(&self, graph: &MotionGraph, playhead: Playhead) -> &[KnownEntry] {
        let moment = self.moment(graph, playhead);
        moment.map_or(&[], |moment| self.layers.of(moment))
    }

    /// The moments of a clip.
    fn moments_of(&self, clip: ClipId) -> Range<u32> {
        self.first_moment[clip.index()]..self.first_moment[clip.index() + 1]
    }

    /// The moment that is nearest to a playhead.
    fn moment(&self, graph: &MotionGraph, playhead: Playhead) -> Option<u32> {
        if self.entries.moments() == 0 {
            return None;
        }
        let edge = graph.edge(playhead.edge);
        let (from, to) = (graph.node(edge.from), graph.node(edge.to));
        let is_late = 2.0 * playhead.frame > edge.frames as f32;
        let (clip, frame) = match edge.motion {
            EdgeMotion::Transition { .. } if is_late => (
                to.clip,
                to.frame as f32 - (edge.frames as f32 - playhead.frame),
            ),
            _ => (from.clip, from.frame as f32 + playhead.frame),
        };
        let moments = self.moments_of(clip);
        let nearest = (frame.max(0.0) / self.step as f32).round() as u32;
        let last = moments.len().checked_sub(1)? as u32;
        Some(moments.start + nearest.min(last))
    }

    /// Checks all indices.
    pub(super) fn check(&self, graph: &MotionGraph, evasions: &[Evasion]) -> Result<(), String> {
        let moments_of = |clip: usize| {
            let frames = graph.clips()[clip].frames() as u32;
            self.first_moment[clip + 1].checked_sub(self.first_moment[clip])
                == Some(frames.div_ceil(self.step.max(1)))
        };
        let clips = graph.clips().len();
        let has_moments = self.first_moment.len() == clips + 1
            && self.first_moment[0] == 0
            && (0..clips).all(moments_of);
        let moments = self.first_moment.last().map_or(0, |&count| count as usize);
        let is_none = self.step == 0
            && self.entries == MomentLists::default()
            && self.targets.is_empty()
            && self.exits == ExitTable::default()
            && self.layers == MomentLists::default();
        let target_fits = |target: &EntryTarget| {
            let evasion = evasions.get(usize::from(target.evasion));
            let edge = graph.edges().get(target.edge.index());
            let (Some(evasion), Some(edge)) = (evasion, edge) else {
                return false;
            };
            let [from, goal] =
                [edge.from, graph.edge(evasion.edge).from].map(|node| graph.node(node));
            edge.motion == EdgeMotion::Clip
                && target.edge_frame < edge.frames
                && (from.clip, from.frame + target.edge_frame) == (goal.clip, target.frame)
        };
        let legs = graph.feet().legs().len();
        let entry_fits = |entry: &KnownEntry| {
            usize::from(entry.target) < self.targets.len()
                && entry.pin().is_none_or(|leg| leg < legs)
        };
        let fits = is_none
            || has_moments
                && self.targets.iter().all(target_fits)
                && self
                    .targets
                    .is_sorted_by_key(|target| (target.evasion, target.frame))
                && self.entries.fits(moments, entry_fits)
                && self.exits.fits(graph, moments)
                && self.layers.fits(moments, |layer| {
                    usize::from(layer.target) < self.targets.len()
                })
                && self.limits.is_sound(graph.skeleton());
        match fits {
            true => Ok(()),
            false => Err("an entry names a moment or an evasion that is none".to_owned()),
        }
    }
}

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
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct EntryTracks {
    /// Track of each evasion, or `None` if it cannot be entered.
    pub(super) tracks: Vec<OnFirstUse<Option<EntryTrack>>>,
    /// Stance at each target, in the space of its clip.
    pub(super) stances: Vec<Stance>,
    /// Stance at each target of an exit, in the space of its clip.
    pub(super) exit_stances: Vec<Stance>,
    /// Joints that determine the facing direction, or `None` if no evasion can be entered.
    pub(super) facing: Option<Facing>,
}

impl EntryTrack {
    /// The track from the first target of an evasion on, at which the body has this stance.
    pub(super) fn new(
        (graph, body): (&MotionGraph, &Body),
        (evasion, first): (&Evasion, &EntryTarget),
        stance: &Stance,
    ) -> Self {
        let placement = stance.placement;
        let start = TrackStart {
            edge: first.edge,
            frame: first.edge_frame as f32,
            placement,
        };
        let seconds = EntryTracks::seconds(graph, evasion, first);
        Self {
            track: BodyTrack::along(graph, body, start, seconds),
            first: first.frame,
            placement,
        }
    }
}

impl EntryTracks {
    /// Time that tracks continue after the evasion's end, in seconds.
    const BEYOND: f32 = 0.5;

    pub(super) fn new(graph: &MotionGraph, evasions: usize, table: &EntryTable) -> Self {
        let facing = Facing::of(graph.skeleton());
        let at = |edge: EdgeId, edge_frame: u32| {
            let at = ClipFrame::of(graph, edge, edge_frame);
            Stance::of_frame(graph, facing, at.node())
        };
        let stance = |target: usize| {
            let target = &table.targets[target];
            at(target.edge, target.edge_frame)
        };
        let exits = table.exits.targets();
        let exit_stance = |target: usize| at(exits[target].edge, exits[target].edge_frame);
        Self {
            tracks: (0..evasions).map(|_| OnFirstUse::default()).collect(),
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
    pub(super) fn bytes(
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

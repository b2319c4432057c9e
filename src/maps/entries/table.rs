//! The entries, exits and layers of all moments, as they are stored.

use crate::graph::{ClipId, EdgeId, EdgeMotion, MotionGraph, Playhead};
use crate::maps::entries::limits::MotionLimits;
use crate::maps::regions::Evasion;
use crate::math::byte_list;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Durations of an entry's blend, in seconds. The shortest plausible one is used. The longest is for a body that has to slow down.
pub(crate) const BLENDS: [f32; 4] = [0.15, 0.2, 0.25, 0.4];
/// Durations of a layer's blend, in seconds: the first of [`BLENDS`].
pub(crate) const LAYER_BLENDS: [f32; 3] = [BLENDS[0], BLENDS[1], BLENDS[2]];
/// Durations of an exit's blend, in seconds. They are longer than those of entries, because an exit is not urgent and a fast body has to slow
/// down.
pub(crate) const EXIT_BLENDS: [f32; 4] = [0.2, 0.3, 0.45, 0.65];

/// Playback rates of an entry. Rates up to the fastest plausible one are used.
pub(crate) const RATES: [f32; 3] = [1.0, 1.25, 1.5];

/// A frame of an evasion, or of its lead-in, that can be entered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTarget {
    /// Position in [`BakedGraph::evasions`](crate::maps::BakedGraph::evasions).
    pub evasion: u16,
    /// Frame of the evasion's clip.
    pub frame: u32,
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

/// A frame of natural motion that an exit leads to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExitTarget {
    /// Edge that plays the frame.
    pub edge: EdgeId,
    /// Position of the frame on that edge, in frames.
    pub edge_frame: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Pod, Zeroable)]
#[repr(C, packed)]
pub(crate) struct KnownEntry {
    /// Index in [`EntryTable::targets`].
    pub target: u16,
    how: u8,
}

/// Blend, rate and pin with which a target is entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EntryWay {
    /// Index of the shortest plausible blend, in [`BLENDS`] or [`EXIT_BLENDS`].
    pub(crate) blend: usize,
    /// Index of the fastest plausible playback rate in [`RATES`].
    pub(crate) rate: usize,
    /// Leg whose foot is kept in place, or `None` if the root is kept.
    pub(crate) pin: Option<usize>,
}

impl KnownEntry {
    pub(crate) fn new(target: u16, way: EntryWay) -> Self {
        let pin = way.pin.map_or(0, |leg| leg + 1);
        let how = way.blend | pin << 2 | way.rate << 6;
        Self {
            target,
            how: how as u8,
        }
    }

    /// Duration of an entry's blend, in seconds.
    pub(crate) fn blend(self) -> f32 {
        BLENDS[usize::from(self.how & 3).min(BLENDS.len() - 1)]
    }

    /// Duration of an exit's blend, in seconds.
    pub(crate) fn exit_blend(self) -> f32 {
        EXIT_BLENDS[usize::from(self.how & 3)]
    }

    /// Leg whose foot is kept in place, or `None` if the root is kept.
    pub(crate) fn pin(self) -> Option<usize> {
        usize::from(self.how >> 2 & 15).checked_sub(1)
    }

    /// Fastest plausible playback rate.
    pub(crate) fn fastest(self) -> f32 {
        RATES[usize::from(self.how >> 6).min(RATES.len() - 1)]
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTable {
    pub(crate) limits: MotionLimits,
    /// Interval of moments, in frames.
    pub(crate) step: u32,
    pub(crate) targets: Vec<EntryTarget>,
    /// First moment of each clip. The last item is the number of moments.
    pub(crate) first_moment: Vec<u32>,
    pub(crate) entries: MomentLists,
    /// Number of moments with the maximum number of entries.
    pub(crate) cut: u64,
    /// Frames of natural motion that exits lead to: cuts from any moment of the clips, also inside an evasion or an attack.
    pub(crate) exit_targets: Vec<ExitTarget>,
    /// Exits of each moment, the one with the least departure first.
    pub(crate) exits: MomentLists,
    /// Layered evasions. Their targets are those of the entries.
    pub(crate) layers: MomentLists,
}

impl EntryTable {
    /// An evasion's first target, or `None` if it cannot be entered.
    pub(crate) fn first_target(&self, evasion: usize) -> Option<&EntryTarget> {
        let of = |target: &EntryTarget| usize::from(target.evasion);
        let first = self.targets.partition_point(|target| of(target) < evasion);
        self.targets
            .get(first)
            .filter(|&target| of(target) == evasion)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.len() == 0
    }

    /// Entries, exits or layers of the moment that is nearest to a playhead, by their lists. In a transition the side with the larger weight
    /// determines the moment.
    pub(crate) fn at<'t>(
        &self,
        lists: &'t MomentLists,
        graph: &MotionGraph,
        playhead: Playhead,
    ) -> &'t [KnownEntry] {
        let moment = self.moment(graph, playhead);
        moment.map_or(&[], |moment| lists.list(moment))
    }

    /// Whether any moment has a layered evasion.
    pub(crate) fn has_layers(&self) -> bool {
        self.layers.len() > 0
    }

    pub(crate) fn moments_of(&self, clip: ClipId) -> Range<u32> {
        self.first_moment[clip.index()]..self.first_moment[clip.index() + 1]
    }

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

    pub(crate) fn check(&self, graph: &MotionGraph, evasions: &[Evasion]) -> Result<(), String> {
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
            && self.exit_targets.is_empty()
            && self.exits == MomentLists::default()
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
        let exit_target_fits = |target: &ExitTarget| {
            let edge = graph.edges().get(target.edge.index());
            edge.is_some_and(|edge| {
                edge.motion == EdgeMotion::Clip && target.edge_frame < edge.frames
            })
        };
        let lists_fit = |lists: &MomentLists, targets: usize| {
            lists.fits(moments, |entry| {
                usize::from(entry.target) < targets && entry.pin().is_none_or(|leg| leg < legs)
            })
        };
        let fits = is_none
            || has_moments
                && self.targets.iter().all(target_fits)
                && self
                    .targets
                    .is_sorted_by_key(|target| (target.evasion, target.frame))
                && lists_fit(&self.entries, self.targets.len())
                && self.exit_targets.iter().all(exit_target_fits)
                && lists_fit(&self.exits, self.exit_targets.len())
                && lists_fit(&self.layers, self.targets.len())
                && self.limits.is_sound(graph.skeleton());
        match fits {
            true => Ok(()),
            false => Err("an entry names a moment or an evasion that is none".to_owned()),
        }
    }
}

/// A list of entries for each moment. The moments are those of the [`EntryTable`](EntryTable).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MomentLists {
    /// End of each moment's list in `entries`.
    ends: Vec<u32>,
    #[serde(with = "byte_list")]
    entries: Vec<KnownEntry>,
}

impl MomentLists {
    pub(crate) fn moments(&self) -> usize {
        self.ends.len()
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Appends the list of the next moment.
    pub(crate) fn push(&mut self, entries: &[KnownEntry]) {
        self.entries.extend_from_slice(entries);
        self.ends.push(self.entries.len() as u32);
    }

    pub(crate) fn list(&self, moment: u32) -> &[KnownEntry] {
        let moment = moment as usize;
        let start = moment.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start as usize..self.ends[moment] as usize]
    }

    /// Checks that there is a list for each moment, and that each entry is valid.
    pub(crate) fn fits(&self, moments: usize, is_sound: impl Fn(&KnownEntry) -> bool) -> bool {
        self.moments() == moments
            && self.ends.is_sorted()
            && self.ends.last().map_or(0, |&end| end as usize) == self.entries.len()
            && self.entries.iter().all(is_sound)
    }
}

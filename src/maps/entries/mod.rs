//! Where an evasion can be entered from any moment, without an edge that leads there.
//!
//! Source: the jump itself is that of [`Entry`](crate::graph::Entry) (Bollo, GDC 2018). Which jumps look right is found when a graph is
//! baked: each moment of the clips is tried against each moment of each evasion and of its lead-in, and what stays within what the clips show
//! a body to do ([`MotionLimits`]) is kept, a few bytes each.

mod find;
mod limits;
mod report;
mod stance;

use serde::{Deserialize, Serialize};

pub(crate) use limits::MotionLimits;
pub use limits::PlausibilitySettings;
pub use report::EntryReport;
pub(crate) use stance::Stance;

use super::{Body, BodyTrack, Evasion, TrackStart};
use crate::anim::Facing;
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, Playhead};
use crate::math::Rigid2;

/// Which entries are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntrySettings {
    /// Frames from one moment that entries are known of to the next. Default 3; 0 for no entries at all, as in the paper.
    pub moment_step: u32,
    /// Frames of an evasion from one that can be entered to the next. Default 2.
    pub target_step: u32,
    /// So long before its start an evasion can be entered, seconds. Default 0.4.
    pub lead_in: f32,
    /// And so long after it, seconds. Default 1.2.
    pub late: f32,
    /// Most moments of evasions that can be entered: where there would be more, they are further apart. Default 256.
    pub most_targets: u32,
    /// Most entries of a moment: the search ends there. Default 64.
    pub most: u32,
    /// What is plausible.
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
            plausible: PlausibilitySettings::default(),
        }
    }
}

/// How long an entry may blend, seconds: the shortest one that is plausible is taken.
pub(crate) const BLENDS: [f32; 3] = [0.15, 0.2, 0.25];

/// How fast an entry may be played: up to the fastest one that is plausible.
pub(crate) const RATES: [f32; 3] = [1.0, 1.25, 1.5];

/// A moment of an evasion, or of its lead-in, that can be entered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTarget {
    /// Position in [`BakedGraph::evasions`](super::BakedGraph::evasions).
    pub evasion: u16,
    /// Frame of the evasion's clip.
    pub frame: u32,
    /// The edge that plays it.
    pub edge: EdgeId,
    /// Frames since that edge's start.
    pub edge_frame: u32,
}

/// One jump that a moment allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct KnownEntry {
    /// Position among the targets.
    pub target: u16,
    how: u8,
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

    /// Seconds.
    #[must_use]
    pub(crate) fn blend(self) -> f32 {
        BLENDS[usize::from(self.how & 3).min(BLENDS.len() - 1)]
    }

    /// The leg whose foot stays where it is; without one the root does.
    #[must_use]
    pub(crate) fn pin(self) -> Option<usize> {
        usize::from(self.how >> 2 & 15).checked_sub(1)
    }

    /// The fastest rate that is plausible.
    #[must_use]
    pub(crate) fn fastest(self) -> f32 {
        RATES[usize::from(self.how >> 6).min(RATES.len() - 1)]
    }
}

/// Every moment's entries.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct EntryTable {
    limits: MotionLimits,
    /// Frames from one moment to the next.
    step: u32,
    targets: Vec<EntryTarget>,
    /// For each clip its first moment; one more at the end.
    first_moment: Vec<u32>,
    /// For each moment where its entries end.
    ends: Vec<u32>,
    entries: Vec<KnownEntry>,
    /// How many moments have the most entries.
    cut: u64,
}

impl EntryTable {
    /// What the clips show a body to do.
    #[must_use]
    pub(crate) fn limits(&self) -> &MotionLimits {
        &self.limits
    }

    /// All moments that can be entered, by evasion and frame.
    #[must_use]
    pub(crate) fn targets(&self) -> &[EntryTarget] {
        &self.targets
    }

    /// Whether no moment has an entry.
    #[must_use]
    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The entries of the moment that is nearest to a playhead: in a transition that of the side that weighs more.
    #[must_use]
    pub(crate) fn at(&self, graph: &MotionGraph, playhead: Playhead) -> &[KnownEntry] {
        if self.entries.is_empty() {
            return &[];
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
        let first = self.first_moment[clip.index()];
        let count = self.first_moment[clip.index() + 1] - first;
        let nearest = (frame.max(0.0) / self.step as f32).round() as u32;
        match count {
            0 => &[],
            _ => self.of(first + nearest.min(count - 1)),
        }
    }

    fn of(&self, moment: u32) -> &[KnownEntry] {
        let moment = moment as usize;
        let start = moment.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start as usize..self.ends[moment] as usize]
    }

    /// Whether every index points somewhere.
    pub(super) fn check(&self, graph: &MotionGraph, evasions: &[Evasion]) -> Result<(), String> {
        let moments_of = |clip: usize| {
            let frames = graph.clips()[clip].frames() as u32;
            self.first_moment[clip + 1].checked_sub(self.first_moment[clip])
                == Some(frames.div_ceil(self.step.max(1)))
        };
        let clips = graph.clips().len();
        let has_moments = self.first_moment.len() == clips + 1
            && self.first_moment[0] == 0
            && (0..clips).all(moments_of)
            && self.first_moment[clips] as usize == self.ends.len();
        let is_none = self.step == 0
            && self.ends.is_empty()
            && self.entries.is_empty()
            && self.targets.is_empty();
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
        let ordered = self.ends.is_sorted()
            && self.ends.last().map_or(0, |&end| end as usize) == self.entries.len();
        let legs = graph.feet().legs().len();
        let entry_fits = |entry: &KnownEntry| {
            usize::from(entry.target) < self.targets.len()
                && entry.pin().is_none_or(|leg| leg < legs)
        };
        let fits = is_none
            || has_moments
                && ordered
                && self.targets.iter().all(target_fits)
                && self
                    .targets
                    .is_sorted_by_key(|target| (target.evasion, target.frame))
                && self.entries.iter().all(entry_fits)
                && self.limits.is_sound(graph.skeleton());
        match fits {
            true => Ok(()),
            false => Err("an entry names a moment or an evasion that is none".to_owned()),
        }
    }
}

/// The body from the first moment on at which an evasion can be entered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EntryTrack {
    /// The body in the character's frame then.
    pub track: BodyTrack,
    /// Frame of the clip that the track starts with.
    pub first: u32,
    /// The character's frame then, in the space of the clip.
    pub placement: Rigid2,
}

/// What is derived of the entries when a graph is baked or read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct EntryTracks {
    /// By evasion; `None` where none can be entered.
    pub(super) tracks: Vec<Option<EntryTrack>>,
    /// By target: how the body stands, in the space of its clip.
    pub(super) stances: Vec<Stance>,
    /// How the way that a body faces is found; none where nothing can be entered.
    pub(super) facing: Option<Facing>,
}

impl EntryTracks {
    /// The body is known at least this long after an evasion's end, seconds.
    const BEYOND: f32 = 0.5;

    pub(super) fn new(
        graph: &MotionGraph,
        body: &Body,
        evasions: &[Evasion],
        table: &EntryTable,
    ) -> Self {
        let stance = |target: &EntryTarget| {
            let clip = graph.node(graph.edge(target.edge).from).clip;
            Stance::of_frame(graph, clip, target.frame)
        };
        let of_evasion = |evasion: usize| {
            let of = |target: &&EntryTarget| usize::from(target.evasion) == evasion;
            let first = table.targets.iter().find(of)?;
            let placement = stance(first).placement;
            let start = TrackStart {
                edge: first.edge,
                frame: first.edge_frame as f32,
                placement,
            };
            let seconds = Self::seconds(graph, &evasions[evasion], first);
            Some(EntryTrack {
                track: BodyTrack::along(graph, body, start, seconds),
                first: first.frame,
                placement,
            })
        };
        Self {
            tracks: (0..evasions.len()).map(of_evasion).collect(),
            stances: table.targets.iter().map(stance).collect(),
            facing: Some(Facing::of(graph.skeleton())),
        }
    }

    /// How long a track is, seconds.
    fn seconds(graph: &MotionGraph, evasion: &Evasion, first: &EntryTarget) -> f32 {
        let end = graph.node(graph.edge(evasion.edge).to).frame;
        let frames = f64::from(end.saturating_sub(first.frame));
        (frames / graph.frame_rate()) as f32 + Self::BEYOND
    }

    /// What the tracks take in memory, about, bytes.
    pub(super) fn bytes(
        graph: &MotionGraph,
        body: &Body,
        evasions: &[Evasion],
        table: &EntryTable,
    ) -> u64 {
        let mut bytes = (table.targets.len() * size_of::<Stance>()) as u64;
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

//! Search for the entries and exits of all moments.

use crate::graph::motion_graph::starts;
use crate::graph::watch::{BakeStage, BakeWatch, Stopped, WatchedStage};
use crate::graph::{ClipId, MotionGraph, Node};
use crate::maps::entries::finder::{Aligned, Departed, Finder, Scratch, Ways};
use crate::maps::entries::layers::{LayerSource, LayerTest};
use crate::maps::entries::limits::{MeasuredMotion, MotionLimits, Plausibility};
use crate::maps::entries::report::PlayedFrames;
use crate::maps::entries::table::{EntryTable, EntryTarget, KnownEntry, MomentLists};
use crate::maps::entries::targets::{ClipFrame, ClipPlaces, natural, targets};
use crate::maps::regions::Evasion;
use serde::{Deserialize, Serialize};

/// Interval of the moments at which entries start, in frames.
const MOMENT_STEP: u32 = 3;
/// Maximum number of entries of a moment.
const MOST: usize = 64;
/// A moment with fewer entries has those within the widest limits.
const FEW: usize = 8;
/// Maximum duration of a stretch of a clip without an entry, an exit, or a choice of edges, in seconds. In longer stretches, exits may use the
/// maxima of the clips as limits.
const UNBRANCHED: f32 = 0.8;

impl EntryTable {
    /// Finds all entries of a graph, or takes those that `shares` found, if there are any. The result does not depend on the number of threads.
    pub(crate) fn find(
        graph: &MotionGraph,
        evasions: &[Evasion],
        shares: Vec<EntryShare>,
        threads: usize,
        watch: &dyn BakeWatch,
    ) -> Result<Self, Stopped> {
        let (limits, places) = (limits(graph, threads), ClipPlaces::new(graph));
        let goals = Goals::new(graph, evasions, &limits, &places, threads);
        let found = match shares.is_empty() {
            true => goals.search(MomentShare::ALL, threads, watch)?,
            false => EntryShare::joined(shares),
        };
        let frames = graph.clips().iter().map(|clip| clip.frames() as u32);
        let mut table = Self {
            step: MOMENT_STEP,
            first_moment: starts(frames.map(|frames| frames.div_ceil(MOMENT_STEP))),
            limits: limits[0].clone(),
            targets: goals.targets,
            ..Self::default()
        };
        for found in found {
            table.cut += u64::from(found.entries.len() == MOST);
            table.entries.push(&found.entries);
            table.exits.push(&found.exits);
            table.layers.push(&found.layers);
        }
        table.exit_targets = goals.exits.targets.iter().map(Into::into).collect();
        let exits = goals.exits.within_utmost(&limits[1]);
        table.shorten_stretches(&exits, watch.stage(BakeStage::Exits, threads));
        watch.check()?;
        Ok(table)
    }
}

impl EntryShare {
    /// Finds the entries of a share of all moments.
    pub(crate) fn find(
        graph: &MotionGraph,
        evasions: &[Evasion],
        share: MomentShare,
        threads: usize,
        watch: &dyn BakeWatch,
    ) -> Result<Self, Stopped> {
        let places = ClipPlaces::new(graph);
        let limits = limits(graph, threads);
        let goals = Goals::new(graph, evasions, &limits, &places, threads);
        goals.search(share, threads, watch).map(Self)
    }
}

/// The usual limits of plausible motion and the widest.
fn limits(graph: &MotionGraph, threads: usize) -> [MotionLimits; 2] {
    let mut measured = MeasuredMotion::new(graph, threads);
    [Plausibility::USUAL, Plausibility::UTMOST].map(|plausible| measured.limits(plausible))
}

/// The search for the entries, exits and layers of moments.
struct Goals<'a> {
    targets: Vec<EntryTarget>,
    entries: Finder<'a>,
    /// Entries of moments that have fewer than [`FEW`] within the usual limits.
    widest: Finder<'a>,
    exits: Finder<'a>,
    layers: LayerSource,
}

/// Entries, exits and layers of a moment. A moment that the graph does not play has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MomentFound {
    pub(crate) entries: Vec<KnownEntry>,
    pub(crate) exits: Vec<KnownEntry>,
    pub(crate) layers: Vec<KnownEntry>,
}

impl<'a> Goals<'a> {
    fn new(
        graph: &'a MotionGraph,
        evasions: &[Evasion],
        [usual, utmost]: &'a [MotionLimits; 2],
        places: &'a ClipPlaces,
        threads: usize,
    ) -> Self {
        let targets = targets(graph, places, evasions);
        let frames = targets
            .iter()
            .map(|target| ClipFrame::new(graph, target.edge, target.edge_frame));
        let finder = |targets, ways| Finder::new(graph, usual, places, targets, ways, threads);
        let entries = finder(frames.collect(), Ways::ENTRIES);
        Self {
            widest: entries.clone().within_utmost(utmost),
            entries,
            exits: finder(natural(graph), Ways::EXITS),
            layers: LayerSource::new(graph, usual, evasions, &targets),
            targets,
        }
    }

    fn search(
        &self,
        share: MomentShare,
        threads: usize,
        watch: &dyn BakeWatch,
    ) -> Result<Vec<MomentFound>, Stopped> {
        let graph = self.entries.graph;
        let frames = graph.clips().iter().map(|clip| clip.frames() as u32);
        let moments: Vec<Node> = frames
            .zip(0..)
            .flat_map(|(frames, clip)| {
                let frames = (0..frames).step_by(MOMENT_STEP as usize);
                let clip = ClipId(clip);
                frames.map(move |frame| Node { clip, frame })
            })
            .collect();
        let batches: Vec<&[Node]> = share.batches(&moments).collect();
        let stage = watch.stage(BakeStage::Entries, threads);
        let found = stage.in_parallel(batches.len(), |batch| {
            let (mut scratch, mut layers) = (Scratch::new(graph), LayerTest::new(graph));
            let own = batches[batch].iter();
            own.map(|&frame| self.at(frame, &mut scratch, &mut layers))
                .collect::<Vec<_>>()
        });
        watch.check()?;
        Ok(found.into_iter().flatten().collect())
    }

    fn at(
        &self,
        frame: Node,
        scratch: &mut Scratch<'_>,
        layers: &mut LayerTest<'_>,
    ) -> MomentFound {
        let Some(before) = self.entries.places.find(frame) else {
            return MomentFound::default();
        };
        let from = self.entries.depart(before, &mut scratch.sampler);
        let mut entries = self.entries.entries(&from, MOST, scratch);
        if entries.len() < FEW {
            entries = self.widest.entries(&from, MOST, scratch);
        }
        MomentFound {
            entries,
            exits: self.exits.exits(&from, scratch),
            layers: self.entries.layers(&from, &self.layers, layers),
        }
    }
}

// Shares of all moments, for several processes that search them.

/// A share of all moments: every `of`th batch, starting with batch `index`. Shares have about equal cost.
#[derive(Clone, Copy, Debug)]
pub struct MomentShare {
    /// Number of the share, from 0.
    pub index: usize,
    /// Number of shares.
    pub of: usize,
}

/// Entries, exits and layers of the moments of a share.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EntryShare(pub(crate) Vec<MomentFound>);

impl MomentShare {
    pub(crate) const ALL: Self = Self { index: 0, of: 1 };

    /// Number of moments of a batch. They share scratch.
    const BATCH: usize = 64;

    fn batches<T>(self, moments: &[T]) -> impl Iterator<Item = &[T]> {
        moments
            .chunks(Self::BATCH)
            .skip(self.index)
            .step_by(self.of)
    }
}

impl EntryShare {
    /// Joins all shares, given in order. Too few moments in a share leave out those after them.
    pub(crate) fn joined(shares: Vec<Self>) -> Vec<MomentFound> {
        let mut rest: Vec<_> = shares.into_iter().map(|it| it.0.into_iter()).collect();
        let mut all = Vec::new();
        loop {
            let before = all.len();
            for share in &mut rest {
                all.extend(share.take(MomentShare::BATCH));
            }
            if all.len() == before {
                return all;
            }
        }
    }
}

// Search for the exits of all moments.

impl EntryTable {
    /// Finds exits for the moments of stretches without a branch point that are longer than [`UNBRANCHED`]. The result does not depend
    /// on the number of threads. After a stop, some exits are missing.
    fn shorten_stretches(&mut self, exits: &Finder<'_>, stage: WatchedStage<'_>) {
        let (graph, step) = (exits.graph, self.step as usize);
        let longest = (f64::from(UNBRANCHED) * graph.frame_rate()) as usize;
        // Moments and their frames.
        let mut places: Vec<(u32, Node)> = Vec::new();
        for clip in (0..graph.clips().len()).map(|clip| ClipId(clip as u32)) {
            let first = self.moments_of(clip).start;
            let mut stretches = PlayedFrames::new(graph, exits.places, clip).stretches(self);
            stretches.retain(|stretch| stretch.len() > longest);
            for stretch in stretches {
                let moments = stretch.start.div_ceil(step)..stretch.end.div_ceil(step);
                places.extend(moments.map(|moment| {
                    let frame = (moment * step) as u32;
                    (first + moment as u32, Node { clip, frame })
                }));
            }
        }
        let found = stage.in_parallel(places.len(), |number| {
            let mut scratch = Scratch::new(graph);
            let Some(before) = exits.places.find(places[number].1) else {
                return Vec::new();
            };
            let from = exits.depart(before, &mut scratch.sampler);
            exits.exits(&from, &mut scratch)
        });
        let mut found = places
            .iter()
            .map(|&(moment, _)| moment)
            .zip(found)
            .peekable();
        let mut lists = MomentLists::default();
        for moment in 0..self.exits.moments() as u32 {
            match found.next_if(|(at, _)| *at == moment) {
                Some((_, list)) => lists.push(&list),
                None => lists.push(self.exits.list(moment)),
            }
        }
        self.exits = lists;
    }
}

impl Finder<'_> {
    /// Finds exits of a frame of a clip, the one with the least departure first.
    pub(crate) fn exits(&self, from: &Departed, scratch: &mut Scratch<'_>) -> Vec<KnownEntry> {
        /// Maximum number of exits of a moment.
        const MOST: usize = 3;
        /// Number of targets that are examined if at least one of them is plausible.
        const EXAMINED: usize = 24;
        /// Number of targets that are examined if none of them is plausible.
        const LAST: usize = 192;
        /// Minimum distance of the targets of one moment's exits in a clip, in frames.
        const APART: u32 = 10;
        let mut found: Vec<KnownEntry> = Vec::new();
        let all = 0..self.targets.len();
        let mut nearest: Vec<Aligned> = all.filter_map(|target| self.align(from, target)).collect();
        nearest.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.target.cmp(&b.target)));
        for (rank, aligned) in nearest.into_iter().enumerate() {
            if found.len() == MOST || rank >= EXAMINED && (!found.is_empty() || rank >= LAST) {
                break;
            }
            let at = self.targets[aligned.target];
            let is_alike = |known: &KnownEntry| {
                let other = self.targets[usize::from(known.target)];
                other.clip == at.clip && other.frame.abs_diff(at.frame) < APART
            };
            if found.iter().any(is_alike) {
                continue;
            }
            found.extend(self.plausible(from, aligned, scratch));
        }
        found
    }
}

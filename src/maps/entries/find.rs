//! Search for the entries and exits of all moments.

use crate::graph::watch::{BakeStage, BakeWatch, Stopped, WatchedStage};
use crate::graph::{ClipId, MotionGraph, Node};
use crate::maps::entries::entry::{EntrySettings, EntryTarget, KnownEntry};
use crate::maps::entries::finder::{Aligned, Departed, Finder, Scratch, Ways};
use crate::maps::entries::layers::{LayerSource, LayerTest};
use crate::maps::entries::limits::{MeasuredMotion, MotionLimits};
use crate::maps::entries::report::PlayedFrames;
use crate::maps::entries::table::{EntryTable, MomentLists};
use crate::maps::entries::targets::{ClipFrame, ClipPlaces, SearchBasis, natural};
use crate::maps::regions::Evasion;
use crate::math::sort_rarely;
use serde::{Deserialize, Serialize};

impl EntryTable {
    /// Finds all entries of a graph, or takes those that `shares` found, if there are any. The result does not depend on the number of threads.
    pub(crate) fn find(search: EntrySearch<'_>, shares: Vec<EntryShare>) -> Result<Self, Stopped> {
        if search.is_off() {
            return Ok(Self::default());
        }
        let mut measured = MeasuredMotion::of(search.graph, search.threads);
        let limits = measured.limits(&search.settings.plausible);
        let utmost = measured.limits(&search.settings.plausible.utmost());
        search.with_goals(&limits, |goals| {
            let found = match shares.is_empty() {
                true => goals.found(MomentShare::ALL)?,
                false => EntryShare::joined(shares),
            };
            let settings = search.settings;
            let mut table = Self {
                step: settings.moment_step,
                first_moment: first_moments(search.graph, settings.moment_step),
                limits: limits.clone(),
                targets: goals.targets.to_vec(),
                ..Self::default()
            };
            for found in found {
                table.cut += u64::from(found.entries.len() == settings.most as usize);
                table.entries.push(&found.entries);
                table.exits.lists.push(&found.exits);
                table.layers.push(&found.layers);
            }
            let exits = goals.exits;
            table.exits.targets = exits.targets.iter().map(Into::into).collect();
            let exits = exits.within_utmost(&utmost);
            let stage = search.stage(BakeStage::Exits);
            table.shorten_stretches(&exits, settings.unbranched, stage);
            search.watch.check()?;
            Ok(table)
        })
    }
}

impl EntryShare {
    /// Finds the entries of a share of all moments.
    pub(crate) fn find(search: EntrySearch<'_>, share: MomentShare) -> Result<Self, Stopped> {
        if search.is_off() {
            return Ok(Self::default());
        }
        let mut measured = MeasuredMotion::of(search.graph, search.threads);
        let limits = measured.limits(&search.settings.plausible);
        search
            .with_goals(&limits, |goals| goals.found(share))
            .map(Self)
    }
}

/// Targets of the entries, exits and layers of all moments.
struct Goals<'a> {
    search: EntrySearch<'a>,
    targets: &'a [EntryTarget],
    entries: Finder<'a>,
    exits: Finder<'a>,
    layers: LayerSource<'a>,
}

impl Goals<'_> {
    /// Searches a share of all moments.
    fn found(&self, share: MomentShare) -> Result<Vec<MomentFound>, Stopped> {
        let search = MomentSearch {
            entries: &self.entries,
            exits: &self.exits,
            layers: &self.layers,
            settings: self.search.settings,
        };
        let found = search.of(share, self.search.stage(BakeStage::Entries));
        self.search.watch.check()?;
        Ok(found)
    }
}

/// Number of each clip's first moment. The last entry is the number of moments.
fn first_moments(graph: &MotionGraph, step: u32) -> Vec<u32> {
    let mut firsts = vec![0];
    for clip in graph.clips() {
        let moments = clip.frames().div_ceil(step as usize) as u32;
        firsts.push(firsts[firsts.len() - 1] + moments);
    }
    firsts
}

/// Inputs of a search for entries.
#[derive(Clone, Copy)]
pub(crate) struct EntrySearch<'a> {
    pub(crate) graph: &'a MotionGraph,
    pub(crate) evasions: &'a [Evasion],
    pub(crate) settings: &'a EntrySettings,
    /// Number of threads, 0 for one per CPU core.
    pub(crate) threads: usize,
    pub(crate) watch: &'a dyn BakeWatch,
}

impl<'a> EntrySearch<'a> {
    /// Whether there are no evasions, or the settings disable entries.
    fn is_off(&self) -> bool {
        self.settings.moment_step == 0 || self.evasions.is_empty()
    }

    /// Calls `work` with the goals of entries within the limits.
    fn with_goals<T>(self, limits: &MotionLimits, work: impl FnOnce(Goals<'_>) -> T) -> T {
        let (graph, settings) = (self.graph, self.settings);
        let basis = SearchBasis {
            graph,
            limits,
            places: &ClipPlaces::new(graph),
            threads: self.threads,
        };
        let targets = basis.targets(self.evasions, settings);
        let frames = targets
            .iter()
            .map(|target| ClipFrame::of(graph, target.edge, target.edge_frame));
        let exits = natural(graph, settings.target_step);
        work(Goals {
            search: self,
            entries: Finder::new(basis, frames.collect(), Ways::ENTRIES),
            exits: Finder::new(basis, exits, Ways::EXITS),
            layers: LayerSource::new(basis, self.evasions, &targets),
            targets: &targets,
        })
    }

    fn stage(self, stage: BakeStage) -> WatchedStage<'a> {
        self.watch.stage(stage, self.threads)
    }
}

// Search for the entries, exits and layers of each moment.

/// Input of the search at each moment.
pub(crate) struct MomentSearch<'a> {
    pub(crate) entries: &'a Finder<'a>,
    pub(crate) exits: &'a Finder<'a>,
    pub(crate) layers: &'a LayerSource<'a>,
    pub(crate) settings: &'a EntrySettings,
}

/// Entries, exits and layers of a moment. A moment that the graph does not play has none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MomentFound {
    pub(crate) entries: Vec<KnownEntry>,
    pub(crate) exits: Vec<KnownEntry>,
    pub(crate) layers: Vec<KnownEntry>,
}

impl MomentSearch<'_> {
    /// Searches a share of all moments. After a stop, only the results of the first moments are returned.
    pub(crate) fn of(&self, share: MomentShare, stage: WatchedStage<'_>) -> Vec<MomentFound> {
        let (graph, step) = (self.entries.graph, self.settings.moment_step);
        let frames = graph.clips().iter().map(|clip| clip.frames() as u32);
        let moments: Vec<Node> = frames
            .zip(0..)
            .flat_map(|(frames, clip)| {
                let frames = (0..frames).step_by(step as usize);
                let clip = ClipId(clip);
                frames.map(move |frame| Node { clip, frame })
            })
            .collect();
        let batches: Vec<&[Node]> = share.of(&moments).collect();
        let found = stage.in_parallel(batches.len(), |batch| {
            let (mut scratch, mut layers) = (Scratch::new(graph), LayerTest::new(graph));
            let own = batches[batch].iter();
            own.map(|&frame| self.at(frame, &mut scratch, &mut layers))
                .collect::<Vec<_>>()
        });
        found.into_iter().flatten().collect()
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
        let most = self.settings.most as usize;
        MomentFound {
            entries: self.entries.entries(&from, most, scratch),
            exits: self.exits.exits(&from, scratch),
            layers: self.entries.layers(&from, self.layers, layers),
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
    /// All moments.
    pub(crate) const ALL: Self = Self { index: 0, of: 1 };

    /// Number of moments of a batch. They share scratch.
    const BATCH: usize = 64;

    /// The batches of the share.
    pub(crate) fn of<T>(self, moments: &[T]) -> impl Iterator<Item = &[T]> {
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
    /// Finds exits for the moments of stretches without a branch point that are longer than `longest` seconds. The result does not depend
    /// on the number of threads. After a stop, some exits are missing.
    pub(crate) fn shorten_stretches(
        &mut self,
        exits: &Finder<'_>,
        longest: f32,
        stage: WatchedStage<'_>,
    ) {
        let (graph, step) = (exits.graph, self.step as usize);
        let longest = (f64::from(longest) * graph.frame_rate()) as usize;
        // Moments and their frames.
        let mut places: Vec<(u32, Node)> = Vec::new();
        for clip in (0..graph.clips().len()).map(|clip| ClipId(clip as u32)) {
            let first = self.moments_of(clip).start;
            let mut stretches = PlayedFrames::of(graph, exits.places, clip).stretches(self);
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
        for moment in 0..self.exits.lists.moments() as u32 {
            match found.next_if(|(at, _)| *at == moment) {
                Some((_, list)) => lists.push(&list),
                None => lists.push(self.exits.lists.of(moment)),
            }
        }
        self.exits.lists = lists;
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
        self.find_near(from, &mut scratch.near);
        let near = scratch.near.iter().enumerate();
        let near = near.filter_map(|(target, &near)| near.then_some(target));
        let mut nearest: Vec<Aligned> = near
            .filter_map(|target| self.align(&from.at, target))
            .collect();
        sort_rarely(&mut nearest, |a, b| {
            a.cost.total_cmp(&b.cost).then(a.target.cmp(&b.target))
        });
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

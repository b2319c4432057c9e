//! Search for the entries and exits of all moments.

use super::finder::{Finder, Ways};
use super::layers::LayerSource;
use super::limits::{MeasuredMotion, MotionLimits};
use super::moment_search::{MomentFound, MomentSearch};
use super::search_basis::SearchBasis;
use super::share::{EntryShare, MomentShare};
use super::targets::{ClipFrame, ClipPlaces, natural};
use super::{EntrySettings, EntryTable, EntryTarget};
use crate::graph::MotionGraph;
use crate::graph::watch::{BakeStage, BakeWatch, Stopped, WatchedStage};
use crate::maps::regions::Evasion;

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

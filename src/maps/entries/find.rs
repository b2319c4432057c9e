//! Search for the entries and exits of all moments.

use super::finder::{Finder, Ways};
use super::layers::LayerSource;
use super::limits::MeasuredMotion;
use super::moment_search::MomentSearch;
use super::record::{EarlierEntries, EntryRecord, TestTable};
use super::search_basis::SearchBasis;
use super::share::MomentShare;
use super::targets::{ClipFrame, ClipPlaces, natural};
use super::{EntrySettings, EntryTable, EntryTarget};
use crate::graph::MotionGraph;
use crate::graph::watch::{BakeStage, BakeWatch, Recorded, Stopped, WatchedStage};
use crate::maps::Evasion;

impl EntryTable {
    /// Finds all entries of a graph, and records the tests for a later bake. The result does not depend on the number of threads, nor on
    /// the tests that are taken over from an earlier bake.
    #[must_use]
    pub(crate) fn find(search: EntrySearch<'_>) -> Recorded<Self, EntryRecord> {
        let found = with_goals(search, |goals, measured| {
            let mut record = goals.record();
            let found = Self::of_goals(goals, measured, &mut record);
            Recorded {
                made: found.ok(),
                record,
            }
        });
        found.unwrap_or_else(|| Recorded {
            made: Some(Self::default()),
            record: EntryRecord::default(),
        })
    }

    fn of_goals(
        goals: Goals<'_>,
        mut measured: MeasuredMotion,
        record: &mut EntryRecord,
    ) -> Result<Self, Stopped> {
        let search = goals.search;
        let settings = search.settings;
        let mut table = Self {
            step: settings.moment_step,
            first_moment: record.first_moment.clone(),
            limits: goals.entries.limits.clone(),
            targets: goals.targets.to_vec(),
            ..Self::default()
        };
        let stage = search.stage(BakeStage::Entries);
        for found in goals.moment_search().of(MomentShare::ALL, stage) {
            table.cut += u64::from(found.entries.len() == settings.most as usize);
            table.entries.push(&found.entries);
            table.exits.lists.push(&found.exits);
            table.layers.push(&found.layers);
            record.push(found.tests);
        }
        search.watch.check()?;
        let exits = goals.exits;
        table.exits.targets = exits.targets.iter().map(Into::into).collect();
        let utmost = measured.limits(&settings.plausible.utmost());
        let mut exits = exits.within_utmost(&utmost);
        let earlier = search.earlier.with(settings);
        exits.known = earlier.map(|it| it.known(&it.record.last_exits, exits.basis()));
        let stage = search.stage(BakeStage::Exits);
        let tests = table.shorten_stretches(&exits, settings.unbranched, stage);
        search.watch.check()?;
        record.last_exits = tests;
        Ok(table)
    }
}

impl EntryRecord {
    /// Tests a share of all moments. [`EntryRecord::of_shares`] puts the records of all shares together.
    pub(crate) fn of_share(share: MomentShare, search: EntrySearch<'_>) -> Result<Self, Stopped> {
        let record = with_goals(search, |goals, _| {
            let mut record = goals.record();
            let stage = search.stage(BakeStage::Entries);
            for found in goals.moment_search().of(share, stage) {
                record.push(found.tests);
            }
            record
        });
        search.watch.check()?;
        Ok(record.unwrap_or_default())
    }
}

/// Calls `work` with the goals of entries and the measured motion. Returns `None` if there are no evasions, or the settings disable entries.
fn with_goals<T>(
    search: EntrySearch<'_>,
    work: impl FnOnce(Goals<'_>, MeasuredMotion) -> T,
) -> Option<T> {
    let EntrySearch {
        graph,
        evasions,
        settings,
        threads,
        ..
    } = search;
    if settings.moment_step == 0 || evasions.is_empty() {
        return None;
    }
    let mut measured = MeasuredMotion::of(graph, threads);
    let basis = SearchBasis {
        graph,
        limits: &measured.limits(&settings.plausible),
        places: &ClipPlaces::new(graph),
        threads,
    };
    let targets = basis.targets(evasions, settings);
    let mut goals = Goals::new(search, basis, &targets);
    if let Some(earlier) = search.earlier.with(settings) {
        goals.know(earlier);
    }
    Some(work(goals, measured))
}

/// Targets of the entries, exits and layers of all moments.
struct Goals<'a> {
    search: EntrySearch<'a>,
    targets: &'a [EntryTarget],
    entries: Finder<'a>,
    exits: Finder<'a>,
    layers: LayerSource<'a>,
}

impl<'a> Goals<'a> {
    fn new(search: EntrySearch<'a>, basis: SearchBasis<'a>, targets: &'a [EntryTarget]) -> Self {
        let (graph, step) = (search.graph, search.settings.target_step);
        let frames = targets
            .iter()
            .map(|target| ClipFrame::of(graph, target.edge, target.edge_frame));
        Self {
            search,
            targets,
            entries: Finder::new(basis, frames.collect(), Ways::ENTRIES),
            exits: Finder::new(basis, natural(graph, step), Ways::EXITS),
            layers: LayerSource::new(basis, search.evasions, targets),
        }
    }

    /// A record without tests.
    fn record(&self) -> EntryRecord {
        let settings = self.search.settings;
        EntryRecord {
            settings: Some(*settings),
            first_moment: first_moments(self.search.graph, settings.moment_step),
            entries: TestTable::new(self.entries.basis()),
            exits: TestTable::new(self.exits.basis()),
            layers: TestTable::new(self.layers.basis(&self.entries)),
            ..EntryRecord::default()
        }
    }

    /// Takes over the tests of an earlier bake.
    fn know(&mut self, earlier: &'a EarlierEntries) {
        let record = &earlier.record;
        let of_entries = earlier.known(&record.entries, self.entries.basis());
        let of_exits = earlier.known(&record.exits, self.exits.basis());
        self.entries.know(Some(of_entries));
        self.exits.know(Some(of_exits));
        self.layers.known = Some(earlier.known(&record.layers, self.layers.basis(&self.entries)));
    }

    fn moment_search(&self) -> MomentSearch<'_> {
        MomentSearch {
            entries: &self.entries,
            exits: &self.exits,
            layers: &self.layers,
            settings: self.search.settings,
        }
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
    /// Tests of an earlier bake.
    pub(crate) earlier: &'a EarlierEntries,
    pub(crate) watch: &'a dyn BakeWatch,
}

impl<'a> EntrySearch<'a> {
    fn stage(self, stage: BakeStage) -> WatchedStage<'a> {
        self.watch.stage(stage, self.threads)
    }
}

//! Search for the entries and exits of all moments.

use super::finder::{Finder, SearchBasis, Ways};
use super::layers::LayerSource;
use super::limits::MeasuredMotion;
use super::moment_search::MomentSearch;
use super::record::{EarlierEntries, EntryRecord, TestTable};
use super::targets::{ClipFrame, ClipPlaces, natural};
use super::{EntrySettings, EntryTable};
use crate::graph::MotionGraph;
use crate::maps::Evasion;

impl EntryTable {
    /// Finds all entries of a graph, and records the tests for a later bake. The result does not depend on the number of threads, nor on
    /// the tests that are taken over from an earlier bake.
    #[must_use]
    pub(crate) fn find(
        graph: &MotionGraph,
        evasions: &[Evasion],
        EntrySearch {
            settings,
            threads,
            earlier,
        }: EntrySearch<'_>,
    ) -> (Self, EntryRecord) {
        if settings.moment_step == 0 || evasions.is_empty() {
            return Default::default();
        }
        let earlier = earlier.with(settings);
        let places = ClipPlaces::new(graph);
        let mut measured = MeasuredMotion::of(graph, threads);
        let limits = measured.limits(&settings.plausible);
        let step = settings.moment_step;
        let mut table = Self {
            step,
            first_moment: first_moments(graph, step),
            ..Self::default()
        };
        let search = SearchBasis {
            graph,
            limits: &limits,
            places: &places,
            threads,
        };
        let targets = search.targets(evasions, settings);
        let frames = targets
            .iter()
            .map(|target| ClipFrame::of(graph, target.edge, target.edge_frame));
        let mut entries = Finder::new(search, frames.collect(), Ways::ENTRIES);
        let frames = natural(graph, settings.target_step);
        let mut exits = Finder::new(search, frames, Ways::EXITS);
        let mut layers = LayerSource::new(search, evasions, &targets);
        let mut record = EntryRecord {
            settings: Some(*settings),
            first_moment: table.first_moment.clone(),
            entries: TestTable::new(entries.basis()),
            exits: TestTable::new(exits.basis()),
            layers: TestTable::new(layers.basis(&entries)),
            ..EntryRecord::default()
        };
        if let Some(earlier) = earlier {
            let of_entries = earlier.known(&earlier.record.entries, entries.basis());
            let of_exits = earlier.known(&earlier.record.exits, exits.basis());
            entries.know(Some(of_entries));
            exits.know(Some(of_exits));
            layers.known = Some(earlier.known(&earlier.record.layers, layers.basis(&entries)));
        }
        let search = MomentSearch {
            entries: &entries,
            exits: &exits,
            layers: &layers,
            settings,
        };
        for found in search.all(threads) {
            table.cut += u64::from(found.entries.len() == settings.most as usize);
            table.entries.push(&found.entries);
            table.exits.lists.push(&found.exits);
            table.layers.push(&found.layers);
            let [entries, exits, layers] = found.tests;
            record.entries.push(entries);
            record.exits.push(exits);
            record.layers.push(layers);
        }
        table.exits.targets = exits.targets.iter().map(Into::into).collect();
        let utmost = measured.limits(&settings.plausible.utmost());
        let mut exits = exits.within_utmost(&utmost);
        exits.known = earlier.map(|it| it.known(&it.record.last_exits, exits.basis()));
        record.last_exits = table.shorten_stretches(&exits, settings.unbranched, threads);
        (table.limits, table.targets) = (limits, targets);
        (table, record)
    }
}

/// The first moment of each clip, and the number of moments.
fn first_moments(graph: &MotionGraph, step: u32) -> Vec<u32> {
    let mut firsts = vec![0];
    for clip in graph.clips() {
        let moments = clip.frames().div_ceil(step as usize) as u32;
        firsts.push(firsts[firsts.len() - 1] + moments);
    }
    firsts
}

/// How entries are searched.
#[derive(Clone, Copy)]
pub(crate) struct EntrySearch<'a> {
    pub(crate) settings: &'a EntrySettings,
    /// Number of threads, 0 for one per CPU core.
    pub(crate) threads: usize,
    /// Tests of an earlier bake.
    pub(crate) earlier: &'a EarlierEntries,
}

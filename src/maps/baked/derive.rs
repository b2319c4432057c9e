//! Computes the tables that are derived from the parts of a graph and not stored in files.

use super::BakedGraph;
use crate::graph::{EdgesInto, MotionGraph, NodeId};
use crate::maps::entries::EntryTracks;
use crate::maps::grid::GridCells;
use crate::maps::regions::EvasionTracks;
use crate::maps::{BodyRows, BodyTrack, Evasion, RegionMaps};
use crate::math::in_parallel;

/// Tables that depend neither on the contents of paths nor on the maps.
pub(super) struct Tables {
    body_rows: BodyRows,
    grid: GridCells,
    entry_tracks: EntryTracks,
}

impl BakedGraph {
    /// Estimated memory of the tables that files do not store, in bytes. It is computed from
    /// untrusted data before any allocation.
    pub(super) fn derived_bytes(&self) -> u64 {
        let of = |count: usize, bytes: usize| count as u64 * bytes as u64;
        let tracks: u64 = self
            .evasions
            .iter()
            .map(|evasion| {
                let seconds = EvasionTracks::seconds(&self.graph, evasion);
                let ticks = (seconds * BodyTrack::RATE) as usize + 2;
                of(ticks, BodyTrack::tick_bytes(&self.body))
            })
            .sum();
        let spheres = self.body.spheres.len() + self.body.props.len();
        let entries = EntryTracks::bytes(self);
        tracks
            + entries
            + of(
                self.atlas.regions().len() * self.atlas.grid().slices as usize,
                64,
            )
            + of(self.graph.nodes().len() + self.graph.edges().len(), 64)
            + of(spheres, 128)
    }

    /// Computes the tables that files do not store. Placements and paths are known.
    pub(super) fn derived(self) -> Self {
        let tables = self.tables(self.paths.count());
        self.with_tables(tables)
    }

    /// Computes the tables that depend only on the number of paths.
    pub(super) fn tables(&self, paths: usize) -> Tables {
        let _span = tracing::trace_span!("bake: derive tables").entered();
        // Computed here, so that the first query need not compute them.
        let _ = self.atlas.coarse();
        Tables {
            body_rows: BodyRows::new(&self.body),
            grid: GridCells::new(self.grid_settings, self.reach, self.evasions.len(), paths),
            entry_tracks: EntryTracks::new(&self.graph, self.evasions.len(), &self.entries),
        }
    }

    /// Sets the tables, and allocates the slots of data that is computed on first use.
    pub(super) fn with_tables(mut self, tables: Tables) -> Self {
        self.body_rows = tables.body_rows;
        self.entry_tracks = tables.entry_tracks;
        self.derive_from_maps();
        self.tracks = EvasionTracks::new(self.evasions.len());
        self.grid = tables.grid;
        if self.evasions.len() <= Self::PREPARED_EVASIONS {
            self.prepare();
        }
        self
    }

    /// Maximum number of evasions whose tables are computed when a graph is baked or loaded.
    const PREPARED_EVASIONS: usize = 32;

    /// Computes everything that queries otherwise compute on first use: for each evasion the body's spheres over time and the cells that
    /// it vacates. That takes a few milliseconds for each evasion, divided among all CPU cores. Graphs with at most 32 evasions are
    /// prepared when they are baked or loaded. For larger graphs, call this on any thread if queries must not take that time or allocate
    /// memory. Answers do not depend on it.
    pub fn prepare(&self) {
        let _span = tracing::trace_span!("bake: prepare evasions").entered();
        let _ = self.graph.rig();
        in_parallel(0, self.evasions.len(), |evasion| {
            let _ = (self.track(evasion), self.entry_track(evasion));
        });
        self.paths.prepare();
        self.grid().prepare();
    }

    /// Computes the tables that depend on the maps.
    pub(super) fn derive_from_maps(&mut self) {
        let _ = self.atlas.coarse();
        let texels =
            |maps: &RegionMaps| maps.slabs.iter().map(|maps| maps.evasion.count()).collect();
        self.evasion_texels = self.atlas.regions().iter().map(texels).collect();
    }
}

/// Minimum number of frames from each node to an evasion's start: Dijkstra's algorithm from all
/// starts, against the edges' direction.
pub(super) fn frames_to_evasion(graph: &MotionGraph, evasions: &[Evasion]) -> Vec<u32> {
    let into = EdgesInto::new(graph);
    let mut frames = vec![u32::MAX; graph.nodes().len()];
    let mut open = std::collections::BinaryHeap::new();
    for evasion in evasions {
        let start = graph.edge(evasion.edge).from;
        frames[start.index()] = 0;
        open.push(std::cmp::Reverse((0, start.0)));
    }
    while let Some(std::cmp::Reverse((so_far, node))) = open.pop() {
        if so_far > frames[node as usize] {
            continue;
        }
        for edge in into.of(NodeId(node)).iter().map(|&edge| graph.edge(edge)) {
            let total = so_far.saturating_add(edge.frames);
            let known = &mut frames[edge.from.index()];
            if total < *known {
                *known = total;
                open.push(std::cmp::Reverse((total, edge.from.0)));
            }
        }
    }
    frames
}

//! The tables that are computed from the parts of a graph, and that files do not store.

use super::BakedGraph;
use crate::graph::{Edge, MotionGraph, NodeId};
use crate::maps::bounding_cylinder::{BoundingCylinder, ClipCylinders};
use crate::maps::entries::EntryTracks;
use crate::maps::grid::{Grid, GridSource};
use crate::maps::{BodyRows, BodyTrack, Evasion, RegionMaps, TrackStart};
use crate::math::in_parallel;

impl BakedGraph {
    /// Estimated memory of the tables that files do not store, in bytes. It is computed from
    /// untrusted data before any allocation.
    pub(super) fn derived_bytes(&self) -> u64 {
        let of = |count: usize, bytes: usize| count as u64 * bytes as u64;
        let frames: usize = self.graph.clips().iter().map(|clip| clip.frames()).sum();
        let tracks: u64 = self
            .evasions
            .iter()
            .map(|evasion| {
                let seconds = self.graph.seconds(evasion.edge).max(Self::TRACK_SECONDS);
                let ticks = (seconds * BodyTrack::RATE) as usize + 2;
                of(ticks, BodyTrack::tick_bytes(&self.body))
            })
            .sum();
        let spheres = self.body.spheres.len() + self.body.props.len();
        let entries = EntryTracks::bytes(&self.graph, &self.body, &self.evasions, &self.entries);
        tracks
            + entries
            + of(frames, size_of::<BoundingCylinder>())
            + of(
                self.atlas.regions().len() * self.atlas.grid().slices as usize,
                64,
            )
            + of(self.graph.nodes().len() + self.graph.edges().len(), 64)
            + of(spheres, 128)
    }

    pub(super) fn derived(mut self) -> Self {
        let _span = tracing::trace_span!("bake: derive tables").entered();
        {
            let _span = tracing::trace_span!("bake: coarse maps").entered();
            self.derive_from_maps();
        }
        self.frames_to_evasion = frames_to_evasion(&self.graph, &self.evasions);
        self.reach = self.body.reach(self.graph.skeleton(), self.graph.clips());
        self.body_rows = BodyRows::new(&self.body);
        self.cylinders = {
            let _span = tracing::trace_span!("bake: bounding cylinders").entered();
            ClipCylinders::new(&self.graph, &self.body)
        };
        let seconds = |evasion: &Evasion| self.graph.seconds(evasion.edge);
        let track = |evasion: usize| {
            let evasion = &self.evasions[evasion];
            let start = TrackStart {
                edge: evasion.edge,
                frame: 0.0,
                placement: evasion.placement,
            };
            let seconds = seconds(evasion).max(Self::TRACK_SECONDS);
            BodyTrack::along(&self.graph, &self.body, start, seconds)
        };
        let tracks = tracing::trace_span!("bake: body tracks").entered();
        self.tracks = in_parallel(0, self.evasions.len(), track);
        self.entry_tracks =
            EntryTracks::new(&self.graph, &self.body, &self.evasions, &self.entries);
        drop(tracks);
        let end = |evasion| (seconds(evasion) * BodyTrack::RATE).round() as usize;
        let evasions = self.tracks.iter().zip(self.evasions.iter().map(end));
        let source = GridSource {
            body: &self.body,
            reach: self.reach,
            evasions: evasions.collect(),
            paths: &self.paths,
        };
        let _span = tracing::trace_span!("bake: make the grid").entered();
        self.grid = Grid::new(&source, self.grid_settings);
        self
    }

    /// Computes the tables that depend on the maps.
    pub(super) fn derive_from_maps(&mut self) {
        // Computed here, so that the first query does not have to.
        let _ = self.atlas.coarse();
        let texels =
            |maps: &RegionMaps| maps.slabs.iter().map(|maps| maps.evasion.count()).collect();
        self.evasion_texels = self.atlas.regions().iter().map(texels).collect();
    }
}

/// Minimum number of frames from each node to an evasion's start: Dijkstra's algorithm from all
/// starts, against the edges' direction.
fn frames_to_evasion(graph: &MotionGraph, evasions: &[Evasion]) -> Vec<u32> {
    // The edges into each node, one node after the other.
    let mut into: Vec<&Edge> = graph.edges().iter().collect();
    into.sort_by_key(|edge| edge.to);
    let of = |node: NodeId| {
        let first = into.partition_point(|edge| edge.to < node);
        into[first..].iter().take_while(move |edge| edge.to == node)
    };
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
        for edge in of(NodeId(node)) {
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

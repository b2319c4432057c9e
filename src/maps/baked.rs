use serde::{Deserialize, Serialize};

use super::grid::{Grid, GridSettings, GridSource};
use super::paths::{PathSettings, PathSource, PathTable, build as find_paths};
use super::strike::attack_spheres;
use super::upright::{Upright, Uprights};
use super::{
    Body, BodyRows, BodyTrack, MovingSphere, RegionAtlas, RegionId, RegionMaps, Retimable, Slab,
    Strike,
};
use crate::anim::{EventKind, Skeleton};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, Node, NodeId};
use crate::math::Rigid2;

/// An edge that avoids.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evasion {
    /// The edge; it plays the whole event and nothing else.
    pub edge: EdgeId,
    /// Its maps.
    pub region: RegionId,
    /// The character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}

/// Everything that a query needs, made once. Immutable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakedGraph {
    graph: MotionGraph,
    body: Body,
    atlas: RegionAtlas,
    /// By edge.
    retimable: Vec<Retimable>,
    evasions: Vec<Evasion>,
    strikes: Vec<Strike>,
    paths: PathTable,
    grid_settings: GridSettings,
    #[serde(skip)]
    grid: Grid,
    /// By evasion.
    #[serde(skip)]
    tracks: Vec<BodyTrack>,
    /// For each node the fewest frames at rate 1 until an evasion starts.
    #[serde(skip)]
    frames_to_evasion: Vec<u32>,
    /// No part of the body is further from the root.
    #[serde(skip)]
    reach: f32,
    #[serde(skip)]
    body_rows: BodyRows,
    #[serde(skip)]
    uprights: Uprights,
    /// For each region and slab.
    #[serde(skip)]
    evasion_texels: Vec<Vec<u32>>,
    /// For each node the character's frame there, in the space of its clip.
    #[serde(skip)]
    placements: Vec<Rigid2>,
}

impl BakedGraph {
    /// The body is known this long from each evasion's start on, or until its end, seconds.
    pub const TRACK_SECONDS: f32 = 1.5;

    pub(super) fn new(
        graph: MotionGraph,
        body: Body,
        atlas: RegionAtlas,
        retimable: Vec<Retimable>,
        (evasions, strikes): (Vec<Evasion>, Vec<Strike>),
        (paths, grid_settings): (&PathSettings, GridSettings),
    ) -> Self {
        let goals: Vec<EdgeId> = evasions.iter().map(|evasion| evasion.edge).collect();
        let source = PathSource {
            graph: &graph,
            retimable: &retimable,
            goals: &goals,
        };
        let paths = find_paths(source, paths);
        let (grid, tracks) = (Grid::default(), Vec::new());
        let (frames_to_evasion, reach) = (Vec::new(), 0.0);
        Self {
            graph,
            body,
            atlas,
            retimable,
            evasions,
            strikes,
            paths,
            grid_settings,
            grid,
            tracks,
            frames_to_evasion,
            reach,
            body_rows: BodyRows::default(),
            uprights: Uprights::default(),
            evasion_texels: Vec::new(),
            placements: Vec::new(),
        }
        .derived()
    }

    /// The motion graph.
    #[must_use]
    pub fn graph(&self) -> &MotionGraph {
        &self.graph
    }

    /// The body's spheres.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The maps of all evasions.
    #[must_use]
    pub fn atlas(&self) -> &RegionAtlas {
        &self.atlas
    }

    /// How an edge's rate may change.
    #[must_use]
    pub fn retimable(&self, edge: EdgeId) -> Retimable {
        self.retimable[edge.index()]
    }

    /// All evasions, by edge.
    #[must_use]
    pub fn evasions(&self) -> &[Evasion] {
        &self.evasions
    }

    /// All attacks, by edge.
    #[must_use]
    pub fn strikes(&self) -> &[Strike] {
        &self.strikes
    }

    /// Where an attack passes, in the character's frame at its start; the clock starts with it.
    #[must_use]
    pub fn strike_spheres(&self, strike: &Strike) -> Vec<MovingSphere> {
        let event = self
            .graph
            .edge(strike.edge)
            .event
            .map(|event| self.graph.event(event));
        event.map_or_else(Vec::new, |event| {
            attack_spheres(&self.graph, &self.body, event)
        })
    }

    /// The ways from every node to an evasion.
    #[must_use]
    pub fn paths(&self) -> &PathTable {
        &self.paths
    }

    /// Those ways, by the cells of space that they take the body out of.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The body all through an evasion and beyond, by the evasion's position in
    /// [`BakedGraph::evasions`].
    #[must_use]
    pub fn track(&self, evasion: usize) -> &BodyTrack {
        &self.tracks[evasion]
    }

    /// The evasion that an edge is, if it is one.
    #[must_use]
    pub fn evasion(&self, edge: EdgeId) -> Option<&Evasion> {
        let index = self
            .evasions
            .binary_search_by_key(&edge, |evasion| evasion.edge)
            .ok()?;
        Some(&self.evasions[index])
    }

    /// No part of the body is ever further than this from the root's joint, metres.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Texels of an evasion's region in a slab: what an attack there can cover at most.
    #[must_use]
    pub fn evasion_texels(&self, region: RegionId, slab: Slab) -> u32 {
        let first = self.atlas.region(region).first_slab;
        let texels = &self.evasion_texels[region.index()];
        let index = slab.0.checked_sub(first.0).map(usize::try_from);
        index
            .and_then(Result::ok)
            .and_then(|index| texels.get(index))
            .map_or(0, |&texels| texels)
    }

    /// The body's spheres, in rows as those of a [`BodyTrack`] are.
    #[must_use]
    pub fn body_rows(&self) -> &BodyRows {
        &self.body_rows
    }

    /// A cylinder around the body at a moment of an edge, in the space of the clip in which that
    /// starts. Where a transition bends the body outwards it can be centimetres too narrow.
    pub(crate) fn upright(&self, edge: EdgeId, frame: f32) -> Upright {
        self.uprights.at(&self.graph, edge, frame)
    }

    /// The character's frame (root on the ground, facing +Z) at a node, in the space of its clip.
    #[must_use]
    pub fn placement(&self, node: NodeId) -> Rigid2 {
        self.placements[node.index()]
    }

    /// The fewest frames at rate 1 from a node until an evasion starts; `None` where the graph has no evasion.
    #[must_use]
    pub fn frames_to_evasion(&self, node: NodeId) -> Option<u32> {
        let frames = self.frames_to_evasion[node.index()];
        (frames != u32::MAX).then_some(frames)
    }

    /// Share of the moments of the graph's clips from whose next node an evasion can start within `seconds`, at rate 1.
    #[must_use]
    pub fn responsive_share(&self, seconds: f64) -> f64 {
        let limit = seconds * self.graph.frame_rate();
        let (mut soon, mut all) = (0.0, 0.0);
        let clip_edges = self
            .graph
            .edges()
            .iter()
            .filter(|edge| edge.motion == EdgeMotion::Clip);
        for edge in clip_edges {
            let frames = f64::from(edge.frames);
            all += frames;
            if let Some(wait) = self.frames_to_evasion(edge.to) {
                // Of the moments 1 to `frames` before the edge's end, those that leave the wait within the limit.
                soon += (limit - f64::from(wait)).floor().clamp(0.0, frames);
            }
        }
        if all > 0.0 { soon / all } else { 0.0 }
    }

    /// Checks what was read from a file, every index of it, and derives the tables that files do not hold.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn restored(self) -> Result<Self, String> {
        self.restored_within(u64::MAX)
    }

    /// The same in so many bytes for what is derived.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn restored_within(mut self, bytes: u64) -> Result<Self, String> {
        self.graph.validate()?;
        let edges = self.graph.edges().len();
        let sorted = self
            .evasions
            .windows(2)
            .all(|pair| pair[0].edge < pair[1].edge)
            && self
                .strikes
                .windows(2)
                .all(|pair| pair[0].edge < pair[1].edge);
        let strikes_fit = self
            .strikes
            .iter()
            .all(|strike| self.event_fits(strike.edge, EventKind::Attack, strike.placement));
        let checks = [
            (
                self.retimable.len() == edges,
                "the table of rates is not one entry an edge",
            ),
            (
                sorted && self.evasions.iter().all(|e| self.evasion_fits(e)),
                "an evasion names an edge that is none, or maps that are not there",
            ),
            (
                strikes_fit && self.atlas.attacks().len() == self.strikes.len(),
                "an attack names an edge that is none, or has no maps",
            ),
            (
                self.body.is_sound(self.graph.skeleton()),
                "a body sphere is not sound",
            ),
        ];
        if let Some((_, what)) = checks.into_iter().find(|(ok, _)| !ok) {
            return Err(what.to_owned());
        }
        self.atlas.check().map_err(str::to_owned)?;
        let needed = self.derived_bytes();
        if needed > bytes {
            return Err(format!(
                "it would need {needed} bytes of memory, and {bytes} are the most for its size"
            ));
        }
        self.paths = self
            .paths
            .restored(&self.graph, &self.retimable, &self.evasions)?;
        Ok(self.derived())
    }

    /// What the tables that files do not hold take in memory, about, bytes: whatever the file says, as much as is asked for.
    fn derived_bytes(&self) -> u64 {
        let of = |count: usize, bytes: usize| count as u64 * bytes as u64;
        let frames: usize = self.graph.clips().iter().map(|clip| clip.frames()).sum();
        let tracks: u64 = { self.evasions.iter() }
            .map(|evasion| {
                let seconds = self.graph.seconds(evasion.edge).max(Self::TRACK_SECONDS);
                let ticks = (seconds * BodyTrack::RATE) as usize + 2;
                of(ticks, BodyTrack::tick_bytes(&self.body))
            })
            .sum();
        let spheres = self.body.spheres.len() + self.body.props.len();
        tracks
            + of(frames, size_of::<Upright>())
            + of(
                self.atlas.regions().len() * self.atlas.grid().slices as usize,
                64,
            )
            + of(self.graph.nodes().len() + self.graph.edges().len(), 64)
            + of(spheres, 128)
    }

    fn derived(mut self) -> Self {
        self.look_at_maps();
        self.frames_to_evasion = frames_to_evasion(&self.graph, &self.evasions);
        self.reach = self.body.reach(self.graph.skeleton(), self.graph.clips());
        self.body_rows = BodyRows::new(&self.body);
        self.uprights = Uprights::new(&self.graph, &self.body);
        let placement = |node: &Node| self.graph.placement(node.clip, node.frame);
        self.placements = self.graph.nodes().iter().map(placement).collect();
        let seconds = |evasion: &Evasion| self.graph.seconds(evasion.edge);
        let track = |evasion: &Evasion| {
            let place = (evasion.edge, evasion.placement);
            let seconds = seconds(evasion).max(Self::TRACK_SECONDS);
            BodyTrack::along(&self.graph, &self.body, place, seconds)
        };
        self.tracks = self.evasions.iter().map(track).collect();
        let end = |evasion| (seconds(evasion) * BodyTrack::RATE).round() as usize;
        let evasions = self.tracks.iter().zip(self.evasions.iter().map(end));
        let source = GridSource {
            body: &self.body,
            reach: self.reach,
            evasions: evasions.collect(),
            paths: &self.paths,
        };
        self.grid = Grid::new(&source, self.grid_settings);
        self
    }

    /// What is derived from the maps.
    fn look_at_maps(&mut self) {
        // Now rather than in the first query.
        let _ = self.atlas.near();
        let texels =
            |maps: &RegionMaps| maps.slabs.iter().map(|maps| maps.evasion.count()).collect();
        self.evasion_texels = self.atlas.regions().iter().map(texels).collect();
    }

    /// The same with other maps of the same evasions and attacks.
    pub(super) fn with_atlas(&self, atlas: RegionAtlas) -> Self {
        let mut other = Self {
            atlas,
            ..self.clone()
        };
        other.look_at_maps();
        other
    }

    fn evasion_fits(&self, evasion: &Evasion) -> bool {
        self.event_fits(evasion.edge, EventKind::Evasion, evasion.placement)
            && evasion.region.index() < self.atlas.regions().len()
    }

    fn event_fits(&self, edge: EdgeId, kind: EventKind, placement: Rigid2) -> bool {
        let event = self
            .graph
            .edges()
            .get(edge.index())
            .and_then(|edge| edge.event);
        event.is_some_and(|event| self.graph.event(event).kind == kind)
            && placement.is_sound(4.0 * Skeleton::FURTHEST)
    }
}

/// Dijkstra from all evasions' starts, against the edges' direction.
fn frames_to_evasion(graph: &MotionGraph, evasions: &[Evasion]) -> Vec<u32> {
    let mut into: Vec<Vec<(u32, u32)>> = vec![Vec::new(); graph.nodes().len()];
    for edge in graph.edges() {
        into[edge.to.index()].push((edge.from.0, edge.frames));
    }
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
        for &(from, length) in &into[node as usize] {
            let total = so_far.saturating_add(length);
            if total < frames[from as usize] {
                frames[from as usize] = total;
                open.push(std::cmp::Reverse((total, from)));
            }
        }
    }
    frames
}

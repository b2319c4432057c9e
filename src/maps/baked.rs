use serde::{Deserialize, Serialize};

use super::attack_move::attack_spheres;
use super::bounding_cylinder::{BoundingCylinder, ClipCylinders};
use super::entries::{EntryTable, EntryTrack, EntryTracks, Stance};
use super::grid::{Grid, GridSettings, GridSource};
use super::paths::{PathSettings, PathSource, PathTable, build as find_paths};
use super::{
    AttackMove, Body, BodyRows, BodyTrack, MovingSphere, RegionAtlas, RegionId, RegionMaps,
    Retimable, Slab, TrackStart,
};
use crate::anim::{EventKind, Facing, JointTransform, Skeleton};
use crate::graph::{EdgeId, EdgeMotion, MotionGraph, Node, NodeId};
use crate::math::Rigid2;

/// An edge that plays an evasion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evasion {
    /// Edge that plays the whole event and nothing else.
    pub edge: EdgeId,
    /// Maps of the evasion in the [`RegionAtlas`].
    pub region: RegionId,
    /// Character's frame at the event's start, in the space of its clip.
    pub placement: Rigid2,
}

/// The immutable result of a bake: everything that a query needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakedGraph {
    graph: MotionGraph,
    body: Body,
    atlas: RegionAtlas,
    /// Allowed rate changes, by edge.
    retimable: Vec<Retimable>,
    evasions: Vec<Evasion>,
    #[serde(rename = "strikes")]
    attack_moves: Vec<AttackMove>,
    entries: EntryTable,
    paths: PathTable,
    grid_settings: GridSettings,
    #[serde(skip)]
    grid: Grid,
    /// Body spheres over time, by evasion.
    #[serde(skip)]
    tracks: Vec<BodyTrack>,
    /// Data derived from the entries.
    #[serde(skip)]
    entry_tracks: EntryTracks,
    /// Minimum number of frames from each node to an evasion's start, at rate 1.
    #[serde(skip)]
    frames_to_evasion: Vec<u32>,
    /// Maximum distance of any part of the body from the root, in metres.
    #[serde(skip)]
    reach: f32,
    #[serde(skip)]
    body_rows: BodyRows,
    #[serde(skip)]
    cylinders: ClipCylinders,
    /// Number of texels of each region's evasion maps, by slab.
    #[serde(skip)]
    evasion_texels: Vec<Vec<u32>>,
    /// Character's frame at each node, in the space of the node's clip.
    #[serde(skip)]
    placements: Vec<Rigid2>,
}

/// The independent parts of a [`BakedGraph`], from which all its tables are computed.
pub(super) struct BakedParts {
    pub graph: MotionGraph,
    pub body: Body,
    pub atlas: RegionAtlas,
    /// Allowed rate changes, by edge.
    pub retimable: Vec<Retimable>,
    pub evasions: Vec<Evasion>,
    pub attack_moves: Vec<AttackMove>,
    pub entries: EntryTable,
}

impl BakedGraph {
    /// Minimum time for which a [`BodyTrack`] holds the body, from an evasion's start, in seconds.
    pub const TRACK_SECONDS: f32 = 1.5;

    pub(super) fn new(
        parts: BakedParts,
        paths: &PathSettings,
        grid_settings: GridSettings,
    ) -> Self {
        let BakedParts {
            graph,
            body,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
        } = parts;
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
            attack_moves,
            entries,
            paths,
            grid_settings,
            grid,
            tracks,
            entry_tracks: EntryTracks::default(),
            frames_to_evasion,
            reach,
            body_rows: BodyRows::default(),
            cylinders: ClipCylinders::default(),
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

    /// Spheres and props of the body.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Maps of all evasions and attacks.
    #[must_use]
    pub fn atlas(&self) -> &RegionAtlas {
        &self.atlas
    }

    /// Allowed rate changes of an edge.
    #[must_use]
    pub fn retimable(&self, edge: EdgeId) -> Retimable {
        self.retimable[edge.index()]
    }

    /// All evasions, sorted by edge.
    #[must_use]
    pub fn evasions(&self) -> &[Evasion] {
        &self.evasions
    }

    /// All attacks, sorted by edge.
    #[must_use]
    pub fn attack_moves(&self) -> &[AttackMove] {
        &self.attack_moves
    }

    /// Spheres of an attack over time, in the character's frame at the attack's start. Time 0 is
    /// the start.
    #[must_use]
    pub fn attack_spheres(&self, attack: &AttackMove) -> Vec<MovingSphere> {
        let event = self
            .graph
            .edge(attack.edge)
            .event
            .map(|event| self.graph.event(event));
        event.map_or_else(Vec::new, |event| {
            attack_spheres(&self.graph, &self.body, event)
        })
    }

    /// Paths from each node to evasions.
    #[must_use]
    pub fn paths(&self) -> &PathTable {
        &self.paths
    }

    /// Paths, filed by the cells that the body leaves when it takes them.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Body spheres during and after an evasion, by its index in [`BakedGraph::evasions`].
    #[must_use]
    pub fn track(&self, evasion: usize) -> &BodyTrack {
        &self.tracks[evasion]
    }

    /// Jumps into evasions that need no edge, by moment.
    #[must_use]
    pub fn entries(&self) -> &EntryTable {
        &self.entries
    }

    /// Body spheres from the first frame at which an evasion can be entered, or `None` if it cannot be entered.
    #[must_use]
    pub fn entry_track(&self, evasion: usize) -> Option<&EntryTrack> {
        self.entry_tracks.tracks.get(evasion)?.as_ref()
    }

    /// Stance of a body, for [`Stance::align`].
    #[must_use]
    pub fn stance(&self, joints: &[JointTransform]) -> Stance {
        let found = || Facing::of(self.graph.skeleton());
        let facing = self.entry_tracks.facing.unwrap_or_else(found);
        Stance::of(&self.graph, facing, joints)
    }

    /// Stance at an entry's target, in the space of its clip.
    #[must_use]
    pub fn entry_stance(&self, target: usize) -> &Stance {
        &self.entry_tracks.stances[target]
    }

    /// Evasion that plays on an edge, or `None` if the edge is not an evasion.
    #[must_use]
    pub fn evasion(&self, edge: EdgeId) -> Option<&Evasion> {
        let index = self
            .evasions
            .binary_search_by_key(&edge, |evasion| evasion.edge)
            .ok()?;
        Some(&self.evasions[index])
    }

    /// Maximum distance of any part of the body from the root joint, in metres.
    #[must_use]
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Number of texels in an evasion map, which is the most that an attack can cover there.
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

    /// Spheres of the body in the row layout of a [`BodyTrack`].
    #[must_use]
    pub fn body_rows(&self) -> &BodyRows {
        &self.body_rows
    }

    /// Cylinder around the body at a frame of an edge, in the space of the clip in which the edge
    /// starts. It may be a few centimetres too narrow where a transition bends the body outwards.
    pub(crate) fn bounding_cylinder(&self, edge: EdgeId, frame: f32) -> BoundingCylinder {
        self.cylinders.at(&self.graph, edge, frame)
    }

    /// Character's frame (root on the ground, facing +Z) at a node, in the space of the node's
    /// clip.
    #[must_use]
    pub fn placement(&self, node: NodeId) -> Rigid2 {
        self.placements[node.index()]
    }

    /// Minimum number of frames from a node to an evasion's start, at rate 1, or `None` if no
    /// evasion can be reached.
    #[must_use]
    pub fn frames_to_evasion(&self, node: NodeId) -> Option<u32> {
        let frames = self.frames_to_evasion[node.index()];
        (frames != u32::MAX).then_some(frames)
    }

    /// Share of the frames of all clips from which an evasion can start within `seconds`, at rate
    /// 1.
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
                // An edge has the frames 1 to `frames` before its end. Count those from which the
                // evasion starts within the limit.
                soon += (limit - f64::from(wait)).floor().clamp(0.0, frames);
            }
        }
        if all > 0.0 { soon / all } else { 0.0 }
    }

    /// Checks all data and indices that were read from a file, and computes the tables that files
    /// do not store.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn restored(self) -> Result<Self, String> {
        self.restored_within(u64::MAX)
    }

    /// Like [`BakedGraph::restored`], but refuses graphs whose computed tables would need more than
    /// `bytes` of memory.
    ///
    /// # Errors
    /// A description of the first invalid item.
    pub fn restored_within(mut self, bytes: u64) -> Result<Self, String> {
        self.graph.validate()?;
        let edges = self.graph.edges().len();
        let sorted = self
            .evasions
            .windows(2)
            .all(|pair| pair[0].edge < pair[1].edge)
            && self
                .attack_moves
                .windows(2)
                .all(|pair| pair[0].edge < pair[1].edge);
        let attacks_fit = self
            .attack_moves
            .iter()
            .all(|attack| self.event_fits(attack.edge, EventKind::Attack, attack.placement));
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
                attacks_fit && self.atlas.attacks().len() == self.attack_moves.len(),
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
        self.entries.check(&self.graph, &self.evasions)?;
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

    /// Estimated memory of the tables that files do not store, in bytes. It is computed from
    /// untrusted data before any allocation.
    fn derived_bytes(&self) -> u64 {
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

    fn derived(mut self) -> Self {
        self.derive_from_maps();
        self.frames_to_evasion = frames_to_evasion(&self.graph, &self.evasions);
        self.reach = self.body.reach(self.graph.skeleton(), self.graph.clips());
        self.body_rows = BodyRows::new(&self.body);
        self.cylinders = ClipCylinders::new(&self.graph, &self.body);
        let placement = |node: &Node| self.graph.placement(node.clip, node.frame);
        self.placements = self.graph.nodes().iter().map(placement).collect();
        let seconds = |evasion: &Evasion| self.graph.seconds(evasion.edge);
        let track = |evasion: &Evasion| {
            let start = TrackStart {
                edge: evasion.edge,
                frame: 0.0,
                placement: evasion.placement,
            };
            let seconds = seconds(evasion).max(Self::TRACK_SECONDS);
            BodyTrack::along(&self.graph, &self.body, start, seconds)
        };
        self.tracks = self.evasions.iter().map(track).collect();
        self.entry_tracks =
            EntryTracks::new(&self.graph, &self.body, &self.evasions, &self.entries);
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

    /// Computes the tables that depend on the maps.
    fn derive_from_maps(&mut self) {
        // Computed here, so that the first query does not have to.
        let _ = self.atlas.coarse();
        let texels =
            |maps: &RegionMaps| maps.slabs.iter().map(|maps| maps.evasion.count()).collect();
        self.evasion_texels = self.atlas.regions().iter().map(texels).collect();
    }

    /// Returns the same graph with other maps of the same evasions and attacks.
    pub(super) fn with_atlas(&self, atlas: RegionAtlas) -> Self {
        let mut other = Self {
            atlas,
            ..self.clone()
        };
        other.derive_from_maps();
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

/// Minimum number of frames from each node to an evasion's start: Dijkstra's algorithm from all
/// starts, against the edges' direction.
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

mod derive;
mod restore;
mod sections;

use std::sync::Arc;

use derive::frames_to_evasion;
use serde::{Deserialize, Serialize};

use super::entries::{EntryReport, EntryTable, EntryTrack, EntryTracks, KnownEntry, Stance};
use super::grid::{Grid, GridCells, GridSettings, PathId, PathSettings, PathTable, find_paths};
use super::regions::attack_spheres;
use super::regions::{BoundingCylinder, ClipCylinders, EvasionTracks};
use super::{
    AttackMove, Body, BodyRows, BodyTrack, Evasion, MovingSphere, OnFirstUse, RegionAtlas,
    RegionId, Retimable, Slab,
};
use crate::anim::{Facing, JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, EdgeMotion, Entry, Motion, MotionGraph, NodeId, Playhead};
use crate::math::Rigid2;

/// The immutable result of a bake: everything that a query needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakedGraph {
    graph: MotionGraph,
    body: Body,
    atlas: RegionAtlas,
    /// Allowed rate changes of each edge.
    retimable: Vec<Retimable>,
    evasions: Vec<Evasion>,
    #[serde(rename = "strikes")]
    attack_moves: Vec<AttackMove>,
    entries: EntryTable,
    paths: PathTable,
    grid_settings: GridSettings,
    #[serde(skip)]
    grid: GridCells,
    /// Body spheres of each evasion over time.
    #[serde(skip)]
    tracks: EvasionTracks,
    /// Data derived from the entries.
    #[serde(skip)]
    entry_tracks: EntryTracks,
    /// Minimum number of frames from each node to an evasion's start, at rate 1.
    #[serde(skip)]
    frames_to_evasion: OnFirstUse<Vec<u32>>,
    /// Maximum distance of any part of the body from the root, in metres.
    #[serde(skip)]
    reach: f32,
    #[serde(skip)]
    body_rows: BodyRows,
    cylinders: ClipCylinders,
    /// Number of texels of each region's evasion maps, by slab.
    #[serde(skip)]
    evasion_texels: Vec<Vec<u32>>,
    /// Character's frame at each node, in the space of the node's clip.
    #[serde(skip)]
    placements: Vec<Rigid2>,
    /// Shared by clones, and by no other graph.
    #[serde(skip)]
    identity: Arc<()>,
}

/// The independent parts of a [`BakedGraph`], from which all its tables are computed.
pub(super) struct BakedParts {
    pub graph: MotionGraph,
    pub body: Body,
    pub atlas: RegionAtlas,
    /// Allowed rate changes of each edge.
    pub retimable: Vec<Retimable>,
    pub evasions: Vec<Evasion>,
    pub attack_moves: Vec<AttackMove>,
    pub entries: EntryTable,
}

impl BakedGraph {
    /// Minimum time for which a [`BodyTrack`] holds the body, from an evasion's start, in seconds.
    pub const TRACK_SECONDS: f32 = EvasionTracks::SECONDS;

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
        let placements = graph.placements();
        let reach = body.reach(graph.skeleton(), graph.clips());
        let paths = {
            let _span = tracing::trace_span!("bake: find paths").entered();
            find_paths(&graph, &retimable, &placements, &goals, paths)
        };
        let cylinders = {
            let _span = tracing::trace_span!("bake: bounding cylinders").entered();
            ClipCylinders::new(&graph, &body)
        };
        let (grid, tracks) = (GridCells::default(), EvasionTracks::default());
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
            frames_to_evasion: OnFirstUse::default(),
            reach,
            body_rows: BodyRows::default(),
            cylinders,
            evasion_texels: Vec::new(),
            placements,
            identity: Arc::default(),
        }
        .derived()
    }

    /// Distinguishes this graph from all others, by its address: what is cached for one graph is not used for another.
    pub(crate) fn identity(&self) -> &Arc<()> {
        &self.identity
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

    /// Evasion at the end of a path of [`BakedGraph::paths`].
    #[must_use]
    pub(crate) fn path_evasion(&self, path: PathId) -> &Evasion {
        &self.evasions[self.paths.path(path).goal as usize]
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
    pub fn grid(&self) -> Grid<'_> {
        Grid {
            cells: &self.grid,
            paths: &self.paths,
            graph: &self.graph,
            body: &self.body,
            evasions: &self.evasions,
            tracks: &self.tracks,
        }
    }

    /// Body spheres during and after an evasion, by its index in [`BakedGraph::evasions`].
    #[must_use]
    pub fn track(&self, evasion: usize) -> &BodyTrack {
        self.tracks
            .get(&self.graph, &self.body, &self.evasions, evasion)
    }

    /// Entries into evasions at a moment of a motion, at playback rate 1.
    #[must_use]
    pub fn entries_at(&self, motion: &Motion, seconds: f32) -> Vec<Entry> {
        let stance = self.stance_at(motion, seconds);
        let entry = |known: &KnownEntry| {
            let index = usize::from(known.target);
            let target = self.entries.targets()[index];
            Entry {
                edge: target.edge,
                frame: target.edge_frame as f32,
                clip_to_world: stance.align(self.entry_stance(index), known.pin()),
                rate: 1.0,
                blend: known.blend(),
            }
        };
        let playhead = motion.playhead(&self.graph, seconds);
        let known = self.entries.at(&self.graph, playhead);
        known.iter().map(entry).collect()
    }

    /// Exits back into natural motion at a moment of a motion, also inside an evasion or an attack. The exit that changes the motion least
    /// comes first. Play one with [`Motion::enter`].
    #[must_use]
    pub fn exits_at(&self, motion: &Motion, seconds: f32) -> Vec<Entry> {
        let playhead = motion.playhead(&self.graph, seconds);
        if self.entries.exits_at(&self.graph, playhead).is_empty() {
            return Vec::new();
        }
        self.exits(playhead, self.stance_at(motion, seconds))
            .collect()
    }

    /// [`BakedGraph::exits_at`] for a body with a stance.
    pub(crate) fn exits(
        &self,
        playhead: Playhead,
        stance: Stance,
    ) -> impl Iterator<Item = Entry> + '_ {
        let known = self.entries.exits_at(&self.graph, playhead);
        known.iter().map(move |known| {
            let index = usize::from(known.target);
            let target = self.entries.exits().targets()[index];
            let to = &self.entry_tracks.exit_stances[index];
            Entry {
                edge: target.edge,
                frame: target.edge_frame as f32,
                clip_to_world: stance.align(to, known.pin()),
                rate: 1.0,
                blend: known.exit_blend(),
            }
        })
    }

    fn stance_at(&self, motion: &Motion, seconds: f32) -> Stance {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        motion.sample(&self.graph, seconds, &mut pose);
        forward_kinematics(self.graph.skeleton(), &pose, &mut joints);
        self.stance(&joints)
    }

    /// Whether an evasion can be entered from a moment of the graph.
    #[must_use]
    pub fn has_entries_at(&self, playhead: Playhead) -> bool {
        !self.entries.at(&self.graph, playhead).is_empty()
    }

    /// Maximum angular speed of each joint in an entry, in radians per second.
    #[must_use]
    pub fn entry_joint_speeds(&self) -> &[f32] {
        &self.entries.limits().joint_speed
    }

    /// Statistics of the entries.
    #[must_use]
    pub fn entry_report(&self) -> EntryReport {
        self.entries.report(&self.graph)
    }

    /// Jumps into evasions that need no edge, by moment.
    #[must_use]
    pub(crate) fn entries(&self) -> &EntryTable {
        &self.entries
    }

    /// Body spheres from the first frame at which an evasion can be entered, or `None` if it cannot be entered.
    #[must_use]
    pub(crate) fn entry_track(&self, evasion: usize) -> Option<&EntryTrack> {
        let slot = self.entry_tracks.tracks.get(evasion)?;
        let make = || {
            let first = self.entries.first_target(evasion)?;
            Some(EntryTrack::new(self, first))
        };
        slot.get_or_make(make).as_ref()
    }

    /// Stance of a body, for [`Stance::align`].
    #[must_use]
    pub(crate) fn stance(&self, joints: &[JointTransform]) -> Stance {
        let found = || Facing::of(self.graph.skeleton());
        let facing = self.entry_tracks.facing.unwrap_or_else(found);
        Stance::of(&self.graph, facing, joints)
    }

    /// Stance at an entry's target, in the space of its clip.
    #[must_use]
    pub(crate) fn entry_stance(&self, target: usize) -> &Stance {
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
    pub(crate) fn body_rows(&self) -> &BodyRows {
        &self.body_rows
    }

    /// Cylinder around the body at a frame of an edge, in the space of the clip in which the edge
    /// starts. It may be a few centimetres too narrow where a transition bends the body outwards.
    pub(crate) fn bounding_cylinder(&self, edge: EdgeId, frame: f32) -> BoundingCylinder {
        self.cylinders.at(&self.graph, edge, frame)
    }

    /// [`BakedGraph::placement`] of each node.
    pub(super) fn placements(&self) -> &[Rigid2] {
        &self.placements
    }

    /// Character's frame (root on the ground, facing +Z) at a node, in the space of the node's
    /// clip.
    #[must_use]
    pub fn placement(&self, node: NodeId) -> Rigid2 {
        self.placements[node.index()]
    }

    /// Minimum number of frames from a node to an evasion's start, at rate 1, or `None` if no
    /// evasion can be reached. The first call computes it for all nodes.
    #[must_use]
    pub fn frames_to_evasion(&self, node: NodeId) -> Option<u32> {
        let all = self
            .frames_to_evasion
            .get_or_make(|| frames_to_evasion(&self.graph, &self.evasions));
        let frames = all[node.index()];
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

    /// Returns the same graph with other maps of the same evasions and attacks.
    pub(super) fn with_atlas(&self, atlas: RegionAtlas) -> Self {
        let mut other = Self {
            atlas,
            ..self.clone()
        };
        other.derive_from_maps();
        other
    }
}

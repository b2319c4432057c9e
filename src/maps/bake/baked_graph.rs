//! The immutable result of a bake: everything that a query needs.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::anim::{Facing, JointTransform, Pose, forward_kinematics};
use crate::graph::{EdgeId, Entry, Motion, MotionGraph, NodeId, Playhead};
use crate::maps::entries::{EntryReport, EntryTable, KnownEntry, Stance, TargetStances};
use crate::maps::grid::{Grid, GridCells, PathTable, Retimable};
use crate::maps::regions::{
    AttackMove, Body, BodyRows, BodySphere, BodyTrack, BoundingCylinder, ClipCylinders, Evasion,
    EvasionTracks, MovingSphere, RegionAtlas, RegionId, Slab, attack_spheres, attacking,
};
use crate::math::{Rigid2, in_parallel};

/// The immutable result of a bake: everything that a query needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BakedGraph {
    pub(super) graph: MotionGraph,
    pub(super) body: Body,
    pub(super) atlas: RegionAtlas,
    /// Allowed rate changes of each edge.
    pub(super) retimable: Vec<Retimable>,
    pub(super) evasions: Vec<Evasion>,
    #[serde(rename = "strikes")]
    pub(super) attack_moves: Vec<AttackMove>,
    pub(super) entries: EntryTable,
    pub(super) paths: PathTable,
    /// Side of a cell of the grid, in metres.
    pub(super) grid_cell: f32,
    pub(super) cylinders: ClipCylinders,
    /// The largest horizontal acceleration of the centre of mass that motions may have, in metres per second squared.
    pub(super) push_limit: f32,
    #[serde(skip)]
    pub(super) derived: Derived,
}

/// What is computed from the rest of a graph and not stored in files.
#[derive(Clone, Debug, Default)]
pub(super) struct Derived {
    /// Character's frame at each node, in the space of the node's clip.
    pub(super) placements: Vec<Rigid2>,
    /// Maximum distance of any part of the body from the root, in metres.
    pub(super) reach: f32,
    pub(super) body_rows: BodyRows,
    pub(super) grid: GridCells,
    pub(super) tracks: EvasionTracks,
    pub(super) stances: TargetStances,
    /// Number of texels of each region's evasion maps, by slab.
    pub(super) evasion_texels: Vec<Vec<u32>>,
    /// Shared by clones, and by graphs that differ in their maps alone: what is cached by it are poses of the body.
    pub(super) identity: Arc<()>,
}

impl PartialEq for Derived {
    /// Equal graphs have equal derived data.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl BakedGraph {
    /// Distinguishes the motion, paths and body of this graph from those of all others, by its address: what is cached for one is not used
    /// for another.
    pub(crate) fn identity(&self) -> &Arc<()> {
        &self.derived.identity
    }

    /// The motion graph.
    pub fn graph(&self) -> &MotionGraph {
        &self.graph
    }

    /// The largest horizontal acceleration of the body's centre of mass over a tenth of a second that an answer's motion may have, learnt from
    /// the clips, in metres per second squared.
    pub fn push_limit(&self) -> f32 {
        self.push_limit
    }

    /// Spheres and props of the body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Maps of all evasions and attacks.
    pub fn atlas(&self) -> &RegionAtlas {
        &self.atlas
    }

    /// Allowed rate changes of an edge.
    pub fn retimable(&self, edge: EdgeId) -> Retimable {
        self.retimable[edge.index()]
    }

    /// All evasions, sorted by edge.
    pub fn evasions(&self) -> &[Evasion] {
        &self.evasions
    }

    /// All attacks, sorted by edge.
    pub fn attack_moves(&self) -> &[AttackMove] {
        &self.attack_moves
    }

    /// Spheres of an attack over time, in the character's frame at the attack's start. Time 0 is
    /// the start.
    pub fn attack_spheres(&self, attack: &AttackMove) -> Vec<MovingSphere> {
        let spheres = |event| attack_spheres(&self.graph, &self.body, self.graph.event(event));
        let event = self.graph.edge(attack.edge).event;
        event.map_or_else(Vec::new, spheres)
    }

    /// The spheres of the body and its props that strike in an attack.
    pub(crate) fn attacking_spheres(&self, attack: &AttackMove) -> Vec<BodySphere> {
        let event = self.graph.edge(attack.edge).event;
        let event = event.map(|event| self.graph.event(event));
        event.map_or_else(Vec::new, |event| {
            attacking(self.graph.skeleton(), &self.body, event)
        })
    }

    /// Paths from each node to evasions.
    pub fn paths(&self) -> &PathTable {
        &self.paths
    }

    /// The cells that the body vacates when it takes a path.
    pub fn grid(&self) -> Grid<'_> {
        Grid {
            cells: &self.derived.grid,
            graph: &self.graph,
            body: &self.body,
            evasions: &self.evasions,
            tracks: &self.derived.tracks,
        }
    }

    /// Body spheres before, during and after an evasion, by its index in [`BakedGraph::evasions`].
    pub fn track(&self, evasion: usize) -> &BodyTrack {
        let tracks = &self.derived.tracks;
        tracks.get(&self.graph, &self.body, &self.evasions, evasion)
    }

    /// Entries into evasions at a moment of a motion, at playback rate 1.
    pub fn entries_at(&self, motion: &Motion, seconds: f32) -> Vec<Entry> {
        let stance = self.stance_at(motion, seconds);
        let known = self.known_entries(motion.playhead(&self.graph, seconds));
        let entry = |known: &KnownEntry| {
            let index = usize::from(known.target);
            let target = self.entries.targets[index];
            Entry {
                edge: target.edge,
                frame: target.edge_frame as f32,
                clip_to_world: stance.align(self.entry_stance(index), known.pin()),
                rate: 1.0,
                blend: known.blend(),
            }
        };
        known.iter().map(entry).collect()
    }

    /// Exits back into natural motion at a moment of a motion, also inside an evasion or an attack. The exit that changes the motion least
    /// comes first. Play one with [`Motion::enter`].
    pub fn exits_at(&self, motion: &Motion, seconds: f32) -> Vec<Entry> {
        let stance = self.stance_at(motion, seconds);
        let playhead = motion.playhead(&self.graph, seconds);
        self.exits(playhead, stance).collect()
    }

    /// [`BakedGraph::exits_at`] for a body with a stance.
    pub(crate) fn exits(
        &self,
        playhead: Playhead,
        stance: Stance,
    ) -> impl Iterator<Item = Entry> + '_ {
        let entries = &self.entries;
        let known = entries.at(&entries.exits, &self.graph, playhead).iter();
        known.map(move |known| {
            let index = usize::from(known.target);
            let target = entries.exit_targets[index];
            Entry {
                edge: target.edge,
                frame: target.edge_frame as f32,
                clip_to_world: stance.align(&self.derived.stances.exits[index], known.pin()),
                rate: 1.0,
                blend: known.exit_blend(),
            }
        })
    }

    fn known_entries(&self, playhead: Playhead) -> &[KnownEntry] {
        let entries = &self.entries;
        entries.at(&entries.entries, &self.graph, playhead)
    }

    fn stance_at(&self, motion: &Motion, seconds: f32) -> Stance {
        let (mut pose, mut joints) = (Pose::default(), Vec::new());
        motion.sample(&self.graph, seconds, &mut pose);
        forward_kinematics(self.graph.skeleton(), &pose, &mut joints);
        self.stance(&joints)
    }

    /// Whether an evasion can be entered from a moment of the graph.
    pub fn has_entries_at(&self, playhead: Playhead) -> bool {
        !self.known_entries(playhead).is_empty()
    }

    /// Maximum angular speed of each joint in an entry, in radians per second.
    pub fn entry_joint_speeds(&self) -> &[f32] {
        &self.entries.limits.joint_speed
    }

    /// Statistics of the entries.
    pub fn entry_report(&self) -> EntryReport {
        self.entries.report(&self.graph)
    }

    /// Jumps into evasions that need no edge, by moment.
    pub(crate) fn entries(&self) -> &EntryTable {
        &self.entries
    }

    /// Stance of a body, for [`Stance::align`].
    pub(crate) fn stance(&self, joints: &[JointTransform]) -> Stance {
        let found = || Facing::of(self.graph.skeleton());
        let facing = self.derived.stances.facing.unwrap_or_else(found);
        Stance::from_joints(&self.graph, facing, joints)
    }

    /// Stance at an entry's target, in the space of its clip.
    pub(crate) fn entry_stance(&self, target: usize) -> &Stance {
        &self.derived.stances.entries[target]
    }

    /// Evasion that plays on an edge, or `None` if the edge is not an evasion.
    pub fn evasion(&self, edge: EdgeId) -> Option<&Evasion> {
        let index = self
            .evasions
            .binary_search_by_key(&edge, |evasion| evasion.edge);
        Some(&self.evasions[index.ok()?])
    }

    /// Maximum distance of any part of the body from the root joint, in metres.
    pub fn reach(&self) -> f32 {
        self.derived.reach
    }

    /// Number of texels in an evasion map, which is the most that an attack can cover there.
    pub fn evasion_texels(&self, region: RegionId, slab: Slab) -> u32 {
        let first = self.atlas.region(region).first_slab;
        let texels = &self.derived.evasion_texels[region.index()];
        let index = slab.0.checked_sub(first.0).map(usize::try_from);
        let texels = index
            .and_then(Result::ok)
            .and_then(|index| texels.get(index));
        texels.copied().unwrap_or(0)
    }

    /// Spheres of the body in the row layout of a [`BodyTrack`].
    pub(crate) fn body_rows(&self) -> &BodyRows {
        &self.derived.body_rows
    }

    /// Cylinder around the body at a frame of an edge, in the space of the clip in which the edge
    /// starts. It may be a few centimetres too narrow where a transition bends the body outwards.
    pub(crate) fn bounding_cylinder(&self, edge: EdgeId, frame: f32) -> BoundingCylinder {
        self.cylinders.at(&self.graph, edge, frame)
    }

    /// Character's frame (root on the ground, facing +Z) at a node, in the space of the node's
    /// clip.
    pub fn placement(&self, node: NodeId) -> Rigid2 {
        self.derived.placements[node.index()]
    }

    /// Share of the frames of all clips from which an evasion can start within `seconds`, at rate
    /// 1.
    pub fn responsive_share(&self, seconds: f64) -> f64 {
        let all = self.graph.responsiveness_within(&[seconds], false, 1);
        all[0].share
    }

    /// Computes everything that queries otherwise compute on first use: for each evasion the body's spheres over time and the cells that
    /// it vacates, and the paths from some nodes. That takes a few milliseconds for each evasion, divided among all CPU cores. Graphs with
    /// at most 32 evasions are prepared when they are baked or loaded. For larger graphs, call this on any thread if queries must not take
    /// that time or allocate memory. Answers do not depend on it.
    pub fn prepare(&self) {
        let _span = tracing::trace_span!("bake: prepare evasions").entered();
        let _ = self.graph.rig();
        in_parallel(0, self.evasions.len(), |evasion| {
            let _ = self.track(evasion);
        });
        self.paths.prepare();
        self.grid().prepare();
    }
}

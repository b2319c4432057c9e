//! The maps of events that a later bake takes over.
//!
//! The maps of an attack depend on its clip, the body and the grid. The maps of an evasion also depend on the motion after it. They are
//! taken over if that motion stays in the evasion's clip and the graph's nodes divide the clip as before.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::drawings::DrawingSource;
use super::region_maps::{AttackMaps, RegionMaps};
use super::{Body, BodyTrack, MapGrid};
use crate::anim::{EventKind, JointId};
use crate::graph::{ClipMatch, EdgeId, EdgeMotion, GraphEvent, Motion, Playhead};
use crate::math::Rigid2;

/// Body and grid that the maps of a bake are drawn for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct MapBasis {
    pub(super) body: Body,
    pub(super) grid: MapGrid,
}

/// The maps of all events of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct MapRecord {
    basis: Option<MapBasis>,
    maps: Vec<(MapKey, EventMaps)>,
}

/// The maps of an event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum EventMaps {
    Evasion(RegionMaps),
    Attack(AttackMaps),
}

impl EventMaps {
    /// Whether these can be the maps of an event of a kind. It checks maps that come from a file.
    fn are_sound(&self, kind: EventKind, slices: u32) -> bool {
        match self {
            Self::Evasion(maps) => kind == EventKind::Evasion && maps.is_sound(slices),
            Self::Attack(maps) => kind == EventKind::Attack && maps.is_sound(),
        }
    }
}

/// Inputs that the maps of an event depend on, besides the contents of its clip.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct MapKey {
    kind: EventKind,
    clip: u32,
    /// First and last frame of the event.
    frames: [u32; 2],
    joints: Vec<JointId>,
    /// First frame and number of frames of each edge that an evasion's motion plays.
    edges: Vec<[u32; 2]>,
}

impl MapKey {
    /// The key of an event's maps. Returns `None` if they depend on other clips too.
    pub(super) fn new(source: DrawingSource<'_>, edge: EdgeId, event: &GraphEvent) -> Option<Self> {
        /// Maximum time by which a track is longer than requested, in seconds.
        const LONGER: f32 = 2.0 / BodyTrack::RATE;
        let graph = source.graph;
        let mut key = Self {
            kind: event.kind,
            clip: event.clip.0,
            frames: [event.first, event.last],
            joints: event.joints.clone(),
            edges: Vec::new(),
        };
        if event.kind == EventKind::Evasion {
            let playhead = Playhead {
                edge,
                frame: 0.0,
                clip_to_world: Rigid2::IDENTITY,
            };
            let mut motion = Motion::new(graph, playhead, &[]);
            motion.extend(graph, source.seconds(edge) + LONGER);
            for edge in motion.edges().map(|edge| graph.edge(edge)) {
                let from = graph.node(edge.from);
                let is_own = edge.motion == EdgeMotion::Clip && from.clip == event.clip;
                is_own.then(|| key.edges.push([from.frame, edge.frames]))?;
            }
        }
        Some(key)
    }
}

/// The maps that an earlier bake drew, by their keys.
#[derive(Debug, Default)]
pub(super) struct KnownMaps(FxHashMap<MapKey, EventMaps>);

impl KnownMaps {
    /// Takes over the maps of a record if they are drawn for the same body and grid.
    pub(super) fn onto(record: MapRecord, clips: &ClipMatch, basis: &MapBasis) -> Self {
        if record.basis.as_ref() != Some(basis) {
            return Self::default();
        }
        let slices = basis.grid.slices;
        let maps = record.maps.into_iter().filter_map(|(key, maps)| {
            let clip = clips.now(key.clip)?;
            let is_sound = maps.are_sound(key.kind, slices);
            is_sound.then_some((MapKey { clip, ..key }, maps))
        });
        Self(maps.collect())
    }

    pub(super) fn of(&self, key: &MapKey) -> Option<&EventMaps> {
        self.0.get(key)
    }
}

impl MapRecord {
    /// Records the maps of a body on a grid.
    pub(super) fn new(basis: MapBasis, maps: Vec<(MapKey, EventMaps)>) -> Self {
        Self {
            basis: Some(basis),
            maps,
        }
    }
}

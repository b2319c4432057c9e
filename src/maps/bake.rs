//! Bakes a motion graph into the data that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The caller may draw the maps with any rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] list the drawings, and
//! [`Baker::finish`] takes the drawn maps.

use serde::{Deserialize, Serialize};

use super::bake_settings::{BakeError, BakeSettings};
use super::baked::BakedParts;
use super::collect::{DrawingOwner, DrawnMaps, MapCollector};
use super::drawings::{self, DrawingSource, EventDrawings, TooHigh};
use super::entries::{EarlierEntries, EntryRecord, EntrySearch, MomentShare};
use super::map_record::{EventMaps, KnownMaps, MapBasis, MapKey, MapRecord};
use super::raster;
use super::retime::retimable_edges;
use super::{
    AttackMove, BakedGraph, BitMap, Body, Drawing, EntryTable, Evasion, MapGrid, MapRect,
    RegionAtlas, RegionId,
};
use crate::anim::EventKind;
use crate::graph::watch::{BakeWatch, Recorded, Unwatched};
use crate::graph::{ClipMatch, EdgeId, GraphEvent, MotionGraph};
use crate::math::{Rigid2, in_parallel};

/// A bake whose drawings are prepared and whose maps are not yet drawn.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    /// Edges of all evasions.
    evasions: Vec<EdgeId>,
    attacks: Vec<EdgeId>,
    every_frame: Vec<Drawing>,
    any_frame: Vec<Drawing>,
    collector: MapCollector,
    /// Key of the maps of each event, evasions first. `None` if the maps depend on other clips too.
    keys: Vec<Option<MapKey>>,
    earlier: EarlierEntries,
}

/// Maps and tests of entries that a later bake takes over.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableRecord {
    /// Tests of entries, exits and layers.
    pub entries: EntryRecord,
    maps: MapRecord,
}

impl From<EntryRecord> for TableRecord {
    fn from(entries: EntryRecord) -> Self {
        Self {
            entries,
            ..Self::default()
        }
    }
}

/// Record of an earlier bake, and the clips that both bakes have in common.
#[derive(Clone, Debug, Default)]
pub struct EarlierTables {
    /// Maps and tests of the earlier bake.
    pub record: TableRecord,
    /// Clips that both bakes have in common.
    pub clips: ClipMatch,
}

/// An event whose maps are known or whose drawings are prepared.
enum Prepared {
    Known(EventMaps),
    New(EventDrawings),
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// A setting is out of range, or an event's maps would be too large.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
        Self::onto(graph, settings, EarlierTables::default())
    }

    /// Like [`Baker::new`], but takes over the maps and the tests of an earlier bake. The baked graph is the same.
    ///
    /// # Errors
    /// The errors of [`Baker::new`].
    #[doc(hidden)]
    pub fn onto(
        graph: MotionGraph,
        settings: BakeSettings,
        earlier: EarlierTables,
    ) -> Result<Self, BakeError> {
        let EarlierTables { record, clips } = earlier;
        let maps = settings.maps;
        if !maps.is_sound() {
            return Err(BakeError::Grid {
                texel: maps.texel,
                attack_pitch: maps.attack_pitch,
                slab_height: maps.slab_height,
                slices: maps.slices,
                slice_seconds: maps.slice_seconds,
            });
        }
        settings.check_numbers()?;
        let mut body = settings
            .body
            .clone()
            .unwrap_or_else(|| Body::from_bones(graph.skeleton()));
        for (index, prop) in settings.props.iter().enumerate() {
            if !prop.is_sound(graph.skeleton()) {
                return Err(BakeError::Prop(index));
            }
            body.hold(prop.clone());
        }
        if !body.is_sound(graph.skeleton()) {
            return Err(BakeError::Body);
        }
        let mut baker = Self {
            evasions: edges_of(&graph, EventKind::Evasion),
            attacks: edges_of(&graph, EventKind::Attack),
            body,
            settings,
            every_frame: Vec::new(),
            any_frame: Vec::new(),
            collector: MapCollector::new(maps),
            keys: Vec::new(),
            earlier: EarlierEntries::default(),
            graph,
        };
        let known = KnownMaps::onto(record.maps, &clips, &baker.map_basis());
        for (kind, key, prepared) in baker.events(&known)? {
            baker.keys.push(key);
            baker.add(kind, prepared);
        }
        baker.earlier = EarlierEntries {
            record: record.entries,
            clips,
        };
        Ok(baker)
    }

    /// Adds an event.
    fn add(&mut self, kind: EventKind, prepared: Prepared) {
        let drawings = match prepared {
            Prepared::Known(maps) => return self.collector.known(maps),
            Prepared::New(drawings) => drawings,
        };
        let collector = &mut self.collector;
        let event = collector.event(kind, &drawings);
        for (part, drawing) in drawings.every_frame {
            collector.every_frame.push(DrawingOwner { event, part });
            self.every_frame.push(drawing);
        }
        for (part, drawing) in drawings.any_frame {
            collector.any_frame.push(DrawingOwner { event, part });
            self.any_frame.push(drawing);
        }
    }

    /// Prepares the drawings of all events whose maps are not known, evasions first.
    fn events(
        &self,
        known: &KnownMaps,
    ) -> Result<Vec<(EventKind, Option<MapKey>, Prepared)>, BakeError> {
        let source = DrawingSource {
            graph: &self.graph,
            body: &self.body,
            grid: self.settings.maps,
        };
        let edges: Vec<EdgeId> = self.evasions.iter().chain(&self.attacks).copied().collect();
        let prepared = in_parallel(self.settings.threads, edges.len(), |index| {
            let edge = edges[index];
            let kind = match index < self.evasions.len() {
                true => EventKind::Evasion,
                false => EventKind::Attack,
            };
            let Some(event) = self.graph.edge(edge).event else {
                return Ok((kind, None, Prepared::New(EventDrawings::default())));
            };
            let event = self.graph.event(event);
            let key = MapKey::new(source, edge, event);
            if let Some(maps) = key.as_ref().and_then(|key| known.of(key)) {
                return Ok((kind, key, Prepared::Known(maps.clone())));
            }
            let drawings = match kind {
                EventKind::Evasion => drawings::of_evasion(source, edge, event),
                EventKind::Attack => drawings::of_attack(source, event),
            };
            let drawings = self.checked(event, drawings)?;
            Ok((kind, key, Prepared::New(drawings)))
        });
        prepared.into_iter().collect()
    }

    /// Returns an error if the drawings do not fit fixed-point maps.
    fn checked(
        &self,
        event: &GraphEvent,
        drawings: Result<EventDrawings, TooHigh>,
    ) -> Result<EventDrawings, BakeError> {
        let describe = || self.graph.describe_event(event);
        let drawings = drawings.map_err(|TooHigh { low, high }| BakeError::TooHigh {
            event: describe(),
            low,
            high,
        })?;
        let mut all = drawings.every_frame.iter().chain(&drawings.any_frame);
        if let Some((_, large)) = all.find(|(_, drawing)| !drawing.rect.fits()) {
            let MapRect { width, height, .. } = large.rect;
            return Err(BakeError::MapTooLarge {
                event: describe(),
                width,
                height,
            });
        }
        Ok(drawings)
    }

    /// Drawings for [`raster::every_frame`] or its GPU counterpart. Each evasion has, slab by slab,
    /// one drawing of the whole evasion and, if the maps are timed, one of each slice.
    #[must_use]
    #[doc(hidden)]
    pub fn every_frame_drawings(&self) -> &[Drawing] {
        &self.every_frame
    }

    /// Drawings for [`raster::any_frame`] or its GPU counterpart. They hold, slab by slab,
    /// everything that the body may touch in each slice of an evasion, and everything that an
    /// attack passes.
    #[must_use]
    #[doc(hidden)]
    pub fn any_frame_drawings(&self) -> &[Drawing] {
        &self.any_frame
    }

    /// Draws all maps on the CPU.
    #[must_use]
    #[doc(hidden)]
    pub fn draw_on_cpu(&self) -> DrawnMaps {
        let _span = tracing::trace_span!("bake: draw maps").entered();
        let threads = self.settings.threads;
        let (every, any) = (&self.every_frame, &self.any_frame);
        DrawnMaps {
            every_frame: in_parallel(threads, every.len(), |i| raster::every_frame(&every[i])),
            any_frame: in_parallel(threads, any.len(), |i| raster::any_frame(&any[i])),
        }
    }

    /// Draws all maps on the CPU and finishes the bake.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`].
    pub fn finish_on_cpu(self) -> Result<BakedGraph, BakeError> {
        let maps = self.draw_on_cpu();
        self.finish(maps)
    }

    /// Finishes the bake with one map for each drawing.
    ///
    /// # Errors
    /// The number of maps differs from the number of drawings, or a map's rectangle differs from
    /// its drawing's.
    #[doc(hidden)]
    pub fn finish(self, maps: DrawnMaps) -> Result<BakedGraph, BakeError> {
        let finished = self.finish_recorded(maps, &Unwatched)?;
        finished.made.ok_or(BakeError::Stopped)
    }

    /// Finishes the bake like [`Baker::finish`], and returns a record for [`Baker::onto`], too.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`].
    #[doc(hidden)]
    pub fn finish_recorded(
        mut self,
        maps: DrawnMaps,
        watch: &dyn BakeWatch,
    ) -> Result<Recorded<BakedGraph, TableRecord>, BakeError> {
        let maps = self.gathered(&maps)?;
        let keys = std::mem::take(&mut self.keys);
        let recorded = keys
            .into_iter()
            .zip(&maps)
            .filter_map(|(key, maps)| Some((key?, maps.clone())))
            .collect();
        let recorded = MapRecord::new(self.map_basis(), recorded);
        let atlas = self.atlas(maps);
        let attacks = self.attacks.iter();
        let attack_moves = attacks
            .map(|&edge| AttackMove {
                edge,
                placement: placement(&self.graph, edge),
            })
            .collect();
        let settings = &self.settings;
        let retimable = retimable_edges(&self.graph, &settings.retime, settings.threads);
        let evasions = evasions_of(&self.graph, &self.evasions);
        let search = EntrySearch {
            graph: &self.graph,
            evasions: &evasions,
            settings: &self.settings.entries,
            threads: self.settings.threads,
            earlier: &self.earlier,
            watch,
        };
        let found = {
            let _span = tracing::trace_span!("bake: find entries").entered();
            EntryTable::find(search)
        };
        let record = TableRecord {
            entries: found.record,
            maps: recorded,
        };
        let Some(entries) = found.made else {
            return Ok(Recorded { made: None, record });
        };
        let parts = BakedParts {
            graph: self.graph,
            body: self.body,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
        };
        let made = Some(BakedGraph::new(
            parts,
            &self.settings.paths,
            self.settings.grid,
        ));
        Ok(Recorded { made, record })
    }

    /// The maps of all events.
    fn gathered(&self, maps: &DrawnMaps) -> Result<Vec<EventMaps>, BakeError> {
        let every = maps.every_frame.iter().map(|maps| maps.body.rect());
        check(every, &self.every_frame)?;
        check(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        Ok(self.collector.gather(maps))
    }

    fn map_basis(&self) -> MapBasis {
        MapBasis {
            body: self.body.clone(),
            grid: self.settings.maps,
        }
    }

    fn atlas(&self, maps: Vec<EventMaps>) -> RegionAtlas {
        let (mut regions, mut attacks) = (Vec::new(), Vec::new());
        for maps in maps {
            match maps {
                EventMaps::Evasion(maps) => regions.push(maps),
                EventMaps::Attack(maps) => attacks.push(maps),
            }
        }
        RegionAtlas::new(self.settings.maps, regions, attacks)
    }
}

impl MomentShare {
    /// Tests the entries of this share of the moments of a graph. [`EntryRecord::of_shares`] puts the records of all shares together, and
    /// [`Baker::onto`] takes that over. Returns `None` if the tests were stopped.
    #[must_use]
    #[doc(hidden)]
    pub fn test_entries(
        self,
        graph: &MotionGraph,
        settings: &BakeSettings,
        watch: &dyn BakeWatch,
    ) -> Option<EntryRecord> {
        let evasions = evasions_of(graph, &edges_of(graph, EventKind::Evasion));
        let search = EntrySearch {
            graph,
            evasions: &evasions,
            settings: &settings.entries,
            threads: settings.threads,
            earlier: &EarlierEntries::default(),
            watch,
        };
        EntryRecord::of_share(self, search).ok()
    }
}

/// The edges of all events of a kind.
fn edges_of(graph: &MotionGraph, kind: EventKind) -> Vec<EdgeId> {
    graph.edges_with(kind).map(|(edge, _)| edge).collect()
}

/// The evasions that some edges play. Each has the region with its index.
fn evasions_of(graph: &MotionGraph, edges: &[EdgeId]) -> Vec<Evasion> {
    let regions = (0..).map(RegionId);
    let evasion = |(&edge, region)| Evasion {
        edge,
        region,
        placement: placement(graph, edge),
    };
    edges.iter().zip(regions).map(evasion).collect()
}

/// The character's frame at an edge's start, in the space of its clip.
fn placement(graph: &MotionGraph, edge: EdgeId) -> Rigid2 {
    let from = graph.node(graph.edge(edge).from);
    graph.placement(from.clip, from.frame)
}

impl BakedGraph {
    /// Returns the same graph and paths with maps of another grid, drawn on the CPU.
    ///
    /// # Errors
    /// The grid is out of range, or an event's maps would be too large.
    pub fn with_maps(&self, maps: MapGrid) -> Result<Self, BakeError> {
        let settings = BakeSettings {
            maps,
            body: Some(self.body().clone()),
            ..BakeSettings::default()
        };
        let baker = Baker::new(self.graph().clone(), settings)?;
        let maps = baker.gathered(&baker.draw_on_cpu())?;
        Ok(self.with_atlas(baker.atlas(maps)))
    }
}

/// Checks that the maps have the rectangles of the drawings.
fn check(
    rects: impl ExactSizeIterator<Item = MapRect>,
    drawings: &[Drawing],
) -> Result<(), BakeError> {
    let (found, expected) = (rects.len(), drawings.len());
    let fitting = rects
        .zip(drawings)
        .filter(|(rect, drawing)| *rect == drawing.rect)
        .count();
    if found == expected && fitting == expected {
        Ok(())
    } else {
        Err(BakeError::Maps {
            found: fitting,
            expected,
        })
    }
}

//! Bakes a motion graph into the data that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The caller may draw the maps with any rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] list the drawings, and
//! [`Baker::finish`] takes the drawn maps.

use super::bake_settings::{BakeError, BakeSettings};
use super::baked::BakedParts;
use super::collect::{DrawingOwner, DrawnMaps, EventMaps, MapCollector};
use super::drawings::{self, DrawingSource, EventDrawings, TooHigh};
use super::entries::{EntrySearch, EntryShare, MomentShare};
use super::grid::retimable_edges;
use super::raster;
use super::{
    AttackMove, BakedGraph, BitMap, Body, Drawing, EntryTable, Evasion, MapGrid, MapRect,
    RegionAtlas, RegionId,
};
use crate::anim::EventKind;
use crate::graph::watch::{BakeWatch, Unwatched};
use crate::graph::{EdgeId, GraphEvent, MotionGraph};
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
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// A setting is out of range, or an event's maps would be too large.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
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
            graph,
        };
        for (kind, drawings) in baker.events()? {
            baker.add(kind, drawings);
        }
        Ok(baker)
    }

    /// Adds an event.
    fn add(&mut self, kind: EventKind, drawings: EventDrawings) {
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

    /// Prepares the drawings of all events, evasions first.
    fn events(&self) -> Result<Vec<(EventKind, EventDrawings)>, BakeError> {
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
                return Ok((kind, EventDrawings::default()));
            };
            let event = self.graph.event(event);
            let drawings = match kind {
                EventKind::Evasion => drawings::of_evasion(source, edge, event),
                EventKind::Attack => drawings::of_attack(source, event),
            };
            Ok((kind, self.checked(event, drawings)?))
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
        self.finish_watched(maps, Vec::new(), &Unwatched)
    }

    /// Finishes the bake like [`Baker::finish`]. If `entries` holds all shares that [`MomentShare::find_entries`] found, in order, they are
    /// not searched again.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`], the watch stopped the bake, or the entries are not those of the graph.
    #[doc(hidden)]
    pub fn finish_watched(
        self,
        maps: DrawnMaps,
        entries: Vec<EntryShare>,
        watch: &dyn BakeWatch,
    ) -> Result<BakedGraph, BakeError> {
        let maps = self.gathered(&maps)?;
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
            watch,
        };
        let entries = {
            let _span = tracing::trace_span!("bake: find entries").entered();
            EntryTable::find(search, entries)?
        };
        if entries.check(&self.graph, &evasions).is_err() {
            return Err(BakeError::Entries);
        }
        let parts = BakedParts {
            graph: self.graph,
            body: self.body,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
        };
        let settings = &self.settings;
        Ok(BakedGraph::new(parts, &settings.paths, settings.grid))
    }

    /// The maps of all events.
    fn gathered(&self, maps: &DrawnMaps) -> Result<Vec<EventMaps>, BakeError> {
        let every = maps.every_frame.iter().map(|maps| maps.body.rect());
        check(every, &self.every_frame)?;
        check(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        Ok(self.collector.gather(maps))
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
    /// Finds the entries of this share of the moments of a graph, for [`Baker::finish_watched`].
    ///
    /// # Errors
    /// The watch stopped the search.
    #[doc(hidden)]
    pub fn find_entries(
        self,
        graph: &MotionGraph,
        settings: &BakeSettings,
        watch: &dyn BakeWatch,
    ) -> Result<EntryShare, BakeError> {
        let search = EntrySearch {
            graph,
            evasions: &evasions_of(graph, &edges_of(graph, EventKind::Evasion)),
            settings: &settings.entries,
            threads: settings.threads,
            watch,
        };
        Ok(EntryShare::find(search, self)?)
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

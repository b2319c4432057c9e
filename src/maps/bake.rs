//! Bakes a motion graph into the data that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The caller may draw the maps with any rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] list the drawings, and
//! [`Baker::finish`] takes the drawn maps.

use super::bake_settings::{BakeError, BakeSettings};
use super::baked::BakedParts;
use super::collect::{DrawingOwner, DrawnMaps, Kind, MapCollector};
use super::drawings::{self, DrawingSource, EventDrawings, TooHigh};
use super::entries::{EarlierEntries, EntryRecord, EntrySearch};
use super::raster;
use super::retime::retimable_edges;
use super::{
    AttackMove, BakedGraph, BitMap, Body, Drawing, EntryTable, Evasion, MapGrid, MapRect,
    RegionAtlas, RegionId,
};
use crate::anim::EventKind;
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
    earlier: EarlierEntries,
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
        let of_kind = |kind| graph.edges_with(kind).map(|(edge, _)| edge).collect();
        let mut baker = Self {
            evasions: of_kind(EventKind::Evasion),
            attacks: of_kind(EventKind::Attack),
            body,
            settings,
            every_frame: Vec::new(),
            any_frame: Vec::new(),
            collector: MapCollector::new(maps),
            earlier: EarlierEntries::default(),
            graph,
        };
        for (kind, drawings) in baker.events()? {
            let event = baker.collector.event(kind, &drawings);
            for (part, drawing) in drawings.every_frame {
                baker
                    .collector
                    .every_frame
                    .push(DrawingOwner { event, part });
                baker.every_frame.push(drawing);
            }
            for (part, drawing) in drawings.any_frame {
                baker.collector.any_frame.push(DrawingOwner { event, part });
                baker.any_frame.push(drawing);
            }
        }
        Ok(baker)
    }

    /// Takes over the tests of an earlier bake, which has `clips`, too. The baked graph is the same.
    #[must_use]
    #[doc(hidden)]
    pub fn onto(self, record: EntryRecord, clips: ClipMatch) -> Self {
        Self {
            earlier: EarlierEntries { record, clips },
            ..self
        }
    }

    /// Prepares the drawings of all events, evasions first.
    fn events(&self) -> Result<Vec<(Kind, EventDrawings)>, BakeError> {
        let source = DrawingSource {
            graph: &self.graph,
            body: &self.body,
            grid: self.settings.maps,
        };
        let evasions = self.evasions.len();
        let count = evasions + self.attacks.len();
        let drawn = in_parallel(self.settings.threads, count, |index| {
            let (kind, edge) = match index.checked_sub(evasions) {
                None => (Kind::Evasion, self.evasions[index]),
                Some(attack) => (Kind::Attack, self.attacks[attack]),
            };
            let Some(event) = self.graph.edge(edge).event else {
                return Ok((kind, EventDrawings::default()));
            };
            let event = self.graph.event(event);
            let drawings = match kind {
                Kind::Evasion => drawings::of_evasion(source, edge, event),
                Kind::Attack => drawings::of_attack(source, event),
            };
            Ok((kind, self.checked(event, drawings)?))
        });
        drawn.into_iter().collect()
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
        let (baked, _) = self.finish_recorded(maps)?;
        Ok(baked)
    }

    /// Finishes the bake like [`Baker::finish`], and returns a record for [`Baker::onto`], too.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`].
    #[doc(hidden)]
    pub fn finish_recorded(self, maps: DrawnMaps) -> Result<(BakedGraph, EntryRecord), BakeError> {
        let atlas = self.atlas(&maps)?;
        let placement = |edge: EdgeId| -> Rigid2 {
            let from = self.graph.node(self.graph.edge(edge).from);
            self.graph.placement(from.clip, from.frame)
        };
        let regions = (0..).map(RegionId);
        let evasions = self.evasions.iter().zip(regions);
        let evasions = evasions
            .map(|(&edge, region)| Evasion {
                edge,
                region,
                placement: placement(edge),
            })
            .collect();
        let attacks = self.attacks.iter();
        let attack_moves = attacks
            .map(|&edge| AttackMove {
                edge,
                placement: placement(edge),
            })
            .collect();
        let retimable = retimable_edges(&self.graph, &self.settings.retime);
        let evasions: Vec<Evasion> = evasions;
        let search = EntrySearch {
            settings: &self.settings.entries,
            threads: self.settings.threads,
            earlier: &self.earlier,
        };
        let (entries, record) = {
            let _span = tracing::trace_span!("bake: find entries").entered();
            EntryTable::find(&self.graph, &evasions, search)
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
        let baked = BakedGraph::new(parts, &self.settings.paths, self.settings.grid);
        Ok((baked, record))
    }

    fn atlas(&self, maps: &DrawnMaps) -> Result<RegionAtlas, BakeError> {
        let every = maps.every_frame.iter().map(|maps| maps.body.rect());
        check(every, &self.every_frame)?;
        check(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        let (regions, attacks) = self.collector.gather(maps);
        Ok(RegionAtlas::new(self.settings.maps, regions, attacks))
    }
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
        Ok(self.with_atlas(baker.atlas(&baker.draw_on_cpu())?))
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

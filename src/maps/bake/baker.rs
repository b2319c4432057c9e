//! Bakes a motion graph into the data that a query needs.
//!
//! Source: Masaoka & Oshita, sections 4.2–4.4. The caller may draw the maps with any rasterizer:
//! [`Baker::every_frame_drawings`] and [`Baker::any_frame_drawings`] list the drawings, and
//! [`Baker::finish`] takes the drawn maps.

use super::baked_graph::{BakedGraph, Derived};
use super::drawings::{EventDrawings, attack_drawings, evasion_drawings};
use super::settings::{BakeError, BakeSettings};
use crate::anim::EventKind;
use crate::graph::push::push_limit;
use crate::graph::watch::{BakeWatch, Unwatched};
use crate::graph::{EdgeId, MotionGraph};
use crate::maps::entries::{EntryShare, EntryTable, MomentShare};
use crate::maps::grid::{GridCells, find_paths, retimable_edges};
use crate::maps::regions::{
    AttackMaps, AttackMove, BitMap, Body, ClipCylinders, Drawing, Evasion, EvasionMaps, MapGrid,
    MapRect, MaskMap, RegionAtlas, RegionId, RegionMaps, Slab, SlabMaps, pushes, raster,
};
use crate::math::{Rigid2, in_parallel};

/// Largest distance of a point of a limb's bone from the spheres that were made along it, in metres.
const MOST_BARE: f32 = 0.01;

/// The maps that a rasterizer drew for a [`Baker`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawnMaps {
    /// Maps of [`Baker::every_frame_drawings`], in order.
    pub every_frame: Vec<EvasionMaps>,
    /// Maps of [`Baker::any_frame_drawings`], in order.
    pub any_frame: Vec<BitMap>,
}

/// A bake whose drawings are prepared and whose maps are not yet drawn.
#[derive(Clone, Debug)]
pub struct Baker {
    graph: MotionGraph,
    body: Body,
    settings: BakeSettings,
    evasions: Vec<EdgeId>,
    attacks: Vec<EdgeId>,
    every_frame: Vec<Drawing>,
    any_frame: Vec<Drawing>,
    /// The parts of all events, evasions first. Their drawings are those above, event by event.
    events: Vec<EventDrawings>,
}

impl Baker {
    /// Prepares the drawings of all events of `graph`.
    ///
    /// # Errors
    /// A setting is out of range, or an event's maps would be too large.
    pub fn new(graph: MotionGraph, settings: BakeSettings) -> Result<Self, BakeError> {
        let maps = settings.maps;
        if !maps.is_sound() {
            return Err(BakeError::Grid(maps));
        }
        settings.check_numbers()?;
        let own = settings.body.clone();
        let is_made = own.is_none();
        let mut body = own.unwrap_or_else(|| Body::from_bones(graph.skeleton()));
        let barest = is_made.then(|| body.barest_bone(graph.skeleton(), graph.clips()));
        let barest = barest.flatten().filter(|&(_, bare)| bare > MOST_BARE);
        if let Some((joint, metres)) = barest {
            let joint = graph.skeleton().joint(joint).name.clone();
            return Err(BakeError::BareBone { joint, metres });
        }
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
            events: Vec::new(),
            graph,
        };
        baker.events = baker.drawings()?;
        for event in &mut baker.events {
            baker.every_frame.append(&mut event.every_frame.1);
            baker.any_frame.append(&mut event.any_frame.1);
        }
        Ok(baker)
    }

    /// Prepares the drawings of all events, evasions first.
    fn drawings(&self) -> Result<Vec<EventDrawings>, BakeError> {
        let (graph, body, grid) = (&self.graph, &self.body, self.settings.maps);
        let edges: Vec<EdgeId> = self.evasions.iter().chain(&self.attacks).copied().collect();
        let prepared = in_parallel(self.settings.threads, edges.len(), |index| {
            let Some(event) = graph.edge(edges[index]).event else {
                return Ok(EventDrawings::default());
            };
            let event = graph.event(event);
            match index < self.evasions.len() {
                true => evasion_drawings(graph, body, grid, edges[index], event),
                false => attack_drawings(graph, body, grid, event),
            }
        });
        prepared.into_iter().collect()
    }

    /// Drawings for [`raster::every_frame`] or its GPU counterpart. Each evasion has, slab by slab,
    /// one drawing of the whole evasion and, if the maps are timed, one of each slice.
    pub fn every_frame_drawings(&self) -> &[Drawing] {
        &self.every_frame
    }

    /// Drawings for [`raster::any_frame`] or its GPU counterpart. They hold, slab by slab,
    /// everything that the body may touch in each slice of an evasion, and everything that an
    /// attack passes.
    pub fn any_frame_drawings(&self) -> &[Drawing] {
        &self.any_frame
    }

    /// Draws all maps on the CPU.
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
    pub fn finish(self, maps: DrawnMaps) -> Result<BakedGraph, BakeError> {
        self.finish_watched(maps, Vec::new(), &Unwatched)
    }

    /// Finishes the bake like [`Baker::finish`]. If `entries` holds all shares that [`MomentShare::find_entries`] found, in order, they are
    /// not searched again.
    ///
    /// # Errors
    /// The errors of [`Baker::finish`], the watch stopped the bake, or the entries are not those of the graph.
    pub fn finish_watched(
        self,
        maps: DrawnMaps,
        entries: Vec<EntryShare>,
        watch: &dyn BakeWatch,
    ) -> Result<BakedGraph, BakeError> {
        let atlas = self.atlas(&maps)?;
        let attack_move = |&edge: &EdgeId| AttackMove {
            edge,
            placement: placement(&self.graph, edge),
        };
        let attack_moves = self.attacks.iter().map(attack_move).collect();
        let settings = &self.settings;
        let retimable = retimable_edges(&self.graph, &settings.retime, settings.threads);
        let evasions = evasions_of(&self.graph, &self.evasions);
        let entries = match settings.without_entries || evasions.is_empty() {
            true => EntryTable::default(),
            false => {
                let _span = tracing::trace_span!("bake: find entries").entered();
                EntryTable::find(&self.graph, &evasions, entries, settings.threads, watch)?
            }
        };
        if entries.check(&self.graph, &evasions).is_err() {
            return Err(BakeError::Entries);
        }
        let placements = self.graph.placements();
        let paths = {
            let _span = tracing::trace_span!("bake: find paths").entered();
            let graph = &self.graph;
            find_paths(
                graph,
                &retimable,
                &placements,
                &self.evasions,
                &settings.paths,
            )
        };
        let cylinders = {
            let _span = tracing::trace_span!("bake: bounding cylinders").entered();
            ClipCylinders::new(&self.graph, &self.body)
        };
        let push_limit = push_limit(pushes(&self.graph, &self.body, settings.threads));
        let baked = BakedGraph {
            push_limit,
            atlas,
            retimable,
            evasions,
            attack_moves,
            entries,
            paths,
            grid_cell: GridCells::CELL,
            cylinders,
            derived: Derived {
                placements,
                reach: self.body.reach(self.graph.skeleton(), self.graph.clips()),
                ..Derived::default()
            },
            graph: self.graph,
            body: self.body,
        };
        let tables = baked.tables();
        Ok(baked.with_tables(tables))
    }

    /// Collects drawn maps into the maps of regions: all slices of a slab are merged into masks in the smallest rectangle.
    fn atlas(&self, maps: &DrawnMaps) -> Result<RegionAtlas, BakeError> {
        let rects = maps.every_frame.iter().map(|maps| maps.body.rect());
        check_rects(rects, &self.every_frame)?;
        check_rects(maps.any_frame.iter().map(BitMap::rect), &self.any_frame)?;
        let (mut every, mut any) = (maps.every_frame.iter(), maps.any_frame.iter());
        let (mut regions, mut attacks) = (Vec::new(), Vec::new());
        let grid = self.settings.maps;
        for (index, event) in self.events.iter().enumerate() {
            let mut slabs = vec![SlabDrawings::default(); event.slabs.count];
            for (part, maps) in event.every_frame.0.iter().zip(every.by_ref()) {
                let slab = &mut slabs[part.slab];
                match part.slice {
                    Some(slice) => slab.body.push((slice, &maps.body)),
                    None => {
                        slab.evasion = Some(&maps.evasion);
                        if !grid.is_timed() {
                            slab.body.push((0, &maps.body));
                        }
                    }
                }
            }
            for (part, map) in event.any_frame.0.iter().zip(any.by_ref()) {
                let slice = part.slice.unwrap_or(0);
                slabs[part.slab].outer.push((slice, map));
            }
            let first_slab = Slab(event.slabs.low);
            match index < self.evasions.len() {
                true => regions.push(RegionMaps {
                    first_slab,
                    slabs: slabs.iter().map(|slab| slab.region(grid)).collect(),
                    seconds: event.seconds,
                }),
                false => attacks.push(AttackMaps {
                    first_slab,
                    slabs: slabs.iter().map(SlabDrawings::attack).collect(),
                }),
            }
        }
        Ok(RegionAtlas::new(grid, regions, attacks))
    }
}

/// The drawn maps of one slab, each with its slice.
#[derive(Clone, Debug, Default)]
struct SlabDrawings<'a> {
    body: Vec<(u32, &'a BitMap)>,
    outer: Vec<(u32, &'a BitMap)>,
    evasion: Option<&'a BitMap>,
}

impl SlabDrawings<'_> {
    fn region(&self, grid: MapGrid) -> SlabMaps {
        SlabMaps {
            body: masks(&self.body, grid),
            outer: masks(&self.outer, grid),
            evasion: self
                .evasion
                .map_or_else(BitMap::default, |map| map.cropped(map.bounds())),
        }
    }

    fn attack(&self) -> BitMap {
        self.outer
            .first()
            .map_or_else(BitMap::default, |&(_, map)| map.clone())
    }
}

/// Merges the maps of all slices into one map of masks.
fn masks(slices: &[(u32, &BitMap)], grid: MapGrid) -> MaskMap {
    let bounds = slices.iter().map(|(_, map)| map.bounds());
    let rect = bounds.fold(MapRect::default(), MapRect::union);
    let mut masks = MaskMap::new(rect, grid.lanes());
    for &(slice, map) in slices {
        let (u, v) = (map.rect().u - rect.u, map.rect().v - rect.v);
        map.for_each(|column, row| masks.set(column + u, row + v, slice));
    }
    masks
}

impl MomentShare {
    /// Finds the entries of this share of the moments of a graph, for [`Baker::finish_watched`].
    ///
    /// # Errors
    /// The watch stopped the search.
    pub fn find_entries(
        self,
        graph: &MotionGraph,
        settings: &BakeSettings,
        watch: &dyn BakeWatch,
    ) -> Result<EntryShare, BakeError> {
        let evasions = evasions_of(graph, &edges_of(graph, EventKind::Evasion));
        if settings.without_entries || evasions.is_empty() {
            return Ok(EntryShare::default());
        }
        Ok(EntryShare::find(
            graph,
            &evasions,
            self,
            settings.threads,
            watch,
        )?)
    }
}

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
        self.with_drawn_maps(maps, |baker| Ok(baker.draw_on_cpu()))
    }

    /// Returns the same graph and paths with maps of another grid that `draw` draws, for example on a device.
    ///
    /// # Errors
    /// That of `draw`; those of [`BakedGraph::with_maps`]; the maps are not those of the baker's drawings.
    pub fn with_drawn_maps<E: From<BakeError>>(
        &self,
        maps: MapGrid,
        draw: impl FnOnce(&Baker) -> Result<DrawnMaps, E>,
    ) -> Result<Self, E> {
        let settings = BakeSettings {
            maps,
            body: Some(self.body().clone()),
            ..BakeSettings::default()
        };
        let baker = Baker::new(self.graph().clone(), settings)?;
        let mut other = self.clone();
        other.atlas = baker.atlas(&draw(&baker)?)?;
        other.derive_from_maps();
        Ok(other)
    }
}

/// Checks that the maps have the rectangles of the drawings.
fn check_rects(
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

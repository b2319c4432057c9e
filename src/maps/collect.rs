//! Collects drawn maps into the maps of regions. Each drawing is assigned to its event, slab and
//! slice, and all slices of a slab are merged into masks in the smallest rectangle.

use super::drawings::{EventDrawings, Part, SlabRange};
use super::regions::{AttackMaps, EvasionMaps, RegionMaps, SlabMaps};
use super::{BitMap, MapGrid, MapRect, MaskMap, Slab};
use crate::anim::EventKind;

/// The maps that a rasterizer drew for a [`Baker`](super::Baker).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawnMaps {
    /// Maps of [`Baker::every_frame_drawings`](super::Baker::every_frame_drawings), in order.
    pub every_frame: Vec<EvasionMaps>,
    /// Maps of [`Baker::any_frame_drawings`](super::Baker::any_frame_drawings), in order.
    pub any_frame: Vec<BitMap>,
}

/// Event and part that a drawing belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawingOwner {
    /// Index of the event among all events.
    pub event: usize,
    pub part: Part,
}

/// The maps of an event.
#[derive(Clone, Debug)]
pub(super) enum EventMaps {
    Evasion(RegionMaps),
    Attack(AttackMaps),
}

/// An event whose maps are drawn.
#[derive(Clone, Debug)]
struct PendingEvent {
    kind: EventKind,
    slabs: SlabRange,
    /// Time from the event's start that the slices cover, in seconds.
    seconds: f32,
}

/// All events of a bake, with the event of each drawing.
#[derive(Clone, Debug)]
pub(super) struct MapCollector {
    grid: MapGrid,
    events: Vec<PendingEvent>,
    /// Owner of each drawing. Drawings of one event are consecutive.
    pub every_frame: Vec<DrawingOwner>,
    pub any_frame: Vec<DrawingOwner>,
}

impl MapCollector {
    pub(super) fn new(grid: MapGrid) -> Self {
        Self {
            grid,
            events: Vec::new(),
            every_frame: Vec::new(),
            any_frame: Vec::new(),
        }
    }

    /// Adds an event whose maps will be drawn, and returns its index.
    pub(super) fn event(&mut self, kind: EventKind, drawings: &EventDrawings) -> usize {
        self.events.push(PendingEvent {
            kind,
            slabs: drawings.slabs,
            seconds: drawings.seconds,
        });
        self.events.len() - 1
    }

    /// Maps of all events. `maps` holds one map for each drawing.
    pub(super) fn gather(&self, maps: &DrawnMaps) -> Vec<EventMaps> {
        let mut every = self.every_frame.iter().zip(&maps.every_frame).peekable();
        let mut any = self.any_frame.iter().zip(&maps.any_frame).peekable();
        let mut of_event = |index: usize, count: usize| {
            let mut slabs = vec![SlabDrawings::default(); count];
            while let Some((member, maps)) = every.next_if(|(member, _)| member.event == index) {
                let slab = &mut slabs[member.part.slab];
                match member.part.slice {
                    Some(slice) => slab.body.push((slice, &maps.body)),
                    None => {
                        slab.evasion = Some(&maps.evasion);
                        if !self.grid.is_timed() {
                            slab.body.push((0, &maps.body));
                        }
                    }
                }
            }
            while let Some((member, map)) = any.next_if(|(member, _)| member.event == index) {
                let slice = member.part.slice.unwrap_or(0);
                slabs[member.part.slab].outer.push((slice, map));
            }
            slabs
        };
        let gathered = self.events.iter().enumerate().map(|(index, event)| {
            let PendingEvent {
                kind,
                slabs,
                seconds,
            } = *event;
            let first_slab = Slab(slabs.low);
            let slabs = of_event(index, slabs.count);
            match kind {
                EventKind::Evasion => EventMaps::Evasion(RegionMaps {
                    first_slab,
                    slabs: slabs.iter().map(|slab| slab.region(self.grid)).collect(),
                    seconds,
                }),
                EventKind::Attack => EventMaps::Attack(AttackMaps {
                    first_slab,
                    slabs: slabs.iter().map(SlabDrawings::attack).collect(),
                }),
            }
        });
        gathered.collect()
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

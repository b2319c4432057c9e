//! From single drawn maps to the maps of regions: which drawing is which slab's and slice's, and
//! all slices of a slab put together as masks in the smallest rectangle.

use super::drawings::{EventDrawings, Part};
use super::{AttackMaps, BitMap, DrawnMaps, MapGrid, MapRect, MaskMap, RegionMaps, Slab, SlabMaps};

/// What an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Evasion,
    Attack,
}

/// Whose map a drawing is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    /// Position among all events.
    pub event: usize,
    pub part: Part,
}

/// An event whose maps are awaited.
#[derive(Clone, Copy, Debug)]
struct Awaited {
    kind: Kind,
    first_slab: Slab,
    slabs: usize,
    seconds: f32,
}

/// All events of a bake, and which drawing belongs to which of them.
#[derive(Clone, Debug)]
pub(super) struct Gathering {
    grid: MapGrid,
    events: Vec<Awaited>,
    /// By drawing; those of one event stand together.
    pub every_frame: Vec<Member>,
    pub any_frame: Vec<Member>,
}

impl Gathering {
    pub(super) fn new(grid: MapGrid) -> Self {
        Self {
            grid,
            events: Vec::new(),
            every_frame: Vec::new(),
            any_frame: Vec::new(),
        }
    }

    /// Takes note of an event; returns its position.
    pub(super) fn event(&mut self, kind: Kind, drawings: &EventDrawings) -> usize {
        self.events.push(Awaited {
            kind,
            first_slab: Slab(drawings.slabs.0),
            slabs: drawings.slabs.1,
            seconds: drawings.seconds,
        });
        self.events.len() - 1
    }

    /// The maps of all evasions and of all attacks. `maps` has one for each member.
    pub(super) fn gather(&self, maps: &DrawnMaps) -> (Vec<RegionMaps>, Vec<AttackMaps>) {
        let mut every = self.every_frame.iter().zip(&maps.every_frame).peekable();
        let mut any = self.any_frame.iter().zip(&maps.any_frame).peekable();
        let (mut regions, mut attacks) = (Vec::new(), Vec::new());
        for (index, event) in self.events.iter().enumerate() {
            let mut slabs = vec![Drawn::default(); event.slabs];
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
            let first_slab = event.first_slab;
            match event.kind {
                Kind::Evasion => regions.push(RegionMaps {
                    first_slab,
                    slabs: slabs.iter().map(|slab| slab.region(self.grid)).collect(),
                    seconds: event.seconds,
                }),
                Kind::Attack => attacks.push(AttackMaps {
                    first_slab,
                    slabs: slabs.iter().map(Drawn::attack).collect(),
                }),
            }
        }
        (regions, attacks)
    }
}

/// What was drawn for a slab, by slice.
#[derive(Clone, Debug, Default)]
struct Drawn<'a> {
    body: Vec<(u32, &'a BitMap)>,
    outer: Vec<(u32, &'a BitMap)>,
    evasion: Option<&'a BitMap>,
}

impl Drawn<'_> {
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

/// One map of all slices.
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

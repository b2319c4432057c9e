//! The attack's maps on the virtual screen, one for each interval of height, start time and slice of time.
//!
//! Source: Masaoka & Oshita, section 5.3: the attack is the same for all candidates, so it is drawn first, once for each interval of height, in
//! the frame in which the paths start. Differs: the screens of all intervals lie side by side in one target, each as large as its discs.
//! Maps are timed, so each start time ("clock") and each slice of time has a screen too. Screens that do not fit the target are drawn in a
//! further pass.

use std::ops::Range;

use super::{
    maps::Part,
    rules,
    screen::{Draws, Place, Shape, Shelves},
};
use crate::{
    gpu::{GpuError, error::within},
    maps::{MapRect, Slab},
    query::cull::{AttackDrawing, Counted, TimedDisc},
};

/// Value of texels that the attack covers. All others are 0.
pub(super) const COVERED: u32 = 1;
/// Side of the target, in texels. It holds any map of an attack.
pub(super) const SIDE: u32 = AttackDrawing::MAX_SIDE;
/// Columns are a multiple of this, because devices draw in tiles.
const TILE: u32 = 64;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Inner discs of one slice, against body maps.
    Inner,
    /// Outer discs of one slice, against outer maps.
    Outer,
    /// Inner discs of all slices, against evasion maps.
    Any,
}

impl Kind {
    /// Kind of the maps that a part of a candidate is compared with.
    pub(super) fn against(part: Part, slices: u32) -> Self {
        match part {
            Part::Body => Self::Inner,
            Part::Outer => Self::Outer,
            Part::Evasion if slices > 1 => Self::Any,
            Part::Evasion => Self::Inner,
        }
    }
}

/// One map of the attack, and its place on the virtual screen.
#[derive(Clone, Debug)]
pub(super) struct AttackMap {
    pub(super) clock: u32,
    pub(super) kind: Kind,
    pub(super) slab: Slab,
    pub(super) slice: u32,
    /// Rectangle relative to that of the attack.
    pub(super) rect: MapRect,
    pub(super) place: Place,
    discs: Range<u32>,
}

/// Maps that are in the target at the same time.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    pub(super) maps: Range<usize>,
    /// Number of used columns and rows of the target.
    pub(super) used: [u32; 2],
}

/// The maps of one attack. The memory is reused.
#[derive(Debug, Default)]
pub(super) struct AttackMaps {
    /// Sorted by clock and kind, then by slab.
    pub(super) maps: Vec<AttackMap>,
    pub(super) passes: Vec<Pass>,
}

impl AttackMaps {
    /// Finds the maps that are counted, and places them.
    pub(super) fn fill(
        &mut self,
        attack: &AttackDrawing,
        counted: Counted,
        slices: u32,
    ) -> Result<(), GpuError> {
        let longest = attack.rect.width.max(attack.rect.height);
        within("side of an attack's maps", longest.into(), SIDE.into())?;
        self.maps.clear();
        let parts = || Part::ALL.into_iter().filter(|part| part.is_in(counted));
        for kind in [Kind::Inner, Kind::Outer, Kind::Any] {
            if parts().any(|part| Kind::against(part, slices) == kind) {
                self.find(attack, kind, slices);
            }
        }
        // In this order a candidate's maps are in few passes.
        let key = |map: &AttackMap| (map.clock, map.kind, map.slab, map.slice);
        self.maps.sort_unstable_by_key(key);
        self.place();
        Ok(())
    }

    fn find(&mut self, attack: &AttackDrawing, kind: Kind, slices: u32) {
        let whole = MapRect {
            u: 0,
            v: 0,
            ..attack.rect
        };
        for layer in &attack.layers {
            let all = match kind {
                Kind::Outer => layer.outer.clone(),
                Kind::Inner | Kind::Any => layer.inner.clone(),
            };
            let discs = &attack.discs[all.start as usize..all.end as usize];
            let mut start = all.start;
            let is_same = |a: &TimedDisc, b: &TimedDisc| kind == Kind::Any || a.slice == b.slice;
            for discs in discs.chunk_by(is_same) {
                let end = start + discs.len() as u32;
                let rects = discs.iter().map(|one| MapRect::around(&[one.disc]));
                let around = rects.fold(MapRect::default(), MapRect::union);
                let map = AttackMap {
                    clock: layer.clock,
                    kind,
                    slab: layer.slab,
                    slice: if kind == Kind::Any { 0 } else { discs[0].slice },
                    rect: around.intersection(whole),
                    place: Place::default(),
                    discs: start..end,
                };
                start = end;
                if !map.rect.is_empty() && map.slice < slices {
                    self.maps.push(map);
                }
            }
        }
    }

    /// Places the maps in the target, in as many passes as they need.
    fn place(&mut self) {
        let area = self.maps.iter().map(|map| map.rect);
        let area: u64 = area
            .map(|rect| rect.width as u64 * rect.height as u64)
            .sum();
        let widest = self.maps.iter().map(|map| map.rect.width).max();
        // The used part is nearly square and consists of whole tiles.
        let columns = ((area as f64).sqrt() as u32).max(widest.unwrap_or(0));
        let sides = [columns.next_multiple_of(TILE).min(SIDE), SIDE];
        self.passes.clear();
        let mut shelves = Shelves::default();
        for (index, map) in self.maps.iter_mut().enumerate() {
            let (place, begins) = shelves.place(map.rect, sides);
            map.place = place;
            if begins {
                self.passes.push(Pass {
                    maps: index..index,
                    used: [0; 2],
                });
            }
            if let Some(pass) = self.passes.last_mut() {
                pass.maps.end = index + 1;
                pass.used[0] = pass.used[0].max(map.place.x + map.rect.width);
                pass.used[1] = pass.used[1].max(map.place.y + map.rect.height);
            }
        }
    }

    pub(super) fn draw(&self, attack: &AttackDrawing, pass: &Pass, out: &mut Draws) {
        for map in &self.maps[pass.maps.clone()] {
            let discs = &attack.discs[map.discs.start as usize..map.discs.end as usize];
            let placed = discs.iter().map(|one| {
                let disc = one.disc.relative_to(map.rect.u, map.rect.v);
                map.place.disc(disc, map.rect)
            });
            out.instances.extend(placed);
        }
        out.draw(Shape::Discs, rules::replace(COVERED));
    }
}

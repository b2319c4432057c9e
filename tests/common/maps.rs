//! Maps made up for tests.

use sabaki::avoid::cull::{AttackDrawing, AttackLayer, TimedDisc};
use sabaki::region::{BitMap, Drawing, MapRect, MaskMap, Slab, SlabMaps, raster};

/// The maps of a drawing of an evasion, untimed: its inner map as the outer one too.
pub fn untimed(drawing: &Drawing) -> SlabMaps {
    let raster::EvasionMaps { body, evasion } = raster::every_frame(drawing);
    let masks = masks(&body);
    SlabMaps {
        outer: masks.clone(),
        body: masks,
        evasion,
    }
}

fn masks(map: &BitMap) -> MaskMap {
    let mut masks = MaskMap::new(map.rect(), 1);
    map.for_each(|column, row| masks.set(column, row, 0));
    masks
}

/// An untimed attack of a drawing for each slab, all of the same rectangle; discs are inner and
/// outer ones.
pub fn attack_of(slabs: impl IntoIterator<Item = (Slab, Drawing)>) -> AttackDrawing {
    let mut attack = AttackDrawing::default();
    for (slab, drawing) in slabs {
        attack.rect = drawing.rect;
        let first = attack.discs.len() as u32;
        let timed = drawing.discs.iter();
        attack
            .discs
            .extend(timed.map(|&disc| TimedDisc { disc, slice: 0 }));
        let range = first..attack.discs.len() as u32;
        attack.layers.push(AttackLayer {
            slab,
            clock: 0,
            inner: range.clone(),
            outer: range,
        });
    }
    attack
}

/// An attack whose maps have this place, and nothing in them.
pub fn empty_attack(rect: MapRect, slabs: std::ops::Range<i32>) -> AttackDrawing {
    let drawing = Drawing {
        rect,
        ..Drawing::default()
    };
    attack_of(slabs.map(|slab| (Slab(slab), drawing.clone())))
}

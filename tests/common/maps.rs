//! Maps made up for tests.

use sabaki::avoid::cull::{AttackDrawing, AttackLayer, CullInput, Overlap, TimedDisc};
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

/// What any culling path counts, by the definition: every texel of the attack's rectangle, every
/// disc, every candidate.
pub fn oracle(input: &CullInput<'_>) -> Vec<Overlap> {
    let (attack, atlas) = (input.attack, input.atlas);
    let (width, height) = (attack.rect.width as i32, attack.rect.height as i32);
    let mut overlaps = vec![Overlap::default(); input.candidates.len()];
    for layer in &attack.layers {
        let discs = attack.discs_of(layer);
        for (u, v) in (0..height).flat_map(|v| (0..width).map(move |u| (u, v))) {
            let [inner, outer] = discs.map(|discs| {
                let covering = discs.iter().filter(|one| one.disc.covers(u, v));
                covering.fold(0u64, |mask, one| mask | 1 << one.slice)
            });
            if inner | outer == 0 {
                continue;
            }
            for (candidate, overlap) in input.candidates.iter().zip(&mut overlaps) {
                let maps = atlas.maps(candidate.region, layer.slab);
                let Some(maps) = maps.filter(|_| layer.clock == candidate.clock) else {
                    continue;
                };
                let (x, z) = candidate.turn.texel(u, v);
                let at = |rect: MapRect| (x - rect.u, z - rect.v);
                let ((bu, bv), (ou, ov)) = (at(maps.body.rect()), at(maps.outer.rect()));
                let (eu, ev) = at(maps.evasion.rect());
                overlap.body += (inner & maps.body.get(bu, bv)).count_ones();
                overlap.outer += (outer & maps.outer.get(ou, ov)).count_ones();
                overlap.evasion += u32::from(inner != 0 && maps.evasion.get(eu, ev));
            }
        }
    }
    overlaps
}

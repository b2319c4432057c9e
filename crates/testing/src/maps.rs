//! Maps made up for tests.

use sabaki::internal::{
    AttackDrawing, AttackLayer, BitMap, Disc, Drawing, MapRect, MaskMap, SUB_TEXELS, Slab,
    SlabMaps, TimedDisc, raster,
};
use sabaki::maps::MapGrid;
use sabaki::query::cull::{CullInput, Overlap};

use super::random::Random;

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

/// Masks of any slices: in each of them a few discs, or nothing.
pub fn timed(random: &mut Random, rect: MapRect, grid: MapGrid) -> MaskMap {
    let mut masks = MaskMap::new(rect, grid.lanes());
    for slice in 0..grid.slices {
        if grid.is_timed() && random.below(3) == 0 {
            continue;
        }
        let discs: Vec<_> = (0..1 + random.below(4))
            .map(|_| disc(random, rect))
            .collect();
        let drawing = Drawing {
            rect,
            frame_ends: vec![discs.len() as u32],
            discs,
        };
        raster::any_frame(&drawing).for_each(|column, row| masks.set(column, row, slice));
    }
    masks
}

/// Space and time of a random attack.
pub struct TimedAttack {
    pub rect: MapRect,
    pub grid: MapGrid,
    pub slabs: std::ops::Range<i32>,
    /// Number of clocks.
    pub clocks: u32,
}

/// An attack of any discs at any time, for some slabs and clocks.
pub fn timed_attack(random: &mut Random, desc: TimedAttack) -> AttackDrawing {
    let TimedAttack {
        rect,
        grid,
        slabs,
        clocks,
    } = desc;
    let mut attack = AttackDrawing {
        rect,
        ..AttackDrawing::default()
    };
    let discs = |random: &mut Random, attack: &mut AttackDrawing| {
        let first = attack.discs.len();
        for _ in 0..random.below(10 + grid.slices as usize) {
            attack.discs.push(TimedDisc {
                disc: disc(random, rect),
                slice: random.below(grid.slices as usize) as u32,
            });
        }
        attack.discs[first..].sort_unstable_by_key(|one| one.slice);
        first as u32..attack.discs.len() as u32
    };
    for clock in 0..clocks {
        for slab in slabs.clone() {
            let inner = discs(random, &mut attack);
            let outer = discs(random, &mut attack);
            attack.layers.push(AttackLayer {
                slab: Slab(slab),
                clock,
                inner,
                outer,
            });
        }
    }
    attack
}

/// A disc about a map, often across its border.
fn disc(random: &mut Random, rect: MapRect) -> Disc {
    let place = |random: &mut Random, texels: u32| {
        let sub = (texels as usize + 16) * SUB_TEXELS as usize;
        random.below(sub) as i32 - 8 * SUB_TEXELS
    };
    let largest = (rect.width.min(rect.height) as usize / 3 + 1) * SUB_TEXELS as usize;
    Disc {
        x: place(random, rect.width),
        z: place(random, rect.height),
        radius: random.below(largest) as i32,
    }
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
                let (x, z) = candidate.transform.texel(u, v);
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

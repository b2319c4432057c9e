//! Maps of one slice, with one or two bits for each texel.
//!
//! Body and evasion map of a slab share a texel of two bits, so that a fragment finds both with one read and a candidate is drawn once
//! for both. Outer maps have texels of one bit.

use super::map_bits::MapBits;
use crate::maps::{MapRect, RegionAtlas, SlabMaps};

/// Bit of the body map in a texel.
const BODY: u32 = 0;
/// Bit of the evasion map in a texel.
const EVASION: u32 = 1;

/// The maps of an atlas with one slice.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    pub(super) words: Vec<u32>,
    /// Positions of the maps of each slab of each region: body, outer, evasion.
    pub(super) bits: Vec<[MapBits; 3]>,
    /// Number of bits in use.
    used: usize,
}

impl Pairs {
    /// Packs an atlas with one slice. Returns `None` if a texel is set in both the body and the evasion map, or if maps of one slab lie far
    /// from each other. Neither happens with drawn maps.
    pub(super) fn new(atlas: &RegionAtlas) -> Option<Self> {
        let mut pairs = Self::default();
        for slab in atlas.regions().iter().flat_map(|region| &region.slabs) {
            let [body, evasion] = pairs.push_pair(slab)?;
            let outer = pairs.push_outer(slab);
            pairs.bits.push([body, outer, evasion]);
        }
        Some(pairs)
    }

    /// Appends the body and the evasion map of a slab.
    fn push_pair(&mut self, slab: &SlabMaps) -> Option<[MapBits; 2]> {
        let (body, evasion) = (slab.body.rect(), slab.evasion.rect());
        let both = body.union(evasion);
        let texels = |rect: MapRect| u64::from(rect.width) * u64::from(rect.height);
        if texels(both) > 4 * (texels(body) + texels(evasion)) + 1024 {
            return None;
        }
        let bits = self.append(both, 1);
        for row in 0..body.height as i32 {
            for column in 0..body.width as i32 {
                if slab.body.get(column, row) & 1 == 1 {
                    self.set(&bits, [body.u + column, body.v + row], BODY);
                }
            }
        }
        let mut are_apart = true;
        slab.evasion.for_each(|column, row| {
            let [column, row] = [evasion.u + column, evasion.v + row];
            are_apart &= slab.body.get(column - body.u, row - body.v) & 1 == 0;
            self.set(&bits, [column, row], EVASION);
        });
        let of = |bit| MapBits {
            first_bit: bits.first_bit + bit,
            ..bits
        };
        are_apart.then(|| [of(BODY), of(EVASION)])
    }

    /// Appends the outer map of a slab.
    fn push_outer(&mut self, slab: &SlabMaps) -> MapBits {
        let rect = slab.outer.rect();
        let bits = self.append(rect, 0);
        for row in 0..rect.height as i32 {
            for column in 0..rect.width as i32 {
                if slab.outer.get(column, row) & 1 == 1 {
                    self.set(&bits, [rect.u + column, rect.v + row], 0);
                }
            }
        }
        bits
    }

    /// Appends a map without a set bit.
    fn append(&mut self, rect: MapRect, texel_bits_log2: u32) -> MapBits {
        let row_bits = rect.width << texel_bits_log2;
        let bits = MapBits {
            u: rect.u,
            v: rect.v,
            width: rect.width,
            height: rect.height,
            first_bit: self.used as u32,
            row_bits,
            texel_bits_log2,
        };
        self.used += row_bits as usize * rect.height as usize;
        // A texel does not cross a word.
        self.used = self.used.next_multiple_of(2);
        self.words.resize(self.used.div_ceil(32), 0);
        bits
    }

    /// Sets a bit of the texel at a place of the evasion's frame.
    fn set(&mut self, map: &MapBits, [u, v]: [i32; 2], bit: u32) {
        let (column, row) = ((u - map.u) as usize, (v - map.v) as usize);
        let texel = row * map.row_bits as usize + (column << map.texel_bits_log2);
        let bit = map.first_bit as usize + texel + bit as usize;
        self.words[bit / 32] |= 1 << (bit % 32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::{BitMap, MapGrid, MaskMap, RegionMaps, Slab};

    const BODY_RECT: MapRect = MapRect {
        u: -3,
        v: 5,
        width: 7,
        height: 4,
    };
    const EVASION_RECT: MapRect = MapRect {
        u: 1,
        v: 2,
        width: 6,
        height: 5,
    };

    fn atlas(body: &[[i32; 2]], evasion: &[[i32; 2]]) -> RegionAtlas {
        let mut maps = SlabMaps {
            body: MaskMap::new(BODY_RECT, 1),
            outer: MaskMap::new(EVASION_RECT, 1),
            evasion: BitMap::new(EVASION_RECT),
        };
        for &[u, v] in body {
            maps.body.set(u - BODY_RECT.u, v - BODY_RECT.v, 0);
        }
        for &[u, v] in evasion {
            let [column, row] = [u - EVASION_RECT.u, v - EVASION_RECT.v];
            maps.evasion.set(column, row);
            maps.outer.set(column, row, 0);
        }
        let region = RegionMaps {
            first_slab: Slab(0),
            slabs: vec![maps.clone(), maps],
            seconds: 1.0,
        };
        RegionAtlas::new(MapGrid::PAPER, vec![region], Vec::new())
    }

    fn get(pairs: &Pairs, map: &MapBits, [u, v]: [i32; 2]) -> bool {
        let (column, row) = ((u - map.u) as u32, (v - map.v) as u32);
        if column >= map.width || row >= map.height {
            return false;
        }
        let bit = map.first_bit + row * map.row_bits + (column << map.texel_bits_log2);
        pairs.words[bit as usize / 32] >> (bit % 32) & 1 == 1
    }

    #[test]
    fn every_map_is_found_again() {
        let (body, evasion) = ([[-3, 5], [2, 6], [3, 8]], [[1, 2], [3, 6], [6, 6]]);
        let pairs = Pairs::new(&atlas(&body, &evasion)).unwrap();
        assert_eq!(pairs.bits.len(), 2);
        for [in_body, in_outer, in_evasion] in &pairs.bits {
            for (u, v) in (-9..12).flat_map(|u| (-4..12).map(move |v| (u, v))) {
                let texel = [u, v];
                assert_eq!(get(&pairs, in_body, texel), body.contains(&texel));
                assert_eq!(get(&pairs, in_evasion, texel), evasion.contains(&texel));
                assert_eq!(get(&pairs, in_outer, texel), evasion.contains(&texel));
            }
        }
    }

    #[test]
    fn a_texel_of_both_is_refused() {
        assert!(Pairs::new(&atlas(&[[2, 6]], &[[2, 6]])).is_none());
    }
}

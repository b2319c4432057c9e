//! The `cpu` culling path: twin of `gpu`'s, equal to the texel.

use super::{AttackTexels, BLOCK, BLOCK_TEXELS, CullCandidate, CullInput, Overlap, TexelLayer};
use crate::region::SlabMaps;

/// Counts overlaps on the CPU. Holds the scratch: nothing is allocated once it has counted as much.
#[derive(Clone, Debug, Default)]
pub struct Culler {
    texels: AttackTexels,
}

impl Culler {
    /// Counts the overlaps of every candidate into `overlaps`, in the order of the candidates.
    pub fn count(&mut self, input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
        self.texels.draw(input.attack, input.atlas.grid().lanes());
        overlaps.clear();
        overlaps.extend(input.candidates.iter().map(|candidate| {
            let mut overlap = Overlap::default();
            for layer in &self.texels.layers {
                let maps = input.atlas.maps(candidate.region, layer.slab);
                if let Some(maps) = maps.filter(|_| layer.clock == candidate.clock) {
                    add(&self.texels, layer, (candidate, maps), &mut overlap);
                }
            }
            overlap
        }));
    }
}

/// Counts with a culler of its own: for one query in a while.
pub fn count(input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
    Culler::default().count(input, overlaps);
}

fn add(
    texels: &AttackTexels,
    layer: &TexelLayer,
    (candidate, maps): (&CullCandidate, &SlabMaps),
    overlap: &mut Overlap,
) {
    for block in layer.blocks.start as usize..layer.blocks.end as usize {
        let [u, v] = texels.places[block];
        for texel in 0..BLOCK_TEXELS {
            let mask = |masks: &[u32]| {
                (0..texels.lanes).fold(0, |mask, lane| {
                    let word = masks[(block * texels.lanes + lane) * BLOCK_TEXELS + texel];
                    mask | u64::from(word) << (32 * lane)
                })
            };
            let (inner, outer) = (mask(&texels.inner), mask(&texels.outer));
            let (x, z) = candidate
                .turn
                .texel(u + (texel % BLOCK) as i32, v + (texel / BLOCK) as i32);
            let body = maps
                .body
                .get(x - maps.body.rect().u, z - maps.body.rect().v);
            let around = maps
                .outer
                .get(x - maps.outer.rect().u, z - maps.outer.rect().v);
            let evasion = maps
                .evasion
                .get(x - maps.evasion.rect().u, z - maps.evasion.rect().v);
            overlap.body += (inner & body).count_ones();
            overlap.outer += (outer & around).count_ones();
            overlap.evasion += u32::from(inner != 0 && evasion);
        }
    }
}

//! The `cpu` culling path: twin of `gpu`'s `stencil`, equal to the texel.

use super::{CullInput, Overlap};
use crate::region::raster;

/// Counts the overlaps of every candidate into `overlaps`, in the order of the candidates.
pub fn count(input: &CullInput<'_>, overlaps: &mut Vec<Overlap>) {
    let attack: Vec<_> = input
        .attack
        .iter()
        .map(|slab| (slab.slab, raster::any_frame(&slab.drawing)))
        .collect();
    overlaps.clear();
    overlaps.extend(input.candidates.iter().map(|candidate| {
        let mut overlap = Overlap::default();
        for (slab, attack) in &attack {
            if let Some(maps) = input.atlas.maps(candidate.region, *slab) {
                overlap.body += candidate.turn.overlap(attack, &maps.body);
                overlap.evasion += candidate.turn.overlap(attack, &maps.evasion);
            }
        }
        overlap
    }));
}

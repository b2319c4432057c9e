//! The CPU's rasterizer: twin of the stencil passes in `gpu`, of the same names, equal to the
//! texel.
//!
//! Source: Masaoka & Oshita, section 4.3.

use serde::{Deserialize, Serialize};

use super::{BitMap, Disc, Drawing, MapRect, SUB_TEXELS};

/// The maps of an evasion in one slab.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct EvasionMaps {
    /// Texels that the body covers in every frame.
    pub body: BitMap,
    /// Texels that the body covers in the first frame and not in every frame.
    pub evasion: BitMap,
}

/// Draws the texels that are covered in every frame, and those that are covered in the first frame
/// only for a while.
#[must_use]
pub fn every_frame(drawing: &Drawing) -> EvasionMaps {
    let rect = drawing.rect;
    let mut counts = vec![0u32; rect.width as usize * rect.height as usize];
    for frame in 0..drawing.frames() {
        // The stencil's rule: only where all earlier frames counted does this one count.
        let (expected, next) = (frame as u32, frame as u32 + 1);
        for disc in drawing.frame(frame) {
            for_each_texel(*disc, rect, |index| {
                if counts[index] == expected {
                    counts[index] = next;
                }
            });
        }
    }
    let frames = drawing.frames() as u32;
    let mut maps = EvasionMaps {
        body: BitMap::new(rect),
        evasion: BitMap::new(rect),
    };
    for (index, &count) in counts.iter().enumerate() {
        let (column, row) = (
            (index as u32 % rect.width) as i32,
            (index as u32 / rect.width) as i32,
        );
        if count == frames && frames > 0 {
            maps.body.set(column, row);
        } else if count > 0 {
            maps.evasion.set(column, row);
        }
    }
    maps
}

/// Draws the texels that are covered in any frame.
#[must_use]
pub fn any_frame(drawing: &Drawing) -> BitMap {
    let mut map = BitMap::new(drawing.rect);
    let width = drawing.rect.width;
    for &disc in &drawing.discs {
        for_each_texel(disc, drawing.rect, |index| {
            map.set((index as u32 % width) as i32, (index as u32 / width) as i32)
        });
    }
    map
}

/// Calls `visit` with the index of each texel of the map that `disc` covers.
fn for_each_texel(disc: Disc, rect: MapRect, mut visit: impl FnMut(usize)) {
    let span = |centre: i32, texels: u32| {
        let first = (centre - disc.radius).div_euclid(SUB_TEXELS).max(0);
        let last = (centre + disc.radius)
            .div_euclid(SUB_TEXELS)
            .min(texels as i32 - 1);
        first..=last
    };
    for v in span(disc.z, rect.height) {
        for u in span(disc.x, rect.width) {
            if disc.covers(u, v) {
                visit(v as usize * rect.width as usize + u as usize);
            }
        }
    }
}

//! Maps over time: each texel has a mask with one bit for each slice.

use serde::{Deserialize, Serialize};

use super::bit_map::MapRect;

/// A map over time: each texel has a mask with one bit for each slice.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskMap {
    rect: MapRect,
    /// Number of words in a mask.
    lanes: u32,
    /// Masks, `[row][column][lane]`.
    masks: Vec<u32>,
}

impl MaskMap {
    /// Creates a map with no bit set. `lanes` is the number of words in a mask, 1 or 2.
    #[must_use]
    pub fn new(rect: MapRect, lanes: usize) -> Self {
        Self {
            rect,
            lanes: lanes as u32,
            masks: vec![0; rect.width as usize * rect.height as usize * lanes],
        }
    }

    /// Position of the map in its frame.
    pub fn rect(&self) -> MapRect {
        self.rect
    }

    /// Number of words in a mask: 1 for up to 32 slices, 2 for up to 64.
    pub fn lanes(&self) -> usize {
        self.lanes as usize
    }

    /// All masks, `[row][column][lane]`. Slice `s` is bit `s % 32` of lane `s / 32`.
    pub fn masks(&self) -> &[u32] {
        &self.masks
    }

    /// Mask of a texel, by its column and row in this map. Texels outside the map have mask 0.
    pub fn get(&self, column: i32, row: i32) -> u64 {
        let inside = (0..self.rect.width as i32).contains(&column)
            && (0..self.rect.height as i32).contains(&row);
        if !inside {
            return 0;
        }
        let first = self.address(column, row);
        let lanes = &self.masks[first..first + self.lanes()];
        let join = |mask, (lane, word): (usize, &u32)| mask | u64::from(*word) << (32 * lane);
        lanes.iter().enumerate().fold(0, join)
    }

    /// Sets the bit of a slice in a texel, by its column and row in this map. The texel must lie
    /// inside the map.
    pub fn set(&mut self, column: i32, row: i32, slice: u32) {
        let word = self.address(column, row) + slice as usize / 32;
        self.masks[word] |= 1 << (slice % 32);
    }

    fn address(&self, column: i32, row: i32) -> usize {
        (row as usize * self.rect.width as usize + column as usize) * self.lanes()
    }

    /// Smallest rectangle around the texels of each slice. It is empty if a slice has no texel.
    pub fn slice_rects(&self, slices: u32) -> Vec<MapRect> {
        let (MapRect { u, v, width, .. }, lanes) = (self.rect, self.lanes().max(1));
        let mut rects = vec![MapRect::default(); slices as usize];
        for (texel, mask) in (0..).zip(self.masks.chunks_exact(lanes)) {
            for (&word, rects) in mask.iter().zip(rects.chunks_mut(32)) {
                let mut left = word;
                while left != 0 {
                    if let Some(rect) = rects.get_mut(left.trailing_zeros() as usize) {
                        *rect = rect.union(MapRect {
                            u: u + texel % width as i32,
                            v: v + texel / width as i32,
                            width: 1,
                            height: 1,
                        });
                    }
                    left &= left - 1;
                }
            }
        }
        rects
    }

    /// Number of texels with at least one bit set.
    pub fn count(&self) -> usize {
        let texels = self.masks.chunks(self.lanes().max(1));
        texels
            .filter(|mask| mask.iter().any(|&word| word != 0))
            .count()
    }

    /// Whether the masks fit the rectangle and have no bits beyond `slices`. Maps that are made
    /// here always pass; maps that come from a file are checked.
    pub fn is_sound(&self, slices: u32) -> bool {
        let lanes = slices.div_ceil(32);
        let texels = u64::from(self.rect.width) * u64::from(self.rect.height);
        let unused = match slices % 32 {
            0 => 0,
            used => u32::MAX << used,
        };
        self.lanes == lanes
            && lanes > 0
            && self.masks.len() as u64 == texels * u64::from(lanes)
            && self
                .masks
                .iter()
                .skip(lanes as usize - 1)
                .step_by(lanes as usize)
                .all(|word| word & unused == 0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_rectangle_of_a_slice_is_the_smallest_around_its_texels(
            [u, v] in prop::array::uniform2(-9..9i32),
            [width, height] in prop::array::uniform2(1..90u32),
            slices in prop::sample::select(vec![1u32, 31, 32, 40, 64]),
            texels in prop::collection::vec(prop::array::uniform3(0..1000u32), 0..30),
        ) {
            let lanes = slices.div_ceil(32) as usize;
            let mut map = MaskMap::new(MapRect { u, v, width, height }, lanes);
            let texels: Vec<[u32; 3]> = texels
                .iter()
                .map(|[column, row, slice]| [column % width, row % height, slice % slices])
                .collect();
            for &[column, row, slice] in &texels {
                map.set(column as i32, row as i32, slice);
            }
            prop_assert!(map.is_sound(slices));
            let highest = texels.iter().map(|texel| texel[2]).max();
            for fewer in (lanes as u32 * 32 - 31)..=slices {
                prop_assert_eq!(map.is_sound(fewer), highest.is_none_or(|slice| slice < fewer));
            }
            let rects = map.slice_rects(slices);
            prop_assert_eq!(rects.len(), slices as usize);
            for (slice, rect) in (0..).zip(rects) {
                let of_slice = texels.iter().filter(|texel| texel[2] == slice);
                let expected = of_slice.fold(MapRect::default(), |around, &[column, row, _]| {
                    around.union(MapRect {
                        u: u + column as i32,
                        v: v + row as i32,
                        width: 1,
                        height: 1,
                    })
                });
                prop_assert_eq!(rect, expected, "slice {}", slice);
            }
        }
    }
}

use serde::{Deserialize, Serialize};

use super::MapRect;

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
    #[must_use]
    pub fn rect(&self) -> MapRect {
        self.rect
    }

    /// Number of words in a mask: 1 for up to 32 slices, 2 for up to 64.
    #[must_use]
    pub fn lanes(&self) -> usize {
        self.lanes as usize
    }

    /// All masks, `[row][column][lane]`. Slice `s` is bit `s % 32` of lane `s / 32`.
    #[must_use]
    pub fn masks(&self) -> &[u32] {
        &self.masks
    }

    /// Mask of a texel, by its column and row in this map. Texels outside the map have mask 0.
    #[must_use]
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
    #[must_use]
    pub fn slice_rects(&self, slices: u32) -> Vec<MapRect> {
        let (rect, lanes) = (self.rect, self.lanes().max(1));
        let row_words = rect.width as usize * lanes;
        let mut columns = vec![0; row_words];
        let mut rows = vec![0; rect.height as usize * lanes];
        for (row, texels) in self.masks.chunks(row_words.max(1)).enumerate() {
            for (word, mask) in texels.iter().enumerate() {
                columns[word] |= mask;
                rows[row * lanes + word % lanes] |= mask;
            }
        }
        let around = |slice: usize| {
            let has = |mask: &[u32]| mask[slice / 32] >> (slice % 32) & 1 == 1;
            let ends = |masks: &[u32]| {
                let first = masks.chunks(lanes).position(has)?;
                let last = masks.chunks(lanes).rposition(has)?;
                Some((first as i32, (last - first + 1) as u32))
            };
            let ((u, width), (v, height)) = (ends(&columns)?, ends(&rows)?);
            Some(MapRect {
                u: rect.u + u,
                v: rect.v + v,
                width,
                height,
            })
        };
        (0..slices as usize)
            .map(|slice| around(slice).unwrap_or_default())
            .collect()
    }

    /// Number of texels with at least one bit set.
    #[must_use]
    pub fn count(&self) -> usize {
        let texels = self.masks.chunks(self.lanes().max(1));
        texels
            .filter(|mask| mask.iter().any(|&word| word != 0))
            .count()
    }

    /// Whether the masks fit the rectangle and have no bits beyond `slices`. Maps that are made
    /// here always pass; maps that come from a file are checked.
    #[must_use]
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
                .chunks(lanes as usize)
                .all(|mask| mask[lanes as usize - 1] & unused == 0)
    }
}

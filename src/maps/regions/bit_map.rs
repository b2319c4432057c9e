//! Maps with one bit for each texel, and the discs that are drawn on them.

use serde::{Deserialize, Serialize};

use super::map_grid::{Disc, MapGrid, SUB_TEXELS};

/// A rectangle of texels in the frame that a map is drawn in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MapRect {
    /// First column, in texels along x.
    pub u: i32,
    /// First row, in texels along z.
    pub v: i32,
    /// Number of columns, 0 for an empty map.
    pub width: u32,
    /// Number of rows, 0 for an empty map.
    pub height: u32,
}

impl MapRect {
    /// Smallest rectangle that contains every texel that `discs` may cover.
    #[must_use]
    pub fn around(discs: &[Disc]) -> Self {
        let corners = |side: i32| {
            let corner =
                move |disc: &Disc| [disc.x + side * disc.radius, disc.z + side * disc.radius];
            discs.iter().map(corner)
        };
        let low = corners(-1).reduce(|[a, b], [c, d]| [a.min(c), b.min(d)]);
        let high = corners(1).reduce(|[a, b], [c, d]| [a.max(c), b.max(d)]);
        let (Some(low), Some(high)) = (low, high) else {
            return Self::default();
        };
        let texel = |sub: i32| sub.div_euclid(SUB_TEXELS);
        Self::between(low.map(texel), high.map(|sub| texel(sub) + 1))
    }

    /// Rectangle from one texel to another, which lies outside. It is empty if an end lies before its start.
    pub(super) fn between([u, v]: [i32; 2], [end_u, end_v]: [i32; 2]) -> Self {
        if end_u <= u || end_v <= v {
            return Self::default();
        }
        Self {
            u,
            v,
            width: (end_u - u) as u32,
            height: (end_v - v) as u32,
        }
    }

    /// First texel after the last column and row.
    pub(super) fn end(self) -> [i32; 2] {
        [self.u + self.width as i32, self.v + self.height as i32]
    }

    /// Intersection of two rectangles.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        let ([a, b], [c, d]) = (self.end(), other.end());
        let start = [self.u.max(other.u), self.v.max(other.v)];
        Self::between(start, [a.min(c), b.min(d)])
    }

    /// Smallest rectangle that contains two rectangles.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        if self.is_empty() || other.is_empty() {
            return if self.is_empty() { other } else { self };
        }
        let ([a, b], [c, d]) = (self.end(), other.end());
        let start = [self.u.min(other.u), self.v.min(other.v)];
        Self::between(start, [a.max(c), b.max(d)])
    }

    /// Whether the rectangle is small enough for fixed-point coordinates
    /// ([`MapGrid::MAX_SIDE`]).
    pub fn fits(self) -> bool {
        let max = MapGrid::MAX_SIDE;
        // Half of the distance to which a fixed-point transform clamps.
        let far = |place: i32| place.unsigned_abs() <= 8 * max;
        self.width <= max && self.height <= max && far(self.u) && far(self.v)
    }

    /// Whether the rectangle contains no texel.
    pub fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }
}

/// A map with one bit for each texel. Rows are padded to whole words, so that a storage buffer can
/// hold them unchanged.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BitMap {
    rect: MapRect,
    words: Vec<u32>,
}

impl BitMap {
    /// Creates a map with no texel set.
    #[must_use]
    pub fn new(rect: MapRect) -> Self {
        Self {
            rect,
            words: vec![0; Self::row_words(rect) * rect.height as usize],
        }
    }

    fn row_words(rect: MapRect) -> usize {
        rect.width.div_ceil(32) as usize
    }

    /// Position of the map in its frame.
    pub fn rect(&self) -> MapRect {
        self.rect
    }

    /// Number of words in a row.
    pub fn words_per_row(&self) -> usize {
        Self::row_words(self.rect)
    }

    /// Words of all rows. Column 0 is the lowest bit of a row's first word. Padding bits are 0.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    pub(crate) fn words_mut(&mut self) -> &mut [u32] {
        &mut self.words
    }

    /// Whether a texel is set, by its column and row in this map. Texels outside the map are not
    /// set.
    pub fn get(&self, column: i32, row: i32) -> bool {
        let inside = (0..self.rect.width as i32).contains(&column)
            && (0..self.rect.height as i32).contains(&row);
        inside && {
            let (word, bit) = self.address(column, row);
            self.words[word] >> bit & 1 == 1
        }
    }

    /// Calls `visit` with the column and the row of each set texel, row by row.
    pub fn for_each(&self, mut visit: impl FnMut(i32, i32)) {
        let words = self.words_per_row().max(1);
        for (row, line) in self.words.chunks(words).enumerate() {
            for (index, &word) in line.iter().enumerate() {
                let mut left = word;
                while left != 0 {
                    visit(
                        (32 * index) as i32 + left.trailing_zeros() as i32,
                        row as i32,
                    );
                    left &= left - 1;
                }
            }
        }
    }

    /// Smallest rectangle that contains the set texels, in the map's frame. It is empty if no texel
    /// is set.
    pub fn bounds(&self) -> MapRect {
        let (mut low, mut end) = ([i32::MAX; 2], [i32::MIN; 2]);
        let MapRect { u, v, .. } = self.rect;
        self.for_each(|column, row| {
            low = [low[0].min(u + column), low[1].min(v + row)];
            end = [end[0].max(u + column + 1), end[1].max(v + row + 1)];
        });
        MapRect::between(low, end)
    }

    /// Returns the part of the map that lies within `rect`.
    pub fn cropped(&self, rect: MapRect) -> Self {
        let mut map = Self::new(rect);
        let (u, v) = (self.rect.u - rect.u, self.rect.v - rect.v);
        self.for_each(|column, row| {
            let (column, row) = (column + u, row + v);
            if (0..rect.width as i32).contains(&column) && (0..rect.height as i32).contains(&row) {
                map.set(column, row);
            }
        });
        map
    }

    /// Sets a texel, by its column and row in this map. The texel must lie inside the map.
    pub fn set(&mut self, column: i32, row: i32) {
        let (word, bit) = self.address(column, row);
        self.words[word] |= 1 << bit;
    }

    fn address(&self, column: i32, row: i32) -> (usize, u32) {
        (
            row as usize * self.words_per_row() + column as usize / 32,
            column as u32 % 32,
        )
    }

    /// Number of set texels.
    pub fn count(&self) -> u32 {
        self.words.iter().map(|word| word.count_ones()).sum()
    }

    /// Whether the words fit the rectangle and all padding bits are 0. Maps that are made here
    /// always pass; maps that come from a file are checked.
    pub fn is_sound(&self) -> bool {
        let words = self.words_per_row();
        let padding = match self.rect.width % 32 {
            0 => 0,
            used => u32::MAX << used,
        };
        self.words.len() == words * self.rect.height as usize
            && (words == 0
                || self
                    .words
                    .chunks(words)
                    .all(|row| row[words - 1] & padding == 0))
    }
}

/// Input of a rasterizer: the discs of every frame of a region, on one map.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Drawing {
    /// Position of the map in its frame.
    pub rect: MapRect,
    /// Discs relative to the rectangle's first texel, frame by frame.
    pub discs: Vec<Disc>,
    /// End of each frame in `discs`. Its length is the number of frames.
    pub frame_ends: Vec<u32>,
}

impl Drawing {
    /// Discs of one frame.
    pub fn frame(&self, frame: usize) -> &[Disc] {
        let start = frame
            .checked_sub(1)
            .map_or(0, |before| self.frame_ends[before]);
        &self.discs[start as usize..self.frame_ends[frame] as usize]
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frame_ends.len()
    }
}

//! Packs rectangles side by side on shelves.
//!
//! Source: next-fit decreasing height (Coffman, Garey, Johnson & Tarjan, "Performance bounds for level-oriented two-dimensional packing
//! algorithms", 1980): a rectangle goes onto the open shelf, or opens the next one if that is full. Callers sort by height, the tallest
//! first. Differs: the height is bounded too. A rectangle that no longer fits is refused.

/// Position of a map in a target: its first texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) x: u32,
    pub(crate) y: u32,
}

/// The open shelf of a target: its end, its lower edge and its height, in texels.
#[derive(Debug, Default)]
pub(super) struct Shelves {
    x: u32,
    y: u32,
    height: u32,
}

impl Shelves {
    /// Position for a map that is not taller than the previous ones, or `None` if the target is full.
    pub(super) fn place(&mut self, [width, height]: [u32; 2], sides: [u32; 2]) -> Option<Place> {
        if self.x + width > sides[0] {
            (self.x, self.y, self.height) = (0, self.y + self.height, 0);
        }
        if self.y + height > sides[1] {
            return None;
        }
        let place = Place {
            x: self.x,
            y: self.y,
        };
        self.x += width;
        self.height = self.height.max(height);
        Some(place)
    }

    /// Starts an empty target with a map.
    pub(super) fn first(&mut self, [width, height]: [u32; 2]) -> Place {
        *self = Self {
            x: width,
            y: 0,
            height,
        };
        Place::default()
    }
}

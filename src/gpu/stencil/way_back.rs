//! Transforms a candidate's maps into the frame of the attack's maps, where they are drawn.

use super::{
    boxes::{CORNERS, UNITS},
    cells::Cell,
    map_bits::MapBits,
    maps::Reach,
    slant::Slant,
};
use crate::maps::{FixedTransform2, MapRect};

/// Transform from an evasion's frame to the attack's maps in single precision, for boxes that are slightly too large.
#[derive(Clone, Copy, Debug)]
pub(super) struct WayBack {
    cos: f32,
    sin: f32,
    /// Translation in the evasion's frame, in texels.
    from: [f32; 2],
    /// Whether the transform can be inverted. It cannot if both `a` and `b` are near 0.
    exists: bool,
    turn: FixedTransform2,
}

impl WayBack {
    /// Margin around a map, in texels. It covers half a texel from centre to border, and the error of single precision.
    const MARGIN: f32 = 1.0;

    pub(super) fn new(turn: FixedTransform2) -> Self {
        let (a, b) = (turn.a as f32, turn.b as f32);
        let one = (1u32 << (FixedTransform2::SHIFT - 1)) as f32;
        let squared = a * a + b * b;
        let scale = one / squared.max(1.0);
        Self {
            cos: a * scale,
            sin: b * scale,
            from: [turn.tx, turn.tz].map(|place| place as f32 / (2.0 * one)),
            exists: squared > 0.25 * one * one,
            turn,
        }
    }

    /// Transform from texels of the target, where the attack's first texel is at `origin`, to texels of the map. It is the arithmetic of
    /// `FixedTransform2::texel` with both positions added to the translation. Intermediate sums may wrap; the result fits.
    pub(super) fn onto(&self, map: &MapBits, [x, y]: [i32; 2]) -> [i32; 4] {
        let FixedTransform2 { a, b, tx, tz } = self.turn;
        let placed = |start: i32, along: i32, across: i32, texel: i32| {
            start
                .wrapping_sub(along.wrapping_mul(2 * x))
                .wrapping_sub(across.wrapping_mul(2 * y))
                .wrapping_sub(texel << FixedTransform2::SHIFT)
        };
        [a, b, placed(tx, a, b, map.u), placed(tz, -b, a, map.v)]
    }

    /// Corners of the box in which the map and a cell can overlap, in the target's units.
    pub(super) fn shared(
        &self,
        reach: &Reach,
        cell: &Cell,
        origin: [i32; 2],
    ) -> Option<[[u16; 2]; CORNERS]> {
        let shared = self.part(reach, &cell.slant)?;
        // No corner is negative, where a cast would round up.
        let place = |at: f32, origin: i32| {
            let at = (at + origin as f32) * UNITS as f32;
            (at + 0.5) as u16
        };
        let corners = shared.corners();
        Some(corners.map(|at| [place(at[0], origin[0]), place(at[1], origin[1])]))
    }

    /// The part of a rectangle in the attack's maps that a map can reach.
    fn part(&self, reach: &Reach, slant: &Slant) -> Option<Slant> {
        if reach.is_empty() {
            return None;
        }
        if !self.exists {
            return Some(*slant);
        }
        let ([x, z], [width, height]) = (reach.middle, reach.half);
        // Tested first because most maps are far from most cells.
        let middle = slant.turned(self.back(reach.middle));
        let [cos, sin] = [
            (self.cos * slant.cos + self.sin * slant.sin).abs(),
            (self.sin * slant.cos - self.cos * slant.sin).abs(),
        ];
        let half = [cos * width + sin * height, sin * width + cos * height];
        let is_near = |axis: usize| {
            middle[axis] - half[axis] < slant.high[axis] + Self::MARGIN
                && middle[axis] + half[axis] > slant.low[axis] - Self::MARGIN
        };
        if !(is_near(0) && is_near(1)) {
            return None;
        }
        let outline = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        slant.shared(outline.map(|[a, b]| self.back([x + a * width, z + b * height])))
    }

    /// Transforms a point of the evasion's frame to the attack's frame.
    fn back(&self, place: [f32; 2]) -> [f32; 2] {
        let [x, z] = [0, 1].map(|axis| place[axis] - self.from[axis]);
        [self.cos * x - self.sin * z, self.sin * x + self.cos * z]
    }

    /// Whether the transform may move a texel centre of a rectangle in the attack's maps into a map.
    pub(super) fn may_meet(&self, reach: &Reach, rect: MapRect) -> bool {
        if reach.is_empty() || rect.is_empty() {
            return false;
        }
        if !self.exists {
            return true;
        }
        let half = [
            self.cos.abs() * reach.half[0] + self.sin.abs() * reach.half[1] + Self::MARGIN,
            self.sin.abs() * reach.half[0] + self.cos.abs() * reach.half[1] + Self::MARGIN,
        ];
        let middle = self.back(reach.middle);
        let [low, high] = [
            [rect.u, rect.v],
            [rect.u + rect.width as i32, rect.v + rect.height as i32],
        ];
        [0, 1].into_iter().all(|axis| {
            middle[axis] - half[axis] < high[axis] as f32
                && middle[axis] + half[axis] > low[axis] as f32
        })
    }
}

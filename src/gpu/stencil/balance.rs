//! Distributes boxes over the tiles of a software rasterizer, which draws each tile on one core (`vendor-notes/lavapipe.md`).
//! Candidates meet an attack in the same few texels, often all of them in one tile. Then everything is moved down until the border
//! between two tiles divides the boxes.

use super::boxes::{CORNERS, UNITS};
use crate::{
    gpu::shader_table::{BoxCorner, PlacedDisc},
    maps::SUB_TEXELS,
};

/// Side of a tile, in texels.
const TILE: u32 = 64;
/// Maximum number of boxes that are examined.
const SAMPLE: usize = 512;

/// Numbers of texels by tile. The memory is reused.
#[derive(Debug, Default)]
pub(super) struct Balance {
    /// Number of box texels in each tile.
    tiles: Vec<u64>,
    /// For each row, the difference of its number of texels to the previous row.
    rows: Vec<i64>,
}

impl Balance {
    /// Number of rows to move everything down by. 0 if no tile has far more texels than all others together.
    pub(super) fn shift(&mut self, corners: &[BoxCorner], [columns, rows]: [u32; 2]) -> u32 {
        let across = columns.div_ceil(TILE) as usize;
        self.tiles.clear();
        self.tiles.resize(across * rows.div_ceil(TILE) as usize, 0);
        self.rows.clear();
        self.rows.resize(rows as usize + 1, 0);
        let boxes = corners.len() / CORNERS;
        for corners in corners.chunks_exact(CORNERS).step_by(1 + boxes / SAMPLE) {
            let [left, right] = extent(corners, 0).map(|at| at.min(columns));
            let [top, bottom] = extent(corners, 1).map(|at| at.min(rows));
            for y in parts(top, bottom) {
                for x in parts(left, right) {
                    self.tiles[y.0 * across + x.0] += y.1 * x.1;
                }
            }
            let width = i64::from(right - left);
            self.rows[top as usize] += width;
            self.rows[bottom as usize] -= width;
        }
        let all: u64 = self.tiles.iter().sum();
        let most = self.tiles.iter().copied().max().unwrap_or(0);
        if 8 * most <= 5 * all {
            return 0;
        }
        let (mut texels, mut above) = (0, 0);
        let middle = self.rows.iter().position(|more| {
            texels += more;
            above += texels;
            2 * above > all as i64
        });
        let middle = middle.map_or(0, |row| row as u32);
        middle.next_multiple_of(TILE) - middle
    }
}

/// First texel along one axis of the rectangle around a box, and the one after its last.
fn extent(corners: &[BoxCorner], axis: usize) -> [u32; 2] {
    let all = corners.iter().map(|one| u32::from(one.corner[axis]));
    let (low, high) = (all.clone().min(), all.max());
    [low.unwrap_or(0) / UNITS, high.unwrap_or(0).div_ceil(UNITS)]
}

/// Tiles along one axis that contain texels from `low` to before `high`, with the number of these texels in each.
fn parts(low: u32, high: u32) -> impl Iterator<Item = (usize, u64)> {
    (low / TILE..high.div_ceil(TILE)).map(move |tile| {
        let texels = high.min((tile + 1) * TILE) - low.max(tile * TILE);
        (tile as usize, texels.into())
    })
}

impl BoxCorner {
    /// Moves a corner down by a number of rows.
    pub(super) fn move_down(&mut self, rows: u32) {
        let [a, b, x, z] = &mut self.turn;
        let twice = 2 * rows as i32;
        // Intermediate sums may wrap; the results fit.
        *x = x.wrapping_sub(b.wrapping_mul(twice));
        *z = z.wrapping_sub(a.wrapping_mul(twice));
        self.corner[1] += (rows * UNITS) as u16;
    }
}

impl PlacedDisc {
    /// Moves a disc and its map down by a number of rows.
    pub(super) fn move_down(&mut self, rows: u32) {
        self.disc[1] += rows as i32 * SUB_TEXELS;
        self.clip[1] += rows as u16;
        self.clip[3] += rows as u16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(list: &[[u16; 4]]) -> Vec<BoxCorner> {
        let corner = |corner: [u16; 2]| BoxCorner {
            corner: corner.map(|texel| texel * UNITS as u16),
            turn: [0; 4],
            map: [0; 4],
        };
        let of = |&[x, y, end_x, end_y]: &[u16; 4]| {
            [[x, y], [end_x, y], [x, end_y], [end_x, end_y]].map(corner)
        };
        list.iter().flat_map(of).collect()
    }

    #[test]
    fn what_lies_in_one_tile_comes_to_lie_in_two() {
        let mut balance = Balance::default();
        let one_tile = boxes(&[[3, 10, 30, 30], [3, 14, 30, 34]]);
        assert_eq!(balance.shift(&one_tile, [60, 40]), 64 - 22);
        let all_of_the_first = boxes(&[[0, 0, 64, 64]]);
        assert_eq!(balance.shift(&all_of_the_first, [64, 64]), 64 - 32);
        let mostly_lower = boxes(&[[0, 0, 10, 60], [0, 70, 60, 100]]);
        assert_eq!(balance.shift(&mostly_lower, [64, 100]), 128 - 80);
    }

    #[test]
    fn what_lies_in_several_tiles_stays() {
        let mut balance = Balance::default();
        let side_by_side = boxes(&[[0, 0, 60, 40], [66, 0, 126, 40]]);
        assert_eq!(balance.shift(&side_by_side, [128, 40]), 0);
        let across = boxes(&[[0, 40, 40, 90]]);
        assert_eq!(balance.shift(&across, [40, 90]), 0);
        assert_eq!(balance.shift(&[], [40, 90]), 0);
        assert_eq!(balance.shift(&[], [0, 0]), 0);
    }
}

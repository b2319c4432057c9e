//! Obstacles by the cells of the ground that they come near to: what a small sphere may touch is one look-up.

use glam::{Vec2, Vec3};

use super::column::Heights;
use super::{Obstacle, Shape};

/// Square cells around a place, each with the obstacles that a small sphere above it may touch.
#[derive(Clone, Debug, Default)]
pub(in crate::query) struct ObstacleCells {
    /// Lowest x and z coordinates of all cells.
    corner: Vec2,
    /// Start of each cell in `list`. The last entry is the length of the list.
    first: Vec<u32>,
    /// Obstacles by cell.
    list: Vec<u32>,
    /// Cells and obstacles by obstacle.
    covered: Vec<Covered>,
}

/// A cell that an obstacle comes near to.
#[derive(Clone, Copy, Debug)]
struct Covered {
    cell: u32,
    obstacle: u32,
}

/// Input that the cells depend on.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct CellRange {
    /// Middle of the cells, in metres.
    pub middle: Vec3,
    /// Largest radius of a sphere, in metres.
    pub radius: f32,
    /// Time during which obstacles move, in seconds.
    pub seconds: f32,
}

impl ObstacleCells {
    /// Side of a cell, in metres.
    const SIDE: f32 = 0.4;
    /// Number of cells in a row, and number of rows.
    const ROW: usize = 32;

    /// Replaces the obstacles.
    pub(in crate::query) fn fill(&mut self, obstacles: &[Obstacle], range: CellRange) {
        let width = Self::SIDE * Self::ROW as f32;
        self.corner = Vec2::new(range.middle.x, range.middle.z) - 0.5 * width;
        self.covered.clear();
        for (index, obstacle) in obstacles.iter().enumerate() {
            self.cover(index as u32, obstacle, range);
        }
        self.first.clear();
        self.first.resize(Self::ROW * Self::ROW + 1, 0);
        for one in &self.covered {
            self.first[one.cell as usize + 1] += 1;
        }
        for cell in 1..self.first.len() {
            self.first[cell] += self.first[cell - 1];
        }
        self.list.clear();
        self.list.resize(self.covered.len(), 0);
        // Backwards, so that each cell's end becomes its start.
        for one in self.covered.iter().rev() {
            let end = &mut self.first[one.cell as usize + 1];
            *end -= 1;
            self.list[*end as usize] = one.obstacle;
        }
        self.first.rotate_left(1);
        if let Some(last) = self.first.last_mut() {
            *last = self.covered.len() as u32;
        }
    }

    /// The obstacles that a sphere at a place of the ground (x, z) may touch; none outside of all cells.
    #[inline]
    pub(in crate::query) fn near(&self, place: Vec2) -> &[u32] {
        let at = (place - self.corner) / Self::SIDE;
        let end = Self::ROW as f32;
        if !(at.x >= 0.0 && at.y >= 0.0 && at.x < end && at.y < end) || self.first.is_empty() {
            return &[];
        }
        let cell = at.y as usize * Self::ROW + at.x as usize;
        &self.list[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    fn cover(&mut self, index: u32, obstacle: &Obstacle, range: CellRange) {
        let bounds = obstacle.ground_bounds(range.seconds);
        let limit = (Self::ROW - 1) as f32;
        let [low, high] = [(bounds[0], -range.radius), (bounds[1], range.radius)]
            .map(|(bound, wider)| ((bound + wider - self.corner) / Self::SIDE).floor());
        if low.x > limit || low.y > limit || high.x < 0.0 || high.y < 0.0 {
            return;
        }
        let [low, high] = [low, high].map(|at| at.clamp(Vec2::ZERO, Vec2::splat(limit)));
        // A sphere above a cell is at most so far from its middle.
        let around = range.radius + 0.5 * std::f32::consts::SQRT_2 * Self::SIDE;
        let heights = Heights {
            low: range.middle.y - 10.0,
            high: range.middle.y + 10.0,
        };
        let is_still = obstacle.velocity == Vec3::ZERO;
        for row in low.y as usize..=high.y as usize {
            for column in low.x as usize..=high.x as usize {
                let at = Vec2::new(column as f32, row as f32) + 0.5;
                let middle = self.corner + at * Self::SIDE;
                if is_still && obstacle.metres_from_line(middle, heights, 0.0) > around {
                    continue;
                }
                self.covered.push(Covered {
                    cell: (row * Self::ROW + column) as u32,
                    obstacle: index,
                });
            }
        }
    }
}

impl Obstacle {
    /// Lowest and highest x and z coordinates from now until `seconds` from now.
    fn ground_bounds(&self, seconds: f32) -> [Vec2; 2] {
        let ground = |point: Vec3| Vec2::new(point.x, point.z);
        let around = |middle: Vec2, half: Vec2| [middle - half, middle + half];
        let [low, high] = match &self.shape {
            Shape::HalfSpace { .. } => [Vec2::NEG_INFINITY, Vec2::INFINITY],
            Shape::Block { center, half, .. } => {
                around(ground(*center), Vec2::splat(ground(*half).length()))
            }
            Shape::Capsule { from, to, radius } => {
                let [from, to] = [from, to].map(|end| ground(*end));
                [from.min(to) - *radius, from.max(to) + *radius]
            }
            Shape::Prism { corners, count } => {
                let corners = &corners[..*count];
                [
                    corners.iter().copied().fold(Vec2::INFINITY, Vec2::min),
                    corners.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max),
                ]
            }
            Shape::Disc { center, radius } => around(*center, Vec2::splat(*radius)),
        };
        let ways = [self.later, self.later + seconds].map(|time| ground(self.velocity) * time);
        [
            low + ways[0].min(ways[1]) - self.margin,
            high + ways[0].max(ways[1]) + self.margin,
        ]
    }
}

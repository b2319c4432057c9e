//! Pairs of windows that a lower bound does not show to be far apart.

use crate::graph::search::features::{Features, NODE, NODES};
use std::ops::Range;

/// A window pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct WindowCell {
    /// Window of the first cloud.
    pub(crate) row: u32,
    /// Window of the second cloud.
    pub(crate) column: u32,
}

/// The search for near pairs of the windows of two clouds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearSearch<'a> {
    pub(crate) features: [&'a Features; 2],
    /// Square of the distance below which pairs are near, in square metres.
    pub(crate) limit: f32,
    /// Difference between that distance and the smaller one that the features are made for, in metres.
    pub(crate) beyond: f32,
    /// Minimum number of columns between the diagonal and a minimum in the map of a clip with itself; `None` for two clips.
    pub(crate) gap: Option<usize>,
    pub(crate) columns: usize,
}

impl NearSearch<'_> {
    /// First column that can be a minimum or a neighbour of one.
    fn first_column(&self, row: usize) -> usize {
        self.gap.map_or(0, |gap| (row + gap).saturating_sub(2))
    }

    /// Finds all pairs of the windows `rows` of the first cloud that are near, and some farther pairs.
    #[inline(always)]
    pub(crate) fn find(&self, rows: Range<usize>, near: &mut Vec<WindowCell>) {
        for node in rows.start / NODE..rows.end.div_ceil(NODE) {
            let own = rows.start.max(node * NODE)..rows.end.min((node + 1) * NODE);
            self.find_of_node(node, own, near);
        }
    }

    /// Finds the pairs of the windows `rows`, which belong to one ball.
    #[inline(always)]
    fn find_of_node(&self, node: usize, rows: Range<usize>, near: &mut Vec<WindowCell>) {
        let [a, b] = self.features;
        let ball = a.ball(node);
        let own = bits(rows.start - node * NODE..rows.end - node * NODE);
        for group in self.first_column(rows.start) / NODE / NODES..b.groups() {
            let mut balls = b.near_balls(ball, group, self.beyond);
            while balls != 0 {
                let other = group * NODES + balls.trailing_zeros() as usize;
                balls &= balls - 1;
                if other >= b.nodes() {
                    break;
                }
                let mut windows = own & a.windows_near_ball(node, b.ball(other), self.beyond);
                while windows != 0 {
                    let row = node * NODE + windows.trailing_zeros() as usize;
                    windows &= windows - 1;
                    self.find_of_row(row, other, near);
                }
            }
        }
    }

    /// Finds the windows of a ball of the second cloud that are near a row.
    #[inline(always)]
    fn find_of_row(&self, row: usize, other: usize, near: &mut Vec<WindowCell>) {
        let [a, b] = self.features;
        let first = self.first_column(row);
        if (other + 1) * NODE <= first {
            return;
        }
        let mut columns = b.near_windows(a.window(row), other, self.limit);
        while columns != 0 {
            let column = other * NODE + columns.trailing_zeros() as usize;
            columns &= columns - 1;
            if column >= first && column < self.columns {
                near.push(WindowCell {
                    row: row as u32,
                    column: column as u32,
                });
            }
        }
    }
}

/// A bit for each index of a range within a ball.
#[inline(always)]
fn bits(range: Range<usize>) -> u32 {
    (1 << range.end) - (1 << range.start)
}

//! The projections of a clip's windows, in the layout that bounds are computed from, and the search for near pairs by these bounds.

use crate::graph::search::projection::{Complex, HEIGHTS, PLACES, Projected, Projection};
use crate::graph::search::windows::Windows;
use std::ops::Range;

/// Number of neighbouring windows in a ball.
pub(crate) const NODE: usize = 8;

/// Number of balls that are compared together.
const NODES: usize = 16;

/// Number of real values of a window: projected heights, and two lengths of remainders.
const REALS: usize = HEIGHTS + 2;

/// Norm of padding windows after the last one, so that no distance to them is below a threshold.
const NOWHERE: f32 = 1e30;

/// Twice the rounding error of a squared distance, in units of the mean square of a window's points, for `joints` joints.
///
/// The kernel of the distance map adds the products of two windows with at most `joints + 4` roundings of 2^-24 (Higham, "Accuracy and
/// stability of numerical algorithms", section 3.1), that of a bound with at most `REALS + 2 * PLACES`, and both with a few more for the
/// norms. By the Cauchy–Schwarz inequality a sum of products is at most the mean of the two windows' squares.
const fn slack(joints: usize) -> f64 {
    const UNIT: f64 = 1.0 / (1 << 24) as f64;
    4.0 * (joints + REALS + 4 * PLACES + 16) as f64 * UNIT
}

#[derive(Clone, Copy, Debug)]
struct Tile<const L: usize> {
    reals: [[f32; L]; REALS],
    re: [[f32; L]; PLACES],
    im: [[f32; L]; PLACES],
    norm: [f32; L],
}

/// Projection of one window that is compared with many windows.
#[derive(Clone, Copy, Debug)]
struct Query {
    reals: [f32; REALS],
    re: [f32; PLACES],
    im: [f32; PLACES],
    norm: f32,
}

/// [`NODES`] balls, each of [`NODE`] neighbouring windows around their middle one.
#[derive(Clone, Copy, Debug)]
struct Group {
    centres: Tile<NODES>,
    /// Radius of each ball, enlarged by half of the threshold.
    radii: [f32; NODES],
}

#[derive(Clone, Debug)]
pub(crate) struct Features {
    /// Single windows and balls, to be compared with many.
    windows: Vec<Query>,
    balls: Vec<Ball>,
    /// Windows and balls that one is compared with.
    tiles: Vec<Tile<NODE>>,
    groups: Vec<Group>,
    /// Radius of the ball of each single window, in metres.
    reaches: Vec<[f32; NODE]>,
}

/// A ball whose neighbours are searched.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Query,
    /// Radius of the ball, enlarged by half of the threshold.
    radius: f32,
}

impl<const L: usize> Tile<L> {
    const EMPTY: Self = Self {
        reals: [[0.0; L]; REALS],
        re: [[0.0; L]; PLACES],
        im: [[0.0; L]; PLACES],
        norm: [NOWHERE; L],
    };

    fn set(&mut self, lane: usize, window: &Query) {
        for (row, value) in self.reals.iter_mut().zip(window.reals) {
            row[lane] = value;
        }
        for (row, value) in self.re.iter_mut().zip(window.re) {
            row[lane] = value;
        }
        for (row, value) in self.im.iter_mut().zip(window.im) {
            row[lane] = value;
        }
        self.norm[lane] = window.norm;
    }

    /// Lower bounds of the squared distances, in square metres.
    #[inline(always)]
    fn squared(&self, window: &Query) -> [f32; L] {
        let (mut real, mut dot, mut cross) = ([0.0f32; L], [0.0f32; L], [0.0f32; L]);
        for (row, value) in self.reals.iter().zip(window.reals) {
            for lane in 0..L {
                real[lane] += value * row[lane];
            }
        }
        for index in 0..PLACES {
            let (re, im) = (window.re[index], window.im[index]);
            let (x, z) = (&self.re[index], &self.im[index]);
            for lane in 0..L {
                dot[lane] += re * x[lane] + im * z[lane];
                cross[lane] += re * z[lane] - im * x[lane];
            }
        }
        let mut out = [0.0; L];
        for lane in 0..L {
            let turned = (dot[lane] * dot[lane] + cross[lane] * cross[lane]).sqrt();
            out[lane] = window.norm + self.norm[lane] - 2.0 * (real[lane] + turned);
        }
        out
    }
}

impl Query {
    /// Converts a projection. `slack` is subtracted from its norm.
    fn new(projected: &Projected, slack: f64) -> Self {
        let reals: [f32; REALS] = std::array::from_fn(|index| match index.checked_sub(HEIGHTS) {
            None => projected.heights[index] as f32,
            Some(index) => projected.remainders[index] as f32,
        });
        let mut query = Self {
            reals,
            re: projected.places.map(|[re, _]| re as f32),
            im: projected.places.map(|[_, im]| im as f32),
            norm: 0.0,
        };
        query.norm = (query.square() - slack) as f32;
        query
    }

    fn square(&self) -> f64 {
        let all = self.reals.iter().chain(&self.re).chain(&self.im);
        all.map(|&value| f64::from(value) * f64::from(value)).sum()
    }

    /// Distance of two projections, in metres.
    fn distance(&self, other: &Self) -> f64 {
        let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
        let reals: f64 = self
            .reals
            .iter()
            .zip(&other.reals)
            .map(|(&a, &b)| product(a, b))
            .sum();
        let mut turned: Complex = [0.0; 2];
        for index in 0..PLACES {
            let (a, b) = (self.re[index], self.im[index]);
            let (c, d) = (other.re[index], other.im[index]);
            turned[0] += product(a, c) + product(b, d);
            turned[1] += product(a, d) - product(b, c);
        }
        let both = self.square() + other.square();
        let square = both - 2.0 * (reals + turned[0].hypot(turned[1]));
        square.max(0.0).sqrt()
    }
}

impl Ball {
    /// Returns a bit for each of several balls, set if it may contain a window near a window of this one, or if its distance is not a number.
    /// Windows are near if they are at most `beyond` metres farther apart than the threshold.
    #[inline(always)]
    fn near<const L: usize>(&self, centres: &Tile<L>, radii: &[f32; L], beyond: f32) -> u32 {
        let squared = centres.squared(&self.centre);
        let mut near = 0;
        for (lane, (squared, radius)) in squared.iter().zip(radii).enumerate() {
            let reach = self.radius + radius + beyond;
            near |= unless(*squared > reach * reach) << lane;
        }
        near
    }
}

impl Features {
    /// Projects the windows of a clip. `threshold` is that of the search, in metres.
    pub(crate) fn new(projection: &Projection, clip: &Windows, threshold: f32) -> Self {
        let slack = slack(clip.weights.len());
        let windows = projection.project(clip).enumerate().map(|(at, projected)| {
            let slack = slack * clip.mean_square(at);
            (Query::new(&projected, slack), slack)
        });
        let windows: Vec<(Query, f64)> = windows.collect();
        let nodes = windows.len().div_ceil(NODE);
        let empty = Group {
            centres: Tile::EMPTY,
            radii: [0.0; NODES],
        };
        let mut features = Self {
            windows: windows.iter().map(|(window, _)| *window).collect(),
            balls: Vec::with_capacity(nodes),
            tiles: vec![Tile::EMPTY; nodes],
            groups: vec![empty; nodes.div_ceil(NODES)],
            reaches: vec![[0.0; NODE]; nodes],
        };
        for (node, own) in windows.chunks(NODE).enumerate() {
            for (lane, (window, _)) in own.iter().enumerate() {
                features.tiles[node].set(lane, window);
            }
            let (centre, _) = &own[own.len() / 2];
            let threshold = f64::from(threshold);
            // √(t² + 2 s) is at most t + s / t, and at most t + √(2 s).
            let extra = |slack: f64| (slack / threshold).min((2.0 * slack).sqrt());
            let rounded_up = |radius: f64| (radius * (1.0 + 1e-5) + 1e-6) as f32;
            let own_reach = |&(_, slack): &(Query, f64)| 0.5 * threshold + extra(slack);
            for (reach, own) in features.reaches[node].iter_mut().zip(own) {
                *reach = rounded_up(own_reach(own));
            }
            let reach = |own: &(Query, f64)| centre.distance(&own.0) + own_reach(own);
            let radius = rounded_up(own.iter().map(reach).fold(0.0, f64::max));
            let group = &mut features.groups[node / NODES];
            group.centres.set(node % NODES, centre);
            group.radii[node % NODES] = radius;
            features.balls.push(Ball {
                centre: *centre,
                radius,
            });
        }
        features
    }

    /// Returns a bit for each window of a ball, set if its distance from a window may be below the square root of `limit`, or is not a number.
    #[inline(always)]
    fn near_windows(&self, window: &Query, node: usize, limit: f32) -> u32 {
        let squared = self.tiles[node].squared(window);
        let mut near = 0;
        for (lane, squared) in squared.iter().enumerate() {
            near |= unless(*squared >= limit) << lane;
        }
        near
    }
}

/// 1, or 0 if a bound is beyond its limit. In this form the compiler keeps nearly all lanes together; with a constant for each lane it tears them
/// apart.
#[inline(always)]
fn unless(far: bool) -> u32 {
    u32::from(!far)
}

// Pairs of windows that a lower bound does not show to be far apart.

/// A window pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct WindowCell {
    /// Window of the first cloud.
    pub(crate) row: u32,
    /// Window of the second cloud.
    pub(crate) column: u32,
}

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
        let ball = &a.balls[node];
        let own = bits(rows.start - node * NODE..rows.end - node * NODE);
        for group in self.first_column(rows.start) / NODE / NODES..b.groups.len() {
            let Group { centres, radii } = &b.groups[group];
            let mut balls = ball.near(centres, radii, self.beyond);
            while balls != 0 {
                let other = group * NODES + balls.trailing_zeros() as usize;
                balls &= balls - 1;
                if other >= b.balls.len() {
                    break;
                }
                let (tile, reaches) = (&a.tiles[node], &a.reaches[node]);
                let mut windows = own & b.balls[other].near(tile, reaches, self.beyond);
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
        let mut columns = b.near_windows(&a.windows[row], other, self.limit);
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

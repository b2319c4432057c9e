//! Covers many points with few balls.
//!
//! Source: Stolpner, Kry & Siddiqi, "Medial Spheres for Shape Approximation" (2012). Balls inside
//! the solid that touch its surface are enlarged by the allowed error, and as few as possible are
//! kept to cover the surface, by greedy set cover (Chvátal 1979). Differs: a point counts as
//! covered if it sticks out of an enlarged ball by at most a second tolerance, because between two
//! balls of a limb a dent remains in any case. The selected balls are then exchanged for better
//! ones, as in Lloyd's method, while that reduces the deepest dent.

use glam::Vec3;

use super::medial::Ball;

/// Input of the cover. The balls already have their final radii.
pub(super) struct Cover<'a> {
    pub points: &'a [Vec3],
    /// Balls to choose from.
    pub balls: Vec<Ball>,
    /// Distance that a point may stick out, in metres.
    pub allowed: f32,
    /// Maximum number of balls.
    pub most: usize,
}

impl Cover<'_> {
    /// Chooses balls. `ball_at` returns a ball that covers a point, for points that no candidate
    /// covers.
    pub(super) fn choose(mut self, ball_at: impl Fn(usize) -> Ball) -> Vec<Ball> {
        let mut chosen = self.greedy(ball_at);
        self.drop_needless(&mut chosen);
        self.exchange(&mut chosen);
        chosen.into_iter().map(|ball| self.balls[ball]).collect()
    }

    fn covers(&self, ball: usize, point: usize) -> bool {
        self.balls[ball].distance(self.points[point]) <= self.allowed
    }

    /// Repeatedly chooses the ball that covers the most remaining points. Ties are decided for the
    /// larger ball, then for the first.
    fn greedy(&mut self, ball_at: impl Fn(usize) -> Ball) -> Vec<usize> {
        let covered: Vec<PointSet> = (0..self.balls.len())
            .map(|ball| self.covered_by(ball))
            .collect();
        let mut left = PointSet::all(self.points.len());
        let mut chosen = Vec::new();
        while chosen.len() < self.most {
            let Some(open) = left.first() else { break };
            let gain = |ball: usize| (covered[ball].common(&left), self.balls[ball].radius);
            let gains: Vec<(u32, f32)> = (0..covered.len()).map(gain).collect();
            let order = |&a: &usize, &b: &usize| {
                let by_radius = gains[a].1.total_cmp(&gains[b].1);
                gains[a].0.cmp(&gains[b].0).then(by_radius).then(b.cmp(&a))
            };
            let best = (0..covered.len())
                .max_by(order)
                .filter(|&ball| gains[ball].0 > 0);
            if let Some(ball) = best {
                left.remove(&covered[ball]);
                chosen.push(ball);
            } else {
                let ball = self.balls.len();
                self.balls.push(ball_at(open));
                left.remove(&self.covered_by(ball));
                // The ball was created to cover this point, so the point is removed even if
                // rounding says otherwise.
                left.clear(open);
                chosen.push(ball);
            }
        }
        chosen
    }

    fn covered_by(&self, ball: usize) -> PointSet {
        PointSet::of(self.points.len(), |point| self.covers(ball, point))
    }

    /// Removes balls whose points later choices cover completely.
    fn drop_needless(&self, chosen: &mut Vec<usize>) {
        let mut times = vec![0_u32; self.points.len()];
        for &ball in chosen.iter() {
            for point in (0..self.points.len()).filter(|&point| self.covers(ball, point)) {
                times[point] += 1;
            }
        }
        for at in (0..chosen.len()).rev() {
            let ball = chosen[at];
            let own: Vec<usize> = (0..self.points.len())
                .filter(|&point| self.covers(ball, point))
                .collect();
            if chosen.len() > 1 && !own.is_empty() && own.iter().all(|&point| times[point] > 1) {
                own.iter().for_each(|&point| times[point] -= 1);
                chosen.remove(at);
            }
        }
    }

    /// Replaces each ball by the candidate that its points stick out of least, as long as the
    /// maximum error decreases.
    fn exchange(&self, chosen: &mut Vec<usize>) {
        const ROUNDS: usize = 6;
        let mut worst = self.worst(chosen);
        for _ in 0..ROUNDS {
            let mut mine = vec![Vec::new(); chosen.len()];
            for &point in self.points {
                let far = |&at: &usize| self.balls[chosen[at]].distance(point);
                let nearest = (0..chosen.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                if let Some(at) = nearest {
                    mine[at].push(point);
                }
            }
            let better: Vec<usize> = chosen
                .iter()
                .zip(&mine)
                .map(|(&ball, mine)| self.best_for(mine, ball))
                .collect();
            let deepest = self.worst(&better);
            if deepest >= worst {
                break;
            }
            (*chosen, worst) = (better, deepest);
        }
    }

    fn best_for(&self, points: &[Vec3], now: usize) -> usize {
        let deepest = |ball: usize, limit: f32| {
            let mut most = f32::NEG_INFINITY;
            for &point in points {
                most = most.max(self.balls[ball].distance(point));
                if most >= limit {
                    break;
                }
            }
            most
        };
        let (mut best, mut least) = (now, deepest(now, f32::INFINITY));
        for ball in 0..self.balls.len() {
            let most = deepest(ball, least);
            if most < least {
                (best, least) = (ball, most);
            }
        }
        best
    }

    /// Maximum distance by which a point sticks out.
    fn worst(&self, chosen: &[usize]) -> f32 {
        let out = |&point: &Vec3| {
            chosen
                .iter()
                .map(|&ball| self.balls[ball].distance(point))
                .fold(f32::INFINITY, f32::min)
        };
        self.points
            .iter()
            .map(out)
            .fold(f32::NEG_INFINITY, f32::max)
    }
}

/// A set of points.
struct PointSet(Vec<u64>);

impl PointSet {
    fn of(count: usize, has: impl Fn(usize) -> bool) -> Self {
        let word = |word: usize| {
            let points = 64 * word..count.min(64 * (word + 1));
            points.fold(0, |bits, point| {
                bits | u64::from(has(point)) << (point % 64)
            })
        };
        Self((0..count.div_ceil(64)).map(word).collect())
    }

    fn all(count: usize) -> Self {
        Self::of(count, |_| true)
    }

    fn first(&self) -> Option<usize> {
        let word = self.0.iter().position(|&bits| bits != 0)?;
        Some(64 * word + self.0[word].trailing_zeros() as usize)
    }

    fn common(&self, other: &Self) -> u32 {
        self.0
            .iter()
            .zip(&other.0)
            .map(|(a, b)| (a & b).count_ones())
            .sum()
    }

    fn remove(&mut self, other: &Self) {
        self.0
            .iter_mut()
            .zip(&other.0)
            .for_each(|(bits, gone)| *bits &= !gone);
    }

    fn clear(&mut self, point: usize) {
        self.0[point / 64] &= !(1 << (point % 64));
    }
}

//! Lower bounds of the distance of two windows, which need a fraction of its work.
//!
//! Sources: that a contraction never loses a near pair is from Faloutsos, Ranganathan & Manolopoulos, "Fast subsequence matching
//! in time-series databases" (1994); that principal components are the contraction that keeps most, from Korn, Jagadish &
//! Faloutsos (1997); balls and the triangle inequality are from Yianilos, "Data structures and algorithms for nearest neighbor
//! search in general metric spaces" (1993).
//!
//! The points of a window are a vector: a real number for each height and, because rotations about the vertical axis are
//! products with a complex number of length 1, a complex number for each place on the ground, relative to the ground mean. Each
//! is scaled by the root of its weight. With the inner products of such vectors, the distance that
//! [`distance`](crate::graph::search::distance) defines is
//! ```text
//! D²(P, Q) = min over φ of |hP - hQ|² + |gP - e^iφ gQ|²
//! ```
//! - **Contraction.** An orthogonal projection onto k directions does not commute with heights alone: it commutes with φ too.
//!   Of what it leaves out, at least the lengths are known, and lengths do not depend on φ. So, with projections h', g' and
//!   lengths of the remainders r, s:
//!   ```text
//!   d² = |h'P - h'Q|² + (rP - rQ)² + (sP - sQ)² + |g'P|² + |g'Q|² - 2 |<g'P, g'Q>|  ≤  D²
//!   ```
//! - **Balls.** φ acts by isometries, so d is a distance itself, and the triangle inequality holds. For windows within r of a
//!   window C and windows within s of a window E, d is at least d(C, E) - r - s.
//! - **Rounding.** The kernel of the distance map computes in f32. The norms of windows are reduced by more than its error, so
//!   that the bound is below the computed distance too: see `slack` in `features`.

use crate::graph::search::windows::Windows;

// Directions onto which windows are projected.
//
// A direction is the product of one over the joints and one over the frames. Those over the joints are principal components,
// found by orthogonal iteration (Golub & Van Loan, "Matrix computations", section 7.3.2); those over the frames are the first
// cosines of the discrete cosine transform. Any orthonormal directions give bounds that hold, so nothing depends on how exact
// they are.

/// Number of directions for heights.
pub(crate) const HEIGHTS: usize = 6;

/// Number of directions on the ground.
pub(crate) const PLACES: usize = 8;

/// Number of principal components, and number of cosines, from which the directions are chosen.
const COMPONENTS: usize = 8;
const COSINES: usize = 3;

/// Number of windows that the directions are chosen for.
const SAMPLES: usize = 1024;

/// A complex number: real and imaginary part.
pub(crate) type Complex = [f64; 2];

/// Orthonormal directions of windows.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    window: usize,
    /// Root of each joint's weight.
    roots: Vec<f64>,
    /// Mean height of each joint. Heights are relative to it.
    heights: Vec<f64>,
    /// Directions over the joints for heights. Their imaginary parts are 0.
    high: Vec<Vec<Complex>>,
    /// Directions over the joints for ground positions. The first one is the ground mean.
    ground: Vec<Vec<Complex>>,
    /// Directions over the frames.
    cosines: Vec<Vec<f64>>,
    /// Products of directions that are used for heights. Each is an index of a direction over the joints and one of a direction over the frames.
    of_heights: Vec<[usize; 2]>,
    of_places: Vec<[usize; 2]>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Projected {
    pub(crate) heights: [f64; HEIGHTS],
    /// Lengths of the remainders that the directions for heights and those on the ground do not represent.
    pub(crate) remainders: [f64; 2],
    pub(crate) places: [Complex; PLACES],
}

impl Projection {
    /// Chooses directions that keep much of the windows of `clips`, which have the same joints.
    pub(crate) fn new(clips: &[&Windows]) -> Self {
        let windows: usize = clips.iter().map(|clip| clip.count()).sum();
        let window = clips.first().map_or(1, |clip| clip.window());
        let weights = clips.first().map_or(&[][..], |clip| &clip.weights[..]);
        let step = windows.div_ceil(SAMPLES).max(1);
        let samples: Vec<(&Windows, usize)> = clips
            .iter()
            .flat_map(|&clip| (0..clip.count()).map(move |at| (clip, at)))
            .step_by(step)
            .collect();
        let mut projection = Self {
            window,
            roots: weights.iter().map(|&w| f64::from(w).sqrt()).collect(),
            heights: mean_heights(&samples, weights.len()),
            high: Vec::new(),
            ground: Vec::new(),
            cosines: cosines(window),
            of_heights: Vec::new(),
            of_places: Vec::new(),
        };
        let joints = weights.len();
        let (mut high, mut ground) = (Covariance::new(joints), Covariance::new(joints));
        let total: f64 = projection.roots.iter().map(|root| root * root).sum();
        for &(clip, frame) in &samples {
            let points = projection.points(clip, frame);
            high.add(&points.heights);
            // The part along the ground mean is a direction of its own.
            let mean = points
                .places
                .iter()
                .zip(&projection.roots)
                .fold([0.0; 2], |sum, (place, root)| {
                    [0, 1].map(|axis| sum[axis] + root * place[axis] / total)
                });
            let around: Vec<Complex> = points
                .places
                .iter()
                .zip(&projection.roots)
                .map(|(place, root)| [0, 1].map(|axis| place[axis] - root * mean[axis]))
                .collect();
            ground.add(&around);
        }
        projection.high = high.components(COMPONENTS, &[]);
        let mean: Vec<Complex> = projection
            .roots
            .iter()
            .map(|root| [root / total.sqrt(), 0.0])
            .collect();
        projection.ground = ground.components(COMPONENTS, std::slice::from_ref(&mean));
        projection.ground.insert(0, mean);
        projection.choose(&samples);
        projection
    }

    /// Chooses the products of directions that keep most of the samples.
    fn choose(&mut self, samples: &[(&Windows, usize)]) {
        let cosines = self.cosines.len();
        let all = |joints: std::ops::Range<usize>| -> Vec<[usize; 2]> {
            joints
                .flat_map(|joint| (0..cosines).map(move |cosine| [joint, cosine]))
                .collect()
        };
        let high = all(0..self.high.len());
        // The window's ground mean lies at the origin, which makes its projection 0.
        let ground = all(0..self.ground.len()).split_off(1);
        let mut kept = [vec![0.0; high.len()], vec![0.0; ground.len()]];
        for &(clip, at) in samples {
            let frames: Vec<Frame> = (at..at + self.window)
                .map(|f| self.frame(clip, f))
                .collect();
            for (kept, &[joint, cosine]) in kept[0].iter_mut().zip(&high) {
                *kept += square(self.over_frames(&frames, cosine, |frame| frame.high[joint]));
            }
            for (kept, &[joint, cosine]) in kept[1].iter_mut().zip(&ground) {
                *kept += square(self.over_frames(&frames, cosine, |frame| frame.ground[joint]));
            }
        }
        let best = |pairs: &[[usize; 2]], kept: &[f64], count: usize| {
            let mut order: Vec<usize> = (0..pairs.len()).collect();
            order.sort_by(|&a, &b| kept[b].total_cmp(&kept[a]));
            order
                .into_iter()
                .take(count)
                .map(|index| pairs[index])
                .collect()
        };
        self.of_heights = best(&high, &kept[0], HEIGHTS);
        self.of_places = best(&ground, &kept[1], PLACES);
    }

    pub(crate) fn project(&self, clip: &Windows) -> impl Iterator<Item = Projected> {
        let frames = match clip.count() {
            0 => 0,
            _ => clip.frames,
        };
        let frames: Vec<Frame> = (0..frames).map(|frame| self.frame(clip, frame)).collect();
        (0..clip.count()).map(move |at| {
            let [x, z] = clip.ground_mean(at);
            let frames = &frames[at..at + self.window];
            let mean = |of: usize| -> f64 {
                frames.iter().map(|f| f.squares[of]).sum::<f64>() / self.window as f64
            };
            let (mut height, mut place) = (mean(0), mean(1) - (x * x + z * z));
            let mut projected = Projected::default();
            for (out, &[joint, cosine]) in projected.heights.iter_mut().zip(&self.of_heights) {
                *out = self.over_frames(frames, cosine, |frame| frame.high[joint])[0];
                height -= *out * *out;
            }
            for (out, &[joint, cosine]) in projected.places.iter_mut().zip(&self.of_places) {
                *out = self.over_frames(frames, cosine, |frame| frame.ground[joint]);
                place -= square(*out);
            }
            projected.remainders = [height, place].map(|square| square.max(0.0).sqrt());
            projected
        })
    }

    /// Projects the points of a frame onto the directions over the joints.
    fn frame(&self, clip: &Windows, frame: usize) -> Frame {
        let points = self.points(clip, frame);
        let mut projected = Frame {
            squares: [&points.heights, &points.places]
                .map(|points| points.iter().map(|&point| square(point)).sum()),
            ..Frame::default()
        };
        for (out, direction) in projected.high.iter_mut().zip(&self.high) {
            *out = inner(direction, &points.heights);
        }
        for (out, direction) in projected.ground.iter_mut().zip(&self.ground) {
            *out = inner(direction, &points.places);
        }
        projected
    }

    fn over_frames(
        &self,
        frames: &[Frame],
        cosine: usize,
        of: impl Fn(&Frame) -> Complex,
    ) -> Complex {
        let mut sum = [0.0; 2];
        for (frame, weight) in frames.iter().zip(&self.cosines[cosine]) {
            let [re, im] = of(frame);
            sum[0] += weight * re;
            sum[1] += weight * im;
        }
        let scale = 1.0 / (self.window as f64).sqrt();
        [scale * sum[0], scale * sum[1]]
    }

    fn points(&self, clip: &Windows, frame: usize) -> Points {
        let joints = self.roots.iter().zip(&self.heights).enumerate();
        let (heights, places) = joints
            .map(|(joint, (root, height))| {
                let [x, y, z] = clip.point(frame, joint).map(f64::from);
                ([root * (y - height), 0.0], [root * x, root * z])
            })
            .unzip();
        Points { heights, places }
    }
}

/// A frame's points, projected onto the directions over the joints.
#[derive(Clone, Copy, Default)]
struct Frame {
    high: [Complex; COMPONENTS],
    ground: [Complex; COMPONENTS + 1],
    /// Sum of the squares of all heights, and sum of the squares of all ground positions.
    squares: [f64; 2],
}

/// Points of a frame, scaled by the roots of the weights.
struct Points {
    heights: Vec<Complex>,
    places: Vec<Complex>,
}

fn mean_heights(samples: &[(&Windows, usize)], joints: usize) -> Vec<f64> {
    let sum = |joint| -> f64 {
        let heights = samples
            .iter()
            .map(|(clip, frame)| clip.point(*frame, joint)[1]);
        heights.map(f64::from).sum()
    };
    (0..joints)
        .map(|joint| sum(joint) / samples.len().max(1) as f64)
        .collect()
}

/// The first cosines of the orthonormal discrete cosine transform of `window` values.
fn cosines(window: usize) -> Vec<Vec<f64>> {
    let n = window as f64;
    let row = |k: usize| {
        let scale = (if k == 0 { 1.0 } else { 2.0 } / n).sqrt();
        let angle = |f: usize| std::f64::consts::PI * k as f64 * (f as f64 + 0.5) / n;
        (0..window).map(|f| scale * angle(f).cos()).collect()
    };
    (0..COSINES.min(window)).map(row).collect()
}

fn square([re, im]: Complex) -> f64 {
    re * re + im * im
}

/// Inner product of two vectors, with `a` conjugated.
fn inner(a: &[Complex], b: &[Complex]) -> Complex {
    let mut sum = [0.0; 2];
    for (a, b) in a.iter().zip(b) {
        sum[0] += a[0] * b[0] + a[1] * b[1];
        sum[1] += a[0] * b[1] - a[1] * b[0];
    }
    sum
}

/// Sum of the outer products of vectors with themselves: a Hermitian matrix, stored by rows.
struct Covariance {
    rows: Vec<Vec<Complex>>,
}

impl Covariance {
    fn new(joints: usize) -> Self {
        Self {
            rows: vec![vec![[0.0; 2]; joints]; joints],
        }
    }

    fn add(&mut self, points: &[Complex]) {
        for (row, a) in self.rows.iter_mut().zip(points) {
            for (sum, b) in row.iter_mut().zip(points) {
                sum[0] += a[0] * b[0] + a[1] * b[1];
                sum[1] += a[1] * b[0] - a[0] * b[1];
            }
        }
    }

    /// Up to `count` orthonormal directions with the largest eigenvalues among those orthogonal to `others`.
    fn components(&self, count: usize, others: &[Vec<Complex>]) -> Vec<Vec<Complex>> {
        const STEPS: usize = 30;
        let joints = self.rows.len();
        let start = |index: usize| -> Vec<Complex> {
            // The square makes the start vectors independent: sines of evenly spaced angles span only a plane.
            let value = |joint: usize| ((index * joints + joint + 1).pow(2) as f64).sin();
            (0..joints).map(|joint| [value(joint), 0.0]).collect()
        };
        let mut found: Vec<_> = (0..count.min(joints)).map(start).collect();
        orthonormalize(&mut found, others);
        for _ in 0..STEPS {
            for direction in &mut found {
                *direction = self.times(direction);
            }
            orthonormalize(&mut found, others);
        }
        found
    }

    fn times(&self, direction: &[Complex]) -> Vec<Complex> {
        let product = |row: &Vec<Complex>| {
            let mut sum = [0.0; 2];
            for (a, b) in row.iter().zip(direction) {
                sum[0] += a[0] * b[0] - a[1] * b[1];
                sum[1] += a[0] * b[1] + a[1] * b[0];
            }
            sum
        };
        self.rows.iter().map(product).collect()
    }
}

/// Applies Gram–Schmidt orthonormalization twice. A direction that depends on those before it becomes 0, and projects every window to 0.
fn orthonormalize(directions: &mut [Vec<Complex>], others: &[Vec<Complex>]) {
    for index in 0..directions.len() {
        let (before, rest) = directions.split_at_mut(index);
        let own = &mut rest[0];
        let length = |own: &[Complex]| own.iter().map(|&c| square(c)).sum::<f64>().sqrt();
        let at_first = length(own);
        for _ in 0..2 {
            for other in others.iter().chain(before.iter()) {
                let [re, im] = inner(other, own);
                for (own, other) in own.iter_mut().zip(other) {
                    own[0] -= re * other[0] - im * other[1];
                    own[1] -= re * other[1] + im * other[0];
                }
            }
        }
        let left = length(own);
        let scale = match left > 1e-9 * at_first && left > f64::MIN_POSITIVE {
            true => 1.0 / left,
            false => 0.0,
        };
        for value in own.iter_mut().flatten() {
            *value *= scale;
        }
    }
}

//! The smallest distance of two moving spheres, in closed form: of two, of one from all spheres of the body, and of sixteen intervals at once.
//!
//! Source: the reduction to a moving point and a sphere with the sum of the radii is that of Ericson, "Real-Time Collision Detection" (2005),
//! section 5.5.5. Differs: the result is the smallest distance instead of the time of contact, and radii may change. The closed form for
//! changing radii is our own.
//!
//! The inner loop, for sixteen spheres of the body at a time:
//!
//! ```text
//! for each block of 16 spheres:
//!     from, to   = centres at the two samples
//!     apart      = from + (to - from) * shares[0] - segment.centres[0]
//!     motion     = (from + (to - from) * shares[1] - segment.centres[1]) - apart
//!     share      = clamp(-apart·motion / motion², 0, 1)
//!     distance   = |apart + motion * share| - radius
//!     keep the lowest distance and its block, lane by lane
//! the closed form then measures the nearest sphere exactly
//! ```

use glam::Vec3;

use super::extent::SAMPLE_RATE;
use crate::maps::{BodyTrack, MovingSphere, SphereKey, SphereRows};
use crate::math::Isa;

/// The smallest distance of two spheres that move along straight lines. `apart` is the vector from one centre to the other at the start and at
/// the end, and `radii` is the sum of the radii at the start and at the end. Returns the time (0 at the start, 1 at the end) and the distance
/// of the surfaces.
///
/// With d(t) = |a + t v| - (r + t k), a convex function, the smallest value lies at an end or where d' = 0:
/// `(v·a + t v·v)² = k² |a + t v|²`.
#[must_use]
pub fn closest(apart: [Vec3; 2], radii: [f32; 2]) -> (f32, f32) {
    let (start, motion) = (apart[0], apart[1] - apart[0]);
    let growth = radii[1] - radii[0];
    let distance = |t: f32| (start + motion * t).length() - (radii[0] + growth * t);
    let (vv, av, aa) = (
        motion.length_squared(),
        start.dot(motion),
        start.length_squared(),
    );
    let mut best = if distance(1.0) < distance(0.0) {
        (1.0, distance(1.0))
    } else {
        (0.0, distance(0.0))
    };
    if vv > growth * growth {
        // The point of the line that is nearest to the other centre lies at -av/vv. The growing radius shifts the minimum.
        let shift = match growth {
            0.0 => 0.0,
            _ => {
                let gap = (aa - av * av / vv).max(0.0);
                growth * (gap / (vv * (vv - growth * growth))).sqrt()
            }
        };
        let t = (shift - av / vv).clamp(0.0, 1.0);
        if distance(t) < best.1 {
            best = (t, distance(t));
        }
    }
    best
}

/// Number of spheres or intervals in a vector.
pub(super) const LANES: usize = 16;

/// One number for each lane.
pub(super) type Lanes = [f32; LANES];

/// A sphere of the attack on a straight line during a part of the time between two samples of the body.
#[derive(Clone, Copy)]
pub(super) struct SphereSegment {
    /// Centres at the start and the end.
    pub centres: [Vec3; 2],
    /// Radii at the start and the end.
    pub radii: [f32; 2],
    /// Start and end of the part, as shares of the interval between the samples.
    pub shares: [f32; 2],
}

impl SphereSegment {
    /// A sphere that moves between two keys, from one sample to another.
    pub(super) fn between(keys: [SphereKey; 2], ticks: [usize; 2]) -> Self {
        Self::part(keys, ticks, ticks)
    }

    /// Like [`SphereSegment::between`], only from one sample to the other of `part`. Shares refer to the interval between `ticks`.
    pub(super) fn part(keys: [SphereKey; 2], part: [usize; 2], ticks: [usize; 2]) -> Self {
        let at = |tick: usize| {
            let t = (tick as f32 / SAMPLE_RATE).clamp(keys[0].t, keys[1].t);
            MovingSphere::between(keys[0], keys[1], t)
        };
        let (from, to) = (at(part[0]), at(part[1]));
        let whole = (ticks[1] - ticks[0]) as f32;
        let share = |t: f32| ((t * SAMPLE_RATE - ticks[0] as f32) / whole).clamp(0.0, 1.0);
        Self {
            centres: [from.center, to.center],
            radii: [from.radius, to.radius],
            shares: [share(from.t), share(to.t)],
        }
    }

    /// Fractional sample number at a share of the segment, which lies between two samples.
    pub(super) fn tick(&self, [from, to]: [usize; 2], share: f32) -> f32 {
        let share = self.shares[0] + (self.shares[1] - self.shares[0]) * share;
        from as f32 + (to - from) as f32 * share
    }

    /// The sphere at each of the two samples; `None` if the segment does not include that sample.
    pub(super) fn at_ends(&self) -> impl Iterator<Item = Option<Self>> + '_ {
        [0, 1].into_iter().map(|end| {
            let share = self.shares[end];
            (share == end as f32).then(|| Self {
                centres: [self.centres[end]; 2],
                radii: [self.radii[end]; 2],
                shares: [share; 2],
            })
        })
    }

    /// Lower bounds of the distances from sixteen resting spheres, for any time on the segment.
    #[inline(always)]
    pub(super) fn distances_to_bounds(&self, [x, y, z, radii]: &SphereRows) -> Lanes {
        let ([start, end], radius) = (self.centres, self.radii[0].max(self.radii[1]));
        let motion = end - start;
        // The added number prevents a division by 0. The share is not used if nothing moves.
        let squared = motion.length_squared() + f32::MIN_POSITIVE;
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let apart = Vec3::new(x[lane], y[lane], z[lane]) - start;
            let share = (apart.dot(motion) / squared).clamp(0.0, 1.0);
            distances[lane] = (apart - motion * share).length() - (radii[lane] + radius);
        }
        distances
    }
}

/// Number of spheres of the body in a vector.
const ROW: usize = BodyTrack::LANES;

/// The body's spheres at two samples: rows of x, y and z, padded to whole vectors.
#[derive(Clone, Copy)]
pub(super) struct Spheres<'a> {
    pub from: [&'a [f32]; 3],
    pub to: [&'a [f32]; 3],
    /// Radii, padded like the rows.
    pub radii: &'a [f32],
    /// Number of spheres without padding.
    pub count: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Nearest {
    /// Distance of the surfaces, in metres.
    pub metres: f32,
    /// Time on the segment: 0 at its start, 1 at its end.
    pub share: f32,
    pub sphere: usize,
}

impl Spheres<'_> {
    /// The nearest of all spheres that are nearer than `limit` metres.
    pub(super) fn nearest(&self, segment: &SphereSegment, limit: f32) -> Option<Nearest> {
        let blocks = self.radii.len() / ROW;
        self.nearest_of(segment, limit, || 0..blocks)
    }

    /// The nearest sphere, if only some blocks of [`BodyTrack::LANES`] spheres can be near: one or more, in order.
    pub(super) fn nearest_of<B: Iterator<Item = usize>>(
        &self,
        segment: &SphereSegment,
        limit: f32,
        blocks: impl Fn() -> B,
    ) -> Option<Nearest> {
        if segment.radii[0] != segment.radii[1] {
            return self.nearest_to_growing(segment, limit);
        }
        let (lowest, sphere) = Isa::best().run(
            #[inline(always)]
            || self.lowest(segment, blocks()),
        );
        if lowest - segment.radii[0] >= limit {
            return None;
        }
        // The padding repeats the last sphere.
        let sphere = sphere.min(self.count - 1);
        let (share, metres) = self.exactly(sphere, segment);
        (metres < limit).then_some(Nearest {
            metres,
            share,
            sphere,
        })
    }

    /// The smallest distance between the segment's centre and the surface of a sphere of these blocks, and the first sphere
    /// with that distance.
    #[inline(always)]
    fn lowest(&self, segment: &SphereSegment, all: impl Iterator<Item = usize>) -> (f32, usize) {
        let (mut lowest, mut blocks) = ([f32::INFINITY; ROW], [0u32; ROW]);
        let ([x0, y0, z0], [x1, y1, z1]) = (rows_of(self.from), rows_of(self.to));
        let radii = self.radii.as_chunks::<ROW>().0;
        for block in all {
            for lane in 0..ROW {
                let from = [x0[block][lane], y0[block][lane], z0[block][lane]];
                let to = [x1[block][lane], y1[block][lane], z1[block][lane]];
                let distance = surface_distance(from, to, radii[block][lane], segment);
                let nearer = distance < lowest[lane];
                lowest[lane] = if nearer { distance } else { lowest[lane] };
                blocks[lane] = if nearer { block as u32 } else { blocks[lane] };
            }
        }
        let least = lowest.iter().copied().fold(f32::INFINITY, f32::min);
        let mut first = usize::MAX;
        for lane in 0..ROW {
            if lowest[lane] == least {
                first = first.min(blocks[lane] as usize * ROW + lane);
            }
        }
        (least, first)
    }

    /// The time and distance by the closed form.
    fn exactly(&self, sphere: usize, segment: &SphereSegment) -> (f32, f32) {
        let (from, to) = (
            Vec3::from(self.from.map(|row| row[sphere])),
            Vec3::from(self.to.map(|row| row[sphere])),
        );
        let apart = |end: usize| from.lerp(to, segment.shares[end]) - segment.centres[end];
        let reach = |end: usize| segment.radii[end] + self.radii[sphere];
        closest([apart(0), apart(1)], [reach(0), reach(1)])
    }

    /// The nearest sphere to a segment whose radius changes.
    fn nearest_to_growing(&self, segment: &SphereSegment, limit: f32) -> Option<Nearest> {
        let mut nearest: Option<Nearest> = None;
        for sphere in 0..self.count {
            let (share, metres) = self.exactly(sphere, segment);
            if metres < nearest.map_or(limit, |nearest| nearest.metres) {
                nearest = Some(Nearest {
                    metres,
                    share,
                    sphere,
                });
            }
        }
        nearest
    }
}

#[inline(always)]
fn rows_of(rows: [&[f32]; 3]) -> [&[[f32; ROW]]; 3] {
    rows.map(|row| row.as_chunks::<ROW>().0)
}

/// The smallest distance between a moving point and the surface of a moving sphere.
#[inline(always)]
fn surface_distance(from: [f32; 3], to: [f32; 3], radius: f32, segment: &SphereSegment) -> f32 {
    let mut apart = [0.0; 3];
    let mut motion = [0.0; 3];
    for axis in 0..3 {
        let way = to[axis] - from[axis];
        let start = from[axis] + way * segment.shares[0] - segment.centres[0][axis];
        let end = from[axis] + way * segment.shares[1] - segment.centres[1][axis];
        apart[axis] = start;
        motion[axis] = end - start;
    }
    let [ax, ay, az] = apart;
    let [vx, vy, vz] = motion;
    // The added number prevents a division by 0. The share is not used if nothing moves.
    let squared = vx * vx + vy * vy + vz * vz + f32::MIN_POSITIVE;
    let share = (-(ax * vx + ay * vy + az * vz) / squared).clamp(0.0, 1.0);
    let (x, y, z) = (ax + vx * share, ay + vy * share, az + vz * share);
    (x * x + y * y + z * z).sqrt() - radius
}

/// Vertical cylinders: x and z of the axis, radius, lowest and highest y.
pub(super) type CylinderRows = [Lanes; 5];

/// A sphere that moves between two keys: one [`SphereSegment`] for each of sixteen consecutive intervals.
pub(super) struct SegmentLanes {
    /// Centres, `[end][axis]`.
    centres: [[Lanes; 3]; 2],
    radii: [Lanes; 2],
    shares: [Lanes; 2],
}

impl SegmentLanes {
    /// Creates the segments of sixteen intervals of `interval` samples, the first of which starts at sample `first`.
    #[inline(always)]
    pub(super) fn new(keys: [SphereKey; 2], first: usize, interval: usize) -> Self {
        let mut segments = Self {
            centres: [[[0.0; LANES]; 3]; 2],
            radii: [[0.0; LANES]; 2],
            shares: [[0.0; LANES]; 2],
        };
        let (start, end) = (keys[0].center.to_array(), keys[1].center.to_array());
        let (span, growth) = (keys[1].t - keys[0].t, keys[1].radius - keys[0].radius);
        let (first, interval) = (first as i32, interval as i32);
        for side in 0..2 {
            for lane in 0..LANES {
                let from = first + lane as i32 * interval;
                let tick = from + side as i32 * interval;
                let t = (tick as f32 / SAMPLE_RATE).max(keys[0].t).min(keys[1].t);
                let way = ((t - keys[0].t) / span).clamp(0.0, 1.0);
                let way = if span > 0.0 { way } else { 0.0 };
                for axis in 0..3 {
                    segments.centres[side][axis][lane] =
                        start[axis] * (1.0 - way) + end[axis] * way;
                }
                segments.radii[side][lane] = keys[0].radius + growth * way;
                let share = (t * SAMPLE_RATE - from as f32) / interval as f32;
                segments.shares[side][lane] = share.clamp(0.0, 1.0);
            }
        }
        segments
    }

    /// The smallest distances from spheres that contain the whole body at the two ends of each interval.
    #[inline(always)]
    pub(super) fn distances_to_spheres(&self, spheres: [&SphereRows; 2]) -> Lanes {
        self.distances(spheres, [(0, 0), (1, 1), (2, 2)], 3)
    }

    /// The smallest distances from vertical cylinders that contain the whole body at the two ends of each interval.
    #[inline(always)]
    pub(super) fn distances_to_cylinders(&self, [from, to]: [&CylinderRows; 2]) -> Lanes {
        let mut distances = self.distances([from, to], [(0, 0), (1, 2)], 2);
        for lane in 0..LANES {
            let (radius, heights) = (
                self.radius(lane),
                self.centres.map(|centre| centre[1][lane]),
            );
            let high = from[4][lane].max(to[4][lane]);
            let low = from[3][lane].min(to[3][lane]);
            let above = heights[0].min(heights[1]) - radius - high;
            let below = low - radius - heights[0].max(heights[1]);
            distances[lane] = distances[lane].max(above).max(below);
        }
        distances
    }

    /// The smallest distances from points, or from lines along the axes that are left out. `axes` are the rows of coordinates, each with its
    /// axis, and `radii` is the row of radii.
    #[inline(always)]
    fn distances<const ROWS: usize, const AXES: usize>(
        &self,
        [from, to]: [&[Lanes; ROWS]; 2],
        axes: [(usize, usize); AXES],
        radii: usize,
    ) -> Lanes {
        let (mut apart, mut reach) = ([[[0.0; LANES]; 3]; 2], [0.0; LANES]);
        for lane in 0..LANES {
            for (side, apart) in apart.iter_mut().enumerate() {
                let share = self.shares[side][lane];
                for (row, axis) in axes {
                    let centre = from[row][lane] * (1.0 - share) + to[row][lane] * share;
                    apart[axis][lane] = centre - self.centres[side][axis][lane];
                }
            }
            reach[lane] = from[radii][lane].max(to[radii][lane]) + self.radius(lane);
        }
        closest_lanes(&apart, &reach)
    }

    #[inline(always)]
    fn radius(&self, lane: usize) -> f32 {
        self.radii[0][lane].max(self.radii[1][lane])
    }
}

/// [`closest`] for constant radii: the smallest distances.
#[inline(always)]
fn closest_lanes(apart: &[[Lanes; 3]; 2], radii: &Lanes) -> Lanes {
    let mut best = [0.0; LANES];
    for lane in 0..LANES {
        let start = Vec3::new(apart[0][0][lane], apart[0][1][lane], apart[0][2][lane]);
        let end = Vec3::new(apart[1][0][lane], apart[1][1][lane], apart[1][2][lane]);
        let motion = end - start;
        let distance = |t: f32| (start + motion * t).length() - radii[lane];
        let (vv, av) = (motion.length_squared(), start.dot(motion));
        let (first, last) = (distance(0.0), distance(1.0));
        let ends = if last < first { last } else { first };
        let between = distance((0.0 - av / vv).clamp(0.0, 1.0));
        let is_nearer = vv > 0.0 && between < ends;
        best[lane] = if is_nearer { between } else { ends };
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-2.0f32..2.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn closest_is_no_further_than_any_sampled_moment(a in vector(), b in vector(), r in 0.01f32..0.5, s in 0.01f32..0.5) {
            let (t, metres) = closest([a, b], [r, s]);
            let at = |t: f32| a.lerp(b, t).length() - (r + (s - r) * t);
            prop_assert!((at(t) - metres).abs() < 1e-4);
            let sampled = (0..=2000).map(|i| at(i as f32 / 2000.0)).fold(f32::INFINITY, f32::min);
            prop_assert!(metres <= sampled + 1e-5, "{} > {}", metres, sampled);
            prop_assert!(metres >= sampled - 5e-3);
        }
    }

    fn values(count: usize) -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(-2.0f32..2.0, count)
    }

    proptest! {
        #[test]
        fn the_nearest_sphere_is_that_of_the_closed_form_on_every_instruction_set(
            rows in values(6 * 32), radii in prop::collection::vec(0.01f32..0.3, 32),
            segment in values(6), growth in prop::sample::select(vec![0.0f32, 0.05]),
        ) {
            let row = |index: usize| &rows[index * 32..(index + 1) * 32];
            let spheres = Spheres { from: [row(0), row(1), row(2)], to: [row(3), row(4), row(5)], radii: &radii, count: 32 };
            let segment = SphereSegment {
                centres: [Vec3::from_slice(&segment[..3]), Vec3::from_slice(&segment[3..])],
                radii: [0.1, 0.1 + growth],
                shares: [0.25, 1.0],
            };
            let search = |limit| spheres.nearest(&segment, limit);
            let found = search(f32::INFINITY).unwrap();
            let naive = (0..32).map(|s| spheres.exactly(s, &segment).1).fold(f32::INFINITY, f32::min);
            prop_assert!((found.metres - naive).abs() < 1e-5, "{} and {naive}", found.metres);
            prop_assert!(search(naive - 1e-4).is_none());
            let (portable, sphere) = spheres.lowest(&segment, 0..2);
            for isa in Isa::available() {
                let (lowest, first) = isa.run(|| spheres.lowest(&segment, 0..2));
                prop_assert_eq!((lowest.to_bits(), first), (portable.to_bits(), sphere));
            }
        }
    }

    /// Naive distance in one interval from the spheres at its ends.
    fn to_spheres(segment: &SphereSegment, [from, to]: [[f32; 4]; 2]) -> f32 {
        let ends = [from, to].map(|[x, y, z, _]| Vec3::new(x, y, z));
        let apart =
            [0, 1].map(|end| ends[0].lerp(ends[1], segment.shares[end]) - segment.centres[end]);
        let reach = from[3].max(to[3]) + segment.radii[0].max(segment.radii[1]);
        closest(apart, [reach; 2]).1
    }

    /// Naive distance in one interval from the cylinders at its ends: the horizontal distance or the vertical distance, whichever is larger.
    fn to_cylinders(segment: &SphereSegment, [from, to]: [[f32; 5]; 2]) -> f32 {
        let apart = [0, 1].map(|end| {
            let share = segment.shares[end];
            let axis = |row: usize| from[row] * (1.0 - share) + to[row] * share;
            let centre = segment.centres[end];
            Vec3::new(axis(0) - centre.x, 0.0, axis(1) - centre.z)
        });
        let radius = segment.radii[0].max(segment.radii[1]);
        let beside = closest(apart, [from[2].max(to[2]) + radius; 2]).1;
        let heights = segment.centres.map(|centre| centre.y);
        let above = heights[0].min(heights[1]) - radius - from[4].max(to[4]);
        let below = from[3].min(to[3]) - radius - heights[0].max(heights[1]);
        beside.max(above).max(below)
    }

    fn key(t: f32, [x, y, z, radius]: [f32; 4]) -> SphereKey {
        let center = Vec3::new(x, y, z);
        SphereKey { t, center, radius }
    }

    fn rows<const ROWS: usize>() -> impl Strategy<Value = [[Lanes; ROWS]; 2]> {
        let lanes = prop::array::uniform16(-2.0f32..2.0);
        prop::collection::vec(lanes, 2 * ROWS)
            .prop_map(|rows| [0, ROWS].map(|first| std::array::from_fn(|row| rows[first + row])))
    }

    fn lane<const ROWS: usize>(rows: &[[Lanes; ROWS]; 2], lane: usize) -> [[f32; ROWS]; 2] {
        [0, 1].map(|end| rows[end].map(|row| row[lane]))
    }

    proptest! {
        #[test]
        fn sixteen_are_each_what_one_is(
            (from, to) in (prop::array::uniform4(0.01f32..3.0), prop::array::uniform4(0.01f32..3.0)),
            (start, seconds) in (0.0f32..2.0, prop_oneof![Just(0.0f32), 0.01f32..1.0]),
            (first, interval) in (0usize..60, prop::sample::select(vec![1usize, 4])),
            spheres in rows::<4>(), cylinders in rows::<5>(), stays in any::<bool>(),
        ) {
            let to = if stays { from } else { to };
            let keys = [key(start, from), key(start + seconds, to)];
            for isa in Isa::available() {
                let found = isa.run(|| {
                    let segments = SegmentLanes::new(keys, first, interval);
                    let [a, b] = &spheres;
                    let [c, d] = &cylinders;
                    (segments.distances_to_spheres([a, b]), segments.distances_to_cylinders([c, d]))
                });
                for at in 0..LANES {
                    let tick = first + at * interval;
                    let one = SphereSegment::between(keys, [tick, tick + interval]);
                    let expected = (to_spheres(&one, lane(&spheres, at)), to_cylinders(&one, lane(&cylinders, at)));
                    prop_assert_eq!(found.0[at].to_bits(), expected.0.to_bits(), "{:?} {}", isa, at);
                    prop_assert_eq!(found.1[at].to_bits(), expected.1.to_bits(), "{:?} {}", isa, at);
                }
            }
        }
    }
}

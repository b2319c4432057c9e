//! A moving sphere in sixteen intervals at once, and its distances from spheres and cylinders around the body.

use glam::Vec3;

use super::extent::SAMPLE_RATE;
use super::segment::{LANES, Lanes};
use crate::maps::{SphereKey, SphereRows};

/// Vertical cylinders: x and z of the axis, radius, lowest and highest y.
pub(super) type CylinderRows = [Lanes; 5];

/// A sphere that moves between two keys: one [`SphereSegment`](super::segment::SphereSegment) for each of sixteen consecutive intervals.
pub(super) struct SegmentLanes {
    /// Centres, `[end][axis]`.
    centres: [[Lanes; 3]; 2],
    radii: [Lanes; 2],
    shares: [Lanes; 2],
}

/// Meaning of the rows of a table of shapes.
#[derive(Clone, Copy)]
struct Rows<const AXES: usize> {
    /// Rows of coordinates, each with its axis.
    axes: [(usize, usize); AXES],
    /// Row of radii.
    radii: usize,
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
        let rows = Rows {
            axes: [(0, 0), (1, 1), (2, 2)],
            radii: 3,
        };
        self.distances(spheres, rows)
    }

    /// The smallest distances from vertical cylinders that contain the whole body at the two ends of each interval.
    #[inline(always)]
    pub(super) fn distances_to_cylinders(&self, [from, to]: [&CylinderRows; 2]) -> Lanes {
        let rows = Rows {
            axes: [(0, 0), (1, 2)],
            radii: 2,
        };
        let mut distances = self.distances([from, to], rows);
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

    /// The smallest distances from points, or from lines along the axes that `rows` leaves out.
    #[inline(always)]
    fn distances<const ROWS: usize, const AXES: usize>(
        &self,
        [from, to]: [&[Lanes; ROWS]; 2],
        rows: Rows<AXES>,
    ) -> Lanes {
        let Rows { axes, radii } = rows;
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
        closest(&apart, &reach)
    }

    #[inline(always)]
    fn radius(&self, lane: usize) -> f32 {
        self.radii[0][lane].max(self.radii[1][lane])
    }
}

/// [`closest`](super::closest) for constant radii: the smallest distances.
#[inline(always)]
fn closest(apart: &[[Lanes; 3]; 2], radii: &Lanes) -> Lanes {
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
    use super::super::closest::closest;
    use super::super::segment::SphereSegment;
    use super::*;
    use crate::math::Isa;
    use proptest::prelude::*;

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

        #[test]
        fn nothing_in_a_bounding_sphere_is_nearer_than_it(
            segment in prop::array::uniform6(-2.0f32..2.0), radii in prop::array::uniform2(0.01f32..0.3),
            bounds in rows::<4>(), (towards, share) in (prop::array::uniform3(-1.0f32..1.0), 0.0f32..=1.0),
        ) {
            let segment = SphereSegment {
                centres: [Vec3::from_slice(&segment[..3]), Vec3::from_slice(&segment[3..])],
                radii,
                shares: [0.0, 1.0],
            };
            let mut bounds = bounds[0];
            bounds[3][0] = f32::NEG_INFINITY;
            let found = segment.distances_to_bounds(&bounds);
            prop_assert_eq!(found[0], f32::INFINITY);
            for at in 1..LANES {
                let [x, y, z, radius] = bounds.map(|row| row[at]);
                let radius = radius.abs();
                // A small sphere somewhere in the bounding sphere.
                let small = 0.3 * radius;
                let centre = Vec3::new(x, y, z) + Vec3::from(towards).normalize_or(Vec3::X) * (radius - small) * share;
                let apart = [0, 1].map(|end| centre - segment.centres[end]);
                let nearest = closest(apart, segment.radii.map(|own| own + small)).1;
                let mut positive = bounds;
                positive[3][at] = radius;
                prop_assert!(segment.distances_to_bounds(&positive)[at] <= nearest + 1e-5);
            }
        }
    }
}

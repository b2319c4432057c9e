//! Finds the body sphere that is nearest to a moving sphere: the innermost loop of the exact test.

use glam::Vec3;

use super::closest::closest;
use super::segment::SphereSegment;
use crate::maps::BodyTrack;
use crate::math::Isa;

const LANES: usize = BodyTrack::LANES;

/// The body's spheres at two samples: rows of x, y and z, padded to whole vectors.
#[derive(Clone, Copy)]
pub(super) struct Spheres<'a> {
    pub from: [&'a [f32]; 3],
    pub to: [&'a [f32]; 3],
    /// Radii, padded like the rows.
    pub radii: &'a [f32],
}

/// The nearest body sphere.
#[derive(Clone, Copy)]
pub(super) struct Nearest {
    /// Distance of the surfaces, in metres.
    pub metres: f32,
    /// Time on the segment: 0 at its start, 1 at its end.
    pub share: f32,
    /// Index of the body sphere.
    pub sphere: usize,
}

/// A search for the nearest body sphere.
#[derive(Clone, Copy)]
pub(super) struct NearestSearch<'a> {
    pub segment: &'a SphereSegment,
    /// Number of spheres without padding.
    pub count: usize,
    /// Spheres at this distance or farther away are not found, in metres.
    pub limit: f32,
}

impl Spheres<'_> {
    /// The nearest of all spheres.
    pub(super) fn nearest(&self, search: NearestSearch<'_>) -> Option<Nearest> {
        let blocks = self.radii.len() / LANES;
        self.nearest_of(search, || 0..blocks)
    }

    /// The nearest sphere, if only some blocks of [`BodyTrack::LANES`] spheres can be near: one or more, in order.
    pub(super) fn nearest_of<B: Iterator<Item = usize>>(
        &self,
        search: NearestSearch<'_>,
        blocks: impl Fn() -> B,
    ) -> Option<Nearest> {
        let NearestSearch {
            segment,
            count,
            limit,
        } = search;
        if segment.radii[0] != segment.radii[1] {
            return self.nearest_to_growing(search);
        }
        let (lowest, sphere) = Isa::best().run(
            #[inline(always)]
            || self.lowest(segment, blocks()),
        );
        if lowest - segment.radii[0] >= limit {
            return None;
        }
        // The padding repeats the last sphere.
        let sphere = sphere.min(count - 1);
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
        let (mut lowest, mut blocks) = ([f32::INFINITY; LANES], [0u32; LANES]);
        let ([x0, y0, z0], [x1, y1, z1]) = (rows_of(self.from), rows_of(self.to));
        let radii = self.radii.as_chunks::<LANES>().0;
        for block in all {
            for lane in 0..LANES {
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
        for lane in 0..LANES {
            if lowest[lane] == least {
                first = first.min(blocks[lane] as usize * LANES + lane);
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
    fn nearest_to_growing(&self, search: NearestSearch<'_>) -> Option<Nearest> {
        let mut nearest: Option<Nearest> = None;
        for sphere in 0..search.count {
            let (share, metres) = self.exactly(sphere, search.segment);
            if metres < nearest.map_or(search.limit, |nearest| nearest.metres) {
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
fn rows_of(rows: [&[f32]; 3]) -> [&[[f32; LANES]]; 3] {
    rows.map(|row| row.as_chunks::<LANES>().0)
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn values(count: usize) -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(-2.0f32..2.0, count)
    }

    proptest! {
        #[test]
        fn the_nearest_sphere_is_that_of_the_closed_form(
            rows in values(6 * 32), radii in prop::collection::vec(0.01f32..0.3, 32),
            segment in values(6), growth in prop::sample::select(vec![0.0f32, 0.05]),
        ) {
            let row = |index: usize| &rows[index * 32..(index + 1) * 32];
            let spheres = Spheres { from: [row(0), row(1), row(2)], to: [row(3), row(4), row(5)], radii: &radii };
            let segment = SphereSegment {
                centres: [Vec3::from_slice(&segment[..3]), Vec3::from_slice(&segment[3..])],
                radii: [0.1, 0.1 + growth],
                shares: [0.25, 1.0],
            };
            let search = |limit| spheres.nearest(NearestSearch { segment: &segment, count: 32, limit });
            let found = search(f32::INFINITY).unwrap();
            let naive = (0..32).map(|s| spheres.exactly(s, &segment).1).fold(f32::INFINITY, f32::min);
            prop_assert!((found.metres - naive).abs() < 1e-5, "{} and {naive}", found.metres);
            prop_assert!(search(naive - 1e-4).is_none());
        }

        #[test]
        fn every_instruction_set_finds_the_same_bits(rows in values(6 * 48), radii in prop::collection::vec(0.01f32..0.3, 48), segment in values(6)) {
            let row = |index: usize| &rows[index * 48..(index + 1) * 48];
            let spheres = Spheres { from: [row(0), row(1), row(2)], to: [row(3), row(4), row(5)], radii: &radii };
            let segment = SphereSegment {
                centres: [Vec3::from_slice(&segment[..3]), Vec3::from_slice(&segment[3..])],
                radii: [0.1; 2],
                shares: [0.0, 1.0],
            };
            let (portable, sphere) = spheres.lowest(&segment, 0..3);
            for isa in Isa::available() {
                let (lowest, first) = isa.run(|| spheres.lowest(&segment, 0..3));
                prop_assert_eq!((lowest.to_bits(), first), (portable.to_bits(), sphere));
            }
        }
    }
}

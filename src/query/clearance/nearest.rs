//! The body's sphere that comes nearest to a moving point: the innermost loop of the exact test.

use glam::Vec3;

use super::closest;
use crate::maps::BodyTrack;
use crate::math::Isa;

const LANES: usize = BodyTrack::LANES;

/// The body's spheres at two samples that follow each other: x, y and z of all, padded to whole
/// lanes.
#[derive(Clone, Copy)]
pub(super) struct Spheres<'a> {
    pub from: [&'a [f32]; 3],
    pub to: [&'a [f32]; 3],
    /// Padded like the rows.
    pub radii: &'a [f32],
}

/// A sphere of the attack on its straight way through a part of the time between the two samples.
#[derive(Clone, Copy)]
pub(super) struct Ball {
    pub centres: [Vec3; 2],
    pub radii: [f32; 2],
    /// The part of the time: shares of the way from one sample to the other.
    pub shares: [f32; 2],
}

impl Ball {
    /// The sample, not a whole one, at a share of the ball's way, which lies between two samples.
    pub(super) fn tick(&self, [from, to]: [usize; 2], share: f32) -> f32 {
        let share = self.shares[0] + (self.shares[1] - self.shares[0]) * share;
        from as f32 + (to - from) as f32 * share
    }

    /// It at either of the two samples, where its way reaches so far.
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
}

/// Where the two come nearest.
#[derive(Clone, Copy)]
pub(super) struct Nearest {
    pub metres: f32,
    /// 0 at the start of the ball's way, 1 at its end.
    pub share: f32,
    pub sphere: usize,
}

impl Spheres<'_> {
    /// The nearest of the first `count` spheres, where it is nearer than `limit`.
    pub(super) fn nearest(&self, ball: &Ball, count: usize, limit: f32) -> Option<Nearest> {
        let blocks = self.radii.len() / LANES;
        self.nearest_of(|| 0..blocks, ball, (count, limit))
    }

    /// The same where only those of some blocks of [`BodyTrack::LANES`] can be that near; at least one, in order.
    pub(super) fn nearest_of<B: Iterator<Item = usize>>(
        &self,
        blocks: impl Fn() -> B,
        ball: &Ball,
        (count, limit): (usize, f32),
    ) -> Option<Nearest> {
        if ball.radii[0] != ball.radii[1] {
            return self.nearest_to_growing(ball, count, limit);
        }
        let (lowest, sphere) = Isa::best().run(
            #[inline(always)]
            || self.lowest(ball, blocks()),
        );
        if lowest - ball.radii[0] >= limit {
            return None;
        }
        // Padding is a copy of the last one.
        let sphere = sphere.min(count - 1);
        let (share, metres) = self.exactly(sphere, ball);
        (metres < limit).then_some(Nearest {
            metres,
            share,
            sphere,
        })
    }

    /// The smallest distance of the ball's centre from a surface of a sphere of these blocks, and the
    /// first sphere that has it.
    #[inline(always)]
    fn lowest(&self, ball: &Ball, all: impl Iterator<Item = usize>) -> (f32, usize) {
        let (mut lowest, mut blocks) = ([f32::INFINITY; LANES], [0u32; LANES]);
        let ([x0, y0, z0], [x1, y1, z1]) = (rows_of(self.from), rows_of(self.to));
        let radii = self.radii.as_chunks::<LANES>().0;
        for block in all {
            for lane in 0..LANES {
                let from = [x0[block][lane], y0[block][lane], z0[block][lane]];
                let to = [x1[block][lane], y1[block][lane], z1[block][lane]];
                let distance = surface_distance(from, to, radii[block][lane], ball);
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

    fn exactly(&self, sphere: usize, ball: &Ball) -> (f32, f32) {
        let (from, to) = (
            Vec3::from(self.from.map(|row| row[sphere])),
            Vec3::from(self.to.map(|row| row[sphere])),
        );
        let apart = |end: usize| from.lerp(to, ball.shares[end]) - ball.centres[end];
        let reach = |end: usize| ball.radii[end] + self.radii[sphere];
        closest([apart(0), apart(1)], [reach(0), reach(1)])
    }

    fn nearest_to_growing(&self, ball: &Ball, count: usize, limit: f32) -> Option<Nearest> {
        let mut nearest: Option<Nearest> = None;
        for sphere in 0..count {
            let (share, metres) = self.exactly(sphere, ball);
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
fn rows_of(rows: [&[f32]; 3]) -> [&[[f32; LANES]]; 3] {
    rows.map(|row| row.as_chunks::<LANES>().0)
}

/// The smallest distance between a point on its straight way and the surface of a sphere on its
/// own.
#[inline(always)]
fn surface_distance(from: [f32; 3], to: [f32; 3], radius: f32, ball: &Ball) -> f32 {
    let mut apart = [0.0; 3];
    let mut motion = [0.0; 3];
    for axis in 0..3 {
        let way = to[axis] - from[axis];
        let start = from[axis] + way * ball.shares[0] - ball.centres[0][axis];
        let end = from[axis] + way * ball.shares[1] - ball.centres[1][axis];
        apart[axis] = start;
        motion[axis] = end - start;
    }
    let [ax, ay, az] = apart;
    let [vx, vy, vz] = motion;
    // So small that it matters only where nothing moves, and then nothing is multiplied by it.
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
            ball in values(6), growth in prop::sample::select(vec![0.0f32, 0.05]),
        ) {
            let row = |index: usize| &rows[index * 32..(index + 1) * 32];
            let spheres = Spheres { from: [row(0), row(1), row(2)], to: [row(3), row(4), row(5)], radii: &radii };
            let ball = Ball {
                centres: [Vec3::from_slice(&ball[..3]), Vec3::from_slice(&ball[3..])],
                radii: [0.1, 0.1 + growth],
                shares: [0.25, 1.0],
            };
            let found = spheres.nearest(&ball, 32, f32::INFINITY).unwrap();
            let naive = (0..32).map(|s| spheres.exactly(s, &ball).1).fold(f32::INFINITY, f32::min);
            prop_assert!((found.metres - naive).abs() < 1e-5, "{} and {naive}", found.metres);
            prop_assert!(spheres.nearest(&ball, 32, naive - 1e-4).is_none());
        }

        #[test]
        fn every_instruction_set_finds_the_same_bits(rows in values(6 * 48), radii in prop::collection::vec(0.01f32..0.3, 48), ball in values(6)) {
            let row = |index: usize| &rows[index * 48..(index + 1) * 48];
            let spheres = Spheres { from: [row(0), row(1), row(2)], to: [row(3), row(4), row(5)], radii: &radii };
            let ball = Ball {
                centres: [Vec3::from_slice(&ball[..3]), Vec3::from_slice(&ball[3..])],
                radii: [0.1; 2],
                shares: [0.0, 1.0],
            };
            let (portable, sphere) = spheres.lowest(&ball, 0..3);
            for isa in Isa::available() {
                let (lowest, first) = isa.run(|| spheres.lowest(&ball, 0..3));
                prop_assert_eq!((lowest.to_bits(), first), (portable.to_bits(), sphere));
            }
        }
    }
}

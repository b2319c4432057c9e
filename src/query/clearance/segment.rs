use glam::Vec3;

use super::extent::SAMPLE_RATE;
use crate::maps::{MovingSphere, SphereKey, SphereRows};

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

//! Levels of detail of all characters, sixteen at a time.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.2 (levels by distance); the bands are those of [`Switching`](crate::lod::Switching).
//!
//! ```text
//! for each group:
//!     distance = |position - eye|
//!     detail = sum of the ramps that begin before the furthest lane and end behind the nearest
//!     with hysteresis: detail = the level before, as far as the ramps allow
//!     note the group if a lane needs a finer level than the group's
//! ```
//!
//! Level plus blend is a continuous, piecewise linear function of the distance: a sum of ramps from 0 to 1, one for each level. The
//! characters of a group have similar distances, so most ramps are 0 or 1 for all of them. Only the others are evaluated.
//!
//! No operation is fused, so that every instruction set gives the same levels, which are those of
//! [`Switching::choose`](crate::lod::Switching::choose).

use std::ops::Range;

use glam::Vec3;

use super::sort::schedule::Schedule;
use crate::lod::Switching;
use crate::math::{F32x16, Kernel, Lanes};

/// Buffers that are kept between frames.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameScratch {
    pub(super) ramps: LevelRamps,
    /// Groups with characters that need a finer level.
    pub(super) groups: Vec<u32>,
    /// Sum of all characters' levels at the last sorting.
    pub(super) sorted_levels: Option<f64>,
}

/// The distances at which levels change, as ramps of a [`Switching`].
#[derive(Clone, Debug, Default)]
pub(super) struct LevelRamps {
    /// Ramps of the coarsest level that is allowed.
    pub(super) coarsest: Ramps,
    /// Ramps of the finest level that is allowed; empty if levels are blended, because hysteresis is then invisible.
    pub(super) finest: Ramps,
    pub(super) has_hysteresis: bool,
}

/// Ramps that do not overlap, nearest first.
#[derive(Clone, Debug, Default)]
pub(super) struct Ramps {
    start: Vec<f32>,
    full: Vec<f32>,
}

impl Ramps {
    fn update(&mut self, ramps: impl Iterator<Item = (f32, f32)>) {
        self.start.clear();
        self.full.clear();
        for (start, full) in ramps {
            // A step is a ramp that starts at the float just below its end.
            self.start.push(start.min(full.next_down()));
            self.full.push(full);
        }
    }

    /// The ramps that are neither 0 nor 1 for all distances from `near` to `far`, in metres. The search begins at `hint`.
    #[inline(always)]
    pub(super) fn between(&self, near: f32, far: f32, hint: &mut usize) -> Range<usize> {
        let count = self.full.len();
        let mut low = (*hint).min(count);
        while low > 0 && self.full[low - 1] > near {
            low -= 1;
        }
        while low < count && self.full[low] <= near {
            low += 1;
        }
        *hint = low;
        let mut high = low;
        while high < count && self.start[high] < far {
            high += 1;
        }
        low..high
    }

    #[inline(always)]
    pub(super) fn sum<L: Lanes>(&self, distance: L, ramps: &Range<usize>) -> L {
        let mut sum = L::splat(ramps.start as f32);
        for (&start, &full) in self.start[ramps.clone()]
            .iter()
            .zip(&self.full[ramps.clone()])
        {
            let gone = (distance - L::splat(start)) / L::splat(full - start);
            sum = sum + gone.max(L::splat(0.0)).min(L::splat(1.0));
        }
        sum
    }
}

impl LevelRamps {
    /// Replaces the ramps by those of `switching`. Allocates only if there are more than before.
    pub(super) fn update(&mut self, switching: &Switching) {
        let bands = switching.bands();
        self.has_hysteresis = !switching.blends();
        if self.has_hysteresis {
            self.coarsest
                .update(bands.iter().map(|band| (band.full, band.full)));
            self.finest
                .update(bands.iter().map(|band| (band.end, band.end)));
        } else {
            self.coarsest
                .update(bands.iter().map(|band| (band.start, band.full)));
        }
    }
}

/// Finds the levels of all groups. Returns the sum of the levels of all lanes.
pub(super) struct LevelPass<'a> {
    pub(super) schedule: &'a mut Schedule,
    /// The camera's position in the world, in metres.
    pub(super) eye: Vec3,
    pub(super) ramps: &'a LevelRamps,
    /// Number of the coarsest level.
    pub(super) last: f32,
    /// Receives the indices of groups in which a character needs a finer level than the group's.
    pub(super) finer: &'a mut Vec<u32>,
}

impl Kernel for LevelPass<'_> {
    type Out = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Self {
            schedule,
            eye,
            ramps,
            last,
            finer,
        } = self;
        let mut levels = 0.0;
        let mut hints = [0; 2];
        for bucket in &schedule.buckets {
            let own = f32::from(bucket.level.0);
            let mut sums = [L::splat(0.0); F32x16::MOST_PARTS];
            for index in bucket.groups.clone() {
                let group = &mut schedule.groups[index];
                let at = [group.x, group.y, group.z];
                let (distance, near, far) = distances::<L>(&at, eye);
                let (ends, mut is_finer) =
                    (ramps.coarsest.between(near, far, &mut hints[0]), false);
                let sticky = match ramps.has_hysteresis {
                    true => Some(ramps.finest.between(near, far, &mut hints[1])),
                    false => None,
                };
                for (part, sum) in sums[..L::PARTS].iter_mut().enumerate() {
                    let distance = L::load(&distance, part);
                    let mut detail = ramps.coarsest.sum(distance, &ends);
                    if let Some(sticky) = &sticky {
                        let before = L::load(&group.detail, part).floor();
                        detail = before.max(ramps.finest.sum(distance, sticky)).min(detail);
                    }
                    let detail = detail.min(L::splat(last));
                    detail.store(&mut group.detail, part);
                    *sum = *sum + detail.floor();
                    is_finer |= !(L::splat(own) - detail).all_below(f32::MIN_POSITIVE);
                }
                if is_finer {
                    finer.push(index as u32);
                }
            }
            for (part, sum) in sums[..L::PARTS].iter().enumerate() {
                let mut lanes = F32x16::ZERO;
                sum.store(&mut lanes, part);
                levels += lanes.0.iter().map(|&sum| f64::from(sum)).sum::<f64>();
            }
        }
        levels
    }
}

/// Distances from `eye`, and the least and the greatest of them. NaN becomes 0.
#[inline(always)]
fn distances<L: Lanes>(at: &[F32x16; 3], eye: Vec3) -> (F32x16, f32, f32) {
    let mut distances = F32x16::ZERO;
    let (mut near, mut minus_far) = (f32::INFINITY, f32::INFINITY);
    for part in 0..L::PARTS {
        let x = L::load(&at[0], part) - L::splat(eye.x);
        let y = L::load(&at[1], part) - L::splat(eye.y);
        let z = L::load(&at[2], part) - L::splat(eye.z);
        let distance = (x * x + y * y + z * z).sqrt().max(L::splat(0.0));
        distance.store(&mut distances, part);
        near = near.min(distance.least());
        minus_far = minus_far.min((L::splat(0.0) - distance).least());
    }
    (distances, near, -minus_far)
}

//! Levels of detail and culling of all characters, sixteen at a time.
//!
//! Source: Hasegawa, Nishio & Kobori, 3.2 (levels by distance); the bands are those of [`Switching`](crate::lod::Switching).
//!
//! ```text
//! for each group:
//!     visible = lanes whose sphere is outside no plane of the frustum          no lane: next group
//!     distance = |position - eye|
//!     detail = sum of the ramps that begin before the furthest lane and end behind the nearest
//!     with hysteresis: detail = the level before, as far as the ramps allow
//!     note the group if a lane needs a finer level than the group's
//! ```
//!
//! No operation is fused, so that every instruction set gives the same levels, which are those of
//! [`Switching::choose`](crate::lod::Switching::choose).

use glam::Vec3;

use super::ramps::LevelRamps;
use crate::crowd::frame_input::{Frame, Frustum};
use crate::crowd::sort::group::Parked;
use crate::crowd::sort::schedule::Schedule;
use crate::math::{F32x16, Kernel, Lanes};

/// Buffers that are kept between frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameScratch {
    pub(crate) ramps: LevelRamps,
    /// Groups with characters that need a finer level, and parked groups with visible characters.
    pub(crate) groups: Vec<u32>,
    /// Sum of all characters' levels at the last sorting.
    pub(crate) sorted_levels: Option<f64>,
}

/// Finds the levels and the visible lanes of all groups.
pub(crate) struct LevelPass<'a> {
    pub(crate) schedule: &'a mut Schedule,
    pub(crate) frame: &'a Frame<'a>,
    pub(crate) ramps: &'a LevelRamps,
    /// Number of the coarsest level.
    pub(crate) last: f32,
    /// Receives the indices of groups in which a character needs a finer level than the group's.
    pub(crate) finer: &'a mut Vec<u32>,
}

/// Sums over a [`LevelPass`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LevelSum {
    /// Sum of the levels of all lanes.
    pub(crate) levels: f64,
    /// Number of joints that are posed for lanes outside the frustum.
    pub(crate) hidden: usize,
}

impl Kernel for LevelPass<'_> {
    type Out = LevelSum;

    #[inline(always)]
    fn run<L: Lanes>(self) -> LevelSum {
        let Self {
            schedule,
            frame,
            ramps,
            last,
            finer,
        } = self;
        let mut found = LevelSum::default();
        let mut hints = [0; 2];
        for bucket in &schedule.buckets {
            let own = f32::from(bucket.level.0);
            let mut sums = L::parts(L::splat(0.0));
            for index in bucket.groups.clone() {
                let group = &mut schedule.groups[index];
                let at = [group.x, group.y, group.z];
                let visible = visible_lanes::<L>(&at, frame.frustum.as_ref());
                schedule.visible[index] = visible;
                if visible == 0 {
                    continue;
                }
                found.hidden += visible.count_zeros() as usize * bucket.lines / F32x16::LANES;
                if frame.switching.is_none() {
                    continue;
                }
                let (distance, near, far) = distances::<L>(&at, frame.eye);
                let (ends, mut is_finer) =
                    (ramps.coarsest.between(near, far, &mut hints[0]), false);
                let sticky = match ramps.has_hysteresis {
                    true => Some(ramps.finest.between(near, far, &mut hints[1])),
                    false => None,
                };
                for part in 0..L::PARTS {
                    let distance = L::load(&distance, part);
                    let mut detail = ramps.coarsest.sum(distance, &ends);
                    if let Some(sticky) = &sticky {
                        let before = L::load(&group.detail, part).floor();
                        detail = before.max(ramps.finest.sum(distance, sticky)).min(detail);
                    }
                    let detail = detail.min(L::splat(last));
                    detail.store(&mut group.detail, part);
                    sums[part] = sums[part] + detail.floor();
                    is_finer |= !(L::splat(own) - detail).all_below(f32::MIN_POSITIVE);
                }
                if is_finer {
                    finer.push(index as u32);
                }
            }
            for part in 0..L::PARTS {
                let mut lanes = F32x16::ZERO;
                sums[part].store(&mut lanes, part);
                found.levels += lanes.0.iter().map(|&sum| f64::from(sum)).sum::<f64>();
            }
        }
        found
    }
}

/// Finds the parked groups with visible characters.
pub(crate) struct ParkedPass<'a> {
    pub(crate) parked: &'a [Parked],
    pub(crate) frame: &'a Frame<'a>,
    pub(crate) visible: &'a mut Vec<u32>,
}

impl Kernel for ParkedPass<'_> {
    type Out = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (index, parked) in self.parked.iter().enumerate() {
            let at = [parked.x, parked.y, parked.z];
            if visible_lanes::<L>(&at, self.frame.frustum.as_ref()) != 0 {
                self.visible.push(index as u32);
            }
        }
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

/// A bit for each lane whose sphere is not outside one of the planes.
#[inline(always)]
fn visible_lanes<L: Lanes>(at: &[F32x16; 3], frustum: Option<&Frustum>) -> u16 {
    let Some(frustum) = frustum else {
        return u16::MAX;
    };
    let mut outside = 0;
    for part in 0..L::PARTS {
        let (x, z) = (L::load(&at[0], part), L::load(&at[2], part));
        let y = L::load(&at[1], part) + L::splat(frustum.centre);
        let mut depth = L::splat(f32::INFINITY);
        for plane in &frustum.planes {
            let signed = L::splat(plane.x) * x
                + L::splat(plane.y) * y
                + L::splat(plane.z) * z
                + L::splat(plane.w);
            depth = signed.min(depth);
        }
        outside |= depth.mask_below(-frustum.radius) << (part * L::COUNT);
    }
    !(outside as u16)
}

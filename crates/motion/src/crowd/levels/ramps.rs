//! The distances at which levels change, as ramps.
//!
//! Level plus blend is a continuous, piecewise linear function of the distance: a sum of ramps from 0 to 1, one for each level. The
//! characters of a group have similar distances, so most ramps are 0 or 1 for all of them. Only the others are evaluated.

use std::ops::Range;

use crate::lod::Switching;
use crate::math::Lanes;

/// The distances at which levels change, as ramps of a [`Switching`].
#[derive(Clone, Debug, Default)]
pub(crate) struct LevelRamps {
    /// Ramps of the coarsest level that is allowed.
    pub(crate) coarsest: Ramps,
    /// Ramps of the finest level that is allowed; empty if levels are blended, because hysteresis is then invisible.
    pub(crate) finest: Ramps,
    pub(crate) has_hysteresis: bool,
}

/// Ramps that do not overlap, nearest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ramps {
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
    pub(crate) fn between(&self, near: f32, far: f32, hint: &mut usize) -> Range<usize> {
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
    pub(crate) fn sum<L: Lanes>(&self, distance: L, ramps: &Range<usize>) -> L {
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
    pub(crate) fn update(&mut self, switching: &Switching) {
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

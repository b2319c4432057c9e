//! The evasions that each moment reaches within a number of frames, as bits. A moment reaches within n frames what its next moment reaches
//! within n - 1, and what the end of a jump of m frames reaches within n - m.

use std::ops::Range;

use crate::graph::moments::Jump;
use crate::math::in_parallel;

/// Connections from each moment.
pub(super) struct Steps {
    /// Whether each moment has a next one in its clip.
    goes_on: Vec<bool>,
    /// Index of each moment's first jump. The last entry is the number of jumps.
    first: Vec<u32>,
    /// Target and number of frames of each jump, sorted by source.
    jumps: Vec<(u32, u32)>,
    /// Number of frames of the longest jump, at least 1.
    longest: u32,
}

impl Steps {
    /// Lists the connections. Jumps of more than `horizon` frames are left out, because they lead to no evasion in time.
    pub(super) fn new(follows: &[bool], into: &[Vec<Jump>], horizon: u32) -> Self {
        let moments = follows.len();
        let all = || into.iter().flatten().filter(|jump| jump.frames <= horizon);
        let mut first = vec![0; moments + 1];
        all().for_each(|jump| first[jump.from as usize + 1] += 1);
        for moment in 0..moments {
            first[moment + 1] += first[moment];
        }
        let (mut next, mut jumps) = (first.clone(), vec![(0, 0); first[moments] as usize]);
        for jump in all() {
            let place = &mut next[jump.from as usize];
            jumps[*place as usize] = (jump.to, jump.frames);
            *place += 1;
        }
        Self {
            goes_on: (0..moments)
                .map(|moment| follows.get(moment + 1) == Some(&true))
                .collect(),
            longest: all().map(|jump| jump.frames).max().unwrap_or(0).max(1),
            first,
            jumps,
        }
    }
}

/// The evasions of a group that each moment reaches.
pub(super) struct Reach {
    /// Ring buffer over the most recent numbers of frames: for each moment, a bit for each evasion that it reaches within that number.
    within: Vec<Vec<u64>>,
}

impl Reach {
    /// Number of evasions of a group.
    pub(super) const EVASIONS: usize = u64::BITS as usize;

    /// Starts with the moments at which the evasions of the group start, which reach them within 0 frames.
    pub(super) fn new(steps: &Steps, starts: &[u32]) -> Self {
        let mut none = vec![0; steps.goes_on.len()];
        let mut within = vec![none.clone(); steps.longest as usize + 1];
        for (evasion, &start) in starts.iter().enumerate() {
            none[start as usize] |= 1 << evasion;
        }
        within[0] = none;
        Self { within }
    }

    fn of(&self, frames: u32) -> &[u64] {
        &self.within[frames as usize % self.within.len()]
    }

    /// Computes what is reached within `frames` frames. Call it for all smaller numbers first, in order.
    pub(super) fn extend(&mut self, steps: &Steps, frames: u32, threads: usize) {
        /// Number of moments that a thread processes at a time.
        const PART: usize = 8192;
        let Some(before) = frames.checked_sub(1) else {
            return;
        };
        let moments = steps.goes_on.len();
        let parts = in_parallel(threads, moments.div_ceil(PART), |part| {
            let own = part * PART..((part + 1) * PART).min(moments);
            let last = self.of(before);
            let reached = |moment: usize| {
                let mut reached = last[moment];
                if steps.goes_on[moment] {
                    reached |= last[moment + 1];
                }
                let jumps = steps.first[moment] as usize..steps.first[moment + 1] as usize;
                for &(to, length) in &steps.jumps[jumps] {
                    if let Some(left) = frames.checked_sub(length) {
                        reached |= self.of(left)[to as usize];
                    }
                }
                reached
            };
            own.map(reached).collect::<Vec<u64>>()
        });
        let count = self.within.len();
        self.within[frames as usize % count] = parts.concat();
    }

    /// Calls `found` for each of some moments and each evasion that it reaches within `frames` frames but not within fewer.
    pub(super) fn for_each_new(
        &self,
        frames: u32,
        moments: Range<usize>,
        mut found: impl FnMut(usize, usize),
    ) {
        let earlier = frames.checked_sub(1).map(|before| self.of(before));
        let all = self.of(frames).iter().enumerate().take(moments.end);
        for (moment, &now) in all.skip(moments.start) {
            let mut new = now & !earlier.map_or(0, |earlier| earlier[moment]);
            while new != 0 {
                found(moment, new.trailing_zeros() as usize);
                new &= new - 1;
            }
        }
    }
}

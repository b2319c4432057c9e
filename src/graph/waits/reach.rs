//! The evasions that each moment reaches within a number of frames, as bits: those that it reaches in n frames are those that its next
//! moment reaches in n - 1, and those that the end of a jump of m frames reaches in n - m.

use crate::graph::moments::Jump;
use crate::math::in_parallel;

/// The ways on from each moment.
pub(super) struct Steps {
    /// Whether each moment has a next one in its clip.
    goes_on: Vec<bool>,
    /// First jump of each moment, and the number of jumps.
    first: Vec<u32>,
    /// Jumps by their source: target and frames.
    jumps: Vec<(u32, u32)>,
    /// Number of frames of the longest jump, at least 1.
    longest: u32,
}

impl Steps {
    /// Jumps of more frames than `horizon` lead to no evasion in time.
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

/// Which of a group of evasions each moment reaches.
pub(super) struct Reach {
    /// For each of the last numbers of frames in turn, a bit for each evasion, by moment.
    within: Vec<Vec<u64>>,
}

impl Reach {
    /// Number of evasions of a group.
    pub(super) const EVASIONS: usize = u64::BITS as usize;

    /// The evasions start at some moments.
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

    /// Finds what is reached within `frames`, after all that is reached within fewer.
    pub(super) fn extend(&mut self, steps: &Steps, frames: u32, threads: usize) {
        /// Number of moments that a thread takes at a time.
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

    /// Calls `found` for each moment and evasion that it reaches within `frames`, and not within fewer.
    pub(super) fn for_each_new(&self, frames: u32, mut found: impl FnMut(usize, usize)) {
        let earlier = frames.checked_sub(1).map(|before| self.of(before));
        for (moment, &now) in self.of(frames).iter().enumerate() {
            let mut new = now & !earlier.map_or(0, |earlier| earlier[moment]);
            while new != 0 {
                found(moment, new.trailing_zeros() as usize);
                new &= new - 1;
            }
        }
    }
}

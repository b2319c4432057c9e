//! How soon each moment reaches the evasions of a group: breadth first from their starts, against the motion's direction, for all of them at
//! once.
//!
//! Source: Then et al., "The more the merrier: efficient multi-source graph traversal" (2014), section 3: one bit for each source. Differs: a
//! jump takes several frames, so the bits that arrive later wait in a ring of frames (Dial, "Algorithm 360", 1969).

use crate::graph::moments::Jump;

/// Connections into each moment.
pub(super) struct Steps<'a> {
    /// For each moment, whether it follows another moment of its clip.
    follows: &'a [bool],
    /// Index of each moment's first jump. The last entry is the number of jumps.
    first: Vec<u32>,
    /// Source and number of frames of each jump, sorted by target.
    jumps: Vec<(u32, u32)>,
    /// Number of frames of the longest jump, at least 1.
    longest: u32,
}

impl<'a> Steps<'a> {
    /// Lists the connections. Jumps of more than `horizon` frames are left out, because they lead to no evasion in time.
    pub(super) fn new(follows: &'a [bool], into: &[Vec<Jump>], horizon: u32) -> Self {
        let (mut first, mut jumps) = (vec![0], Vec::new());
        for into in into {
            let near = into.iter().filter(|jump| jump.frames <= horizon);
            jumps.extend(near.map(|jump| (jump.from, jump.frames)));
            first.push(jumps.len() as u32);
        }
        let longest = jumps.iter().map(|&(_, frames)| frames).max();
        Self {
            follows,
            longest: longest.unwrap_or(0).max(1),
            first,
            jumps,
        }
    }

    /// The jumps that lead to a moment.
    fn into(&self, moment: u32) -> &[(u32, u32)] {
        let [first, end] = [0, 1].map(|after| self.first[moment as usize + after] as usize);
        &self.jumps[first..end]
    }
}

/// The evasions of a group that each moment reaches, as bits.
pub(super) struct Reach<'a> {
    steps: &'a Steps<'a>,
    /// Evasions that each moment reaches within the frames so far.
    reached: Vec<u64>,
    /// Evasions that moments may reach within the next numbers of frames: a ring.
    arriving: Vec<Arriving>,
}

/// The evasions that moments may reach within one number of frames.
struct Arriving {
    evasions: Vec<u64>,
    /// Moments with such evasions.
    moments: Vec<u32>,
}

impl<'a> Reach<'a> {
    /// Maximum number of evasions of a group.
    pub(super) const EVASIONS: usize = u64::BITS as usize;

    /// Starts with the moments at which the evasions of the group start.
    pub(super) fn new(steps: &'a Steps<'a>, starts: &[u32]) -> Self {
        let moments = steps.follows.len();
        let none = || Arriving {
            evasions: vec![0; moments],
            moments: Vec::new(),
        };
        let mut reach = Self {
            steps,
            reached: vec![0; moments],
            arriving: (0..=steps.longest).map(|_| none()).collect(),
        };
        for (evasion, &start) in starts.iter().enumerate() {
            reach.arrive(start, 0, 1 << evasion);
        }
        reach
    }

    /// Calls `found` for each moment and each evasion that it reaches within `frames` frames but not within fewer. Call it for all numbers of
    /// frames from 0 on, in order.
    pub(super) fn advance(&mut self, frames: u32, mut found: impl FnMut(usize, usize)) {
        let now = self.place(frames);
        let mut moments = std::mem::take(&mut self.arriving[now].moments);
        for moment in moments.drain(..) {
            let index = moment as usize;
            let arrived = std::mem::take(&mut self.arriving[now].evasions[index]);
            let new = arrived & !self.reached[index];
            self.reached[index] |= new;
            let mut left = new;
            while left != 0 {
                found(index, left.trailing_zeros() as usize);
                left &= left - 1;
            }
            if self.steps.follows[index] {
                self.arrive(moment - 1, frames + 1, new);
            }
            let steps = self.steps;
            for &(from, length) in steps.into(moment) {
                self.arrive(from, frames + length, new);
            }
        }
        self.arriving[now].moments = moments;
    }

    /// Place of a number of frames in the ring.
    fn place(&self, frames: u32) -> usize {
        frames as usize % self.arriving.len()
    }

    /// Notes that a moment reaches some evasions within a number of frames.
    fn arrive(&mut self, moment: u32, frames: u32, evasions: u64) {
        let new = evasions & !self.reached[moment as usize];
        if new == 0 {
            return;
        }
        let place = self.place(frames);
        let Arriving { evasions, moments } = &mut self.arriving[place];
        let arriving = &mut evasions[moment as usize];
        if *arriving == 0 {
            moments.push(moment);
        }
        *arriving |= new;
    }
}

//! Computes how soon each moment reaches each evasion's start, up to a horizon: breadth first, for many evasions at once ([`Reach`]). New
//! jumps are added by Dijkstra's algorithm against the motion's direction. Differs: when the wait of a moment falls, those of the frames before
//! it are lowered at once, possibly several times.

use crate::graph::build::moments::{Jump, Moments};
use crate::math::in_parallel;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Number of whole frames that fit into a time.
pub(crate) fn whole_frames(seconds: f64, frame_rate: f64) -> u32 {
    // The tolerance keeps times of whole frames whole despite rounding.
    (seconds * frame_rate + 1e-6).floor() as u32
}

/// Number of frames at rate 1 from each moment to each evasion's start.
#[derive(Debug)]
pub(crate) struct Waits {
    /// Maximum wait that is computed, in frames.
    horizon: u32,
    /// For each moment, whether it follows another moment of its clip.
    follows: Vec<bool>,
    /// For each moment, the jumps that end there.
    into: Vec<Vec<Jump>>,
    evasions: usize,
    /// For each group of evasions, the waits, `[moment][evasion]`, or `u16::MAX` if the wait is beyond the horizon.
    groups: Vec<Vec<u16>>,
    /// Moments whose wait may fall, each behind its new wait.
    open: BinaryHeap<Reverse<(u32, u32)>>,
}

/// Maximum number of evasions of a group: one bit for each ([`Reach`]).
const GROUP: usize = u64::BITS as usize;

/// A wait that fell, in frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WaitChange {
    pub(crate) moment: u32,
    pub(crate) old: u32,
    pub(crate) new: u32,
}

impl Waits {
    pub(crate) fn new(moments: &Moments, jumps: &[Jump], horizon: u32) -> Self {
        let mut follows = vec![false; moments.len()];
        for (moment, goes_on) in moments.goes_on().into_iter().enumerate() {
            if goes_on {
                follows[moment + 1] = true;
            }
        }
        let mut into = vec![Vec::new(); moments.len()];
        for jump in jumps {
            into[jump.to as usize].push(*jump);
        }
        let horizon = horizon.min(u32::from(u16::MAX) - 1);
        Self {
            horizon,
            follows,
            into,
            evasions: 0,
            groups: Vec::new(),
            open: BinaryHeap::new(),
        }
    }

    /// Number of frames from a moment to an evasion's start, or `u32::MAX` if it is beyond the
    /// horizon.
    pub(crate) fn wait(&self, evasion: usize, moment: u32) -> u32 {
        match self.groups[evasion / GROUP][self.index(evasion, moment)] {
            u16::MAX => u32::MAX,
            frames => u32::from(frames),
        }
    }

    fn index(&self, evasion: usize, moment: u32) -> usize {
        let first = evasion - evasion % GROUP;
        moment as usize * (self.evasions - first).min(GROUP) + evasion % GROUP
    }

    /// For each moment, the number of evasions for which the wait is below a number of frames.
    pub(crate) fn counts_below(&self, frames: u32, threads: usize) -> Vec<u16> {
        let (moments, frames) = (self.follows.len(), frames.min(self.horizon + 1) as u16);
        in_parallel(threads, moments, |moment| {
            let below = |waits: &Vec<u16>| -> u16 {
                let evasions = waits.len() / moments;
                let own = &waits[moment * evasions..(moment + 1) * evasions];
                own.iter().map(|&wait| u16::from(wait < frames)).sum()
            };
            self.groups.iter().map(below).sum()
        })
    }

    /// Sets the evasions by the moments at which they start, and computes all waits. Evasions of one list are not told apart.
    pub(crate) fn set_goals(&mut self, starts: &[Vec<u32>], threads: usize) {
        self.evasions = starts.len();
        let groups: Vec<_> = starts.chunks(GROUP).collect();
        self.groups = in_parallel(threads, groups.len(), |group| {
            let starts = groups[group];
            let mut waits = vec![u16::MAX; self.follows.len() * starts.len()];
            let mut reach = Reach::new(&self.follows, &self.into, self.horizon, starts);
            for frames in 0..=self.horizon {
                reach.advance(frames, |moment, evasion| {
                    waits[moment * starts.len() + evasion] = frames as u16;
                });
            }
            waits
        });
    }

    /// Adds a jump. When the wait of a moment that follows another moment of its clip falls, `lowered` is called, maybe several times.
    pub(crate) fn add_jump(&mut self, jump: Jump, mut lowered: impl FnMut(WaitChange)) {
        self.into[jump.to as usize].push(jump);
        for evasion in 0..self.evasions {
            let frames = self.wait(evasion, jump.to).saturating_add(jump.frames);
            if frames <= self.horizon && frames < self.wait(evasion, jump.from) {
                self.open.push(Reverse((frames, jump.from)));
                self.lower(evasion, &mut lowered);
            }
        }
    }

    /// Lowers the waits for one evasion, starting from the moments in the queue. From each moment it goes back along the clip at once. A wait
    /// that a jump lowers further is lowered again later.
    fn lower(&mut self, evasion: usize, lowered: &mut impl FnMut(WaitChange)) {
        while let Some(Reverse((least, last))) = self.open.pop() {
            for (moment, new) in (0..=last).rev().zip(least..=self.horizon) {
                let old = self.wait(evasion, moment);
                if new >= old {
                    break;
                }
                let index = self.index(evasion, moment);
                self.groups[evasion / GROUP][index] = new as u16;
                for jump in &self.into[moment as usize] {
                    if new + jump.frames <= self.horizon {
                        self.open.push(Reverse((new + jump.frames, jump.from)));
                    }
                }
                if !self.follows[moment as usize] {
                    break;
                }
                lowered(WaitChange { moment, old, new });
            }
        }
    }
}

// How soon each moment reaches the evasions of a group: breadth first from their starts, against the motion's direction, for all of them at
// once.
//
// Source: Then et al., "The more the merrier: efficient multi-source graph traversal" (2014), section 3: one bit for each source. Differs: a
// jump takes several frames, so the bits that arrive later wait in a ring of frames (Dial, "Algorithm 360", 1969).

/// The evasions of a group that each moment reaches, as bits.
struct Reach<'a> {
    follows: &'a [bool],
    into: &'a [Vec<Jump>],
    /// Longer jumps lead to no evasion in time.
    horizon: u32,
    /// Evasions that each moment reaches within the frames so far.
    reached: Vec<u64>,
    /// Evasions that moments may reach within the next numbers of frames: a ring.
    arriving: Vec<Arriving>,
}

/// The evasions that moments may reach within one number of frames.
struct Arriving {
    evasions: Vec<u64>,
    moments: Vec<u32>,
}

impl<'a> Reach<'a> {
    /// Starts with the moments at which the evasions of the group start.
    fn new(follows: &'a [bool], into: &'a [Vec<Jump>], horizon: u32, starts: &[Vec<u32>]) -> Self {
        let moments = follows.len();
        let near = into.iter().flatten().map(|jump| jump.frames);
        let longest = near.filter(|&frames| frames <= horizon).max().unwrap_or(0);
        let none = || Arriving {
            evasions: vec![0; moments],
            moments: Vec::new(),
        };
        let mut reach = Self {
            follows,
            into,
            horizon,
            reached: vec![0; moments],
            arriving: (0..=longest.max(1)).map(|_| none()).collect(),
        };
        for (evasion, starts) in starts.iter().enumerate() {
            for &start in starts {
                reach.arrive(start, 0, 1 << evasion);
            }
        }
        reach
    }

    /// Calls `found` for each moment and each evasion that it reaches within `frames` frames but not within fewer. Call it for all numbers of
    /// frames from 0 on, in order.
    fn advance(&mut self, frames: u32, mut found: impl FnMut(usize, usize)) {
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
            if self.follows[index] {
                self.arrive(moment - 1, frames + 1, new);
            }
            let into = self.into;
            for jump in &into[index] {
                if jump.frames <= self.horizon {
                    self.arrive(jump.from, frames + jump.frames, new);
                }
            }
        }
        self.arriving[now].moments = moments;
    }

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

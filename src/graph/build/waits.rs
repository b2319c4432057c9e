//! Computes how soon each moment reaches each evasion's start, up to a horizon: breadth first, for many evasions at once ([`reach`]). New
//! jumps are added by Dijkstra's algorithm against the motion's direction, with a bucket for each number of frames (Dial, "Algorithm 360",
//! 1969). Differs: when the wait of a moment falls, those of the frames before it are lowered at once, possibly several times.

use crate::graph::build::moments::{Jump, Moments};
use crate::math::in_parallel;
use crate::math::parallel::lock;
use std::sync::Mutex;

/// Number of whole frames that fit into a time.
pub(crate) fn within(seconds: f64, frame_rate: f64) -> u32 {
    // The tolerance keeps times of whole frames whole despite rounding.
    (seconds * frame_rate + 1e-6).floor() as u32
}

/// Number of frames at rate 1 from each moment to each evasion's start.
#[derive(Debug)]
pub(crate) struct Waits {
    /// Maximum wait that is computed, in frames.
    horizon: u32,
    /// Maximum wait that [`Waits::add_jump`] keeps up to date, in frames.
    near: u32,
    /// For each moment, whether it follows another moment of its clip.
    follows: Vec<bool>,
    /// For each moment, the jumps that end there.
    into: Vec<Vec<Jump>>,
    table: WaitTable,
    open: Queue,
}

/// The waits of all moments for all evasions.
#[derive(Debug, Default, PartialEq)]
struct WaitTable {
    /// Number of evasions.
    evasions: usize,
    /// Number of blocks of moments.
    blocks: usize,
    /// Waits, `[group of evasions][block of moments][evasion][moment]`, or `u16::MAX` if the wait is beyond the horizon. Those of one moment
    /// are near each other, as are those of one evasion along a clip.
    frames: Vec<u16>,
}

/// Number of moments of a block.
const BLOCK: usize = 4;

/// The waits of all moments for one group of evasions.
struct GroupWaits<T> {
    /// Number of evasions.
    evasions: usize,
    frames: T,
}

impl WaitTable {
    /// A table of waits beyond the horizon.
    fn new(moments: usize, evasions: usize) -> Self {
        let blocks = moments.div_ceil(BLOCK);
        Self {
            evasions,
            blocks,
            frames: vec![u16::MAX; blocks * BLOCK * evasions],
        }
    }

    /// Number of waits of a group of as many evasions as a group can have.
    fn group_len(&self) -> usize {
        (Reach::EVASIONS * self.blocks * BLOCK).max(1)
    }

    fn index(&self, evasion: usize, moment: usize) -> usize {
        let (group, evasion) = (evasion / Reach::EVASIONS, evasion % Reach::EVASIONS);
        let evasions = evasions_of_group(self.evasions, group);
        group * Reach::EVASIONS * self.blocks * BLOCK + index_in_group(evasions, evasion, moment)
    }

    fn set(&mut self, evasion: usize, moment: usize, frames: u32) {
        let index = self.index(evasion, moment);
        self.frames[index] = frames as u16;
    }

    /// Number of evasions of each group.
    fn group_evasions(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        let all = self.evasions;
        let groups = 0..all.div_ceil(Reach::EVASIONS);
        groups.map(move |group| evasions_of_group(all, group))
    }

    /// The waits of each group.
    fn groups(&self) -> impl Iterator<Item = GroupWaits<&[u16]>> + Clone {
        let evasions = self.group_evasions();
        let groups = self.frames.chunks(self.group_len());
        groups
            .zip(evasions)
            .map(|(frames, evasions)| GroupWaits { evasions, frames })
    }

    /// The waits of each group, to be set.
    fn groups_mut(&mut self) -> impl Iterator<Item = GroupWaits<&mut [u16]>> {
        let (evasions, length) = (self.group_evasions(), self.group_len());
        let groups = self.frames.chunks_mut(length);
        groups
            .zip(evasions)
            .map(|(frames, evasions)| GroupWaits { evasions, frames })
    }
}

/// Number of evasions of one group of `all` evasions.
fn evasions_of_group(all: usize, group: usize) -> usize {
    (all - group * Reach::EVASIONS).min(Reach::EVASIONS)
}

/// Index of a wait in its group of `evasions` evasions.
fn index_in_group(evasions: usize, evasion: usize, moment: usize) -> usize {
    (moment / BLOCK * evasions + evasion) * BLOCK + moment % BLOCK
}

impl GroupWaits<&[u16]> {
    /// The waits of a block of moments, by evasion.
    fn block(&self, block: usize) -> &[[u16; BLOCK]] {
        let size = BLOCK * self.evasions;
        self.frames[block * size..(block + 1) * size].as_chunks().0
    }
}

impl GroupWaits<&mut [u16]> {
    fn set(&mut self, evasion: usize, moment: usize, frames: u32) {
        let index = index_in_group(self.evasions, evasion, moment);
        self.frames[index] = frames as u16;
    }
}

/// Moments whose wait may fall, in buckets of their new wait.
#[derive(Debug, Default)]
struct Queue {
    moments: Vec<Vec<u32>>,
    count: usize,
    /// Shortest wait of the moments, in frames.
    least: usize,
}

/// A wait that fell, in frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WaitChange {
    pub(crate) evasion: usize,
    pub(crate) moment: u32,
    pub(crate) old: u32,
    pub(crate) new: u32,
}

impl Waits {
    /// Creates a table without evasions.
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
            near: horizon,
            follows,
            into,
            table: WaitTable::default(),
            open: Queue::default(),
        }
    }

    /// Number of frames from a moment to an evasion's start, or `u32::MAX` if it is beyond the
    /// horizon.
    pub(crate) fn of(&self, evasion: usize, moment: u32) -> u32 {
        match self.table.frames[self.table.index(evasion, moment as usize)] {
            u16::MAX => u32::MAX,
            frames => u32::from(frames),
        }
    }

    /// For each moment, the number of evasions for which the wait is below a number of frames.
    pub(crate) fn counts_below(&self, frames: u32, threads: usize) -> Vec<u16> {
        let (moments, frames) = (self.follows.len(), frames.min(self.horizon + 1) as u16);
        let groups = self.table.groups();
        let mut counts = in_parallel(threads, moments.div_ceil(BLOCK), |block| {
            let mut counts = [0; BLOCK];
            for group in groups.clone() {
                for waits in group.block(block) {
                    for (count, &wait) in counts.iter_mut().zip(waits) {
                        *count += u16::from(wait < frames);
                    }
                }
            }
            counts
        })
        .concat();
        counts.truncate(moments);
        counts
    }

    /// From now on, [`Waits::add_jump`] keeps only waits of up to `frames` up to date. Longer ones may be shorter than the table says, until
    /// [`Waits::set_goals`].
    pub(crate) fn forget_beyond(&mut self, frames: u32) {
        self.near = self.near.min(frames);
    }

    /// Sets the evasions by the moments at which they start, and computes all waits.
    pub(crate) fn set_goals(&mut self, starts: &[u32], threads: usize) {
        self.near = self.horizon;
        self.table = WaitTable::new(self.follows.len(), starts.len());
        let steps = Steps::new(&self.follows, &self.into, self.horizon);
        let groups = self.table.groups_mut().zip(starts.chunks(Reach::EVASIONS));
        let groups: Vec<_> = groups.map(Mutex::new).collect();
        in_parallel(threads, groups.len(), |group| {
            let (waits, starts) = &mut *lock(&groups[group]);
            let mut reach = Reach::new(&steps, starts);
            for frames in 0..=self.horizon {
                reach.advance(frames, |moment, evasion| waits.set(evasion, moment, frames));
            }
        });
    }

    /// Adds a jump. When the wait of a moment that follows another moment of its clip falls, `lowered` is called, maybe several times.
    pub(crate) fn add_jump(&mut self, jump: Jump, mut lowered: impl FnMut(WaitChange)) {
        self.into[jump.to as usize].push(jump);
        for evasion in 0..self.table.evasions {
            let frames = self.of(evasion, jump.to).saturating_add(jump.frames);
            if frames <= self.near && frames < self.of(evasion, jump.from) {
                self.open.push(frames, jump.from, self.near);
                self.lower(evasion, &mut lowered);
            }
        }
    }

    /// Lowers the waits for one evasion, starting from the moments in the queue. From each moment it goes back along the clip at once. A wait
    /// that a jump lowers further is lowered again later.
    fn lower(&mut self, evasion: usize, lowered: &mut impl FnMut(WaitChange)) {
        while let Some((last, least)) = self.open.pop() {
            for (moment, new) in (0..=last).rev().zip(least..=self.near) {
                let old = self.of(evasion, moment);
                if new >= old {
                    break;
                }
                self.table.set(evasion, moment as usize, new);
                for jump in &self.into[moment as usize] {
                    self.open.push(new + jump.frames, jump.from, self.near);
                }
                if !self.follows[moment as usize] {
                    break;
                }
                lowered(WaitChange {
                    evasion,
                    moment,
                    old,
                    new,
                });
            }
        }
    }
}

impl Queue {
    /// Adds a moment with its new wait, unless the wait is beyond the horizon.
    fn push(&mut self, frames: u32, moment: u32, horizon: u32) {
        if frames > horizon {
            return;
        }
        let at = frames as usize;
        if self.moments.len() <= at {
            self.moments.resize_with(at + 1, Vec::new);
        }
        self.moments[at].push(moment);
        self.least = match self.count {
            0 => at,
            _ => self.least.min(at),
        };
        self.count += 1;
    }

    /// Takes a moment with the shortest wait. Returns the wait and the moment.
    fn pop(&mut self) -> Option<(u32, u32)> {
        if self.count == 0 {
            return None;
        }
        loop {
            match self.moments[self.least].pop() {
                Some(moment) => {
                    self.count -= 1;
                    return Some((moment, self.least as u32));
                }
                None => self.least += 1,
            }
        }
    }
}

// How soon each moment reaches the evasions of a group: breadth first from their starts, against the motion's direction, for all of them at
// once.
//
// Source: Then et al., "The more the merrier: efficient multi-source graph traversal" (2014), section 3: one bit for each source. Differs: a
// jump takes several frames, so the bits that arrive later wait in a ring of frames (Dial, "Algorithm 360", 1969).

/// Connections into each moment.
pub(crate) struct Steps<'a> {
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
    pub(crate) fn new(follows: &'a [bool], into: &[Vec<Jump>], horizon: u32) -> Self {
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
pub(crate) struct Reach<'a> {
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
    pub(crate) const EVASIONS: usize = u64::BITS as usize;

    /// Starts with the moments at which the evasions of the group start.
    pub(crate) fn new(steps: &'a Steps<'a>, starts: &[u32]) -> Self {
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
    pub(crate) fn advance(&mut self, frames: u32, mut found: impl FnMut(usize, usize)) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CLIPS: [usize; 4] = [5, 1, 7, 4];

    /// Bellman–Ford: relaxes every connection until nothing changes.
    fn naive(moments: &Moments, jumps: &[Jump], start: u32, horizon: u32) -> Vec<u32> {
        let mut waits = vec![u32::MAX; moments.len()];
        waits[start as usize] = 0;
        let steps = moments.goes_on().into_iter().enumerate();
        let mut ways: Vec<Jump> = steps
            .filter(|(_, goes_on)| *goes_on)
            .map(|(moment, _)| Jump {
                from: moment as u32,
                to: moment as u32 + 1,
                frames: 1,
            })
            .collect();
        ways.extend(jumps);
        for _ in 0..waits.len() {
            for way in &ways {
                let over = waits[way.to as usize].saturating_add(way.frames);
                waits[way.from as usize] = waits[way.from as usize].min(over);
            }
        }
        let far = |wait: &u32| if *wait > horizon { u32::MAX } else { *wait };
        waits.iter().map(far).collect()
    }

    proptest! {
        #[test]
        fn jumps_that_come_later_are_taken_in(
            jumps in prop::collection::vec((0..17u32, 0..17u32, 1..6u32), 0..14),
            (early, horizon, near) in (0usize..14, 0..15u32, 0..15u32),
            starts in prop::collection::vec(0..17u32, 1..70),
        ) {
            let moments = Moments::new(CLIPS.into_iter());
            let jumps: Vec<Jump> =
                jumps.into_iter().map(|(from, to, frames)| Jump { from, to, frames }).collect();
            let early = early.min(jumps.len());
            let mut waits = Waits::new(&moments, &jumps[..early], horizon);
            waits.set_goals(&starts, 2);
            for jump in &jumps[early..] {
                waits.add_jump(*jump, |it| assert!(it.new < it.old && it.new <= horizon));
            }
            for (evasion, &start) in starts.iter().enumerate() {
                let expected = naive(&moments, &jumps, start, horizon);
                let found: Vec<u32> =
                    (0..moments.len() as u32).map(|moment| waits.of(evasion, moment)).collect();
                prop_assert_eq!(found, expected);
            }
            let mut nearer = Waits::new(&moments, &jumps[..early], horizon);
            nearer.set_goals(&starts, 2);
            nearer.forget_beyond(near);
            for jump in &jumps[early..] {
                nearer.add_jump(*jump, |it| assert!(it.new < it.old && it.new <= near));
            }
            let is_known = |wait: &u32| *wait <= near;
            for (evasion, moment) in (0..starts.len()).flat_map(|it| (0..17).map(move |m| (it, m))) {
                let [exact, found] = [&waits, &nearer].map(|all| all.of(evasion, moment));
                prop_assert_eq!(Some(exact).filter(is_known), Some(found).filter(is_known));
                prop_assert!(found >= exact);
            }
            nearer.set_goals(&starts, 2);
            prop_assert_eq!(&nearer.table, &waits.table);
            for limit in 0..horizon + 3 {
                let below = |moment: u32| {
                    let reached = |evasion: &usize| waits.of(*evasion, moment) < limit;
                    (0..starts.len()).filter(reached).count() as u16
                };
                let expected: Vec<u16> = (0..moments.len() as u32).map(below).collect();
                prop_assert_eq!(waits.counts_below(limit, 2), expected);
            }
        }
    }
}

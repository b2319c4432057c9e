//! Computes how soon each moment reaches each evasion's start: Dijkstra's algorithm against the
//! motion's direction, up to a horizon. New jumps can be added incrementally.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::moments::{Jump, Moments};

/// Number of whole frames that fit into a time.
pub(super) fn within(seconds: f64, frame_rate: f64) -> u32 {
    // The tolerance keeps times of whole frames whole despite rounding.
    (seconds * frame_rate + 1e-6).floor() as u32
}

/// Number of frames at rate 1 from each moment to each evasion's start.
#[derive(Debug)]
pub(super) struct Waits {
    /// Maximum wait that is computed, in frames.
    horizon: u32,
    /// For each moment, whether it follows another moment of its clip.
    follows: Vec<bool>,
    /// For each moment, the jumps that end there.
    into: Vec<Vec<Jump>>,
    /// Waits, `[evasion][moment]`, or `u16::MAX` if the wait is beyond the horizon.
    frames: Vec<Vec<u16>>,
    /// Queue of the search: frames and moment.
    open: BinaryHeap<Reverse<(u32, u32)>>,
}

impl Waits {
    /// Creates a table without evasions.
    pub(super) fn new(moments: &Moments, jumps: &[Jump], horizon: u32) -> Self {
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
        Self {
            horizon: horizon.min(u32::from(u16::MAX) - 1),
            follows,
            into,
            frames: Vec::new(),
            open: BinaryHeap::new(),
        }
    }

    /// Number of frames from a moment to an evasion's start, or `u32::MAX` if it is beyond the
    /// horizon.
    pub(super) fn of(&self, evasion: usize, moment: u32) -> u32 {
        wait(self.frames[evasion][moment as usize])
    }

    /// Adds an evasion that starts at moment `start`. When the wait of a moment that follows
    /// another moment of its clip falls, `lowered(moment, from, to)` is called.
    pub(super) fn add_goal(&mut self, start: u32, mut lowered: impl FnMut(u32, u32, u32)) {
        let moments = self.follows.len();
        self.frames.push(vec![u16::MAX; moments]);
        self.open.push(Reverse((0, start)));
        self.lower(self.frames.len() - 1, &mut lowered);
    }

    /// Adds a jump.
    pub(super) fn add_jump(&mut self, jump: Jump, mut lowered: impl FnMut(u32, u32, u32)) {
        self.into[jump.to as usize].push(jump);
        for evasion in 0..self.frames.len() {
            let frames = self.of(evasion, jump.to).saturating_add(jump.frames);
            self.open.push(Reverse((frames, jump.from)));
            self.lower(evasion, &mut lowered);
        }
    }

    /// Lowers the waits until an evasion's start, from what is in the queue on.
    fn lower(&mut self, evasion: usize, lowered: &mut impl FnMut(u32, u32, u32)) {
        let waits = &mut self.frames[evasion];
        while let Some(Reverse((frames, moment))) = self.open.pop() {
            let old = wait(waits[moment as usize]);
            if frames >= old || frames > self.horizon {
                continue;
            }
            waits[moment as usize] = frames as u16;
            if self.follows[moment as usize] {
                lowered(moment, old, frames);
                self.open.push(Reverse((frames + 1, moment - 1)));
            }
            let jumps = self.into[moment as usize].iter();
            self.open
                .extend(jumps.map(|jump| Reverse((frames + jump.frames, jump.from))));
        }
    }
}

fn wait(frames: u16) -> u32 {
    if frames == u16::MAX {
        u32::MAX
    } else {
        u32::from(frames)
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
            (early, horizon) in (0usize..14, 0..15u32),
            starts in [0..17u32, 0..17u32],
        ) {
            let moments = Moments::new(CLIPS.into_iter());
            let jumps: Vec<Jump> =
                jumps.into_iter().map(|(from, to, frames)| Jump { from, to, frames }).collect();
            let early = early.min(jumps.len());
            let mut waits = Waits::new(&moments, &jumps[..early], horizon);
            for start in starts {
                waits.add_goal(start, |_, _, _| {});
            }
            for jump in &jumps[early..] {
                waits.add_jump(*jump, |_, old, new| assert!(new < old && new <= horizon));
            }
            for (evasion, start) in starts.into_iter().enumerate() {
                let expected = naive(&moments, &jumps, start, horizon);
                let found: Vec<u32> =
                    (0..moments.len() as u32).map(|moment| waits.of(evasion, moment)).collect();
                prop_assert_eq!(found, expected);
            }
        }
    }
}

use crate::graph::moments::Moments;
use crate::graph::{GraphEvent, PointCloud};

/// Number of frames that a blend can use before and after each moment. A blend reaches at most to
/// the clip's end or to an event, because it must not blend a part of an event.
#[derive(Debug)]
pub(super) struct FreeFrames {
    before: Vec<u32>,
    after: Vec<u32>,
}

impl FreeFrames {
    pub(super) fn new(moments: &Moments, clouds: &[PointCloud], events: &[GraphEvent]) -> Self {
        // Whether the step from each moment to the next moment of its clip may be blended.
        let mut free = moments.goes_on();
        for event in events {
            let [first, last] =
                [event.first, event.last].map(|f| moments.at(event.clip.index(), f as usize));
            free[first as usize..last as usize].fill(false);
        }
        let (mut before, mut after) = (vec![0; free.len()], vec![0; free.len()]);
        for clip in 0..clouds.len() {
            let range = moments.of_clip(clip);
            for moment in range.clone().skip(1) {
                if free[moment - 1] {
                    before[moment] = before[moment - 1] + 1;
                }
            }
            for moment in range.rev().filter(|&moment| free[moment]) {
                after[moment] = after[moment + 1] + 1;
            }
        }
        Self { before, after }
    }

    /// Number of frames that a blend which ends at `moment` can use.
    pub(super) fn before(&self, moment: u32) -> usize {
        self.before[moment as usize] as usize
    }

    /// Number of frames that a blend which starts at `moment` can use.
    pub(super) fn after(&self, moment: u32) -> usize {
        self.after[moment as usize] as usize
    }
}

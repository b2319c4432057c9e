//! Positions of the last two frames' poses in the output, for motion vectors.

use super::output::{Output, PoseSlice, SlicePlace};
use super::schedule::Schedule;
use crate::math::F32x16;

/// Positions of two frames' poses, by character.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    current: Vec<Option<SlicePlace>>,
    previous: Vec<Option<SlicePlace>>,
}

impl History {
    /// Reserves memory for `characters` characters.
    pub(super) fn reserve(&mut self, characters: usize) {
        for places in [&mut self.current, &mut self.previous] {
            places.reserve(characters.saturating_sub(places.len()));
        }
    }

    /// Records a frame: the current positions become the previous ones. `place` returns where a lane of a group is written.
    pub(super) fn note(
        &mut self,
        characters: usize,
        schedule: &Schedule,
        place: impl Fn(usize, usize) -> SlicePlace,
    ) {
        std::mem::swap(&mut self.current, &mut self.previous);
        self.current.clear();
        self.current.resize(characters, None);
        for (group, (cold, visible)) in schedule.cold.iter().zip(&schedule.visible).enumerate() {
            for lane in 0..F32x16::LANES {
                if let Some(current) = self.current.get_mut(cold.ids[lane] as usize)
                    && visible >> lane & 1 == 1
                {
                    *current = Some(place(group, lane));
                }
            }
        }
    }

    /// The pose of a character in the frame before the last one.
    pub(super) fn previous(&self, output: Output, id: usize) -> Option<PoseSlice> {
        let place = (*self.previous.get(id)?)?;
        Some(PoseSlice::new(output, place))
    }
}

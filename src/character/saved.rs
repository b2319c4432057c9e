//! What is saved, and goes on to the same bit.

use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::characters::Characters;
use super::error::CharacterError;
use super::slot::Slot;
use super::state::CharacterState;
use super::world::KnownThreat;
use crate::graph::Motion;
use crate::maps::BakedGraph;
use sabaki_motion::internal::lock;

/// Everything about characters and threats but the graph and the settings. Saved and restored, it goes on to the same bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharactersState {
    slots: Vec<Slot>,
    free: Vec<u32>,
    threats: Vec<KnownThreat>,
    next_threat: u64,
    now: f64,
}

impl Characters {
    /// Everything that can be saved. Serialize it in any format that keeps floats to the bit.
    #[must_use]
    pub fn state(&self) -> CharactersState {
        CharactersState {
            slots: self.slots.iter().map(|slot| lock(slot).clone()).collect(),
            free: self.free.clone(),
            threats: self.threats.clone(),
            next_threat: self.next_threat,
            now: self.now,
        }
    }

    /// Goes on from a saved state of the same graph.
    ///
    /// # Errors
    /// A state that is damaged or belongs to another graph. The characters then stay as they are.
    pub fn restore(&mut self, state: CharactersState) -> Result<(), CharacterError> {
        state.check(&self.baked)?;
        self.slots = state.slots.into_iter().map(Mutex::new).collect();
        self.free = state.free;
        self.threats = state.threats;
        self.next_threat = state.next_threat;
        self.now = state.now;
        Ok(())
    }

    /// [`Characters::state`] as bytes.
    ///
    /// # Errors
    /// Memory is exhausted.
    pub fn save(&self) -> Result<Vec<u8>, CharacterError> {
        postcard::to_stdvec(&self.state())
            .map_err(|_| CharacterError::Saved("needs too much memory"))
    }

    /// [`Characters::restore`] from bytes.
    ///
    /// # Errors
    /// Those of [`Characters::restore`]; bytes that are none of [`Characters::save`].
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), CharacterError> {
        let damaged = |_| CharacterError::Saved("is damaged");
        let (state, rest) = postcard::take_from_bytes(bytes).map_err(damaged)?;
        if !rest.is_empty() {
            return Err(CharacterError::Saved("is longer than it should be"));
        }
        self.restore(state)
    }
}

impl CharactersState {
    fn check(&self, baked: &BakedGraph) -> Result<(), CharacterError> {
        let graph = baked.graph();
        // A time is long past or near: what waits for one does not wait for ever.
        let near_now = |time: f64| time.is_finite() && time < self.now + 600.0;
        let plays = |motion: &Motion| !motion.is_empty() && motion.is_sound(graph);
        let sound = |state: &CharacterState| {
            let playing = &state.playing;
            let times =
                (0.0..=600.0).contains(&playing.seconds) && (0.01..=100.0).contains(&playing.rate);
            let pending = state.pending.as_ref();
            times
                && plays(&playing.motion)
                && pending.is_none_or(|pending| plays(&pending.motion) && pending.at.is_finite())
                && state.goal.is_sound()
                && state.steer.is_sound()
                && state.times().iter().all(|time| near_now(*time))
        };
        let states = self.slots.iter().filter_map(|slot| slot.state.as_deref());
        let empty = |index: &u32| {
            { self.slots.get(*index as usize) }.is_some_and(|slot| slot.state.is_none())
        };
        let vacant = self
            .slots
            .iter()
            .filter(|slot| slot.state.is_none())
            .count();
        let fits = self.now.is_finite()
            && states.into_iter().all(sound)
            && self.free.iter().all(empty)
            && self.free.len() == vacant
            && is_distinct(&self.free)
            && self.threats.iter().all(|known| known.threat.is_sound())
            && self.threats.is_sorted_by(|a, b| a.id < b.id)
            && self
                .threats
                .iter()
                .all(|known| known.id.0 < self.next_threat);
        match fits {
            true => Ok(()),
            false => Err(CharacterError::Saved("does not fit this graph")),
        }
    }
}

/// Whether no place is listed twice.
fn is_distinct(places: &[u32]) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

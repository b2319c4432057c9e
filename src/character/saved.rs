//! Saves and restores all characters. A loaded game continues bit-identically.
//!
//! ```text
//! 0   8  "sabgame\n"
//! 8   4  format version, u32 little-endian
//! 12  4  CRC-32 of all following bytes, u32 little-endian
//! 16  …  CharactersState, serialized by postcard
//! ```

use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::characters::Characters;
use super::error::{CharacterError, FURTHEST};
use super::slot::Slot;
use super::state::CharacterState;
use super::world::KnownThreat;
use crate::archive;
use crate::graph::Motion;
use crate::maps::BakedGraph;
use crate::math::parallel::lock;

const MAGIC: [u8; 8] = *b"sabgame\n";
const VERSION: u32 = 5;
/// Length of magic, version and checksum, in bytes.
const HEADER: usize = 16;

/// The state of all characters and threats, without the graph and the settings. A restored game continues bit-identically.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharactersState {
    /// Fingerprint of the graph.
    graph: u32,
    slots: Vec<Slot>,
    free: Vec<u32>,
    threats: Vec<KnownThreat>,
    next_threat: u64,
    now: f64,
}

impl Characters {
    /// The state of all characters and threats. Serialize it in a format that keeps floats exactly.
    #[must_use]
    pub fn state(&self) -> CharactersState {
        CharactersState {
            graph: self.fingerprint,
            slots: self.slots.iter().map(|slot| lock(slot).clone()).collect(),
            free: self.free.clone(),
            threats: self.threats.clone(),
            next_threat: self.next_threat,
            now: self.now,
        }
    }

    /// Continues from a saved state of the same graph.
    ///
    /// # Errors
    /// A state that is damaged or belongs to another graph. The characters then stay as they are.
    pub fn restore(&mut self, state: CharactersState) -> Result<(), CharacterError> {
        if state.graph != self.fingerprint {
            return Err(CharacterError::Saved("belongs to another graph"));
        }
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
        let saved = postcard::to_extend(&self.state(), vec![0; HEADER]);
        let mut bytes = saved.map_err(|_| CharacterError::Saved("needs too much memory"))?;
        let checksum = crc32fast::hash(&bytes[HEADER..]);
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
        bytes[12..HEADER].copy_from_slice(&checksum.to_le_bytes());
        Ok(bytes)
    }

    /// [`Characters::restore`] from bytes.
    ///
    /// # Errors
    /// The errors of [`Characters::restore`], and bytes that are not from [`Characters::save`], are damaged, or were written by a version of
    /// this crate with another format.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), CharacterError> {
        let wrong = |what| Err(CharacterError::Saved(what));
        let Some((header, saved)) = bytes.split_at_checked(HEADER) else {
            return wrong("is too short");
        };
        if header[..8] != MAGIC {
            return wrong(match archive::is_baked(bytes) {
                true => "is a baked graph",
                false => "does not begin with the mark of a saved game",
            });
        }
        if header[8..12] != VERSION.to_le_bytes() {
            return wrong("was written by another version of sabaki");
        }
        if header[12..] != crc32fast::hash(saved).to_le_bytes() {
            return wrong("is damaged: its checksum does not fit");
        }
        match postcard::take_from_bytes(saved) {
            Ok((state, [])) => self.restore(state),
            _ => wrong("is damaged"),
        }
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
                && state.goal.check().is_ok()
                && state.height.abs() <= FURTHEST
                && state.moved >= 0.0
                && state.steer.is_sound()
                && state.reach.is_none_or(|reach| reach.is_sound())
                && [state.held_until, state.passed_at, state.look_at]
                    .into_iter()
                    .chain(state.retry_at)
                    .chain(state.given_up.iter().map(|one| one.until))
                    .chain(
                        state
                            .strike
                            .iter()
                            .flat_map(|it| [it.from, it.contact, it.until]),
                    )
                    .all(near_now)
        };
        let states = self.slots.iter().filter_map(|slot| slot.state.as_deref());
        let empty = |index: &u32| {
            self.slots
                .get(*index as usize)
                .is_some_and(|slot| slot.state.is_none())
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
            && self.threats.iter().all(|known| {
                let threat = &known.threat;
                let limb = known.limb.as_ref();
                threat.check(self.now).is_ok() && limb.is_none_or(|limb| limb.is_sound(threat))
            })
            && self.threats.is_sorted_by(|a, b| a.id < b.id)
            && self
                .threats
                .iter()
                .all(|known| known.id.0 < self.next_threat);
        match fits {
            true => Ok(()),
            false => Err(CharacterError::Saved(
                "is damaged: it has what no game leads to",
            )),
        }
    }
}

/// Whether no place is listed twice.
fn is_distinct(places: &[u32]) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

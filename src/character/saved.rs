//! Saves and restores all characters, or one. A loaded game continues bit-identically.
//!
//! ```text
//! 0   8  "sabgame\n", or "sabchar\n" for one character
//! 8   4  format version, u32 little-endian
//! 12  4  CRC-32 of all following bytes, u32 little-endian
//! 16  …  CharactersState, or fingerprint of the graph and CharacterState, serialized by postcard
//! ```

use std::sync::Mutex;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::characters::Characters;
use super::error::{CharacterError, FURTHEST};
use super::event::CharacterId;
use super::kind::Kind;
use super::slot::Slot;
use super::state::CharacterState;
use super::world::KnownThreat;
use crate::archive;
use crate::graph::Motion;
use crate::math::parallel::lock;

const GAME: [u8; 8] = *b"sabgame\n";
const CHARACTER: [u8; 8] = *b"sabchar\n";
const VERSION: u32 = 9;
/// Length of magic, version and checksum, in bytes.
const HEADER: usize = 16;

/// The state of all characters and threats, without the graph and the settings. A restored game continues bit-identically.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CharactersState {
    /// Fingerprint of each kind's graph.
    graphs: Vec<u32>,
    slots: Vec<Slot>,
    free: Vec<u32>,
    threats: Vec<KnownThreat>,
    next_threat: u64,
    now: f64,
}

impl Characters {
    fn fingerprints(&self) -> impl Iterator<Item = u32> {
        self.kinds.iter().map(|kind| kind.fingerprint)
    }

    /// The state of all characters and threats. Serialize it in a format that keeps floats exactly.
    pub fn state(&self) -> CharactersState {
        CharactersState {
            graphs: self.fingerprints().collect(),
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
        if !self.fingerprints().eq(state.graphs.iter().copied()) {
            return Err(CharacterError::Saved("belongs to another graph"));
        }
        state.check(&self.kinds)?;
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
        to_bytes(GAME, &self.state())
    }

    /// [`Characters::restore`] from bytes.
    ///
    /// # Errors
    /// The errors of [`Characters::restore`], and bytes that are not from [`Characters::save`], are damaged, or were written by a version of
    /// this crate with another format.
    pub fn load(&mut self, bytes: &[u8]) -> Result<(), CharacterError> {
        self.restore(from_bytes(GAME, bytes)?)
    }

    /// The state of one character, for example to send it to another machine that plays the same game.
    ///
    /// # Errors
    /// An unknown character; memory is exhausted.
    pub fn save_character(&self, id: CharacterId) -> Result<Vec<u8>, CharacterError> {
        self.with_state(id, |kind, state| {
            to_bytes(CHARACTER, &(kind.fingerprint, state))
        })?
    }

    /// Continues a character from [`Characters::save_character`], of a character with the same graph. Times in it, and the ids of threats and
    /// characters, are those of its game: with the same [`Characters::now`] and the same threats it continues bit-identically.
    ///
    /// # Errors
    /// An unknown character; bytes that are not from there, are damaged, belong to another graph, or were written by a version of this crate with
    /// another format. The character then stays as it is.
    pub fn load_character(&mut self, id: CharacterId, bytes: &[u8]) -> Result<(), CharacterError> {
        let now = self.now;
        let (kind, state) = self.character_mut(id)?;
        let (graph, mut loaded): (u32, CharacterState) = from_bytes(CHARACTER, bytes)?;
        if graph != kind.fingerprint {
            return Err(CharacterError::Saved("belongs to another graph"));
        }
        if !loaded.is_sound(kind, now) {
            return Err(CharacterError::Saved(UNSOUND));
        }
        // The limb of a strike is announced by the game that plays it.
        if let Some(strike) = &mut loaded.strike {
            let same = state.strike.filter(|own| own.from == strike.from);
            strike.threat = same.and_then(|own| own.threat);
        }
        loaded.events = std::mem::take(&mut state.events);
        *state = loaded;
        Ok(())
    }
}

/// Why a state is refused that no game leads to.
const UNSOUND: &str = "is damaged: it has what no game leads to";

fn to_bytes(magic: [u8; 8], state: &impl Serialize) -> Result<Vec<u8>, CharacterError> {
    let saved = postcard::to_extend(state, vec![0; HEADER]);
    let mut bytes = saved.map_err(|_| CharacterError::Saved("needs too much memory"))?;
    let checksum = crc32fast::hash(&bytes[HEADER..]);
    bytes[..8].copy_from_slice(&magic);
    bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
    bytes[12..HEADER].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

fn from_bytes<T: DeserializeOwned>(magic: [u8; 8], bytes: &[u8]) -> Result<T, CharacterError> {
    let wrong = |what| Err(CharacterError::Saved(what));
    let Some((header, saved)) = bytes.split_at_checked(HEADER) else {
        return wrong("is too short");
    };
    if header[..8] != magic {
        return wrong(match archive::is_baked(bytes) {
            true => "is a baked graph",
            false if magic == GAME => "does not begin with the mark of a saved game",
            false => "does not begin with the mark of a saved character",
        });
    }
    if header[8..12] != VERSION.to_le_bytes() {
        return wrong("was written by another version of sabaki");
    }
    if header[12..] != crc32fast::hash(saved).to_le_bytes() {
        return wrong("is damaged: its checksum does not fit");
    }
    match postcard::take_from_bytes(saved) {
        Ok((state, [])) => Ok(state),
        _ => wrong("is damaged"),
    }
}

impl CharacterState {
    /// Whether a game leads to it at the time `now`.
    fn is_sound(&self, kind: &Kind, now: f64) -> bool {
        // A time is long past or near: what waits for one does not wait for ever.
        let near_now = |time: f64| time.is_finite() && time < now + 600.0;
        let graph = kind.baked.graph();
        let plays = |motion: &Motion| !motion.is_empty() && motion.is_sound(graph);
        let playing = &self.playing;
        let strike = self.strike.iter();
        let times = [self.held_until, self.passed_at, self.look_at].into_iter();
        let mut times = times
            .chain(self.retry_at)
            .chain(self.given_up.iter().map(|one| one.until))
            .chain(strike.flat_map(|it| [it.from, it.contact, it.until]));
        (0.0..=600.0).contains(&playing.seconds)
            && (0.01..=100.0).contains(&playing.rate)
            && playing.drift.length() <= 1_000.0
            && plays(&playing.motion)
            && self
                .pending
                .as_ref()
                .is_none_or(|pending| plays(&pending.motion) && pending.at.is_finite())
            && self.goal.check().is_ok()
            && self.height.abs() <= FURTHEST
            && self.moved >= 0.0
            && self.additive.is_sound(graph.skeleton().len())
            && self.steer.is_sound()
            && self.reach.is_none_or(|reach| reach.is_sound())
            && times.all(near_now)
    }
}

impl CharactersState {
    fn check(&self, kinds: &[Kind]) -> Result<(), CharacterError> {
        let sound = |slot: &Slot| {
            let kind = kinds.get(usize::from(slot.kind.0));
            let state = slot.state.as_deref();
            state.is_none_or(|state| kind.is_some_and(|kind| state.is_sound(kind, self.now)))
        };
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
            && self.slots.iter().all(sound)
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
            false => Err(CharacterError::Saved(UNSOUND)),
        }
    }
}

/// Whether no place is listed twice.
fn is_distinct(places: &[u32]) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

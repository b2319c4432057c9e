//! The places of the characters, and the threads that share them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use super::scratch::Worker;
use super::state::CharacterState;
use crate::math::WorkerPool;

/// A place for a character.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Slot {
    pub(super) generation: u32,
    pub(super) state: Option<Box<CharacterState>>,
    /// Time until a new threat may reach the body, during a step.
    #[serde(skip)]
    pub(super) urgency: Option<f32>,
}

/// Calls `work` for each place, on all threads.
pub(super) fn on_all(
    pool: &mut WorkerPool,
    (slots, workers): (&[Mutex<Slot>], &[Mutex<Worker>]),
    work: impl Fn(usize, &mut Slot, &mut Worker) + Sync,
) {
    let next = AtomicUsize::new(0);
    pool.run(&|thread: usize| {
        let mut worker = lock(&workers[thread]);
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(slot) = slots.get(index) else {
                return;
            };
            work(index, &mut lock(slot), &mut worker);
        }
    });
}

/// The last character of `most` that may plan in a step, by the time until a threat may reach it and its index.
pub(super) fn most_urgent(slots: &[Mutex<Slot>], most: usize) -> (f32, usize) {
    const ALL: (f32, usize) = (f32::INFINITY, usize::MAX);
    if most >= slots.len() {
        return ALL;
    }
    let slots = slots.iter().enumerate();
    let urgency = |(index, slot): (usize, &Mutex<Slot>)| Some((lock(slot).urgency?, index));
    let mut all: Vec<(f32, usize)> = slots.filter_map(urgency).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    match most.checked_sub(1).map(|last| all.get(last)) {
        Some(Some(&last)) => last,
        Some(None) => ALL,
        None => (f32::NEG_INFINITY, 0),
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

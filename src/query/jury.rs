//! Threads that test candidates side by side.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::clearance::{Clearance, MotionBody};
use crate::math::WorkerPool;

/// Who tests, and what each of them works with; kept from one query to the next. The threads are started when they are first
/// asked for, and are nobody else's: a clone starts its own.
#[derive(Default)]
pub(super) struct Jury {
    /// And how many were asked for: there may be fewer.
    pool: Option<(usize, WorkerPool)>,
    /// The caller's first.
    seats: Vec<Mutex<Seat>>,
    found: Vec<Option<Clearance>>,
}

/// One thread's.
#[derive(Default)]
struct Seat {
    body: MotionBody,
    found: Vec<(usize, Clearance)>,
}

/// No more threads than this are started: candidates are too few for them.
const MOST: usize = 64;

impl Jury {
    /// The caller's own.
    pub(super) fn body(&mut self) -> &mut MotionBody {
        if self.seats.is_empty() {
            self.seats.push(Mutex::default());
        }
        let seat = self.seats[0].get_mut();
        &mut seat.unwrap_or_else(PoisonError::into_inner).body
    }

    /// Forgets how bodies stood.
    pub(super) fn forget(&mut self) {
        for seat in &mut self.seats {
            let seat = seat.get_mut().unwrap_or_else(PoisonError::into_inner);
            seat.body.forget();
        }
    }

    /// Tests 0 to `count - 1` by so many threads, as far as the first one whose clearance `ends` it: that one, and each before
    /// it, is what it would be on one thread. What comes after it is `None`, or that as well.
    pub(super) fn test(
        &mut self,
        (threads, count): (usize, usize),
        test: impl Fn(usize, &mut MotionBody) -> Clearance + Sync,
        ends: impl Fn(&Clearance) -> bool + Sync,
    ) -> &[Option<Clearance>] {
        let threads = threads.min(MOST);
        self.pool.take_if(|(asked, _)| *asked != threads);
        let (_, pool) = self
            .pool
            .get_or_insert_with(|| (threads, WorkerPool::new(threads)));
        self.seats
            .resize_with(pool.threads().max(self.seats.len()), Mutex::default);
        let (next, end) = (AtomicUsize::new(0), AtomicUsize::new(count));
        pool.run(&|thread: usize| {
            let mut seat = lock(&self.seats[thread]);
            let Seat { body, found } = &mut *seat;
            found.clear();
            // The more threads, the less each finds; but nobody knows which.
            found.reserve(count);
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= end.load(Ordering::Relaxed) {
                    return;
                }
                let one = test(index, body);
                if ends(&one) {
                    end.fetch_min(index, Ordering::Relaxed);
                }
                found.push((index, one));
            }
        });
        self.found.clear();
        self.found.resize(count, None);
        for seat in &self.seats[..pool.threads()] {
            for &(index, one) in &lock(seat).found {
                self.found[index] = Some(one);
            }
        }
        &self.found
    }
}

fn lock(seat: &Mutex<Seat>) -> MutexGuard<'_, Seat> {
    seat.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Clone for Jury {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Jury {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Jury")
            .field(
                "threads",
                &self.pool.as_ref().map_or(1, |(_, pool)| pool.threads()),
            )
            .finish_non_exhaustive()
    }
}

//! Work shared out among threads, with results in order.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

pub use super::worker_pool::WorkerPool;

/// Returns `work(0)` to `work(count - 1)`, in order, computed by `threads` threads; 0 for as many as the machine has. Each
/// thread takes short runs of neighbouring items, so that long items do not hold up others and short ones have little
/// overhead.
pub fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let runs = Runs::new(threads, count);
    let results = Mutex::new(Vec::new());
    lock(&results).resize_with(runs.count, Vec::new);
    runs.share(&|number, run| {
        let done = run.map(&work).collect();
        lock(&results)[number] = done;
    });
    let mut all = Vec::with_capacity(count);
    for mut run in results.into_inner().unwrap_or_else(PoisonError::into_inner) {
        all.append(&mut run);
    }
    all
}

/// Locks a mutex, also after a panic of another thread.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs of consecutive items, each of which one thread takes at a time.
struct Runs {
    threads: usize,
    /// Number of items.
    pieces: usize,
    /// Number of items in a run.
    length: usize,
    /// Number of runs.
    count: usize,
}

impl Runs {
    fn new(threads: usize, pieces: usize) -> Self {
        /// Number of runs for each thread, if there are enough items.
        const RUNS: usize = 16;
        let threads = thread_count(threads).min(pieces).max(1);
        let length = (pieces / (threads * RUNS)).max(1);
        Self {
            threads,
            pieces,
            length,
            count: pieces.div_ceil(length),
        }
    }

    /// Calls `work` with the number and the items of each run.
    fn share(&self, work: &(dyn Fn(usize, Range<usize>) + Sync)) {
        let next = AtomicUsize::new(0);
        on_threads(self.threads, &|| {
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= self.count {
                    return;
                }
                let first = number * self.length;
                work(number, first..(first + self.length).min(self.pieces));
            }
        });
    }
}

/// Sets each value of a list to the result of `work`, on as many threads as the machine has.
pub fn fill<T: Send>(list: &mut [T], work: impl Fn(usize) -> T + Sync) {
    let length = list.len().div_ceil(thread_count(0)).max(1);
    each(list.chunks_mut(length).enumerate(), |(part, values), ()| {
        for (value, index) in values.iter_mut().zip(part * length..) {
            *value = work(index);
        }
    });
}

/// Calls `work` once on each part, on as many threads as the machine has. Each thread has its own scratch.
pub fn each<T: Send, S: Default>(
    parts: impl Iterator<Item = T> + Send,
    work: impl Fn(T, &mut S) + Sync,
) {
    let parts = Mutex::new(parts);
    let next = || lock(&parts).next();
    on_threads(thread_count(0), &|| {
        let mut scratch = S::default();
        while let Some(part) = next() {
            work(part, &mut scratch);
        }
    });
}

/// Runs `a` and `b` at the same time, on two threads, and returns their results.
pub fn both<A: Send, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B) -> (A, B) {
    std::thread::scope(|scope| {
        let a = scope.spawn(a);
        let b = b();
        match a.join() {
            Ok(a) => (a, b),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// Runs `work` on a number of threads, including the caller's. The function is not generic, so that the code that starts and
/// joins threads is compiled once.
fn on_threads(threads: usize, work: &(dyn Fn() + Sync)) {
    std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        work();
        for worker in workers {
            if let Err(panic) = worker.join() {
                std::panic::resume_unwind(panic);
            }
        }
    });
}

/// The number of threads for a setting: 0 for as many as the machine has. At most 1024.
#[must_use]
pub fn thread_count(setting: usize) -> usize {
    /// More threads would only cost time and memory.
    const MOST_THREADS: usize = 1024;
    let threads = match setting {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    threads.min(MOST_THREADS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_filled_and_two_things_are_done() {
        for count in [0, 1, 5, 100] {
            let mut squares = vec![0; count];
            fill(&mut squares, |index| index * index);
            let expected: Vec<usize> = (0..count).map(|index| index * index).collect();
            assert_eq!(squares, expected);
        }
        assert_eq!(both(|| 1, || 2), (1, 2));
    }

    #[test]
    fn each_part_is_worked_on_once() {
        let mut list = vec![0u32; 100];
        each(
            list.iter_mut().zip(0..),
            |(value, number), before: &mut Option<u32>| {
                assert!(before.replace(number).is_none_or(|before| before < number));
                *value += number;
            },
        );
        assert!(list.into_iter().eq(0..100));
    }

    #[test]
    fn a_setting_is_taken_at_its_word_up_to_a_limit() {
        assert!(thread_count(0) >= 1);
        assert_eq!([1, 7, 1024].map(thread_count), [1, 7, 1024]);
        assert_eq!([1025, 999_999, usize::MAX].map(thread_count), [1024; 3]);
    }

    #[test]
    fn results_come_in_order_for_any_number_of_threads() {
        for threads in 0..6 {
            for count in [0, 1, 2, 7, 100] {
                let squares = in_parallel(threads, count, |index| index * index);
                let expected: Vec<usize> = (0..count).map(|index| index * index).collect();
                assert_eq!(squares, expected, "{threads} threads, {count} pieces");
            }
        }
    }
}

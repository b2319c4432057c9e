//! Work shared out among threads, with results in order.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// `work(0)` to `work(count - 1)`, in order, done by `threads` threads; 0 for as many as the
/// machine has. Threads take one short run of neighbours after the other, so that long pieces of
/// work do not wait for each other and short ones cost no more than themselves.
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

/// Consecutive pieces of work that a thread takes at a time.
struct Runs {
    threads: usize,
    /// Number of pieces of work.
    pieces: usize,
    /// Number of pieces of a run.
    length: usize,
    /// Number of runs.
    count: usize,
}

impl Runs {
    fn new(threads: usize, pieces: usize) -> Self {
        /// Number of runs of a thread, if there are enough pieces.
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

    /// Calls `work` with the number and the pieces of each run.
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

/// Sets each value of a list to that of `work`, by as many threads as the machine has.
pub fn fill<T: Send>(list: &mut [T], work: impl Fn(usize) -> T + Sync) {
    let length = list.len().div_ceil(thread_count(0)).max(1);
    each(list.chunks_mut(length).enumerate(), |(part, values), ()| {
        for (value, index) in values.iter_mut().zip(part * length..) {
            *value = work(index);
        }
    });
}

/// Works on each part once, by as many threads as the machine has; each has a scratch of its own.
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

/// Does two things at a time, on two threads.
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

/// Does the same on a number of threads, of which the caller's is one. The work is not generic:
/// what starts and joins threads is compiled once, not for each use.
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

/// How many threads a setting asks for: 0 for as many as the machine has. At most 1024, whatever the setting or the machine.
#[must_use]
pub fn thread_count(setting: usize) -> usize {
    /// More threads only cost time and memory: no work here is shared among as many cores.
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

//! Work shared out among threads, with results in order.

use std::sync::atomic::{AtomicUsize, Ordering};
#[cfg(feature = "vulkan")]
use std::sync::{Mutex, PoisonError};

/// `work(0)` to `work(count - 1)`, in order, done by `threads` threads; 0 for as many as the
/// machine has. Threads take one short run of neighbours after the other, so that long pieces of
/// work do not wait for each other and short ones cost no more than themselves.
pub fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    /// Number of consecutive runs that a thread takes at a time, if there are enough.
    const RUNS: usize = 16;
    let threads = thread_count(threads).min(count).max(1);
    if threads == 1 {
        return (0..count).map(work).collect();
    }
    let length = (count / (threads * RUNS)).max(1);
    let next = AtomicUsize::new(0);
    let take = || {
        let mut runs: Vec<(usize, Vec<T>)> = Vec::new();
        loop {
            let first = next.fetch_add(length, Ordering::Relaxed);
            if first >= count {
                return runs;
            }
            let run = first..(first + length).min(count);
            runs.push((first, run.map(&work).collect()));
        }
    };
    let mut runs = std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(take)).collect();
        let mut runs = take();
        for worker in workers {
            match worker.join() {
                Ok(more) => runs.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        runs
    });
    runs.sort_unstable_by_key(|&(first, _)| first);
    runs.into_iter().flat_map(|(_, run)| run).collect()
}

/// Sets each value of a list to that of `work`, by as many threads as the machine has.
pub(crate) fn fill<T: Send>(list: &mut [T], work: impl Fn(usize) -> T + Sync) {
    let length = list.len().div_ceil(thread_count(0)).max(1);
    std::thread::scope(|scope| {
        for (part, values) in list.chunks_mut(length).enumerate() {
            let work = &work;
            scope.spawn(move || {
                for (value, index) in values.iter_mut().zip(part * length..) {
                    *value = work(index);
                }
            });
        }
    });
}

/// Works on each part once, by as many threads as the machine has; each has a scratch of its own.
#[cfg(feature = "vulkan")]
pub(crate) fn each<T: Send, S: Default>(
    parts: impl Iterator<Item = T> + Send,
    work: impl Fn(T, &mut S) + Sync,
) {
    let parts = Mutex::new(parts);
    let take = || {
        let mut scratch = S::default();
        loop {
            let part = parts.lock().unwrap_or_else(PoisonError::into_inner).next();
            match part {
                Some(part) => work(part, &mut scratch),
                None => return,
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..thread_count(0) {
            scope.spawn(take);
        }
        take();
    });
}

/// Does two things at a time, on two threads.
pub(crate) fn both<A: Send, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B) -> (A, B) {
    std::thread::scope(|scope| {
        let a = scope.spawn(a);
        let b = b();
        match a.join() {
            Ok(a) => (a, b),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}

/// How many threads a setting asks for: 0 for as many as the machine has.
#[must_use]
pub fn thread_count(setting: usize) -> usize {
    match setting {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    }
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

    #[cfg(feature = "vulkan")]
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

//! Work shared out among threads, with results in order.

/// `work(0)` to `work(count - 1)`, in order, done by `threads` threads; 0 for as many as the
/// machine has. Each thread takes a run of neighbours, so that work of even size is shared evenly.
pub fn in_parallel<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let threads = thread_count(threads).min(count).max(1);
    let part = count.div_ceil(threads).max(1);
    let run = |thread: usize| {
        let range = thread * part..((thread + 1) * part).min(count);
        range.map(&work).collect::<Vec<T>>()
    };
    if threads == 1 {
        return run(0);
    }
    std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads)
            .map(|thread| scope.spawn(move || run(thread)))
            .collect();
        let mut results = run(0);
        for worker in workers {
            match worker.join() {
                Ok(part) => results.extend(part),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        results
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

//! Threads that test candidates in parallel.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::math::parallel::{WorkerPool, lock};
use crate::query::clearance::{Clearance, MotionBody};

/// The threads of a context, with the memory of each thread. The first query that needs them starts them. A clone starts its own threads.
#[derive(Default)]
pub(super) struct Workers {
    /// The requested number of threads, and the threads, which may be fewer.
    pool: Option<(usize, WorkerPool)>,
    /// Memory of each thread. The first is that of the caller.
    workers: Vec<Mutex<Worker>>,
    results: Vec<Option<Clearance>>,
}

#[derive(Default)]
struct Worker {
    body: MotionBody,
    results: Vec<(usize, Clearance)>,
}

impl Workers {
    /// Maximum number of threads. There are too few candidates for more.
    const MAX_THREADS: usize = 64;

    pub(super) fn body(&mut self) -> &mut MotionBody {
        if self.workers.is_empty() {
            self.workers.push(Mutex::default());
        }
        let worker = self.workers[0].get_mut();
        &mut worker.unwrap_or_else(PoisonError::into_inner).body
    }

    pub(super) fn forget(&mut self) {
        for worker in &mut self.workers {
            let worker = worker.get_mut().unwrap_or_else(PoisonError::into_inner);
            worker.body.forget();
        }
    }

    /// Runs `count` tests by their numbers, up to the first result that ends them. This result and all results before it do not depend on the
    /// number of threads. Later results may be missing.
    pub(super) fn run(
        &mut self,
        threads: usize,
        count: usize,
        test: impl Fn(usize, &mut MotionBody) -> Clearance + Sync,
        ends: impl Fn(&Clearance) -> bool + Sync,
    ) -> &[Option<Clearance>] {
        let threads = threads.min(Self::MAX_THREADS);
        self.pool.take_if(|(asked, _)| *asked != threads);
        let (_, pool) = self
            .pool
            .get_or_insert_with(|| (threads, WorkerPool::new(threads)));
        self.workers
            .resize_with(pool.threads().max(self.workers.len()), Mutex::default);
        // The caller does this, because a worker that wakes late takes no part. Any worker may run all tests.
        for worker in &self.workers {
            let results = &mut lock(worker).results;
            results.clear();
            results.reserve(count);
        }
        let (next, end) = (AtomicUsize::new(0), AtomicUsize::new(count));
        pool.run(&|thread: usize| {
            let mut worker = lock(&self.workers[thread]);
            let Worker { body, results } = &mut *worker;
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= end.load(Ordering::Relaxed) {
                    return;
                }
                let result = test(index, body);
                if ends(&result) {
                    end.fetch_min(index, Ordering::Relaxed);
                }
                results.push((index, result));
            }
        });
        self.results.clear();
        self.results.resize(count, None);
        for worker in &self.workers[..pool.threads()] {
            for &(index, result) in &lock(worker).results {
                self.results[index] = Some(result);
            }
        }
        &self.results
    }
}

impl Clone for Workers {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Workers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = self.pool.as_ref().map_or(1, |(_, pool)| pool.threads());
        f.debug_struct("Workers")
            .field("threads", &threads)
            .finish_non_exhaustive()
    }
}
